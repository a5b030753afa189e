//! Effects of the user's own: a signature in a table or a formula.

use std::collections::BTreeMap;

use errsep_models::model::{About, Column, Effect, FittedModel, Parameter, Place, Shape};
use serde::Deserialize;
use toml::Spanned;

use crate::diagnosis::catalogue::formula::{Circumstances, Formula};

/// An effect given by its change of the readings, times a weight for each channel: over the
/// positions, straight between them and zero outside, or by a formula.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tabulated {
    /// Name in the verdict.
    pub name: String,
    /// Pairs of position and change of the reading.
    #[serde(default)]
    pub signature: Vec<[f64; 2]>,
    /// The change of the reading in x, time, direction, repeat and channel.
    #[serde(default)]
    pub formula: Option<Formula>,
    /// Weight of each channel by its name; absent: 1 for all.
    #[serde(default)]
    pub channels: BTreeMap<String, f64>,
    /// Whether the sign turns with the direction of travel.
    #[serde(default)]
    pub turns_with_direction: bool,
    /// The only repeats in which it is there; absent: all.
    #[serde(default)]
    pub repeats: Vec<u32>,
}

/// The effects of a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TabulatedEffects {
    /// One table each.
    pub effect: Vec<Spanned<Tabulated>>,
}

fn circumstances(place: &Place) -> Circumstances {
    Circumstances {
        x: place.x,
        time: place.time,
        direction: place.direction,
        repeat: f64::from(place.repeat),
        channel: place.channel as f64 + 1.0,
    }
}

impl Tabulated {
    /// The weight of each channel.
    fn weights(&self, channels: &[String]) -> Vec<f64> {
        let missing = if self.channels.is_empty() { 1.0 } else { 0.0 };
        channels
            .iter()
            .map(|name| self.channels.get(name).copied().unwrap_or(missing))
            .collect()
    }

    /// The change of one reading, with the weights of the channels.
    fn change(&self, place: &Place, weights: &[f64]) -> f64 {
        let here = self.repeats.is_empty() || self.repeats.contains(&place.repeat);
        let sign = if self.turns_with_direction {
            place.direction
        } else {
            1.0
        };
        let weight = weights.get(place.channel).copied().unwrap_or(0.0);
        f64::from(u8::from(here)) * sign * weight * self.at(place)
    }

    fn at(&self, place: &Place) -> f64 {
        if let Some(formula) = &self.formula {
            return formula.at(&circumstances(place));
        }
        let x = place.x;
        let right = self.signature.partition_point(|p| p[0] < x);
        match (
            right.checked_sub(1).and_then(|k| self.signature.get(k)),
            self.signature.get(right),
        ) {
            (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]),
            (None, Some(b)) if b[0] == x => b[1],
            _ => 0.0,
        }
    }

    /// What is wrong with the effect for some readings, if anything.
    pub fn fault(&self, channels: &[String], places: &[Place]) -> Option<String> {
        if self.name.trim().is_empty() {
            return Some("an effect has no name".to_owned());
        }
        if self.formula.is_some() != self.signature.is_empty() {
            return Some(format!(
                "`{}` needs either a signature or a formula",
                self.name
            ));
        }
        let undefined = |f: &Formula| places.iter().find(|p| !f.at(&circumstances(p)).is_finite());
        if let Some(place) = self.formula.as_ref().and_then(undefined) {
            return Some(format!(
                "the formula of `{}` gives no finite number at position {}, time {}",
                self.name, place.x, place.time
            ));
        }
        if self.formula.is_none() && self.signature.len() < 2
            || self.signature.windows(2).any(|w| w[1][0] <= w[0][0])
        {
            return Some(format!(
                "`{}` needs two or more growing positions",
                self.name
            ));
        }
        if self.signature.iter().flatten().any(|v| !v.is_finite()) {
            return Some(format!("`{}` has a number that is not finite", self.name));
        }
        let known = |repeat: &u32| places.iter().any(|p| p.repeat == *repeat);
        if let Some(unknown) = self.repeats.iter().find(|r| !known(r)) {
            return Some(format!(
                "`{}` names the repeat {unknown}, which has no readings",
                self.name
            ));
        }
        if let Some(unknown) = self.channels.keys().find(|c| !channels.contains(c)) {
            return Some(format!(
                "`{}` names the channel `{unknown}`, which has no readings",
                self.name
            ));
        }
        if let Some((channel, weight)) = self.channels.iter().find(|(_, w)| !w.is_finite()) {
            return Some(format!(
                "`{}` gives the channel `{channel}` the weight {weight}, which is no finite number",
                self.name
            ));
        }
        let weights = self.weights(channels);
        let endless = |place: &&Place| !self.change(place, &weights).is_finite();
        if let Some(place) = places.iter().find(endless) {
            return Some(format!(
                "`{}` changes the reading at {} by no finite number",
                self.name, place.x
            ));
        }
        places
            .iter()
            .all(|place| self.change(place, &weights) == 0.0)
            .then(|| format!("`{}` changes no reading", self.name))
    }
}

impl<M: FittedModel> Effect<M> for Tabulated {
    fn name(&self) -> &str {
        &self.name
    }

    fn about(&self) -> About {
        About {
            physics: "an effect of the user's own",
            confirm: "repeat the measurement without its cause",
            source: "a table of its signature, or a formula",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("size", "1", f64::MIN, f64::MAX)]
    }

    fn columns(&self, model: &M, _shape: &Shape) -> Vec<Column> {
        let weights = self.weights(&model.channel_names());
        vec![Column::from_places(model.places(), |_, place| {
            self.change(place, &weights)
        })]
    }
}
