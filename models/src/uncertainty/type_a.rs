//! Evaluation of type A: statistics of repeated observations (GUM 4.2).

use super::{DegreesOfFreedom, Quantity, UncertaintyError};

/// Mean and sample standard deviation (divisor `n - 1`), by the two-pass formula with its
/// correction for the rounding of the mean.
///
/// # Errors
/// Fewer than two observations.
pub fn sample_standard_deviation(observations: &[f64]) -> Result<(f64, f64), UncertaintyError> {
    let n = observations.len();
    if n < 2 {
        return Err(UncertaintyError::TooFewObservations {
            needed: 2,
            found: n,
        });
    }
    let count = n as f64;
    let mean = observations.iter().sum::<f64>() / count;
    let (squares, rest) = observations.iter().fold((0.0, 0.0), |(s, r), x| {
        let d = x - mean;
        (s + d * d, r + d)
    });
    let variance = (squares - rest * rest / count) / (count - 1.0);
    Ok((mean + rest / count, variance.max(0.0).sqrt()))
}

/// The mean of `n` repeats with the standard uncertainty `s/√n` and `n - 1` degrees of freedom.
///
/// # Errors
/// Fewer than two observations, or observations that are not finite.
pub fn mean_of(
    label: impl Into<String>,
    observations: &[f64],
    unit: impl Into<String>,
) -> Result<Quantity, UncertaintyError> {
    let (mean, deviation) = sample_standard_deviation(observations)?;
    let count = observations.len() as f64;
    Ok(Quantity::new(label, mean, deviation / count.sqrt(), unit)?
        .with_degrees_of_freedom(DegreesOfFreedom::new(count - 1.0)?))
}

/// Pooled standard deviation of several samples `(s_i, ν_i)` of one process: the root of
/// `Σ ν_i s_i² / Σ ν_i`, with `Σ ν_i` degrees of freedom (GUM 4.2.4 note).
///
/// # Errors
/// No sample with a degree of freedom.
pub fn pooled_standard_deviation(
    samples: &[(f64, f64)],
) -> Result<(f64, DegreesOfFreedom), UncertaintyError> {
    let degrees: f64 = samples.iter().map(|(_, nu)| nu).sum();
    let degrees_of_freedom = DegreesOfFreedom::new(degrees)?;
    let squares: f64 = samples.iter().map(|(s, nu)| nu * s * s).sum();
    Ok(((squares / degrees).sqrt(), degrees_of_freedom))
}
