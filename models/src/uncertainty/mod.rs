//! Uncertainty in the vocabulary of the Guide to the expression of uncertainty in measurement
//! (GUM, JCGM 100:2008) and of its first supplement (JCGM 101:2008).
//!
//! One type, [`Quantity`], carries a value with its standard uncertainty, degrees of freedom, unit
//! and label through every model. The files are the guide's chapters: evaluation of type A
//! (statistics of repeats) and of type B (everything else), combination by the law of propagation
//! into a [`Budget`], expansion by a coverage factor, and propagation of distributions by
//! [`simulate`].

mod budget;
mod correlation;
mod coverage;
mod degrees_of_freedom;
mod disagreement;
mod monte_carlo;
mod quantity;
mod type_a;
mod type_b;

pub use budget::{Budget, Contribution, second_order_variance};
pub use correlation::Correlation;
pub use coverage::{Expanded, coverage_factor};
pub use degrees_of_freedom::{DegreesOfFreedom, welch_satterthwaite};
pub use disagreement::{Disagreement, TOLD_BELOW, exceeding};
pub use monte_carlo::{CoverageInterval, Sample, Trials, simulate};
pub use quantity::Quantity;
pub use type_a::{mean_of, pooled_standard_deviation, sample_standard_deviation};
pub use type_b::{arcsine, degrees_from_reliability, rectangular, triangular};

/// What cannot be evaluated, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UncertaintyError {
    /// A standard uncertainty is negative or not finite.
    #[error("the standard uncertainty of `{label}` is {found}: it must be finite and not negative")]
    BadStandardUncertainty {
        /// Label of the quantity.
        label: String,
        /// The number found.
        found: f64,
    },
    /// A value is not finite.
    #[error("the value of `{label}` is {found}: it must be finite")]
    BadValue {
        /// Label of the quantity.
        label: String,
        /// The number found.
        found: f64,
    },
    /// Degrees of freedom must be positive.
    #[error("degrees of freedom are {found}: they must be positive")]
    BadDegreesOfFreedom {
        /// The number found.
        found: f64,
    },
    /// A coverage probability outside the open interval from 0 to 1.
    #[error("a coverage probability of {found} was asked for: it must lie between 0 and 1")]
    BadProbability {
        /// The number found.
        found: f64,
    },
    /// Too few observations for a statistic.
    #[error("{found} observations were given where {needed} are needed")]
    TooFewObservations {
        /// The number needed.
        needed: usize,
        /// The number given.
        found: usize,
    },
    /// Two lists that belong together have different lengths.
    #[error("{what}: {expected} were expected, {found} given")]
    LengthMismatch {
        /// What was counted.
        what: &'static str,
        /// The number expected.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// A correlation coefficient outside -1..=1, or between quantities that do not exist.
    #[error("the correlation of quantities {first} and {second} is {found}: {why}")]
    BadCorrelation {
        /// Index of the first quantity.
        first: usize,
        /// Index of the second quantity.
        second: usize,
        /// The coefficient found.
        found: f64,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The correlations contradict each other: the variance of the result would be negative.
    #[error("the correlations contradict each other: the combined variance would be {variance:e}")]
    NegativeVariance {
        /// The variance that follows from them.
        variance: f64,
    },
    /// A simulated trial gave something that is not a number.
    #[error("trial {trial} of the simulation gave {found}")]
    BadTrial {
        /// Number of the trial, from 0.
        trial: usize,
        /// What it gave.
        found: f64,
    },
}
