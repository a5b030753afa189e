//! Outputs that cannot be separated, and why.

use errsep_solvers::regularization::RegularizationError;

use crate::straightness::NoStraightness;

/// Why four-sensor outputs have no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FourSensorError {
    /// The sampling interval is no length.
    #[error("the sampling interval is {step} mm: it must be positive and finite")]
    Step {
        /// The interval, mm.
        step: f64,
    },
    /// Two sensors at one place.
    #[error(
        "sensor {sensor} stands where the sensor before it stands: give it a spacing of at least one step"
    )]
    SensorsCoincide {
        /// Number of the sensor, from 1.
        sensor: usize,
    },
    /// Fewer slide positions than the unknowns need.
    #[error(
        "there are outputs at {found} slide positions; this spacing of the sensors needs {needed} or more"
    )]
    TooFewOutputs {
        /// Positions given.
        found: usize,
        /// Positions needed.
        needed: usize,
    },
    /// Readings and geometry disagree.
    #[error("there are {found} rows of readings where the geometry has {expected} slide positions")]
    OutputCount {
        /// Rows given.
        found: usize,
        /// Slide positions.
        expected: usize,
    },
    /// A reading that is no number.
    #[error("the reading of sensor {sensor} at {position} mm is not finite")]
    NotFinite {
        /// Number of the sensor, from 1.
        sensor: usize,
        /// Slide position, mm.
        position: f64,
    },
    /// A stated value that cannot be one.
    #[error("{what} is {found}: it must be {needed}")]
    Value {
        /// What was given.
        what: &'static str,
        /// Its value.
        found: f64,
        /// What it must be.
        needed: &'static str,
    },
    /// A record too long for the dense fit, with a parabola from a quantity that spans all of it.
    #[error(
        "the parabola of a record this long can be stated as the surface's curvature only: the \
         uncertainty that zero-adjustments or a slope of the tilt bring is not local"
    )]
    ParabolaOfLongRecord,
    /// Neither the L-curve nor cross-validation has an answer inside the range of λ.
    #[error(
        "no rule finds a regularization parameter: the surface does not stand out of the noise over \
         the reach of the sensors, or a sensor reads so much else, bent, stretched or out of its place, that no surface \
         fits; space them wider against its waves, compare the sensors on one step, or state lambda, or the noise and \
         choice = \"discrepancy\""
    )]
    NoChoice,
    /// The residuals leave no degree of freedom and no noise was stated.
    #[error("the fit leaves nothing to estimate the noise from: state the noise of one reading")]
    NoNoise,
    /// The regularized problem has no answer.
    #[error(transparent)]
    Regularization(#[from] RegularizationError),
    /// The profile has no straightness.
    #[error(transparent)]
    Straightness(#[from] NoStraightness),
}
