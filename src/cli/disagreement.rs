//! Residuals that the noise of a reading does not explain, as every answer tells of them.

use errsep_models::uncertainty::Disagreement;
use serde_json::{Value, json};

use crate::report::number;

/// "The residuals are as if the noise of a reading were 0.86 µm, the set-up states 0.0100 µm: …": `seen`
/// is what scatters, `teller` says where `noise`, µm, comes from.
pub(super) fn in_words(found: Disagreement, seen: &str, teller: &str, noise: f64) -> String {
    format!(
        "{seen} as if the noise of a reading were {} µm, {teller} {} µm: the uncertainties are too small. \
         `errsep diagnose` looks for the cause.",
        number::plain(found.observed, 3),
        number::plain(noise, 3)
    )
}

/// The same for programs; `null` where there is none.
pub(super) fn as_json(found: Option<Disagreement>) -> Value {
    found.map_or(
        Value::Null,
        |found| json!({"observed": found.observed, "unit": "um", "p_value": found.p_value}),
    )
}
