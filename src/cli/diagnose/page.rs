//! The page of a diagnosis of any model.

use errsep_models::model::{AnyModel, FittedModel, Place};

use super::words::{by_shape, harm_in_words, moved, shown};
use crate::diagnosis::{
    Confidence, Diagnosis, Joined, JoinedEffect, Kind, ParameterOut, for_people,
};
use crate::report::diagnosis as sheet;

pub fn view(data: String, model: &AnyModel, along: &str, diagnosis: &Diagnosis) -> sheet::View {
    let size = |s: crate::diagnosis::Size| sheet::Size {
        rms: s.rms,
        ci95: s.ci95,
    };
    let gap = &diagnosis.gap;
    let profiles = model.profiles();
    sheet::View {
        data,
        finding: match diagnosis.verdict.kind {
            Kind::None => sheet::Finding::None,
            Kind::Effect => sheet::Finding::Effect,
            Kind::Unknown => sheet::Finding::Unknown,
        },
        statement: diagnosis.verdict.statement.clone(),
        taken_out: diagnosis.verdict.taken_out().to_vec(),
        gap: sheet::Gap {
            unit: for_people(gap.unit).to_owned(),
            noise: gap.noise,
            of_what: gap.of_what(),
            before: size(gap.before),
            after: size(gap.after),
            shrink: gap.shrink,
            held_out: gap.held_out.map(|h| (h.before, h.after)),
        },
        places: diagnosis.places.iter().map(place).collect(),
        candidates: diagnosis.candidates.iter().map(candidate).collect(),
        groups: groups(diagnosis),
        severities: diagnosis.verdict.severity.iter().map(severity).collect(),
        residuals: residuals(model, &diagnosis.detail.before, &diagnosis.detail.after),
        x: (along.to_owned(), model.position_unit().to_owned()),
        shifts: diagnosis.bias.iter().map(shift).collect(),
        profiles: diagnosis
            .detail
            .profiles
            .iter()
            .zip(profiles)
            .map(|((name, before, after), profile)| sheet::Profile {
                name: name.clone(),
                x: profile.positions,
                before: before.clone(),
                after: after.clone(),
            })
            .collect(),
        hidden: diagnosis.hidden.iter().map(hidden).collect(),
        notes: diagnosis.notes.clone(),
        trials: None,
    }
}

/// What the page shows of a fit that effects have joined; the statement is the caller's.
pub(super) fn of_fit(data: String, model: &AnyModel, along: &str, fit: &Joined) -> sheet::View {
    let size = |s: crate::diagnosis::Size| sheet::Size {
        rms: s.rms,
        ci95: s.ci95,
    };
    let gap = &fit.gap;
    sheet::View {
        data,
        finding: sheet::Finding::Effect,
        taken_out: fit.effects.iter().map(|e| e.effect.clone()).collect(),
        gap: sheet::Gap {
            unit: for_people(gap.unit).to_owned(),
            noise: gap.noise,
            of_what: gap.of_what(),
            before: size(gap.before),
            after: size(gap.after),
            shrink: gap.shrink,
            held_out: gap.held_out.map(|h| (h.before, h.after)),
        },
        candidates: fit.effects.iter().map(fitted).collect(),
        residuals: residuals(model, &fit.before, &fit.after),
        x: (along.to_owned(), model.position_unit().to_owned()),
        shifts: fit.quantities.iter().map(shift).collect(),
        profiles: fit
            .profiles
            .iter()
            .map(|profile| sheet::Profile {
                name: profile.name.clone(),
                x: profile.x.clone(),
                before: profile.before.clone(),
                after: profile.after.clone(),
            })
            .collect(),
        notes: fit.notes.clone(),
        ..sheet::View::default()
    }
}

/// An effect of a fit.
fn fitted(effect: &JoinedEffect) -> sheet::Candidate {
    let told = effect.parameters.iter().map(ParameterOut::told);
    sheet::Candidate {
        effect: effect.effect.clone(),
        variant: effect.variant.clone(),
        p_value: effect.p_value,
        visible: effect.visible,
        named: true,
        parameters: told.map(|t| (t.name, t.value, t.std, t.unit)).collect(),
        ..sheet::Candidate::default()
    }
}

