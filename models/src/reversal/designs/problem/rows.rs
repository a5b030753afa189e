//! Single rows of a design, and its channels' weights.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredFit, fit_structured};

use super::columns::Batch;
use super::{DesignProblem, Prepared};
use crate::reversal::channel_noise::Weighed;
use crate::reversal::channel_noise::gathered::Derivatives;
use crate::reversal::designs::error::DesignFitError;
use crate::reversal::designs::readings::Trace;
use crate::reversal::simultaneous::rows::Run;

impl DesignProblem<'_> {
    /// The derivatives of what one reading of a channel, by its place in the trace, would be; nothing is
    /// weighted.
    ///
    /// # Errors
    /// [`NoValue`] where the probe touches in two places.
    pub(in crate::reversal::designs) fn derivatives(
        &self,
        prepared: &Prepared,
        channel: usize,
        row: usize,
    ) -> Result<Derivatives, NoValue> {
        let (cells, _) = self.cells_at(prepared, channel, row);
        let run = Run {
            weight: 1.0,
            ..self.run(prepared, channel, cells)
        };
        let trace = &self.traces[channel];
        let (x, value) = (&trace.x[row..=row], &trace.value[row..=row]);
        let (mut batch, mut one) = (Batch::default(), Tall::new(16));
        self.locate(prepared, (channel, cells), &run, (x, value), &mut batch)?;
        one.reset(1, self.columns(channel));
        self.fill(prepared, channel, (&run, cells), x, &mut batch, &mut one);
        let unknowns = self.band_columns(channel, cells).into_iter();
        let band = unknowns
            .enumerate()
            .filter_map(|(column, unknown)| Some((unknown?, one.column(column)[0])))
            .collect();
        let mut border = vec![0.0; self.layout.border_count()];
        for share in self.shares(channel, cells) {
            border[share.unknown as usize] += share.weight * one.column(share.column as usize)[0];
        }
        Ok((band, border))
    }

    /// The state in which derivatives at a point are taken.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(in crate::reversal::designs) fn at(&self, point: &Parameters) -> Result<Prepared, NoValue> {
        self.prepared(point)
    }
}

impl Weighed for DesignProblem<'_> {
    type Error = DesignFitError;

    fn lengths(&self) -> Vec<usize> {
        self.traces.iter().map(Trace::len).collect()
    }

    fn weights(&self) -> &[f64] {
        &self.weights
    }

    fn weigh(&mut self, weights: Vec<f64>) {
        self.weights = weights;
    }

    fn free_count(&self) -> usize {
        self.layout.free_count() + self.traces.iter().map(|t| t.taken_out).sum::<usize>()
    }

    fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue> {
        DesignProblem::residuals(self, at)
    }

    fn minimise(
        &mut self,
        start: Parameters,
        options: &Minimisation,
    ) -> Result<StructuredFit, DesignFitError> {
        Ok(fit_structured(self, start, options)?)
    }
}
