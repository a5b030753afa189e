//! Effects of the user's own: a signature in a table, a formula, or curves with a band.

use std::collections::BTreeMap;

use errsep_models::model::{About, Column, Effect, FittedModel, Parameter, Place, Shape};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::catalogue::curve::{Along, Curve, Way, curves_of};
use crate::catalogue::formula::{Circumstances, Formula};

/// An effect given by its change of the readings, times a weight for each channel: over the
/// positions, straight between them and zero outside; by a formula; or by curves with a band.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
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
    /// What its curves are functions of; absent: the position.
    #[serde(default)]
    pub along: Option<Along>,
    /// Its curves; a reading that none of them speaks of is not changed.
    #[serde(default)]
    pub curve: Vec<Curve>,
    /// Where it was seen.
    #[serde(default)]
    pub seen: Option<Seen>,
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

/// The curve of a reading, and where on it the reading is.
type On<'c> = Option<(&'c Curve, f64)>;

/// Where an effect was learnt.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    /// The model.
    pub model: String,
    /// The file of its readings.
    pub file: String,
    /// SHA-256 of that file, in hexadecimal digits.
    pub sha256: String,
    /// The channels that were read.
    pub channels: Vec<String>,
    /// The repeats.
    pub repeats: Vec<u32>,
    /// The day on which it was learnt, year-month-day.
    pub date: String,
}

/// A reading as the model has it, where it is asked for.
fn reading_at(readings: &Option<Vec<f64>>, k: usize) -> f64 {
    readings
        .as_ref()
        .and_then(|r| r.get(k))
        .copied()
        .unwrap_or(0.0)
}

/// The effects of a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TabulatedEffects {
    /// One table each.
    pub effect: Vec<Spanned<Tabulated>>,
}

