//! The verdict in a sentence that a person can act on.

use crate::attribution::reported::{Candidate, ParameterOut};
use crate::levels::MOSTLY;
use crate::planning::splitting::Split;
use crate::severity::{Confidence, JUMP, NO_NOISE, Severity, TOGETHER};
use crate::verdict::told::for_people;
use crate::verdict::types::{
    Fingerprint, Gap, Hidden, Kind, NOT_REPEATED, NoiseOut, Verdict, Where,
};
use errsep_models::number::{percent, plain, probability};

/// The sentence.
pub(crate) fn statement(
    verdict: &Verdict,
    (gap, noise): (&Gap, &NoiseOut),
    places: &[Where],
    candidates: &[Candidate],
    hidden: &[Hidden],
) -> String {
    let place = places.first().map_or(String::new(), |p| {
        let range = p
            .range()
            .map_or(String::new(), |range| format!(" from {range}"));
        let part = if p.share > 0.5 {
            "most of it".to_owned()
        } else {
            format!("the greatest part ({}) of it", percent(p.share))
        };
        format!(", {part} in {} {}{range}", p.axis, p.value)
    });
    match verdict.kind {
        Kind::None => nothing((gap, noise), hidden),
        Kind::Unknown => {
            let missed = if gap.before.rms > 0.0 {
                format!("The model misses {}{place}", gap.before.in_words(gap.unit))
            } else {
                format!(
                    "Something stands out of the noise (p {}){place}, though the model misses {}",
                    probability(verdict.p_value),
                    gap.before.in_words(gap.unit)
                )
            };
            let no_noise = no_noise(noise);
            let partial = match verdict.partial[..] {
                [] => no_noise.map_or(String::new(), |why| format!("; {why}")),
                ref some => format!(
                    "; {} would leave {} but {}{}",
                    some.join(" and "),
                    gap.after.in_words(gap.unit),
                    if some.len() > 1 {
                        "do not pass as its causes"
                    } else {
                        "does not pass as its cause"
                    },
                    no_noise
                        .as_ref()
                        .map_or(String::new(), |why| format!(": {why}"))
                ),
            };
            format!(
                "{missed}, and no effect of the catalogue explains it{partial}.{}",
                verdict.shape.as_ref().map_or(String::new(), described)
            )
        }
        Kind::Effect => named(verdict, gap, candidates),
    }
}

/// No gap, and what would not have shown.
fn nothing((gap, noise): (&Gap, &NoiseOut), hidden: &[Hidden]) -> String {
    let said = |implausible: bool, what: &str| {
        let names: Vec<&str> = hidden
            .iter()
            .filter(|h| h.detectable.is_none() && h.implausible() == implausible)
            .map(|h| h.effect.as_str())
            .collect();
        if names.is_empty() {
            String::new()
        } else {
            format!("; {} would {what}", names.join(", "))
        }
    };
    let level = format!(
        "{} {}{}",
        gap.noise_figure(),
        for_people(gap.unit),
        if gap.is_of_means() {
            format!(" in {}", gap.of_what())
        } else {
            String::new()
        }
    );
    let begin = if noise.source == NOT_REPEATED {
        format!(
            "No significant misfit at a noise of {level} that is correlated along its traces, as these readings alone tell \
             it: without repeats a smooth cause looks the same"
        )
    } else {
        format!("No significant misfit at a noise of {level}")
    };
    format!(
        "{begin}{}{}.",
        said(false, "not show in such readings whatever their size"),
        said(true, "show only at sizes that are not plausible")
    )
}

/// One or several causes, each alone or one of a group.
fn named(verdict: &Verdict, gap: &Gap, candidates: &[Candidate]) -> String {
    let described = |effect: &str| {
        let candidate = candidates.iter().find(|c| c.effect == effect);
        format!("{effect}{}", candidate.map_or(String::new(), describe))
    };
    let causes = verdict.causes();
    let open = causes.iter().any(|group| group.len() > 1);
    let said: Vec<String> = causes
        .iter()
        .map(|group| match group[..] {
            [only] => described(only),
            ref several => {
                let each: Vec<String> = several.iter().map(|e| described(e)).collect();
                format!("one of: {}", each.join("; "))
            }
        })
        .collect();
    let said = said.join(" and ");
    let weak = weakness(verdict);
    let advice = advice(verdict, candidates, !weak.is_empty());
    let beginning = because(gap, &said, &weak);
    let with = if open {
        verdict.effects.join(" and ")
    } else if causes.len() > 1 {
        "them".to_owned()
    } else {
        "it".to_owned()
    };
    let more = if gap.after.is_clear() {
        ", more than the noise explains"
    } else {
        ""
    };
    let remain = if gap.after.is_nothing() {
        "remains"
    } else {
        "remain"
    };
    format!(
        "{beginning}; with {with} {} {remain}{more}. {advice}",
        gap.after.in_words(gap.unit)
    )
}

/// What to do next: to tell the members of groups apart, or to confirm a name.
fn advice(verdict: &Verdict, candidates: &[Candidate], is_weak: bool) -> String {
    let causes = verdict.causes();
    let open = causes.iter().any(|group| group.len() > 1);
    if open {
        format!(
            "These readings cannot tell {} apart. To tell them apart: {}.",
            if causes.len() > 1 {
                "the members of a group"
            } else {
                "them"
            },
            verdict.separate.join("; ")
        )
    } else {
        let confirm: Vec<&str> = candidates
            .iter()
            .filter(|c| verdict.effects.contains(&c.effect))
            .map(|c| c.confirm.as_str())
            .collect();
        let purpose = if is_weak {
            "To tell them apart"
        } else {
            "To confirm"
        };
        format!("{purpose}: {}.", confirm.join("; "))
    }
}

