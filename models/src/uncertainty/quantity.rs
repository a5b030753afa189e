//! The measured quantity.

use serde::{Deserialize, Serialize};

use super::{DegreesOfFreedom, UncertaintyError};

/// A value with its standard uncertainty, degrees of freedom, unit and label.
///
/// In JSON: `{"label":"alpha","value":..,"std":..,"degrees_of_freedom":..,"unit":"rad"}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Name that travels into every budget.
    pub label: String,
    /// Best estimate, in `unit`.
    pub value: f64,
    /// Standard uncertainty, in `unit`.
    #[serde(rename = "std")]
    pub standard_uncertainty: f64,
    /// How well the standard uncertainty is known.
    pub degrees_of_freedom: DegreesOfFreedom,
    /// Unit of the value and of its uncertainty, `"1"` for a pure number.
    pub unit: String,
}

impl Quantity {
    /// A quantity with infinite degrees of freedom.
    ///
    /// # Errors
    /// A value that is not finite; a standard uncertainty that is negative or not finite.
    pub fn new(
        label: impl Into<String>,
        value: f64,
        standard_uncertainty: f64,
        unit: impl Into<String>,
    ) -> Result<Self, UncertaintyError> {
        let label = label.into();
        if !value.is_finite() {
            return Err(UncertaintyError::BadValue {
                label,
                found: value,
            });
        }
        if !(standard_uncertainty.is_finite() && standard_uncertainty >= 0.0) {
            return Err(UncertaintyError::BadStandardUncertainty {
                label,
                found: standard_uncertainty,
            });
        }
        Ok(Self {
            label,
            value,
            standard_uncertainty,
            degrees_of_freedom: DegreesOfFreedom::Infinite,
            unit: unit.into(),
        })
    }

    /// From a certificate that states an expanded uncertainty and its coverage factor (GUM 4.3.3).
    ///
    /// # Errors
    /// As [`Quantity::new`] for `expanded_uncertainty / coverage_factor`.
    pub fn from_expanded(
        label: impl Into<String>,
        value: f64,
        expanded_uncertainty: f64,
        coverage_factor: f64,
        unit: impl Into<String>,
    ) -> Result<Self, UncertaintyError> {
        Self::new(label, value, expanded_uncertainty / coverage_factor, unit)
    }

    /// The same quantity with these degrees of freedom.
    #[must_use]
    pub fn with_degrees_of_freedom(mut self, degrees_of_freedom: DegreesOfFreedom) -> Self {
        self.degrees_of_freedom = degrees_of_freedom;
        self
    }
}
