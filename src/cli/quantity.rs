//! Results in the vocabulary of the GUM, as every JSON answer writes them.

use errsep_models::uncertainty::{DegreesOfFreedom, Quantity, UncertaintyError, coverage_factor};
use serde_json::{Value, json};

use crate::io::Message;
use crate::io::units::{URAD_PER_RAD, per_cent, symbol};
use crate::report::number;

/// Coverage probability of expanded uncertainties where a command has no option for it.
pub(super) const COVERAGE: f64 = 0.95;

/// A quantity with its expanded uncertainty at [`COVERAGE`].
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub(super) fn quantity_json(quantity: &Quantity) -> Result<Value, Message> {
    with_expanded(quantity, COVERAGE)
}

/// A quantity with its expanded uncertainty.
///
/// # Errors
/// Degrees of freedom without a coverage factor, or a coverage outside 0 to 1.
pub(super) fn with_expanded(quantity: &Quantity, coverage: f64) -> Result<Value, Message> {
    let expanded = quantity.expanded(coverage).map_err(unexpandable)?;
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

/// "-12.3 ± 1.4 µrad, U = 2.9 µrad (k = 2.18, 95 %, 12 degrees of freedom)": value and standard
/// uncertainty, then the expanded one; angles in µrad.
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub(super) fn measured_words(quantity: &Quantity) -> Result<String, Message> {
    let (factor, unit) = shown(&quantity.unit);
    let measured = number::measured(
        factor * quantity.value,
        Some(factor * quantity.standard_uncertainty),
    );
    Ok(format!(
        "{measured} {unit}, {}",
        expanded_words(quantity, COVERAGE)?
    ))
}

/// "expanded uncertainty, 95 % coverage, k = 2.18 (12 degrees of freedom)".
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub(super) fn coverage_words(degrees: DegreesOfFreedom) -> Result<String, Message> {
    let k = coverage_factor(COVERAGE, degrees).map_err(unexpandable)?;
    Ok(format!(
        "expanded uncertainty, {} coverage, k = {} ({degrees} degrees of freedom)",
        number::percent(COVERAGE),
        number::plain(k, 3)
    ))
}

/// "U = 2.9 µm (k = 2.18, 95 %, 12 degrees of freedom)".
///
/// # Errors
/// Degrees of freedom without a coverage factor, or a coverage outside 0 to 1.
pub(super) fn expanded_words(quantity: &Quantity, coverage: f64) -> Result<String, Message> {
    let (factor, unit) = shown(&quantity.unit);
    let expanded = quantity.expanded(coverage).map_err(unexpandable)?;
    Ok(format!(
        "U = {} {unit} (k = {}, {}, {} degrees of freedom)",
        number::uncertainty(factor * expanded.expanded_uncertainty),
        number::plain(expanded.coverage_factor, 3),
        format_args!("{} %", per_cent(coverage)),
        quantity.degrees_of_freedom
    ))
}

/// Factor to and name of the unit that people read: angles in µrad.
fn shown(unit: &str) -> (f64, &str) {
    match unit {
        "rad" => (URAD_PER_RAD, symbol("urad")),
        other => (1.0, symbol(other)),
    }
}

/// The message where a result cannot be told as a quantity.
pub(super) fn unexpandable(error: UncertaintyError) -> Message {
    Message::not_determined(format!("the uncertainty cannot be stated: {error}"))
}
