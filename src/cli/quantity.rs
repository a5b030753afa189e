//! Results in the vocabulary of the GUM, as every JSON answer writes them.

use errsep_models::uncertainty::{DegreesOfFreedom, Quantity, UncertaintyError, coverage_factor};
use serde_json::{Value, json};

use crate::io::Message;

/// Coverage probability of expanded uncertainties where a command has no option for it.
pub(super) const COVERAGE: f64 = 0.95;

/// A quantity with its expanded uncertainty.
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub(super) fn quantity_json(quantity: &Quantity) -> Result<Value, Message> {
    let expanded = quantity.expanded(COVERAGE).map_err(unexpandable)?;
    Ok(json!({
        "label": quantity.label,
        "value": quantity.value,
        "std": quantity.standard_uncertainty,
        "degrees_of_freedom": quantity.degrees_of_freedom,
        "unit": quantity.unit,
        "expanded": expanded,
    }))
}

/// What turns every standard uncertainty of an answer into an expanded one; `null` where there is
/// none to turn.
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub(super) fn coverage_json(degrees: Option<DegreesOfFreedom>) -> Result<Value, Message> {
    degrees.map_or(Ok(Value::Null), |degrees| {
        Ok(json!({
            "degrees_of_freedom": degrees,
            "coverage_probability": COVERAGE,
            "coverage_factor": coverage_factor(COVERAGE, degrees).map_err(unexpandable)?,
        }))
    })
}

/// The message where a result cannot be told as a quantity.
pub(super) fn unexpandable(error: UncertaintyError) -> Message {
    Message::not_solved(format!("the uncertainty cannot be stated: {error}"))
}
