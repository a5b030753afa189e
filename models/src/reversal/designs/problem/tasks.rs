//! The rows of a design, task by task: one slab and one channel.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Constraints;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, Sink, StructuredProblem};

use super::columns::Batch;
use super::{DesignProblem, Prepared};
use crate::basis::bspline::{Cubic, horner};
use crate::reversal::forward::{Attitude, no_contact};
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
        let mut prepared = self.prepared(at)?;
        prepared.width = self.width(&prepared)?;
        Ok(prepared)
    }

    fn band_width(&self, prepared: &Prepared) -> usize {
        prepared.width
    }

    fn task_count(&self, _: &Prepared) -> usize {
        self.slab_count() * self.traces.len()
    }

    fn task(&self, prepared: &Prepared, index: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let (slab, c) = (index / self.traces.len(), index % self.traces.len());
        let trace = &self.traces[c];
        let mut batch = Batch::default();
        self.runs(prepared, c, slab, |from, to, cells| {
            let run = self.run(prepared, c, cells);
            sink.open(self.columns(c));
            for first in (from..to).step_by(Tall::CAPACITY) {
                let last = to.min(first + Tall::CAPACITY);
                let (x, value) = (&trace.x[first..last], &trace.value[first..last]);
                self.locate(prepared, (c, cells), &run, (x, value), &mut batch)?;
                let out = sink.batch(last - first);
                self.fill(prepared, c, (&run, cells), x, &mut batch, out);
                sink.push();
            }
            sink.close(self.band_columns(c, cells), self.shares(c, cells), c);
            Ok(())
        })
    }

    fn border_name(&self, index: usize) -> String {
        if self.layout.thickness_index() == Some(index) {
            return "thickness".to_owned();
        }
        let known = self.layout.names.get(index).cloned();
        known.unwrap_or_else(|| "line of a form".to_owned())
    }

    fn band_name(&self, index: usize) -> String {
        let (form, k) = self.layout.member(index);
        let breaks = self.splines.bases[form].breaks();
        format!("a form near {:.4} mm", breaks[k - 1])
    }
}

impl DesignProblem<'_> {
    /// The first reading at or beyond each break of the form of a channel's side, seen on the slide.
    pub(super) fn side_starts(
        &self,
        attitude: &Attitude,
        cubics: &[Vec<Cubic>],
        channel: usize,
        x: &[f64],
    ) -> Result<Vec<usize>, NoValue> {
        let form = self.layout.side[channel];
        let own = &cubics[form];
        let breaks: Vec<f64> = self.splines.bases[form]
            .breaks()
            .iter()
            .enumerate()
            .map(|(k, u)| {
                let height = match own.get(k) {
                    Some(cubic) => cubic[0],
                    None => own.last().map_or(0.0, |cubic| horner(cubic, 1.0)),
                };
                attitude.slide_position(*u, mm_from_um(height))
            })
            .collect();
        match breaks.windows(2).find(|pair| !(pair[0] < pair[1])) {
            Some(pair) => Err(no_contact(pair[0])),
            None => Ok(starts(x, &breaks)),
        }
    }

    /// Unknowns of the band from the lowest of a group to the highest of all groups before it.
    fn width(&self, prepared: &Prepared) -> Result<usize, NoValue> {
        let (mut highest, mut width) = (0, 1);
        for slab in 0..self.slab_count() {
            for channel in 0..self.traces.len() {
                self.runs(prepared, channel, slab, |_, _, cells| {
                    let band = self.band_columns(channel, cells).into_iter().flatten();
                    let own = band.fold(None, |range: Option<(usize, usize)>, j| {
                        Some(range.map_or((j, j), |(low, high)| (low.min(j), high.max(j))))
                    });
                    if let Some((low, high)) = own {
                        highest = highest.max(high);
                        width = width.max(highest + 1 - low);
                    }
                    Ok(())
                })?;
            }
        }
        Ok(width)
    }
}