fn residuals(model: &AnyModel, before: &[f64], after: &[f64]) -> Vec<sheet::Residual> {
    let channels = model.channel_names();
    let rows = RowNames::of(model.places());
    let pairs = before.iter().zip(after);
    model
        .places()
        .iter()
        .zip(pairs)
        .map(|(p, (before, after))| sheet::Residual {
            panel: channels.get(p.channel).cloned().unwrap_or_default(),
            row: model.trace_name(p).unwrap_or_else(|| rows.name(p)),
            x: p.x,
            time: p.time,
            before: *before,
            after: *after,
        })
        .collect()
}

/// Which of a trace's circumstances tell it from others.
struct RowNames {
    repeats: bool,
    directions: bool,
}

impl RowNames {
    fn of(places: &[Place]) -> Self {
        Self {
            repeats: places.windows(2).any(|w| w[0].repeat != w[1].repeat),
            directions: places
                .windows(2)
                .any(|w| (w[0].direction > 0.0) != (w[1].direction > 0.0)),
        }
    }

    fn name(&self, place: &Place) -> String {
        let direction = if place.direction > 0.0 {
            "forward"
        } else {
            "backward"
        };
        match (self.repeats, self.directions) {
            (true, true) => format!("{} {direction}", place.repeat),
            (true, false) => place.repeat.to_string(),
            (false, true) => direction.to_owned(),
            (false, false) => String::new(),
        }
    }
}

fn place(place: &crate::diagnosis::Where) -> sheet::Place {
    let range = place
        .range()
        .map_or(String::new(), |range| format!(", {range}"));
    sheet::Place {
        axis: place.axis.to_owned(),
        value: format!("{}{range}", place.value),
        share: place.share,
        p_value: place.p_value,
    }
}

fn candidate(candidate: &crate::diagnosis::Candidate) -> sheet::Candidate {
    sheet::Candidate {
        effect: candidate.effect.clone(),
        variant: candidate.variant.as_ref().map(|own| {
            let others = candidate.elsewhere.iter().filter(|o| o.variant != *own);
            others.fold(own.clone(), |text, other| {
                format!("{text}; as likely {}", other.variant)
            })
        }),
        explained: candidate.explained,
        p_value: candidate.p_value,
        evidence: candidate.evidence,
        visible: candidate.visible,
        named: candidate.in_set,
        parameters: candidate
            .parameters
            .iter()
            .map(|p| {
                let told = p.told();
                // Of several variants that fit as well the figure is that of one.
                let name = match &candidate.variant {
                    Some(own) if !candidate.elsewhere.is_empty() => format!("{}, {own}", told.name),
                    _ => told.name,
                };
                (name, told.value, told.std, told.unit)
            })
            .collect(),
        physics: candidate.physics.clone(),
        confirm: candidate.confirm.clone(),
    }
}

fn severity(severity: &crate::diagnosis::Severity) -> sheet::Severity {
    let rivals = severity.rivals.iter();
    sheet::Severity {
        effect: severity.effect.clone(),
        line: severity.in_words(),
        weak: severity.confidence == Confidence::Weak,
        rivals: rivals.map(|r| (r.in_words(), r.probability)).collect(),
    }
}

fn groups(diagnosis: &Diagnosis) -> Vec<sheet::Group> {
    diagnosis
        .verdict
        .indistinguishable
        .iter()
        .zip(&diagnosis.verdict.separate)
        .map(|(names, separate)| sheet::Group {
            effects: names.clone(),
            separate: separate.clone(),
        })
        .collect()
}

fn shift(bias: &crate::diagnosis::Bias) -> sheet::Shift {
    let value = |value: f64, std: f64| {
        let told = |v| shown(v, &bias.unit).0;
        (told(value), told(std))
    };
    let moved = moved(bias);
    sheet::Shift {
        quantity: bias.quantity.clone(),
        before: value(bias.before, bias.std),
        after: value(bias.after, bias.after_std),
        moved: (moved.value, moved.std),
        unit: moved.unit,
    }
}

fn hidden(hidden: &crate::diagnosis::Hidden) -> sheet::Hidden {
    sheet::Hidden {
        effect: hidden.effect.clone(),
        visible: hidden.visible,
        detectable: hidden.detectable.map(|d| {
            let (value, unit) = shown(d, &hidden.unit);
            (value, unit.to_owned())
        }),
        by_shape: by_shape(hidden),
        at_least: hidden.at_least,
        harm: hidden
            .harm
            .as_ref()
            .map_or(String::new(), |harm| harm_in_words(harm, hidden)),
    }
}
