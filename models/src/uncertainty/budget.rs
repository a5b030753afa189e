//! The law of propagation of uncertainty and the budget it fills (GUM chapter 5).

use serde::{Deserialize, Serialize};

use super::{Correlation, DegreesOfFreedom, Quantity, UncertaintyError, welch_satterthwaite};

/// One row of a budget.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// The influence.
    #[serde(flatten)]
    pub input: Quantity,
    /// Partial derivative of the result by the influence, result unit per input unit.
    pub sensitivity: f64,
    /// `|c| u`, in the unit of the result.
    pub contribution: f64,
    /// Part of the combined variance: `c_i u_i Σ_j r_ij c_j u_j / u_c²`. The shares sum to one;
    /// with correlated inputs one of them can be negative. Zero in a budget without uncertainty.
    pub share: f64,
}

/// A result and the influences that make its uncertainty, the largest share first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// The result with its combined standard uncertainty and effective degrees of freedom.
    pub result: Quantity,
    /// One row an influence.
    pub contributions: Vec<Contribution>,
}

impl Budget {
    /// Combines inputs with known sensitivities by the law of propagation (GUM equations 10, 16).
    ///
    /// The effective degrees of freedom follow Welch–Satterthwaite, which holds for independent
    /// inputs; correlated inputs are merged into one contribution for it, with the smallest
    /// degrees of freedom among them.
    ///
    /// # Errors
    /// A correlation table of another size, or coefficients that no joint distribution has.
    pub fn combine(
        label: impl Into<String>,
        value: f64,
        unit: impl Into<String>,
        inputs: Vec<(Quantity, f64)>,
        correlation: &Correlation,
    ) -> Result<Self, UncertaintyError> {
        if correlation.count() != inputs.len() {
            return Err(UncertaintyError::LengthMismatch {
                what: "inputs of the correlation table",
                expected: inputs.len(),
                found: correlation.count(),
            });
        }
        let signed: Vec<f64> = inputs
            .iter()
            .map(|(q, c)| c * q.standard_uncertainty)
            .collect();
        let mut parts: Vec<f64> = signed.iter().map(|s| s * s).collect();
        for (i, j, r) in correlation.pairs() {
            parts[i] += r * signed[i] * signed[j];
            parts[j] += r * signed[i] * signed[j];
        }
        let variance: f64 = parts.iter().sum();
        let scale: f64 = signed.iter().map(|s| s * s).sum();
        if variance < -1e-12 * scale {
            return Err(UncertaintyError::NegativeVariance { variance });
        }
        let variance = variance.max(0.0);
        let degrees = effective_degrees(&inputs, &signed, correlation);
        let mut contributions: Vec<Contribution> = inputs
            .into_iter()
            .zip(&signed)
            .zip(&parts)
            .map(|(((input, sensitivity), signed), part)| Contribution {
                input,
                sensitivity,
                contribution: signed.abs(),
                share: if variance > 0.0 { part / variance } else { 0.0 },
            })
            .collect();
        contributions.sort_by(|a, b| b.share.abs().total_cmp(&a.share.abs()));
        Ok(Self {
            result: Quantity::new(label, value, variance.sqrt(), unit)?
                .with_degrees_of_freedom(degrees),
            contributions,
        })
    }

    /// As [`Budget::combine`] for a measurement function, with the sensitivities taken as
    /// `[f(x_i + u_i) - f(x_i - u_i)] / 2 u_i` (GUM 5.1.3 note 2).
    ///
    /// # Errors
    /// As [`Budget::combine`]; a function value that is not finite.
    pub fn of_function(
        label: impl Into<String>,
        unit: impl Into<String>,
        inputs: &[Quantity],
        correlation: &Correlation,
        function: impl Fn(&[f64]) -> f64,
    ) -> Result<Self, UncertaintyError> {
        let mut at: Vec<f64> = inputs.iter().map(|q| q.value).collect();
        let value = function(&at);
        let mut rows = Vec::with_capacity(inputs.len());
        for (i, input) in inputs.iter().enumerate() {
            let step = input.standard_uncertainty;
            let sensitivity = if step > 0.0 {
                at[i] = input.value + step;
                let above = function(&at);
                at[i] = input.value - step;
                let below = function(&at);
                at[i] = input.value;
                (above - below) / (2.0 * step)
            } else {
                0.0
            };
            if !sensitivity.is_finite() {
                return Err(UncertaintyError::BadValue {
                    label: input.label.clone(),
                    found: sensitivity,
                });
            }
            rows.push((input.clone(), sensitivity));
        }
        Self::combine(label, value, unit, rows, correlation)
    }
}

