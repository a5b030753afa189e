//! The verdict in a sentence that a person can act on.

use super::verdict::{Candidate, Gap, Hidden, Kind, Verdict, Where};
use crate::report::number::{measured, plain};

/// The sentence.
pub(super) fn statement(
    verdict: &Verdict,
    gap: &Gap,
    places: &[Where],
    candidates: &[Candidate],
    hidden: &[Hidden],
) -> String {
    let unit = gap.unit;
    let undetectable: Vec<&str> = hidden
        .iter()
        .filter(|h| h.detectable.is_none())
        .map(|h| h.effect.as_str())
        .collect();
    let place = places.first().map_or(String::new(), |p| {
        let range = match (p.from, p.to) {
            (Some(from), Some(to)) => format!(" from {} to {}", plain(from, 4), plain(to, 4)),
            _ => String::new(),
        };
        format!(", most of it in {} {}{range}", p.axis, p.value)
    });
    match verdict.kind {
        Kind::None => {
            let blind = if undetectable.is_empty() {
                String::new()
            } else {
                format!(
                    "; {} would not show in such readings whatever their size",
                    undetectable.join(", ")
                )
            };
            format!(
                "The model misses nothing that stands out of the noise of {} {unit}{blind}.",
                plain(gap.noise, 3)
            )
        }
        Kind::Unknown => format!(
            "The model misses {} {unit} RMS{place}, and no effect of the catalogue explains it.",
            plain(gap.before.rms, 3)
        ),
        Kind::Effect => {
            let named: Vec<String> = verdict
                .effects
                .iter()
                .map(|name| {
                    let detail = candidates
                        .iter()
                        .find(|c| c.effect == *name)
                        .map_or(String::new(), describe);
                    format!("{name}{detail}")
                })
                .collect();
            let doubt = if verdict.indistinguishable.is_empty() {
                let confirm: Vec<&str> = candidates
                    .iter()
                    .filter(|c| verdict.effects.contains(&c.effect))
                    .map(|c| c.confirm.as_str())
                    .collect();
                format!("To confirm: {}.", confirm.join("; "))
            } else {
                let groups: Vec<String> = verdict
                    .indistinguishable
                    .iter()
                    .map(|g| g.join(" or "))
                    .collect();
                format!(
                    "These readings cannot tell apart {}.",
                    groups.join(", nor ")
                )
            };
            format!(
                "The model misses {} {unit} RMS because of {}; with it {} {unit} remain. {doubt}",
                plain(gap.before.rms, 3),
                named.join(" and "),
                plain(gap.after.rms, 3)
            )
        }
    }
}

fn describe(candidate: &Candidate) -> String {
    let mut parts: Vec<String> = candidate.variant.iter().cloned().collect();
    parts.extend(
        candidate
            .parameters
            .iter()
            .map(|p| format!("{} {} {}", p.name, measured(p.value, Some(p.std)), p.unit)),
    );
    format!(" ({})", parts.join(", "))
}