/// What is missed because of what, or what a weak name (`weak`: why) is consistent with.
fn because(gap: &Gap, said: &str, weak: &str) -> String {
    let missed = gap.before.in_words(gap.unit);
    match (gap.before.rms > 0.0, weak.is_empty()) {
        (true, true) => format!("The model misses {missed} because of {said}"),
        (true, false) => {
            format!("The model misses {missed}, which is consistent ({weak}) with {said}")
        }
        (false, true) => {
            format!("The model misses {missed}, but what stands out of the noise is {said}")
        }
        (false, false) => format!(
            "The model misses {missed}, but what stands out of the noise is consistent ({weak}) with {said}"
        ),
    }
}

/// Why causes do not pass: what differs between repeats is not noise alone.
fn no_noise(noise: &NoiseOut) -> Option<String> {
    let comes_back = noise.period.as_ref().map(|period| {
        let (length, unit) = (plain(period.length, 3), for_people(period.unit));
        format!("comes back every {length} {unit}")
    });
    let goes_on = noise.between_traces.as_ref();
    let goes_on = goes_on.map(|_| "goes on from one trace to the next".to_owned());
    let uneven = noise.uneven.as_ref().map(|uneven| {
        let channels = uneven.channels.join(" and ");
        format!("shifts the traces of {channels} more than the others")
    });
    let ways: Vec<String> = comes_back
        .into_iter()
        .chain(goes_on)
        .chain(uneven)
        .collect();
    (!ways.is_empty()).then(|| {
        let ways = ways.join(" and ");
        format!("what differs from repeat to repeat {ways}, which noise does not")
    })
}

/// Of each weak name what else would be given it, or how rare it is that noise leaves as much, of several that they are
/// several, and of all whether the noise is none; nothing where all are strong.
fn weakness(verdict: &Verdict) -> String {
    let alone = verdict.effects.len() == 1;
    let weak = verdict
        .severity
        .iter()
        .filter(|s| s.confidence == Confidence::Weak);
    let mut each: Vec<String> = weak
        .map(|severity| {
            let name = match (alone, verdict.indistinguishable.is_empty()) {
                (true, true) => "this name".to_owned(),
                (true, false) => "one of these names".to_owned(),
                (false, _) => format!("the name {}", severity.effect),
            };
            let mut reasons = Vec::new();
            if severity.is_weak_by_rivals() {
                reasons.push(match severity.rivals.first() {
                    Some(worst) if worst.probability > 0.0 => format!(
                        "{} of this size would be given {name} in {} of cases",
                        worst.in_words(),
                        percent(worst.probability)
                    ),
                    _ => {
                        format!("too few rivals were drawn to say what else would be given {name}")
                    }
                });
            }
            if severity.leaves_something() {
                reasons.push(format!(
                    "noise alone would leave as much beside {name} in only {} of cases",
                    percent(severity.left)
                ));
            }
            reasons.join(", and ")
        })
        .filter(|reasons| !reasons.is_empty())
        .collect();
    let of_any = |holds: fn(&Severity) -> bool| verdict.severity.iter().any(holds);
    if of_any(|s| s.beside_others) {
        each.push(TOGETHER.to_owned());
    }
    if of_any(|s| s.dependent_noise) {
        each.push(NO_NOISE.to_owned());
    }
    if of_any(|s| s.jump_beside) {
        each.push(JUMP.to_owned());
    }
    if each.is_empty() {
        String::new()
    } else {
        format!("weak: {}", each.join("; "))
    }
}

/// Variant and sizes, and the others that are as likely.
fn describe(candidate: &Candidate) -> String {
    let own = detail(candidate.variant.as_deref(), &candidate.parameters);
    if own.is_empty() {
        return String::new();
    }
    let others = candidate.elsewhere.iter();
    let others = others.map(|other| detail(Some(&other.variant), &other.parameters));
    // What differs by less than is told is told once.
    let others = others.filter(|there| *there != own);
    let others = others.map(|there| format!("; as likely {there}"));
    format!(" ({own}{})", others.collect::<String>())
}

fn detail(variant: Option<&str>, parameters: &[ParameterOut]) -> String {
    let mut parts: Vec<String> = variant.iter().map(|v| (*v).to_owned()).collect();
    parts.extend(parameters.iter().map(|p| p.told().in_words()));
    parts.join(", ")
}

/// For each group what would split it: a further measurement where one suffices, and else the
/// observation that confirms or refutes the effect named first.
pub(crate) fn separating(
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
        Some(odd) if odd > MOSTLY => parts.push("it turns its sign with the direction".to_owned()),
        Some(odd) if odd < 1.0 - MOSTLY => {
            parts.push("it is the same in both directions".to_owned())
        }
        _ => {}
    }
    match shape.repeated {
        Some(part) if part > MOSTLY => parts.push("it comes back in every repeat".to_owned()),
        Some(part) if part < 1.0 - MOSTLY => {
            parts.push("it changes from repeat to repeat".to_owned())
        }
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
