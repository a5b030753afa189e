//! What is told of positions that repeats lack.

use crate::report::number;

/// Positions that were filled in from other repeats, the first by name: spacing, repeat and x of each, mm.
pub(super) fn lacking(missing: &[(f64, u32, f64)]) -> Option<String> {
    /// As many are named.
    const NAMED: usize = 3;
    let named: Vec<String> = missing
        .iter()
        .take(NAMED)
        .map(|(spacing, repeat, x)| {
            let [spacing, x] = [spacing, x].map(|v| short(*v));
            format!("x = {x} mm in repeat {repeat} of spacing {spacing} mm")
        })
        .collect();
    let more = match missing.len().saturating_sub(NAMED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let are = match missing.len() {
        0 => return None,
        1 => "one position is".to_owned(),
        n => format!("{n} positions are"),
    };
    Some(format!(
        "{are} missing ({}{more}) and filled in from the other repeats, less the heights of the repeats; the \
         uncertainties know it.",
        named.join(", ")
    ))
}

/// A position as short as it is, to 0.1 µm.
fn short(position: f64) -> String {
    let text = number::fixed(position, 4);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
