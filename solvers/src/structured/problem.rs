//! What the structured solver needs to know of a problem.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::sink::Sink;
use crate::linear::bordered::Constraints;
use crate::problem::NoValue;

/// A point: the unknowns of the band and those of the border.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Parameters {
    /// Unknowns of which each row sees a few neighbours, n.
    pub band: Vec<f64>,
    /// Unknowns which every row may see, q.
    pub border: Vec<f64>,
}

impl Parameters {
    /// All zero.
    pub fn zeros(band: usize, border: usize) -> Self {
        Self {
            band: vec![0.0; band],
            border: vec![0.0; border],
        }
    }

    /// This point plus a step.
    pub fn stepped(&self, band: &[f64], border: &[f64]) -> Self {
        let add = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self {
            band: add(&self.band, band),
            border: add(&self.border, border),
        }
    }

    /// All unknowns in one vector, those of the band first.
    pub fn joined(&self) -> DVector<f64> {
        let all = self.band.iter().chain(&self.border);
        DVector::from_iterator(self.band.len() + self.border.len(), all.copied())
    }
}

/// A least-squares problem with a banded and bordered Jacobian: minimise ½ Σ r².
///
/// The rows come in *tasks* (independent, done on any core) of *groups*: the rows of a group share
/// their columns. A group's local columns are, in this order, band unknowns, others and the
/// residual. What they are to the unknowns of the border is told once a group, by
/// [`Share`](crate::linear::bordered::Share)s: eight global unknowns that a trace sees through the
/// same two columns cost two columns in every row, and an offset that is a combination of the band's
/// columns costs none.
pub trait StructuredProblem: Sync {
    /// What is computed once at a point and shared by all tasks.
    type Prepared: Sync;

    /// Number of unknowns in the band, n.
    fn band_count(&self) -> usize;

    /// Number of unknowns in the border, q.
    fn border_count(&self) -> usize;

    /// Number of parts of the rows, each with a weight and degrees of freedom of its own.
    fn part_count(&self) -> usize {
        1
    }

    /// Linear equality constraints, satisfied at the start.
    fn constraints(&self) -> &Constraints;

    /// Border unknowns that keep the value they have, one flag each.
    fn held(&self) -> &[bool];

    /// Prepares a point.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    fn prepare(&self, at: &Parameters) -> Result<Self::Prepared, NoValue>;

    /// Number of columns the widest row spans at this point.
    fn band_width(&self, prepared: &Self::Prepared) -> usize;

    /// Number of tasks at this point.
    fn task_count(&self, prepared: &Self::Prepared) -> usize;

    /// Pushes the rows of a task into the sink. Groups advance along the band: from the lowest
    /// unknown of a group to the highest of all groups before it, in the order of the tasks, there
    /// must be no more than [`band_width`](Self::band_width) unknowns.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    fn task(&self, prepared: &Self::Prepared, index: usize, sink: &mut Sink)
    -> Result<(), NoValue>;

    /// The name of a border unknown, for messages.
    fn border_name(&self, index: usize) -> String {
        format!("y{index}")
    }

    /// The name of an unknown of the band, for messages.
    fn band_name(&self, index: usize) -> String {
        format!("c{index}")
    }
}
