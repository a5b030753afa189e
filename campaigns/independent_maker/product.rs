//! What is asked of the product, and what it says: all of the product that the campaign touches.

use std::collections::HashMap;
use std::time::Instant;

use errsep::diagnosis::{NoiseLaw, Options, certificate, diagnose};
use errsep_models::model::FittedModel;
use errsep_models::noise::Law;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::{Channel, Observations};
use serde_json::Value;

use crate::case::{Case, Truth};
use crate::design::Schedule;
use crate::rig::Moment;

/// What a diagnosis says, from its JSON.
#[derive(Debug, Clone)]
pub struct Said {
    /// `none`, `effect` or `unknown`.
    pub kind: String,
    /// The effects named.
    pub effects: Vec<String>,
    /// Whether the name of each of these effects is strong; empty where severity was not asked for.
    pub strong: Vec<bool>,
    /// Groups that cannot be told apart.
    pub groups: Vec<Vec<String>>,
    /// Probability of as much with nothing there.
    pub p_value: f64,
    /// The gap before, µm.
    pub gap: f64,
    /// Sizes: effect, value, standard uncertainty, unit.
    pub sizes: Vec<(String, f64, f64, String)>,
    /// What the effects named change in the readings, in the order of the traces; empty where none is named.
    pub change: Vec<Vec<f64>>,
    /// Whether what differs from repeat to repeat is said not to be independent noise.
    pub dependent: bool,
    /// How long it took, s.
    pub seconds: f64,
}

impl Said {
    /// The group of an effect, or the effect alone.
    pub fn group_of(&self, effect: &str) -> Vec<String> {
        let mine = |group: &&Vec<String>| group.iter().any(|name| name == effect);
        self.groups
            .iter()
            .filter(|group| group.len() > 1)
            .find(mine)
            .cloned()
            .unwrap_or_else(|| vec![effect.to_owned()])
    }

    /// All that stands for a cause: one group an effect named.
    pub fn causes(&self) -> Vec<Vec<String>> {
        if self.kind != "effect" {
            return Vec::new();
        }
        self.effects
            .iter()
            .map(|effect| self.group_of(effect))
            .collect()
    }

    /// In one line.
    pub fn in_words(&self) -> String {
        if self.kind != "effect" {
            return self.kind.clone();
        }
        let causes: Vec<String> = self
            .causes()
            .iter()
            .enumerate()
            .map(|(k, group)| match self.strong.get(k) {
                Some(true) => format!("{} (strong)", group.join("|")),
                _ => group.join("|"),
            })
            .collect();
        causes.join(" + ")
    }

    /// Whether a name is strong, of an effect or group for which `which` holds.
    pub fn is_strong(&self, which: impl Fn(&[String]) -> bool) -> bool {
        let causes = self.causes();
        let mut named = causes.iter().zip(&self.strong);
        named.any(|(group, strong)| *strong && which(group))
    }
}

/// The model that is diagnosed.
fn model(readings: &Observations, thickness: Option<f64>) -> Result<Linearised, String> {
    let assumptions = Assumptions {
        thickness,
        ..Assumptions::default()
    };
    Linearised::new(readings, assumptions).map_err(|e| e.to_string())
}

/// Diagnoses the readings of a case with a catalogue from which some effects are left out, with so many rivals of each
/// family for the severity of names.
pub fn ask(case: &Case, without: &[&str], (severity, seed): (usize, u64)) -> Result<Said, String> {
    let start = Instant::now();
    let model = model(&case.observations, case.thickness)?;
    let without = without.iter().map(|name| (*name).to_owned()).collect();
    let options = Options {
        seed,
        without,
        severity,
        ..Options::default()
    };
    let diagnosis = diagnose(&model, &options);
    let json = serde_json::to_value(&diagnosis).map_err(|e| e.to_string())?;
    let mut said = heard(&json, start.elapsed().as_secs_f64())
        .ok_or_else(|| "an answer without a verdict".to_owned())?;
    if said.kind == "effect" {
        said.change = at_moments(&case.schedule, &model, &diagnosis.detail.change);
    }
    Ok(said)
}

/// Positions with values.
type Profile = Vec<(f64, f64)>;

