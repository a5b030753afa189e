//! The rows of the reversal, task by task: one cell and one channel.

use std::cell::RefCell;

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Constraints;
use errsep_solvers::loss::Loss;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, Sink, StructuredProblem};

use super::{Prepared, Reversal};
use crate::basis::bspline::horner;
use crate::reversal::forward::{Attitude, no_contact};
use crate::reversal::simultaneous::placed::Placed;
use crate::reversal::simultaneous::robust::Robust;
use crate::reversal::simultaneous::rows::Points;
use crate::reversal::simultaneous::starts::starts;
use crate::units::mm_from_um;

thread_local! {
    // Seven kilobytes, of which a short run fills a few: clearing them anew for every cell would take
    // as long as the readings.
    static POINTS: RefCell<Points> = RefCell::default();
}

impl StructuredProblem for Reversal<'_> {
    type Prepared = Prepared;

    fn band_count(&self) -> usize {
        self.unknowns.band_count()
    }

    fn border_count(&self) -> usize {
        self.unknowns.border_count()
    }

    fn part_count(&self) -> usize {
        self.channels.len()
    }

    fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    fn held(&self) -> &[bool] {
        &self.held
    }

    fn prepare(&self, at: &Parameters) -> Result<Prepared, NoValue> {
        let half_mm = self.thickness(at) / 2.0;
        let cubics = self.cubics(at);
        if let Some(joined) = &self.joined {
            let placed = Placed::new(self, joined, at, &cubics)?;
            return Ok(Prepared {
                cubics,
                attitudes: Vec::new(),
                offsets: Vec::new(),
                side_starts: Vec::new(),
                width: self.width(placed.apart()),
                placed: Some(placed),
            });
        }
        let mut attitudes = Vec::with_capacity(self.channels.len());
        let mut side_starts = Vec::with_capacity(self.channels.len());
        for (c, channel) in self.channels.iter().enumerate() {
            let attitude = Attitude::new(self.unknowns.slope(c, &at.border), half_mm)?;
            let form = self.unknowns.side_of(channel.channel);
            let basis = &self.bases[form];
            // Breaks of the artefact's form, seen on the slide.
            let breaks: Vec<f64> = basis
                .breaks()
                .iter()
                .enumerate()
                .map(|(k, u)| {
                    let height = match cubics[form].get(k) {
                        Some(cubic) => cubic[0],
                        None => cubics[form].last().map_or(0.0, |cubic| horner(cubic, 1.0)),
                    };
                    attitude.slide_position(*u, mm_from_um(height))
                })
                .collect();
            if let Some(pair) = breaks.windows(2).find(|pair| !(pair[0] < pair[1])) {
                return Err(no_contact(pair[0]));
            }
            attitudes.push(attitude);
            side_starts.push(starts(&channel.x, &breaks));
        }
        let mut prepared = Prepared {
            cubics,
            attitudes,
            offsets: (0..self.channels.len())
                .map(|c| at.border[self.unknowns.offset(c)])
                .collect(),
            side_starts,
            width: 0,
            placed: None,
        };
        let mut apart = 0;
        for channel in 0..self.channels.len() {
            for cell in 0..self.cell_count() {
                self.runs(&prepared, channel, cell, |_, _, side, slide| {
                    apart = apart.max(side.abs_diff(slide));
                    Ok(())
                })?;
            }
        }
        prepared.width = self.width(apart);
        Ok(prepared)
    }

    fn band_width(&self, prepared: &Prepared) -> usize {
        prepared.width
    }

    fn task_count(&self, _: &Prepared) -> usize {
        self.cell_count() * self.channels.len()
    }

    fn task(&self, prepared: &Prepared, index: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let (cell, c) = (index / self.channels.len(), index % self.channels.len());
        if let Some(placed) = &prepared.placed {
            placed.task(self, c, cell, sink);
            return Ok(());
        }
        let channel = &self.channels[c];
        POINTS.with_borrow_mut(|points| {
            self.runs(prepared, c, cell, |from, to, side, slide| {
                let run = self.run(prepared, c, side, slide);
                sink.open(run.columns());
                for first in (from..to).step_by(Tall::CAPACITY) {
                    let last = to.min(first + Tall::CAPACITY);
                    let x = &channel.x[first..last];
                    points.locate(&run, x, &channel.value[first..last])?;
                    if self.loss == Loss::Quadratic {
                        points.fill(&run, x, None, sink.batch(last - first));
                        sink.push();
                    } else {
                        let residual = &points.residual[..last - first];
                        let robust = Robust::of(self.loss, self.far, residual);
                        let batch = sink.batch(last - first);
                        points.fill(&run, x, Some(&robust.rows), batch);
                        robust.replace_residuals(batch);
                        sink.push_with_cost(robust.cost);
                    }
                }
                let band = self.band_columns(c, side, slide);
                sink.close(band, self.shares(c, side, slide), c);
                Ok(())
            })
        })
    }

    fn border_name(&self, index: usize) -> String {
        self.unknowns.border_name(index)
    }

    fn band_name(&self, index: usize) -> String {
        self.bases
            .first()
            .map_or_else(String::new, |b| self.unknowns.band_name(index, b.breaks()))
    }
}
