//! What a solution holds, value by value.

use errsep_solvers::outcome::{Ending, Iteration};

use crate::reversal::staged::Value;

/// A fitted slope or constant: an unknown by itself, or with others that the design does not tell from
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Its name, such as `alpha_h` or `alpha_h + cone`.
    pub name: String,
    /// Whether it is an unknown by itself.
    pub alone: bool,
    /// rad for slopes, µm for constants.
    pub value: Value,
    /// Degrees of freedom of its standard uncertainty; infinite where the noise is declared.
    pub degrees_of_freedom: f64,
}

/// A fitted form, or forms that the design does not tell apart.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundForm {
    /// Its name, such as `M_h`, `S_90` or `M_h + S_0`.
    pub name: String,
    /// The side of the artefact, degrees, where it is that of a side by itself.
    pub side: Option<f64>,
    /// Whether it is a form by itself.
    pub alone: bool,
    /// Values, µm, without straight-line part over the measured positions.
    pub values: Vec<f64>,
    /// Standard uncertainties, µm.
    pub std: Vec<f64>,
    /// What is no noise in each of these, µm: what the model misses, or the knots cut off.
    pub missed: f64,
    /// Degrees of freedom of these: the fewest of any point.
    pub degrees_of_freedom: f64,
}

/// Residuals and noise of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelResiduals {
    /// Number of readings.
    pub readings: usize,
    /// Root mean square, µm.
    pub rms: f64,
    /// Standard deviation of one reading, µm, without what the model misses.
    pub sigma: f64,
}

/// How the fit went.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignConvergence {
    /// How it ended.
    pub ending: Ending,
    /// One record a pass over all readings.
    pub history: Vec<Iteration>,
    /// Time of the whole fit.
    pub seconds: f64,
}
