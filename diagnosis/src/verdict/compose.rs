//! Puts what was found into the verdict's words and tables.

use errsep_models::model::FittedModel;
use nalgebra::DVector;

use crate::attribution::alternatives::Alternative;
use crate::attribution::bias::biases;
use crate::attribution::candidates::candidates;
use crate::attribution::confidence::Answer;
use crate::attribution::context::{Cause, Context, raw_signatures};
use crate::attribution::examined::Examined;
use crate::attribution::reported::Candidate;
use crate::attribution::shrink::GapMeter;
use crate::detection::estimate::neighbour_scatter;
use crate::levels::NOISE_DIFFERS;
use crate::noise::dependence::Dependence;
use crate::noise::law::{NoiseSource, of_repeats};
use crate::noise::spikes::Calmed;
use crate::options::Options;
use crate::planning::splitting::splits;
use crate::severity::severities;
use crate::verdict::conclusion::{Conclusion, Measured};
use crate::verdict::hidden::hidden;
use crate::verdict::places::places;
use crate::verdict::shape::fingerprint;
use crate::verdict::statement::{separating, statement};
use crate::verdict::told::{drifting, for_people, no_noise, pulled_in};
use crate::verdict::types::{Detail, Diagnosis, Kind, NoiseOut, Verdict};
use errsep_models::number::plain;

pub(crate) fn compose(examined: &Examined<'_>, calm: &Calmed, options: &Options) -> Diagnosis {
    let mut told = Told::of(examined, options);
    let (context, readings, first) = (examined.context, examined.readings, examined.first);
    let clean = readings - &told.change;
    let meter = GapMeter::new(context.model, &context.law, options.seed);
    let dependence = Dependence::of(context.model, &context.law, &clean, || {
        context.repeats_show_whole()
    });
    told.heed(&dependence, options);
    let noise = NoiseOut::of(context.model, &context.law, &dependence);
    let Conclusion { kind, gap } = told.conclusion(&meter, dependence.is_no_noise());
    let groups = told.groups(kind);
    // Without a gap there is nothing to explain.
    let whole = if told.alarmed && told.square > 0.0 {
        told.excess()
    } else {
        f64::INFINITY
    };
    let candidates = candidates(context, readings, first, whole, groups, told.causes);
    let places = if told.alarmed {
        places(context, first, told.excess())
    } else {
        Vec::new()
    };
    let mut verdict = told.verdict(kind, &dependence, options);
    let splits = match (told.found, kind) {
        (Some(answer), Kind::Effect) => splits(context, readings, answer),
        _ => Vec::new(),
    };
    verdict.separate = separating(&verdict.indistinguishable, &candidates, &splits);
    let hidden = hidden(context, &verdict.effects, options);
    verdict.statement = statement(&verdict, (&gap, &noise), &places, &candidates, &hidden);
    let (bias, profiles) = biases(context, readings, told.causes);
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
            notes(context, &clean, calm),
            no_noise(context.model, &dependence).into_iter().collect(),
            elsewhere(&candidates),
        ]
        .concat(),
        candidates,
        detail: Detail {
            before: meter.residuals(readings),
            after: meter.residuals(&clean),
            profiles,
            change: told.change.as_slice().to_vec(),
            apart: splits.iter().flatten().map(|split| split.now).collect(),
        },
    }
}

/// What is told of what was found: nothing without an alarm, nor of what cannot be fitted.
struct Told<'a> {
    examined: &'a Examined<'a>,
    alarmed: bool,
    /// Probability of as much as was noticed with nothing there.
    p_value: f64,
    found: Option<&'a Answer>,
    causes: &'a [Cause],
    /// What the causes change in the readings.
    change: DVector<f64>,
    /// What is missed without them, beyond the noise.
    square: f64,
}

impl<'a> Told<'a> {
    fn of(examined: &'a Examined<'a>, options: &Options) -> Self {
        let (context, readings) = (examined.context, examined.readings);
        let alarmed = examined.detected <= options.false_alarm;
        let found = examined.found.as_ref().filter(|_| alarmed);
        let fit = found.and_then(|answer| {
            let (amplitudes, _) = context.amplitudes(readings, &answer.causes)?;
            Some((answer.causes.as_slice(), amplitudes))
        });
        let (causes, change) = fit.map_or_else(
            || (&[][..], DVector::zeros(readings.len())),
            |(causes, amplitudes)| (causes, context.change(causes, &amplitudes)),
        );
        let freedom = context.space.degrees_of_freedom() as f64;
        Self {
            examined,
            alarmed,
            p_value: examined.detected,
            found,
            causes,
            change,
            square: examined.first.residual.norm_squared() - freedom,
        }
    }

