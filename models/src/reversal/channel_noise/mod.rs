//! The noise of the channels of a reversal, and what repeats say of it: one code for the four channels
//! and for any design.
//!
//! [`settle`](settle::settle) minimises and weighs the channels by their own noise where neighbouring
//! readings tell them apart; [`White`](white::White) makes standard uncertainties of that;
//! [`AlongTraces`](along::AlongTraces) puts the laws that repeats allow in the place of white noise.

pub mod alike;
pub mod along;
pub mod between;
pub mod gathered;
pub mod heights;
pub mod laws;
pub mod levels;
pub mod pairs;
pub mod passes;
pub mod rounded;
pub mod scatter;
pub mod settle;
pub mod supposed;
pub mod survey;
pub mod traces;
pub mod white;

use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredFit, StructuredProblem};

use super::designs::channel::{DesignChannel, is_same};

/// The readings of one channel in growing order of position.
pub trait SortedReadings: Sync {
    /// Positions, mm, not falling.
    fn x(&self) -> &[f64];
    /// Readings, µm.
    fn value(&self) -> &[f64];
    /// Where a reading stands in the observations.
    fn source(&self, row: usize) -> usize;
    /// How indicator and spindle stand.
    fn seat(&self) -> Seat;
}

/// How indicator and spindle stand in a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// Direction of the indicator about the spindle axis, degrees.
    pub indicator: f64,
    /// Position of the spindle, degrees.
    pub spindle: f64,
}

impl From<&DesignChannel> for Seat {
    fn from(channel: &DesignChannel) -> Self {
        Self {
            indicator: channel.indicator,
            spindle: channel.spindle,
        }
    }
}

impl Seat {
    /// Whether one indicator reads both.
    pub fn has_indicator_of(&self, other: &Self) -> bool {
        is_same(self.indicator, other.indicator)
    }

    /// Whether the spindle stands alike in both.
    pub fn is_at_the_spindle_of(&self, other: &Self) -> bool {
        is_same(self.spindle, other.spindle)
    }

    /// Whether two indicators that stand opposite each other read both at one position of the spindle.
    pub fn is_opposite(&self, other: &Self) -> bool {
        is_same(self.spindle, other.spindle) && is_same(self.indicator + 180.0, other.indicator)
    }
}

/// A reversal whose channels have weights: a part of the rows of [`StructuredProblem`] is a channel.
pub trait Weighed: StructuredProblem {
    /// Why there is no answer.
    type Error: From<NoValue>;

    /// Number of readings by channel.
    fn lengths(&self) -> Vec<usize>;

    /// 1/σ of a reading of each channel, 1/µm.
    fn weights(&self) -> &[f64];

    /// Weighs the channels anew.
    fn weigh(&mut self, weights: Vec<f64>);

    /// Number of unknowns that the fit chooses.
    fn free_count(&self) -> usize;

    /// Reading less model, µm, by channel in the order of its sorted readings.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue>;

    /// The minimum from a start.
    ///
    /// # Errors
    /// Where the model is not defined at the start.
    fn minimise(
        &mut self,
        start: Parameters,
        options: &Minimisation,
    ) -> Result<StructuredFit, Self::Error>;

    /// Loss of a weighted residual.
    fn loss(&self) -> Loss {
        Loss::Quadratic
    }

    /// Minimises under another loss from now on, at first `far` from its minimum; nothing where there
    /// is least squares alone.
    fn lose(&mut self, _loss: Loss, _far: bool) {}
}

/// Readings less unknowns.
pub fn freedom_left(problem: &impl Weighed) -> f64 {
    let readings: usize = problem.lengths().iter().sum();
    readings as f64 - problem.free_count() as f64
}

/// 1/σ by channel.
pub fn weights_of(sigmas: &[f64]) -> Vec<f64> {
    sigmas.iter().map(|s| 1.0 / s).collect()
}

pub fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}

/// The root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (sum_of_squares(values) / values.len().max(1) as f64).sqrt()
}
