//! Quantiles of Student's distribution for any degrees of freedom, whole or not, small or huge.
//!
//! The usual way inverts the incomplete beta function by Newton's method, which for many thousands of
//! degrees of freedom need not end; effective degrees of freedom take any value.

use std::convert::Infallible;

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::scalar::root_between;

/// From here on the expansion about the normal quantile is exact to 1e-12 of the quantile, for shares
/// to 1e-9 from the ends; below it the survival function is exact.
const MANY: f64 = 2000.0;

/// From here on it is so for quantiles whose square is at most this share of the degrees of freedom.
const SEVERAL: f64 = 300.0;
const NEAR: f64 = 0.02;

/// The value below which a share `probability` of Student's distribution with `degrees` of freedom
/// lies; of the normal distribution when they are infinite. Relative error below 1e-10.
///
/// NaN for a probability outside the open interval 0 to 1 or degrees of freedom that are not positive.
///
/// ```
/// use errsep_solvers::uncertainty::student_quantile;
/// assert!((student_quantile(0.975, 4.0) - 2.776_445).abs() < 1e-6);
/// assert!((student_quantile(0.975, 1e30) - 1.959_964).abs() < 1e-6);
/// ```
#[must_use]
pub fn student_quantile(probability: f64, degrees: f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0 && degrees > 0.0) {
        return f64::NAN;
    }
    if probability == 0.5 {
        return 0.0;
    }
    let tail = probability.min(1.0 - probability);
    let z = -Normal::standard().inverse_cdf(tail);
    let is_near = degrees >= SEVERAL && z * z <= NEAR * degrees;
    let size = if is_near || degrees >= MANY {
        expanded(z, degrees)
    } else {
        StudentsT::new(0.0, 1.0, degrees).map_or(f64::NAN, |t| place_of(tail, |x| t.sf(x)))
    };
    if probability < 0.5 { -size } else { size }
}

/// Expansion in 1/ν about the normal quantile z (Abramowitz and Stegun 26.7.5).
fn expanded(z: f64, degrees: f64) -> f64 {
    let s = z * z;
    let terms = [
        (s + 1.0) / 4.0,
        ((5.0 * s + 16.0) * s + 3.0) / 96.0,
        (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0,
        ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0,
    ];
    let series = terms.iter().rev().fold(0.0, |sum, t| (sum + t) / degrees);
    z * (1.0 + series)
}

/// The x > 0, to its rounding, at which a falling survival function from 1/2 takes the value `tail`.
fn place_of(tail: f64, survival: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while survival(high) > tail && high < f64::MAX / 4.0 {
        low = high;
        high *= 2.0;
    }
    root_between(low, high, 0.0, |x| {
        Ok::<_, Infallible>(survival(x) / tail - 1.0)
    })
    .unwrap_or(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_give_the_quantile() {
        // Other tool: mpmath 1.3, 30 digits, by its incomplete beta function.
        for (probability, degrees, expected) in [
            (0.975, 300.0, 1.967_903_011_261_087),
            (0.995, 400.0, 2.588_176_080_034_74),
            (0.84, 1900.0, 0.994_718_204_357_032_8),
            (0.9999, 310.0, 3.763_977_829_236_517),
        ] {
            let off = student_quantile(probability, degrees) / expected - 1.0;
            // What the expansion leaves out from 300 degrees on.
            assert!(off.abs() < 1e-12, "{probability} {degrees}: {off:e}");
        }
    }
}
