//! The report of a reversal.

use std::path::Path;

use errsep_models::reversal::NOT_SHOWN;
use errsep_models::uncertainty::coverage_factor;

use super::effects;
use super::outcome::Outcome;
use super::text::summary;
use crate::cli::quantity::COVERAGE;
use crate::io::reversal::{ReversalData, ReversalSetup};
use crate::report::reversal::{
    Angle, Closure, Contrast, Convergence, Effect, Form, Residual, Straightness, View,
    page as lay_out,
};
use crate::report::{Page, Standing};

pub fn page(file: &Path, data: &ReversalData, setup: &ReversalSetup, o: &Outcome) -> Page {
    lay_out(&View {
        data: file.display().to_string(),
        method: o.method.to_owned(),
        summary: summary(o),
        standing: Some(if o.warnings.is_empty() && o.open().is_none() {
            Standing::Good
        } else {
            Standing::Caution
        }),
        tilts: o
            .tilts
            .iter()
            .map(|t| Angle {
                name: t.name.clone(),
                value: t.angle.value,
                std: Some(t.angle.std),
                meaning: o.meaning(t),
            })
            .collect(),
        effects: o
            .effects
            .iter()
            .flat_map(|e| e.parameters.iter().map(move |p| (e, p)))
            .map(|(e, p)| Effect {
                effect: effects::title(e),
                parameter: p.name.clone(),
                value: effects::in_words(p),
            })
            .collect(),
        contrasts: o
            .contrasts
            .iter()
            .flatten()
            .map(|(c, v)| Contrast {
                signs: c.pattern().to_owned(),
                name: c.name(o.convention).to_owned(),
                value: v.value,
                std: Some(v.std),
                meaning: c.meaning(o.convention).to_owned(),
            })
            .collect(),
        forms: o
            .forms
            .iter()
            .map(|f| Form {
                name: f.name.clone(),
                x: o.x.clone(),
                value: f.values.clone(),
                std: f.std.clone(),
            })
            .collect(),
        straightness: o
            .straightness()
            .into_iter()
            .map(
                |(name, [(_, least_squares), (_, end_point), (_, minimum_zone)])| Straightness {
                    form: name.to_owned(),
                    least_squares,
                    end_point,
                    minimum_zone,
                },
            )
            .collect(),
        residuals: o
            .residuals
            .iter()
            .map(|r| Residual {
                channel: r.channel.name(),
                repeat: r.repeat as usize,
                backward: r.backward,
                x: r.x,
                residual: r.residual,
            })
            .collect(),
        coverage_factor: coverage_factor(COVERAGE, o.form_freedom).unwrap_or_default(),
        noise_um: Some(o.noise),
        noise_source: o.noise_words.clone(),
        channel_noise: o
            .channel_noise
            .iter()
            .map(|(c, s)| (c.name().to_owned(), *s))
            .collect(),
        degrees_of_freedom: Some(o.degrees_of_freedom.round() as usize),
        closure: o.closure.as_ref().map(|c| Closure {
            x: c.x.clone(),
            value: c.profile.clone(),
            rms: c.rms,
            expected_rms: Some(c.expected_rms),
        }),
        convergence: Some(Convergence {
            converged: true,
            reason: o.convergence.reason.clone(),
            costs: o.convergence.costs.clone(),
        }),
        knots: o.knots.clone(),
        method_errors: o.method_errors.clone(),
        setup: format!("{}\n# data: {}\n", setup.as_toml(), data.in_words()),
        hidden: NOT_SHOWN
            .iter()
            .map(|(name, why)| format!("{name}: {why}"))
            .collect(),
        open: o
            .open()
            .map(|open| format!("{}: {}.", open.combination, open.remedy)),
        warnings: o.warnings.clone(),
    })
}
