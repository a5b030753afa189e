//! The rows of a design, task by task: one cell and one channel.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Constraints;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, Sink, StructuredProblem};

use super::{DesignProblem, Prepared};
use crate::basis::bspline::horner;
use crate::reversal::forward::{Attitude, no_contact};
use crate::reversal::simultaneous::rows::Points;
use crate::reversal::simultaneous::starts::starts;
use crate::units::mm_from_um;

impl StructuredProblem for DesignProblem<'_> {
    type Prepared = Prepared;

    fn band_count(&self) -> usize {
        self.layout.band_count()
    }

    fn border_count(&self) -> usize {
        self.layout.border_count()
    }

    fn part_count(&self) -> usize {
        self.traces.len()
    }

    fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    fn held(&self) -> &[bool] {
        &self.held
    }

    fn prepare(&self, at: &Parameters) -> Result<Prepared, NoValue> {
        let cubics = self.cubics(at);
        let mut attitudes = Vec::with_capacity(self.traces.len());
        let mut side_starts = Vec::with_capacity(self.traces.len());
        for (c, trace) in self.traces.iter().enumerate() {
            let attitude = Attitude::new(self.layout.slope(c, &at.border), self.half_mm)?;
            let form = self.layout.side[c];
            // Breaks of the side's form, seen on the slide.
            let breaks: Vec<f64> = self.bases[form]
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
            side_starts.push(starts(&trace.x, &breaks));
        }
        let mut prepared = Prepared {
            cubics,
            attitudes,
            constants: (0..self.traces.len())
                .map(|c| self.layout.constant(c, &at.border))
                .collect(),
            side_starts,
            width: 0,
        };
        let mut apart = 0;
        for channel in 0..self.traces.len() {
            for cell in 0..self.cell_count() {
                self.runs(&prepared, channel, cell, |_, _, side, slide| {
                    apart = apart.max(side.abs_diff(slide));
                    Ok(())
                })?;
            }
        }
        let forms = self.layout.forms.len();
        prepared.width = (forms * (4 + apart)).min(self.layout.band_count());
        Ok(prepared)
    }

    fn band_width(&self, prepared: &Prepared) -> usize {
        prepared.width
    }

    fn task_count(&self, _: &Prepared) -> usize {
        self.cell_count() * self.traces.len()
    }

    fn task(&self, prepared: &Prepared, index: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let (cell, c) = (index / self.traces.len(), index % self.traces.len());
        let trace = &self.traces[c];
        let mut points = Points::default();
        let mut scratch = Tall::new(10);
        self.runs(prepared, c, cell, |from, to, side, slide| {
            let run = self.run(prepared, c, side, slide);
            sink.open(self.columns(c));
            for first in (from..to).step_by(Tall::CAPACITY) {
                let last = to.min(first + Tall::CAPACITY);
                let x = &trace.x[first..last];
                points.locate(&run, x, &trace.value[first..last])?;
                self.fill(c, &points, &run, x, &mut scratch, sink.batch(last - first));
                sink.push();
            }
            let band = self.band_columns(c, side, slide);
            sink.close(band, self.shares(c, side, slide), c);
            Ok(())
        })
    }

    fn border_name(&self, index: usize) -> String {
        self.layout
            .names
            .get(index)
            .cloned()
            .unwrap_or_else(|| "line of a form".to_owned())
    }

    fn band_name(&self, index: usize) -> String {
        let forms = self.layout.forms.len();
        let breaks = self.bases[index % forms].breaks();
        let knot = (index / forms).min(breaks.len() - 1);
        format!("a form near {:.4} mm", breaks[knot])
    }
}
