//! The derivatives of single readings around a solution.

use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::StructuredProblem;

use super::placed::Placed;
use super::predict::Prediction;
use super::problem::Reversal;
use super::solution::Simultaneous;
use crate::reversal::channel_noise::gathered::Derivatives;

/// Where rows come from: of a position alone, or of a reading where effects tell readings apart.
pub struct RowSource<'s> {
    solution: &'s Simultaneous,
    problem: &'s Reversal<'s>,
    placed: Option<Placed>,
}

impl<'s> RowSource<'s> {
    /// The rows of a problem at its solution.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn new(solution: &'s Simultaneous, problem: &'s Reversal<'s>) -> Result<Self, NoValue> {
        let placed = match problem.joined {
            Some(_) => problem.prepare(&solution.parameters)?.placed,
            None => None,
        };
        Ok(Self {
            solution,
            problem,
            placed,
        })
    }

    /// What a reading (channel, place among its sorted readings) would be, with its derivatives.
    ///
    /// # Errors
    /// [`NoValue`] where the probe touches in two places.
    pub fn row(&self, channel: usize, row: usize) -> Result<Prediction, NoValue> {
        let readings = &self.problem.channels[channel];
        match &self.placed {
            Some(placed) => Ok(placed.prediction(self.problem, channel, row)),
            None => self.solution.predict(readings.channel, readings.x[row]),
        }
    }

    /// The derivatives alone, by unknowns of band and border.
    ///
    /// # Errors
    /// As [`Self::row`].
    pub fn derivatives(&self, channel: usize, row: usize) -> Result<Derivatives, NoValue> {
        let prediction = self.row(channel, row)?;
        Ok((prediction.band, prediction.border))
    }
}