    /// Counts as noticed what the law of the noise has taken for noise.
    fn heed(&mut self, dependence: &Dependence, options: &Options) {
        let p_value = dependence.p_value_of_no_noise();
        if !self.alarmed && p_value <= options.false_alarm {
            (self.alarmed, self.p_value) = (true, p_value);
        }
    }

    fn excess(&self) -> f64 {
        self.square.max(f64::MIN_POSITIVE)
    }

    /// What the data allow to say, and the gap. `no_noise`: what differs between repeats is something else.
    fn conclusion(&self, meter: &GapMeter, no_noise: bool) -> Conclusion {
        let (context, readings) = (self.examined.context, self.examined.readings);
        let unknowns: usize = self.causes.iter().map(Cause::unknowns).sum();
        let whole = self.examined.first.residual.norm_squared();
        let beside = context.remainder(readings, self.causes);
        let explained = whole - beside.residual.norm_squared();
        let before = meter.size(readings, 0);
        let signatures = raw_signatures(context, self.causes);
        let measured = Measured {
            unit: context.model.reading_unit(),
            noise: context.law.sigma(),
            readings_in_each: context.model.readings_in_each(),
            before,
            after: meter.size(&(readings - &self.change), unknowns),
            predicted_shrink: if before.rms > 0.0 {
                1.0 - (1.0 - explained / self.excess()).max(0.0).sqrt()
            } else {
                0.0
            },
            held_out: meter.held_out(context.model, readings, &signatures),
            no_noise,
        };
        Conclusion::of(self.alarmed, self.found, measured)
    }

    /// What could stand in the place of each cause that is named.
    fn groups(&self, kind: Kind) -> &'a [Vec<Alternative>] {
        match (self.found, kind) {
            (Some(answer), Kind::Effect) => &answer.groups,
            _ => &[],
        }
    }

    /// The verdict but for what separates the members of groups, and its sentence.
    fn verdict(&self, kind: Kind, dependence: &Dependence, options: &Options) -> Verdict {
        let Examined {
            context,
            readings,
            first,
            ..
        } = *self.examined;
        let names = |causes: &mut dyn Iterator<Item = &Cause>| -> Vec<String> {
            causes
                .map(|c| context.catalogue[c.effect].name().to_owned())
                .collect()
        };
        let own = |wanted: Kind| {
            let causes = if kind == wanted { self.causes } else { &[] };
            names(&mut causes.iter())
        };
        let groups = self.groups(kind).iter().filter(|group| group.len() > 1);
        Verdict {
            kind,
            effects: own(Kind::Effect),
            severity: match (self.found, kind) {
                (Some(answer), Kind::Effect) if options.severity > 0 => {
                    severities(context, readings, answer, dependence, options)
                }
                _ => Vec::new(),
            },
            indistinguishable: groups
                .map(|group| names(&mut group.iter().map(|a| &a.cause)))
                .collect(),
            partial: own(Kind::Unknown),
            separate: Vec::new(),
            shape: (kind == Kind::Unknown && self.square > 0.0)
                .then(|| fingerprint(context, readings, first, self.excess())),
            statement: String::new(),
            p_value: self.p_value,
            adequacy: context.global(self.found.map_or(first, |a| &a.remainder)),
        }
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
        notes.push(pulled_in(calm.count));
    }
    if let Some(tails) = calm.tails {
        notes.push(format!(
            "The noise has heavier tails than the normal law: single readings follow Student's law with about {} degrees of freedom. All probabilities are computed with that.",
            plain(tails.freedom, 2)
        ));
    }
    notes.extend(drifting(context.model, &context.law));
    notes.extend(disagreement(context, clean));
    if context.law.source == NoiseSource::Neighbours {
        notes.push(
            "The noise is not measured: there are no repeats. It is taken from differences of neighbouring readings, so anything rougher than the spacing counts as noise; measure at least three repeats."
                .to_owned(),
        );
    } else if context.law.source == NoiseSource::Residuals {
        notes.push(format!(
            "The noise is not measured: there are no repeats. It is told from all that the fit leaves, correlated along its traces over {} {}: an effect as smooth and as small as such noise would look the same. Measure at least three repeats to tell them apart.",
            plain(context.law.parts.length, 2),
            for_people(context.model.position_unit())
        ));
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
