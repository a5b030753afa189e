//! When to stop, and what is told on the way.

use crate::outcome::Ending;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Most factorisations of all rows.
    pub max_iterations: usize,
    /// Converged when a full step promises to lower the cost by less than this share of it. That
    /// step is still taken.
    pub cost_tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: 50,
            cost_tolerance: 1e-12,
        }
    }
}

/// What one pass over the rows brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Cost at the best point so far.
    pub cost: f64,
    /// By how much the next step promises to lower it.
    pub predicted: f64,
    /// Damping of the step that led here; zero for a Gauss–Newton step.
    pub damping: f64,
    /// Whether that step was accepted.
    pub accepted: bool,
}

/// What a full step would leave, part by part of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// By how much the step promises to lower the cost.
    pub predicted: f64,
    /// Whether it is the last.
    pub last: bool,
    /// The sum of squares of the weighted rows of each part after it.
    pub squares: Vec<f64>,
    /// The trace of the hat matrix of each part: how many unknowns its rows use up.
    pub traces: Vec<f64>,
}

/// Whether to go on.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// Not there yet.
    Continue,
    /// Ended, and how.
    Done(Ending),
}
