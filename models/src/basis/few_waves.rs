//! A smooth function over a travel in a few terms: a slope, a bend and the first three waves.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::model::Estimate;

/// The terms, functions of the part of the travel from 0 to 1.
pub(crate) const FEW_WAVES: [fn(f64) -> f64; 8] = [
    |t| t,
    |t| t * t,
    |t| (TAU * t).cos(),
    |t| (TAU * t).sin(),
    |t| (2.0 * TAU * t).cos(),
    |t| (2.0 * TAU * t).sin(),
    |t| (3.0 * TAU * t).cos(),
    |t| (3.0 * TAU * t).sin(),
];

/// Root mean square over the travel of the function with these amplitudes, its mean taken off.
pub(crate) fn root_mean_square(
    name: &str,
    unit: &str,
    amplitudes: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<Estimate> {
    let terms = FEW_WAVES.len();
    if amplitudes.len() != terms || covariance.nrows() < terms {
        return Vec::new();
    }
    let points = 200u32;
    let mean = |f: &dyn Fn(f64) -> f64| {
        let sum: f64 = (0..points)
            .map(|k| f((f64::from(k) + 0.5) / f64::from(points)))
            .sum();
        sum / f64::from(points)
    };
    // The mean square is a quadratic form of the amplitudes.
    let gram = DMatrix::from_fn(terms, terms, |i, j| {
        let (p, q) = (FEW_WAVES[i], FEW_WAVES[j]);
        mean(&|t| p(t) * q(t)) - mean(&p) * mean(&q)
    });
    let a = DVector::from_column_slice(amplitudes);
    let half = &gram * &a;
    let rms = a.dot(&half).max(0.0).sqrt();
    let own = covariance.view((0, 0), (terms, terms));
    vec![Estimate {
        name: name.to_owned(),
        value: rms,
        std: half.dot(&(own * &half)).max(0.0).sqrt() / rms.max(f64::MIN_POSITIVE),
        unit: unit.to_owned(),
    }]
}
