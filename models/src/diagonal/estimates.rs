//! What goes into the regression besides readings, and what comes out.

use super::components::{Axis, Component, Location};
use super::determination::{Ambiguity, Determined, Remedy};
use super::diagonals::{Diagonal, Target};
use super::prediction::Parameter;
use crate::uncertainty::{DegreesOfFreedom, Disagreement};
use serde::{Deserialize, Serialize};

/// A positioning slope measured by other means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Axis.
    pub axis: Axis,
    /// Slope by end points, µm/mm.
    pub slope: f64,
    /// Its standard uncertainty, µm/mm.
    pub std: f64,
    /// How well that is known.
    pub degrees_of_freedom: DegreesOfFreedom,
}

/// What is taken from elsewhere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Assumptions {
    /// Errors taken as zero: the usual analysis takes all nine angular ones.
    pub zero: Vec<Component>,
    /// Slopes that were measured.
    pub slopes: Vec<Measured>,
    /// Standard deviation of one reading, µm, where it is known.
    pub noise: Option<f64>,
}

/// One error function or its reversal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComponentEstimate {
    /// Which.
    pub component: Component,
    /// How far the readings determine it.
    pub determined: Determined,
    /// Grid positions, mm.
    pub positions: Vec<f64>,
    /// Values there, µm or rad: from corner A where determined wholly (straightness: from the line
    /// through its ends), from the line through the ends where only the shape is, else the determined
    /// part. A reversal counts from its first value where only its changes are determined. Empty where
    /// nothing is.
    pub values: Vec<f64>,
    /// Standard uncertainties; empty where the noise is not known.
    pub std: Vec<f64>,
    /// Their effective degrees of freedom, of the noise and of measured slopes together
    /// (Welch–Satterthwaite); empty where the noise is not known.
    pub degrees_of_freedom: Vec<DegreesOfFreedom>,
}

/// One squareness error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LocationEstimate {
    /// Which.
    pub location: Location,
    /// Whether it is determined.
    pub determined: Determined,
    /// The paper's S, rad, where determined.
    pub value: Option<f64>,
    /// Its standard uncertainty, rad.
    pub std: Option<f64>,
    /// Its effective degrees of freedom.
    pub degrees_of_freedom: Option<DegreesOfFreedom>,
}

/// One misalignment angle of the mirror of one set-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MirrorEstimate {
    /// Diagonal.
    pub diagonal: Diagonal,
    /// Target.
    pub target: Target,
    /// Number of the direction in [`Diagonal::mirror_axes`].
    pub direction: usize,
    /// Angle, rad, where determined.
    pub value: Option<f64>,
    /// Its standard uncertainty, rad.
    pub std: Option<f64>,
    /// Its effective degrees of freedom.
    pub degrees_of_freedom: Option<DegreesOfFreedom>,
}

/// The result of the regression.
#[derive(Debug, Clone)]
pub struct StepDiagonalFit {
    /// The 18 functions, in the order of [`Component::all`].
    pub components: Vec<ComponentEstimate>,
    /// Their reversals in the same order; empty without readings on the way back.
    pub reversals: Vec<ComponentEstimate>,
    /// The three squareness errors.
    pub squareness: Vec<LocationEstimate>,
    /// The mirrors.
    pub mirrors: Vec<MirrorEstimate>,
    /// Unknowns, definitions taken out.
    pub parameters: usize,
    /// Independent combinations determined.
    pub rank: usize,
    /// What cannot be told apart.
    pub ambiguities: Vec<Ambiguity>,
    /// What would settle it.
    pub remedies: Vec<Remedy>,
    /// Standard deviation of one reading, µm: given or estimated; none without redundancy.
    pub noise: Option<f64>,
    /// How well that is known: infinite where it was given.
    pub noise_degrees_of_freedom: Option<DegreesOfFreedom>,
    /// Where the residuals refute a noise that was given.
    pub disagreement: Option<Disagreement>,
    /// Readings and measured slopes less runs less rank.
    pub degrees_of_freedom: usize,
    /// Reading less model, µm, in the order of the readings.
    pub residuals: Vec<f64>,
    /// For each reading the places in `names` of the parameters it depends on, and how, µm per µm or rad; the unknown zero of its run comes to that.
    pub sensitivities: Vec<Vec<(usize, f64)>>,
    /// The parameters.
    pub names: Vec<Parameter>,
}