fn circumstances(place: &Place, reading: f64) -> Circumstances {
    Circumstances {
        x: place.x,
        time: place.time,
        direction: place.direction,
        repeat: f64::from(place.repeat),
        channel: place.channel as f64 + 1.0,
        reading,
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

    /// The changes of readings.
    fn changes<M: FittedModel>(&self, model: &M) -> Vec<f64> {
        let channels = model.channel_names();
        let weights = self.weights(&channels);
        let of = |(place, change): (&Place, f64)| self.weight(&weights, place) * change;
        if self.curve.is_empty() {
            let readings = self.readings(model);
            let places = model.places().iter().enumerate();
            let pairs = places.map(|(k, place)| (place, self.at(place, reading_at(&readings, k))));
            return pairs.map(of).collect();
        }
        let pairs = model.places().iter().zip(self.on_curves(model));
        let at = |(place, on): (_, On<'_>)| of((place, on.map_or(0.0, |(c, value)| c.at(value))));
        pairs.map(at).collect()
    }

    /// Every reading as the model has it, where its formula asks for them.
    fn readings<M: FittedModel>(&self, model: &M) -> Option<Vec<f64>> {
        let asks = self.formula.as_ref().is_some_and(Formula::has_reading);
        asks.then(|| Along::Reading.values(model))
    }

    /// The curve of each reading, and where on it the reading is.
    fn on_curves<M: FittedModel>(&self, model: &M) -> Vec<On<'_>> {
        let curves = curves_of(&self.curve, &model.channel_names());
        let values = self.along.unwrap_or(Along::Position).values(model);
        let places = model.places().iter().zip(values);
        places
            .map(|(place, value)| Some((self.curve_of(&curves, place)?, value)))
            .collect()
    }

    /// Sign and weight of the change of a reading.
    fn weight(&self, weights: &[f64], place: &Place) -> f64 {
        let here = self.repeats.is_empty() || self.repeats.contains(&place.repeat);
        let sign = if self.turns_with_direction {
            place.direction
        } else {
            1.0
        };
        let weight = weights.get(place.channel).copied().unwrap_or(0.0);
        f64::from(u8::from(here)) * sign * weight
    }

    fn curve_of(&self, curves: &[[Option<usize>; 2]], place: &Place) -> Option<&Curve> {
        let both = curves.get(place.channel)?;
        self.curve
            .get(both[usize::from(Way::of(place) == Way::Backward)]?)
    }

    /// Part of the readings at which its curves were not seen; of a formula none is told.
    pub fn outside<M: FittedModel>(&self, model: &M) -> f64 {
        if self.curve.is_empty() {
            return 0.0;
        }
        let all = self.on_curves(model);
        let unseen = all
            .iter()
            .filter(|on| !on.is_some_and(|(curve, value)| curve.holds(value)));
        unseen.count() as f64 / all.len().max(1) as f64
    }

    fn at(&self, place: &Place, reading: f64) -> f64 {
        if let Some(formula) = &self.formula {
            return formula.at(&circumstances(place, reading));
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

    /// What is wrong with its name and with what it is given by, whatever the readings.
    fn fault_of_form(&self, channels: &[String]) -> Option<String> {
        if self.name.trim().is_empty() {
            return Some("an effect has no name".to_owned());
        }
        let given = [
            self.formula.is_some(),
            !self.signature.is_empty(),
            !self.curve.is_empty(),
        ];
        if given.iter().filter(|given| **given).count() != 1 {
            return Some(format!(
                "`{}` needs either a signature or a formula, or curves",
                self.name
            ));
        }
        if let Some(what) = self.curve.iter().find_map(|c| c.fault(channels)) {
            return Some(format!("`{}` {what}", self.name));
        }
        if self.along.is_some() && self.curve.is_empty() {
            return Some(format!("`{}` says along what, but has no curve", self.name));
        }
        None
    }

    /// What is wrong with the effect for some readings, if anything.
    pub fn fault<M: FittedModel>(&self, model: &M) -> Option<String> {
        let (channels, places) = (model.channel_names(), model.places());
        if let Some(what) = self.fault_of_form(&channels) {
            return Some(what);
        }
        let readings = self.readings(model);
        let value =
            |f: &Formula, k: usize| f.at(&circumstances(&places[k], reading_at(&readings, k)));
        let undefined = |f: &Formula| {
            let mut all = (0..places.len()).filter(|k| !value(f, *k).is_finite());
            all.next().map(|k| &places[k])
        };
        if let Some(place) = self.formula.as_ref().and_then(undefined) {
            return Some(format!(
                "the formula of `{}` gives no finite number at position {}, time {}",
                self.name, place.x, place.time
            ));
        }
        if !self.signature.is_empty() && self.signature.len() < 2
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
        let changes = self.changes(model);
        let endless = |(_, change): &(&Place, &f64)| !change.is_finite();
        if let Some((place, _)) = places.iter().zip(&changes).find(endless) {
            return Some(format!(
                "`{}` changes the reading at {} by no finite number",
                self.name, place.x
            ));
        }
        changes
            .iter()
            .all(|change| *change == 0.0)
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
            source: "a table of its signature, a formula, or curves that were learnt",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("size", "1", f64::MIN, f64::MAX)]
    }

    fn columns(&self, model: &M, _shape: &Shape) -> Vec<Column> {
        let changes = self.changes(model);
        vec![Column::from_places(model.places(), |k, _| changes[k])]
    }

    fn open(&self, model: &M, _shape: &Shape) -> Vec<Column> {
        let count = self.curve.iter().map(|c| c.open.len()).max().unwrap_or(0);
        if count == 0 {
            return Vec::new();
        }
        let weights = self.weights(&model.channel_names());
        let all = self.on_curves(model);
        let column = |which: usize| {
            Column::from_places(model.places(), |k, place| {
                let change = all[k].map_or(0.0, |(curve, value)| curve.open_at(which, value));
                self.weight(&weights, place) * change
            })
        };
        (0..count).map(column).collect()
    }
}
