//! Curves with a band: what an effect changes along a position, the time or the reading itself.

use errsep_models::model::{FittedModel, Place};
use serde::Deserialize;

use crate::detection::fitted::without_misfit;

/// What a curve is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Along {
    /// The position along the trace.
    Position,
    /// The time since the first reading.
    Time,
    /// The reading.
    Reading,
}

impl Along {
    /// As it stands in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Time => "time",
            Self::Reading => "reading",
        }
    }

    /// Its unit in a model.
    pub fn unit<M: FittedModel>(self, model: &M) -> &'static str {
        match self {
            Self::Position => model.position_unit(),
            Self::Time => model.time_unit(),
            Self::Reading => model.reading_unit(),
        }
    }

    /// Its value for every reading. A reading counts as the model has it: in the reading itself stands
    /// its own noise, which a straight line of it would explain whole.
    pub fn values<M: FittedModel>(self, model: &M) -> Vec<f64> {
        let places = model.places();
        match self {
            Self::Position => places.iter().map(|p| p.x).collect(),
            Self::Time => places.iter().map(|p| p.time).collect(),
            Self::Reading => without_misfit(model).as_slice().to_vec(),
        }
    }
}

/// A direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// As positions grow.
    Forward,
    /// As they shrink.
    Backward,
}

impl Way {
    /// The direction of a reading.
    #[must_use]
    pub fn of(place: &Place) -> Self {
        if place.direction < 0.0 {
            Self::Backward
        } else {
            Self::Forward
        }
    }

    /// As it stands in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }
}

/// A curve, straight between its points; beyond its ends it keeps the value of the end.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// The channel that it belongs to; absent: every channel.
    #[serde(default)]
    pub channel: Option<String>,
    /// The direction of travel that it belongs to; absent: both.
    #[serde(default)]
    pub direction: Option<Way>,
    /// What it is a function of, the change of the reading, its standard uncertainty.
    pub points: Vec<[f64; 3]>,
    /// Independent changes of one standard deviation each, at the points: together they are the band.
    #[serde(default)]
    pub open: Vec<Vec<f64>>,
}

/// Where a value stands among the points: the point before, and the part of the way to the next.
type Between = (usize, f64);

impl Curve {
    /// Whether it speaks of a reading.
    fn is_of(&self, channel: Option<&String>, way: Way) -> bool {
        let own = self.channel.as_ref().is_none_or(|c| Some(c) == channel);
        own && self.direction.is_none_or(|d| d == way)
    }

    /// Whether a value lies within the points.
    pub fn holds(&self, value: f64) -> bool {
        let ends = self.points.first().zip(self.points.last());
        ends.is_some_and(|(a, b)| value >= a[0] && value <= b[0])
    }

    fn between(&self, value: f64) -> Between {
        let last = self.points.len().saturating_sub(2);
        let right = self.points.partition_point(|p| p[0] <= value);
        let left = right.saturating_sub(1).min(last);
        let (a, b) = (self.points[left][0], self.points[left + 1][0]);
        (left, ((value - a) / (b - a)).clamp(0.0, 1.0))
    }

    /// The change at a value.
    pub fn at(&self, value: f64) -> f64 {
        let (k, part) = self.between(value);
        (1.0 - part) * self.points[k][1] + part * self.points[k + 1][1]
    }

    /// One of the independent changes at a value.
    pub fn open_at(&self, which: usize, value: f64) -> f64 {
        let Some(change) = self.open.get(which) else {
            return 0.0;
        };
        let (k, part) = self.between(value);
        (1.0 - part) * change[k] + part * change[k + 1]
    }

    /// What is wrong with it, if anything.
    pub fn fault(&self, channels: &[String]) -> Option<&'static str> {
        let numbers = self.points.iter().flatten();
        let finite = numbers
            .chain(self.open.iter().flatten())
            .all(|v| v.is_finite());
        let grows = self.points.windows(2).all(|w| w[1][0] > w[0][0]);
        let known = self.channel.as_ref().is_none_or(|c| channels.contains(c));
        if !known {
            Some("has a curve of a channel that has no readings")
        } else if self.points.len() < 2 || !grows {
            Some("needs two or more growing points in every curve")
        } else if !finite {
            Some("has a number that is not finite")
        } else if self.points.iter().any(|p| p[2] < 0.0) {
            Some("has a standard uncertainty below zero")
        } else if self.open.iter().any(|o| o.len() != self.points.len()) {
            Some("needs one value a point in every change that is open")
        } else {
            None
        }
    }
}

/// The curve of each reading's channel and direction, by their place among the curves.
pub(super) fn curves_of(curves: &[Curve], channels: &[String]) -> Vec<[Option<usize>; 2]> {
    let of = |channel: &String, way: Way| curves.iter().position(|c| c.is_of(Some(channel), way));
    let both = |channel: &String| [of(channel, Way::Forward), of(channel, Way::Backward)];
    channels.iter().map(both).collect()
}
