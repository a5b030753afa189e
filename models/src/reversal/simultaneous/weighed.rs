//! The four channels as a fit whose channels have weights.

use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredFit};

use super::descent;
use super::error::ReversalError;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use crate::reversal::channel_noise::{Seat, SortedReadings, Weighed};
use crate::reversal::designs::channel::DesignChannel;

impl SortedReadings for ChannelReadings {
    fn x(&self) -> &[f64] {
        &self.x
    }

    fn value(&self) -> &[f64] {
        &self.value
    }

    fn source(&self, row: usize) -> usize {
        self.source[row] as usize
    }

    fn seat(&self) -> Seat {
        Seat::from(&DesignChannel::from(self.channel))
    }
}

impl Weighed for Reversal<'_> {
    type Error = ReversalError;

    fn lengths(&self) -> Vec<usize> {
        self.channels.iter().map(ChannelReadings::len).collect()
    }

    fn weights(&self) -> &[f64] {
        &self.weights
    }

    fn weigh(&mut self, weights: Vec<f64>) {
        self.weights = weights;
    }

    fn free_count(&self) -> usize {
        self.unknowns.free_count() + self.channels.iter().map(|c| c.taken_out).sum::<usize>()
    }

    fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue> {
        Reversal::residuals(self, at)
    }

    fn minimise(
        &mut self,
        start: Parameters,
        options: &Minimisation,
    ) -> Result<StructuredFit, ReversalError> {
        descent::minimise(self, start, options)
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn lose(&mut self, loss: Loss, far: bool) {
        (self.loss, self.far) = (loss, far);
    }
}
