//! Uncertainty of a number that depends on the deviations at several points, with a budget by
//! component.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::model::coordinate;
use super::{Component, Kind, Machine, MachineError, Position};
use crate::uncertainty::{Budget, Correlation, Quantity};

/// What the deviations at different points have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Independence {
    /// The fitted functions and the errors of location are the same for all points; only the
    /// scatter about the functions is drawn anew at each.
    #[default]
    Scatter,
    /// Every point has errors of its own.
    Points,
    /// Every coordinate of every point has errors of its own: NISTIR 6868, equations (35), (38) and
    /// (46). An angle that moves both coordinates is then counted as two.
    Coordinates,
}

/// What is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prediction {
    /// The next part: function and scatter (equation 20).
    #[default]
    Future,
    /// The mean of many parts: the function alone (equation 28).
    Mean,
}

/// How a number depends on the deviation at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// The point, mm.
    pub position: Position,
    /// Change of the number per um of deviation along X, Y, Z.
    pub gradient: Vector3<f64>,
}

/// A number, linear in the deviations for the purpose of its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Functional {
    /// Name of the number.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Its dependence on each point.
    pub weights: Vec<Weight>,
}

/// The budget of a number by component. The cost is the number of points times that of components;
/// no covariance between points is ever formed.
///
/// # Errors
/// A position outside a table, or a number that is not finite.
pub fn propagate(
    machine: &Machine,
    functional: &Functional,
    independence: Independence,
    prediction: Prediction,
) -> Result<Budget, MachineError> {
    let mut rows = Vec::with_capacity(machine.errors().len());
    let count = functional.weights.len().max(1) as f64;
    let values = functional
        .weights
        .iter()
        .map(|w| machine.values(&w.position))
        .collect::<Result<Vec<_>, _>>()?;
    for error in machine.errors() {
        let component = error.component;
        let variance = variance(machine, functional, component, independence, prediction);
        let of_weights: f64 = functional
            .weights
            .iter()
            .map(|w| {
                let motion = machine.sensitivity(component, &w.position);
                match independence {
                    Independence::Coordinates => motion.component_mul(&w.gradient).norm_squared(),
                    Independence::Points | Independence::Scatter => motion.dot(&w.gradient).powi(2),
                }
            })
            .sum();
        let sensitivity = of_weights.sqrt();
        if !(sensitivity.is_finite() && variance.is_finite()) {
            return Err(MachineError::NotFinite {
                what: "the uncertainty of the number",
                found: sensitivity.max(variance),
            });
        }
        let mean = values.iter().map(|v| v[component.index()] / count).sum();
        let own = if sensitivity > 0.0 {
            variance.sqrt() / sensitivity
        } else {
            0.0
        };
        let quantity = Quantity::new(component.to_string(), mean, own, component.unit())?
            .with_degrees_of_freedom(error.spread.degrees);
        rows.push((quantity, sensitivity));
    }
    let independent = Correlation::none(rows.len());
    let (label, unit) = (functional.label.as_str(), functional.unit.as_str());
    Ok(Budget::combine(
        label,
        functional.value,
        unit,
        rows,
        &independent,
    )?)
}

/// Variance of the number by one component.
fn variance(
    machine: &Machine,
    functional: &Functional,
    component: Component,
    independence: Independence,
    prediction: Prediction,
) -> f64 {
    let Some(error) = machine.errors().iter().find(|e| e.component == component) else {
        return 0.0;
    };
    let spread = &error.spread;
    let scatter = match prediction {
        Prediction::Future => spread.scatter,
        Prediction::Mean => 0.0,
    };
    let mut sum = 0.0;
    let mut common = vec![0.0; spread.basis.terms];
    let mut squares = 0.0;
    let mut total = 0.0;
    for weight in &functional.weights {
        let motion = machine.sensitivity(component, &weight.position);
        let w = motion.dot(&weight.gradient);
        let at = coordinate(component, &weight.position);
        match independence {
            Independence::Scatter => {
                for (a, power) in common.iter_mut().zip(spread.basis.powers(at)) {
                    *a += w * power;
                }
                squares += w * w;
                total += w;
            }
            Independence::Points => sum += w * w * (spread.of_function(at) + scatter),
            Independence::Coordinates => {
                let apart = motion.component_mul(&weight.gradient).norm_squared();
                sum += apart * (spread.of_function(at) + scatter);
            }
        }
    }
    if independence == Independence::Scatter {
        // An angle between two paths is drawn once a part, not once a point.
        let anew = if component.kind == Kind::Squareness {
            total * total
        } else {
            squares
        };
        sum = spread.quadratic(&common) + scatter * anew;
    }
    sum.max(0.0)
}