/// What is said of the model's readings, at those of the case: for each that of the same channel, repeat and direction
/// at the nearest position.
fn at_moments(schedule: &Schedule, model: &Linearised, said: &[f64]) -> Vec<Vec<f64>> {
    let names = model.channel_names();
    let mut traces: HashMap<(&str, u32, bool), Profile> = HashMap::new();
    for (place, value) in model.places().iter().zip(said) {
        let key = (
            names[place.channel].as_str(),
            place.repeat,
            place.direction > 0.0,
        );
        traces.entry(key).or_default().push((place.x, *value));
    }
    let of = |moment: Moment| {
        let channel = Channel::ALL[moment.channel()].name();
        let key = (channel, moment.repeat, moment.direction > 0.0);
        let trace = traces.get(&key).into_iter().flatten();
        let far = |x: f64| (x - moment.x).abs();
        let nearest = trace.min_by(|a, b| far(a.0).total_cmp(&far(b.0)));
        nearest.map_or(0.0, |(_, value)| *value)
    };
    let traces = schedule.traces.iter();
    traces
        .map(|trace| trace.moments().map(of).collect())
        .collect()
}

fn heard(json: &Value, seconds: f64) -> Option<Said> {
    let names = |list: &Value| -> Vec<String> {
        let all = list.as_array().into_iter().flatten();
        all.filter_map(|name| name.as_str().map(str::to_owned))
            .collect()
    };
    let verdict = json.get("verdict")?;
    let mut sizes = Vec::new();
    for candidate in json.get("candidates")?.as_array()? {
        let effect = candidate.get("effect")?.as_str()?;
        for parameter in candidate.get("parameters")?.as_array()? {
            let number = |key: &str| parameter.get(key).and_then(Value::as_f64);
            let unit = parameter.get("unit").and_then(Value::as_str).unwrap_or("");
            if let (Some(value), Some(std)) = (number("value"), number("std")) {
                sizes.push((effect.to_owned(), value, std, unit.to_owned()));
            }
        }
    }
    let severity = verdict.get("severity").and_then(Value::as_array);
    let strong = severity.into_iter().flatten().map(|name| {
        let confidence = name.get("confidence").and_then(Value::as_str);
        confidence == Some("strong")
    });
    Some(Said {
        strong: strong.collect(),
        kind: verdict.get("kind")?.as_str()?.to_owned(),
        effects: names(verdict.get("effects")?),
        groups: verdict
            .get("indistinguishable")?
            .as_array()?
            .iter()
            .map(names)
            .collect(),
        p_value: verdict.get("p_value")?.as_f64()?,
        gap: json.get("gap")?.get("before")?.get("rms")?.as_f64()?,
        sizes,
        change: Vec::new(),
        dependent: ["between_channels", "period"].iter().any(|key| {
            json.get("noise")
                .is_some_and(|noise| noise.get(key).is_some())
        }),
        seconds,
    })
}

/// Names of the effects that the product has for such readings.
pub fn catalogue(readings: &Observations) -> Result<Vec<String>, String> {
    let effects = model(readings, None)?.effects();
    Ok(effects
        .iter()
        .map(|effect| effect.name().to_owned())
        .collect())
}

/// Standard deviations between each effect of a case, which are so many standard deviations from nothing, and the
/// effect most like it, after the product's own certificate for the law of the case's noise; none where the
/// certificate gives none.
pub fn apart(case: &Case, seen: &[f64]) -> Vec<Option<f64>> {
    let Ok(model) = model(&case.undisturbed, case.thickness) else {
        return vec![None; seen.len()];
    };
    let noise = &case.noise;
    let variance = noise.sigma * noise.sigma;
    let law = NoiseLaw::stated(Law {
        white: variance * (1.0 - noise.correlated) + noise.resolution * noise.resolution / 12.0,
        correlated: variance * noise.correlated,
        length: noise.length,
        shift: 0.0,
        drift: 0.0,
    });
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    let rows = certificate(&model, model.effects(), &law, &options);
    let of = |(truth, seen): (&Truth, &f64)| {
        let row = rows.iter().find(|row| row.effect == truth.name)?;
        // The certificate's visible root mean square, in units of the noise, belongs to the detectable amplitude.
        let length = row.visible_rms? / law.sigma() * (model.places().len() as f64).sqrt();
        Some(4.65 * seen / (length * row.identifiable? / row.detectable?))
    };
    case.truths.iter().zip(seen).map(of).collect()
}
