//! What a certificate states of each kind of result; one file a kind, one line in [`READERS`].

mod circle;
mod four_sensor;
mod machine;
mod positioning;
mod reversal;
mod step_diagonal;
mod straightness;

use serde_json::Value;

use super::numbers::{Coverage, Entry, Group, Numbers};

/// Takes from a result what a certificate states; nothing where the result lacks it.
type Reader = fn(&Value) -> Option<Numbers>;

/// The schemas of results and how they are read.
const READERS: [(&str, Reader); 8] = [
    ("errsep.reversal/1", reversal::read),
    ("errsep.reversal/2", reversal::read_designs),
    ("errsep.circle/1", circle::read),
    ("errsep.positioning/1", positioning::read),
    ("errsep.straightness/1", straightness::read),
    ("errsep.four-sensor/1", four_sensor::read),
    ("errsep.step-diagonal/1", step_diagonal::read),
    ("errsep.machine/1", machine::read),
];

/// Whether results of this schema can be certified.
pub fn known(schema: &str) -> bool {
    READERS.iter().any(|(name, _)| *name == schema)
}

/// The numbers of a result, or nothing where it has none or lacks what its schema says.
pub fn numbers(schema: &str, result: &Value) -> Option<Numbers> {
    let (_, read) = READERS.iter().find(|(name, _)| *name == schema)?;
    let mut numbers = read(result)?;
    numbers.version = result["provenance"]["version"].as_str().map(str::to_owned);
    let warnings = result["warnings"].as_array().into_iter().flatten();
    numbers.warnings = warnings
        .filter_map(Value::as_str)
        .map(str::to_owned)
        .collect();
    numbers.groups.retain(|group| !group.entries.is_empty());
    (!numbers.groups.is_empty()).then_some(numbers)
}

/// Names and reasons of what is left out.
fn left(told: &[(&str, &str)]) -> Vec<(String, String)> {
    told.iter()
        .map(|(name, why)| ((*name).to_owned(), (*why).to_owned()))
        .collect()
}
