//! Puts what was found into the verdict's words and tables.

use errsep_models::model::FittedModel;
use nalgebra::DVector;

use crate::diagnosis::attribution::alternatives::Alternative;
use crate::diagnosis::attribution::bias::biases;
use crate::diagnosis::attribution::candidates::candidates;
use crate::diagnosis::attribution::context::{Cause, Context, raw_signatures};
use crate::diagnosis::attribution::examined::Examined;
use crate::diagnosis::attribution::reported::Candidate;
use crate::diagnosis::attribution::shrink::GapMeter;
use crate::diagnosis::detection::estimate::neighbour_scatter;
use crate::diagnosis::levels::NOISE_DIFFERS;
use crate::diagnosis::noise::dependence::Dependence;
use crate::diagnosis::noise::law::{NoiseSource, of_repeats};
use crate::diagnosis::noise::spikes::Calmed;
use crate::diagnosis::options::Options;
use crate::diagnosis::planning::splitting::splits;
use crate::diagnosis::severity::severities;
use crate::diagnosis::verdict::conclusion::{Conclusion, Measured};
use crate::diagnosis::verdict::hidden::hidden;
use crate::diagnosis::verdict::places::places;
use crate::diagnosis::verdict::shape::fingerprint;
use crate::diagnosis::verdict::statement::{separating, statement};
use crate::diagnosis::verdict::told::{for_people, no_noise};
use crate::diagnosis::verdict::types::{Detail, Diagnosis, Kind, NoiseOut, Verdict};
use crate::number::plain;

pub(in crate::diagnosis) fn compose(
    examined: &Examined<'_>,
    calm: &Calmed,
    options: &Options,
) -> Diagnosis {
    let Examined {
        context,
        readings,
        first,
        detected,
        ref found,
    } = *examined;
    let alarmed = detected <= options.false_alarm;
    let found = found.as_ref().filter(|_| alarmed);
    // What cannot be fitted is no cause.
    let fit = found.and_then(|answer| {
        let (amplitudes, _) = context.amplitudes(readings, &answer.causes)?;
        Some((answer.causes.as_slice(), amplitudes))
    });
    let (causes, change) = fit.map_or_else(
        || (&[][..], DVector::zeros(readings.len())),
        |(causes, amplitudes)| (causes, context.change(causes, &amplitudes)),
    );
    let meter = GapMeter::new(context.model, &context.law, options.seed);
    let unknowns: usize = causes.iter().map(Cause::unknowns).sum();
    let signatures = raw_signatures(context, causes);
    let square = first.residual.norm_squared() - context.space.degrees_of_freedom() as f64;
    let excess = square.max(f64::MIN_POSITIVE);
    let explained =
        first.residual.norm_squared() - context.remainder(readings, causes).residual.norm_squared();
    let before = meter.size(readings, 0);
    let dependence = Dependence::of(context.model, &context.law, &(readings - &change));
    let noise = NoiseOut::of(context.model, &context.law, &dependence);
    let Conclusion { kind, gap } = Conclusion::of(
        alarmed,
        found,
        Measured {
            unit: context.model.reading_unit(),
            noise: context.law.sigma(),
            before,
            after: meter.size(&(readings - &change), unknowns),
            predicted_shrink: if before.rms > 0.0 {
                1.0 - (1.0 - explained / excess).max(0.0).sqrt()
            } else {
                0.0
            },
            held_out: meter.held_out(context.model, readings, &signatures),
            periodic: noise.period.is_some(),
        },
    );
    // Without a gap there is nothing to explain.
    let whole = if alarmed && square > 0.0 {
        excess
    } else {
        f64::INFINITY
    };
    let names = |causes: &mut dyn Iterator<Item = &Cause>| -> Vec<String> {
        causes
            .map(|c| context.catalogue[c.effect].name().to_owned())
            .collect()
    };
    let own = names(&mut causes.iter());
    let groups: &[Vec<Alternative>] = match (found, kind) {
        (Some(answer), Kind::Effect) => &answer.groups,
        _ => &[],
    };
    let candidates = candidates(context, readings, first, whole, groups, causes);
    let indistinguishable: Vec<Vec<String>> = groups
        .iter()
        .filter(|group| group.len() > 1)
        .map(|group| names(&mut group.iter().map(|a| &a.cause)))
        .collect();
    let places = if alarmed {
        places(context, first, excess)
    } else {
        Vec::new()
    };
    let mut verdict = Verdict {
        kind,
        effects: if kind == Kind::Effect {
            own.clone()
        } else {
            Vec::new()
        },
        severity: match (found, kind) {
            (Some(answer), Kind::Effect) if options.severity > 0 => {
                severities(context, readings, answer, &dependence, options)
            }
            _ => Vec::new(),
        },
        indistinguishable,
        partial: if kind == Kind::Unknown {
            own
        } else {
            Vec::new()
        },
        separate: Vec::new(),
        shape: (kind == Kind::Unknown && square > 0.0)
            .then(|| fingerprint(context, readings, first, excess)),
        statement: String::new(),
        p_value: detected,
        adequacy: context.global(found.map_or(first, |a| &a.remainder)),
    };
    let splits = match (found, kind) {
        (Some(answer), Kind::Effect) => splits(context, readings, answer),
        _ => Vec::new(),
    };
    verdict.separate = separating(&verdict.indistinguishable, &candidates, &splits);
    let hidden = hidden(context, &verdict.effects, options);
    verdict.statement = statement(&verdict, (&gap, &noise), &places, &candidates, &hidden);
    let (bias, profiles) = biases(context, readings, causes);
    Diagnosis {
        schema: "errsep.diagnosis/1",
        model: context.model.name(),
        verdict,
        gap,
        noise,
        places,
        bias,
        hidden,
        notes: [
            notes(context, &(readings - &change), calm),
            no_noise(context.model, &dependence).into_iter().collect(),
            elsewhere(&candidates),
        ]
        .concat(),
        candidates,
        detail: Detail {
            before: meter.residuals(readings),
            after: meter.residuals(&(readings - &change)),
            profiles,
            change: change.as_slice().to_vec(),
            apart: splits.iter().flatten().map(|split| split.now).collect(),
        },
    }
}

