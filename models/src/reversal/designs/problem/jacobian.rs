//! The derivatives of all readings in one matrix: a check of the model.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;
use nalgebra::DMatrix;

use super::DesignProblem;
use super::columns::Batch;
use crate::reversal::designs::readings::Trace;

impl DesignProblem<'_> {
    /// Derivatives of the weighted residuals by every unknown, band first: one row a reading, channel by
    /// channel.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(in crate::reversal::designs) fn jacobian(
        &self,
        at: &Parameters,
    ) -> Result<DMatrix<f64>, NoValue> {
        let prepared = self.prepared(at)?;
        let rows = self.traces.iter().map(Trace::len).sum();
        let n = self.layout.band_count();
        let mut jacobian = DMatrix::zeros(rows, n + self.layout.border_count());
        let (mut batch, mut columns) = (Batch::default(), Tall::new(16));
        let mut above = 0;
        for (c, trace) in self.traces.iter().enumerate() {
            for slab in 0..self.slab_count() {
                self.runs(&prepared, c, slab, |from, to, cells| {
                    let run = self.run(&prepared, c, cells);
                    let (band, shares) = (self.band_columns(c, cells), self.shares(c, cells));
                    for first in (from..to).step_by(Tall::CAPACITY) {
                        let last = to.min(first + Tall::CAPACITY);
                        let (x, value) = (&trace.x[first..last], &trace.value[first..last]);
                        self.locate(&prepared, (c, cells), &run, (x, value), &mut batch)?;
                        columns.reset(last - first, self.columns(c));
                        self.fill(&prepared, c, (&run, cells), x, &mut batch, &mut columns);
                        for row in 0..last - first {
                            let mut out = jacobian.row_mut(above + first + row);
                            for (l, j) in band.iter().enumerate() {
                                if let Some(j) = j {
                                    out[*j] += columns.column(l)[row];
                                }
                            }
                            for share in &shares {
                                let local = columns.column(share.column as usize)[row];
                                out[n + share.unknown as usize] += share.weight * local;
                            }
                        }
                    }
                    Ok(())
                })?;
            }
            above += trace.len();
        }
        Ok(jacobian)
    }
}
