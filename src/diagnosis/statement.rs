//! The verdict in a sentence that a person can act on.

use super::splitting::Split;
use super::verdict::{Candidate, Fingerprint, Gap, Hidden, Kind, ParameterOut, Verdict, Where};
use crate::report::number::{measured, plain};

/// The sentence.
pub(super) fn statement(
    verdict: &Verdict,
    gap: &Gap,
    places: &[Where],
    candidates: &[Candidate],
    hidden: &[Hidden],
) -> String {
    let unit = for_people(gap.unit);
    let unseen = |implausible: bool| -> Vec<&str> {
        hidden
            .iter()
            .filter(|h| h.detectable.is_none() && h.implausible() == implausible)
            .map(|h| h.effect.as_str())
            .collect()
    };
    let place = places.first().map_or(String::new(), |p| {
        let range = p
            .range()
            .map_or(String::new(), |range| format!(" from {range}"));
        format!(", most of it in {} {}{range}", p.axis, p.value)
    });
    match verdict.kind {
        Kind::None => {
            let said = |names: Vec<&str>, what: &str| {
                if names.is_empty() {
                    String::new()
                } else {
                    format!("; {} would {what}", names.join(", "))
                }
            };
            let blind = said(
                unseen(false),
                "not show in such readings whatever their size",
            ) + &said(unseen(true), "show only at sizes that are not plausible");
            format!(
                "The model misses nothing that stands out of the noise of {} {unit}{blind}.",
                plain(gap.noise, 3)
            )
        }
        Kind::Unknown => {
            let partial = match verdict.partial[..] {
                [] => String::new(),
                ref some => format!(
                    "; {} would leave {} {unit} of it",
                    some.join(" and "),
                    plain(gap.after.rms, 3)
                ),
            };
            format!(
                "The model misses {} {unit} RMS{place}, and no effect of the catalogue explains it{partial}.{}",
                plain(gap.before.rms, 3),
                verdict.shape.as_ref().map_or(String::new(), described)
            )
        }
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
                    "These readings cannot tell apart {}. To tell them apart: {}.",
                    groups.join(", nor "),
                    verdict.separate.join("; ")
                )
            };
            let named = named.join(" and ");
            if gap.before.rms > 0.0 {
                format!(
                    "The model misses {} {unit} RMS because of {named}; with it {} {unit} remain. {doubt}",
                    plain(gap.before.rms, 3),
                    plain(gap.after.rms, 3)
                )
            } else {
                format!(
                    "The model misses less than {} {unit} RMS, but {named} stands out of it. {doubt}",
                    plain(gap.before.ci95[1], 3)
                )
            }
        }
    }
}

fn describe(candidate: &Candidate) -> String {
    let own = detail(candidate.variant.as_deref(), &candidate.parameters);
    let others = candidate.elsewhere.iter().map(|other| {
        let there = detail(Some(&other.variant), &other.parameters);
        format!("; as likely {there}")
    });
    format!(" ({own}{})", others.collect::<String>())
}

fn detail(variant: Option<&str>, parameters: &[ParameterOut]) -> String {
    let mut parts: Vec<String> = variant.iter().map(|v| (*v).to_owned()).collect();
    parts.extend(parameters.iter().map(|p| {
        let (scale, unit) = if p.unit == "rad" {
            (1e6, "µrad")
        } else {
            (1.0, for_people(&p.unit))
        };
        let value = measured(scale * p.value, Some(scale * p.std));
        format!("{} {value} {unit}", p.name).trim_end().to_owned()
    }));
    parts.join(", ")
}

/// For each group what would split it: a further measurement where one suffices, and else the
/// observation that confirms or refutes the effect named first.
pub(super) fn separating(
    groups: &[Vec<String>],
    candidates: &[Candidate],
    splits: &[Option<Split>],
) -> Vec<String> {
    groups
        .iter()
        .enumerate()
        .filter_map(|(k, group)| {
            let first = group.first()?;
            let candidate = candidates.iter().find(|c| c.effect == *first)?;
            let observe = format!("{} (only {first} would show there)", candidate.confirm);
            let split = splits.get(k).and_then(Option::as_ref);
            Some(match split {
                Some(split) if split.suffices() => format!(
                    "{}, which takes them from {} to {} standard deviations apart, or {observe}",
                    split.measurement,
                    plain(split.now, 2),
                    plain(split.then, 2)
                ),
                Some(split) => format!(
                    "{observe}; to {} would take them from {} to {} standard deviations apart only",
                    split.measurement,
                    plain(split.now, 2),
                    plain(split.then, 2)
                ),
                None => observe,
            })
        })
        .collect()
}

/// The fingerprint of an unknown gap in words.
fn described(shape: &Fingerprint) -> String {
    let mut parts = Vec::new();
    if !shape.present.is_empty() && !shape.absent.is_empty() {
        parts.push(format!(
            "it is in {} and not in {}",
            shape.present.join(", "),
            shape.absent.join(", ")
        ));
    }
    match shape.odd {
        Some(odd) if odd > 0.8 => parts.push("it turns its sign with the direction".to_owned()),
        Some(odd) if odd < 0.2 => parts.push("it is the same in both directions".to_owned()),
        _ => {}
    }
    match shape.repeated {
        Some(part) if part > 0.8 => parts.push("it comes back in every repeat".to_owned()),
        Some(part) if part < 0.2 => parts.push("it changes from repeat to repeat".to_owned()),
        _ => {}
    }
    if let Some(nearest) = &shape.nearest {
        let against = nearest.against.as_ref().map_or(String::new(), |w| {
            let range = match (w.from, w.to) {
                (Some(from), Some(to)) => format!(" from {} to {}", plain(from, 4), plain(to, 4)),
                _ => String::new(),
            };
            format!(
                ", but beside it there remains something in {} {}{range}",
                w.axis, w.value
            )
        });
        parts.push(format!(
            "it is most like {} (cosine {}){against}",
            nearest.effect,
            plain(nearest.cosine, 2)
        ));
    }
    let text = parts.join("; ");
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        format!(" {}{}.", first.to_uppercase(), letters.as_str())
    })
}

/// A unit as people write it.
pub fn for_people(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "1" => "",
        unit => unit,
    }
}