/// Of which variant bias and remainder are, where another fits as well.
fn elsewhere(candidates: &[Candidate]) -> Vec<String> {
    let open = candidates.iter().filter(|c| !c.elsewhere.is_empty());
    open.map(|candidate| {
        let others: Vec<&str> = candidate
            .elsewhere
            .iter()
            .map(|other| other.variant.as_str())
            .collect();
        format!(
            "The bias of the answer is that of `{}` in {}; in {}, which fits as well, it would be another.",
            candidate.effect,
            candidate.variant.as_deref().unwrap_or("its place"),
            others.join(" or ")
        )
    })
    .collect()
}

fn notes(context: &Context<'_>, clean: &DVector<f64>, calm: &Calmed) -> Vec<String> {
    let mut notes = Vec::new();
    if calm.count > 0 {
        notes.push(format!(
            "{} single readings stand out of their neighbours and of their own repeats by more than four standard deviations; they are pulled in to four.",
            calm.count
        ));
    }
    if let Some(tails) = calm.tails {
        notes.push(format!(
            "The noise has heavier tails than the normal law: single readings follow Student's law with about {} degrees of freedom. All probabilities are computed with that.",
            plain(tails.freedom, 2)
        ));
    }
    notes.extend(disagreement(context, clean));
    if context.law.source == NoiseSource::Neighbours {
        notes.push(
            "The noise is not measured: there are no repeats. It is taken from differences of neighbouring readings, so anything rougher than the spacing counts as noise; measure at least three repeats."
                .to_owned(),
        );
    } else if context.law.source == NoiseSource::Stated {
        notes.push(stated(context, clean));
    }
    notes
}

/// What the repeats say of a noise that is stated.
fn stated(context: &Context<'_>, clean: &DVector<f64>) -> String {
    let told = "The noise is not measured but stated in the set-up.";
    let Some((seen, freedom)) = of_repeats(context.model, clean) else {
        return told.to_owned();
    };
    let ratio = seen / context.law.sigma();
    // Three standard deviations of a standard deviation, and by a part that matters.
    let reach = NOISE_DIFFERS + 3.0 * (0.5 / freedom).sqrt();
    if (ratio - 1.0).abs() < reach {
        return told.to_owned();
    }
    format!(
        "{told} The repeats differ by {} {} instead: leave `noise` out of the set-up if they are to be believed.",
        plain(seen, 2),
        for_people(context.model.reading_unit())
    )
}

/// What it means when neighbouring readings scatter otherwise than repeats do.
fn disagreement(context: &Context<'_>, clean: &DVector<f64>) -> Option<String> {
    if context.law.source != NoiseSource::Repeats {
        return None;
    }
    let scatter = neighbour_scatter(context.model, &context.law, clean)?;
    let unit = for_people(context.model.reading_unit());
    let (seen, expected) = (plain(scatter.seen, 2), plain(scatter.expected, 2));
    // Beyond three standard deviations of the comparison, and by a part that matters.
    let reach = NOISE_DIFFERS + 3.0 * scatter.relative_std;
    let ratio = scatter.seen / scatter.expected;
    if ratio > 1.0 + reach {
        Some(format!(
            "Neighbouring readings scatter by {seen} {unit}, repeats say {expected} {unit}: something rougher than the spacing of the readings comes back in every repeat."
        ))
    } else if ratio < 1.0 - reach {
        Some(format!(
            "Neighbouring readings scatter by {seen} {unit} only, repeats say {expected} {unit}: something changes from repeat to repeat that is neither a shift nor a steady drift, or readings have been smoothed."
        ))
    } else {
        None
    }
}