/// Welch–Satterthwaite over the groups of inputs that are correlated with one another.
fn effective_degrees(
    inputs: &[(Quantity, f64)],
    signed: &[f64],
    correlation: &Correlation,
) -> DegreesOfFreedom {
    let mut group: Vec<usize> = (0..inputs.len()).collect();
    for (i, j, r) in correlation.pairs() {
        if r != 0.0 && group[i] != group[j] {
            let (keep, drop) = (group[i], group[j]);
            group
                .iter_mut()
                .filter(|g| **g == drop)
                .for_each(|g| *g = keep);
        }
    }
    let mut merged = vec![(0.0_f64, f64::INFINITY); inputs.len()];
    for (i, (input, _)) in inputs.iter().enumerate() {
        let slot = &mut merged[group[i]];
        slot.0 += signed[i] * signed[i];
        if signed[i] != 0.0 {
            slot.1 = slot.1.min(input.degrees_of_freedom.as_f64());
        }
    }
    for (i, j, r) in correlation.pairs() {
        merged[group[i]].0 += 2.0 * r * signed[i] * signed[j];
    }
    let groups: Vec<(f64, DegreesOfFreedom)> = merged
        .into_iter()
        .map(|(variance, degrees)| {
            let degrees = DegreesOfFreedom::new(degrees).unwrap_or(DegreesOfFreedom::Infinite);
            (variance.max(0.0).sqrt(), degrees)
        })
        .collect();
    welch_satterthwaite(&groups)
}

/// The next terms of the variance of a function of independent, symmetrically distributed inputs:
/// `Σ_ij (1/2 f_ij² + f_i f_ijj) u_i² u_j²` (GUM 5.1.2 note).
///
/// Derivatives are differences with the standard uncertainties as steps: exact for polynomials of
/// second degree. Worth adding when a first derivative nearly vanishes, as in GUM H.1.7.
#[must_use]
pub fn second_order_variance(inputs: &[Quantity], function: impl Fn(&[f64]) -> f64) -> f64 {
    let centre: Vec<f64> = inputs.iter().map(|q| q.value).collect();
    let u: Vec<f64> = inputs.iter().map(|q| q.standard_uncertainty).collect();
    let at = |i: usize, a: f64, j: usize, b: f64| {
        let mut x = centre.clone();
        x[i] += a * u[i];
        x[j] += b * u[j];
        function(&x)
    };
    let middle = function(&centre);
    let mut variance = 0.0;
    for i in 0..inputs.len() {
        let first = 0.5 * (at(i, 1.0, i, 0.0) - at(i, -1.0, i, 0.0));
        for j in 0..inputs.len() {
            // Every difference below is already multiplied by its standard uncertainties.
            let (mixed, third) = if i == j {
                (
                    at(i, 1.0, i, 0.0) - 2.0 * middle + at(i, -1.0, i, 0.0),
                    0.5 * (at(i, 2.0, i, 0.0) - at(i, -2.0, i, 0.0)) - 2.0 * first,
                )
            } else {
                let plus = at(i, 1.0, j, 1.0) + at(i, 1.0, j, -1.0);
                let minus = at(i, -1.0, j, 1.0) + at(i, -1.0, j, -1.0);
                (
                    0.25 * (at(i, 1.0, j, 1.0) - at(i, 1.0, j, -1.0) - at(i, -1.0, j, 1.0)
                        + at(i, -1.0, j, -1.0)),
                    0.5 * (plus - minus) - 2.0 * first,
                )
            };
            variance += 0.5 * mixed * mixed + first * third;
        }
    }
    variance
}
