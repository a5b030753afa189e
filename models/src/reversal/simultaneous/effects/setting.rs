//! What effects know of the readings beside their values.

use std::collections::BTreeMap;

use crate::reversal::{Channel, Convention, Direction, Observations, Reading};

/// Where and when a reading was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances {
    /// Which channel.
    pub channel: Channel,
    /// Commanded position, mm.
    pub x: f64,
    /// Seconds since the first reading.
    pub time: f64,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// Number of the repeat.
    pub repeat: u32,
}

impl Circumstances {
    /// Those of a reading.
    pub fn of(reading: &Reading, time: f64) -> Self {
        Self {
            channel: reading.channel,
            x: reading.x,
            time,
            direction: match reading.direction {
                Direction::Forward => 1.0,
                Direction::Backward => -1.0,
            },
            repeat: reading.repeat,
        }
    }
}

/// One of the two indicators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Indicator {
    /// It reads 1A and 2B.
    Near,
    /// It reads 1B and 2A.
    Far,
}

impl Indicator {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Near, Self::Far];

    /// The indicator of a channel.
    pub fn of(channel: Channel) -> Self {
        if channel.indicator_sign() > 0.0 {
            Self::Near
        } else {
            Self::Far
        }
    }

    /// `near` or `far`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::Far => "far",
        }
    }
}

/// What the readings of a measurement have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Which contrast is held at zero.
    pub convention: Convention,
    /// Whether the thickness is an unknown of the fit already.
    pub thickness_fitted: bool,
    /// The channels with readings.
    pub channels: Vec<Channel>,
    /// The repeats, in growing order.
    pub repeats: Vec<u32>,
    /// Whether readings were taken in both directions.
    pub both_directions: bool,
    /// First and last position, mm.
    pub travel: (f64, f64),
    /// Most different positions of any channel.
    pub positions: usize,
    /// Mean reading of every channel, µm, in the order of [`Channel::ALL`].
    pub middle: [f64; 4],
    /// Greatest less least reading of the channel with the narrowest, and of that with the widest span, µm.
    pub spans: (f64, f64),
    /// Least and greatest reading, µm.
    pub range: (f64, f64),
    /// Greatest reading off the indicators' zero, µm.
    pub reach: f64,
    /// Time from the first to the last reading, s.
    pub duration: f64,
    /// Whether every reading has a time.
    pub timed: bool,
}

impl Setting {
    /// What these readings, taken at these times, have in common.
    pub fn of(
        observations: &Observations,
        times: &[f64],
        convention: Convention,
        thickness_fitted: bool,
    ) -> Self {
        let readings = &observations.readings;
        let (mut sums, mut counts) = ([0.0; 4], [0.0; 4]);
        let mut travel = (f64::INFINITY, f64::NEG_INFINITY);
        for r in readings {
            sums[r.channel.index()] += r.value;
            counts[r.channel.index()] += 1.0;
            travel = (travel.0.min(r.x), travel.1.max(r.x));
        }
        let middle = [0, 1, 2, 3].map(|c| sums[c] / f64::max(counts[c], 1.0));
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let mut own = [none; 4];
        for r in readings {
            let own = &mut own[r.channel.index()];
            *own = (own.0.min(r.value), own.1.max(r.value));
        }
        let read = || own.iter().filter(|o| o.0 <= o.1);
        let range = read().fold(none, |r, o| (r.0.min(o.0), r.1.max(o.1)));
        let spans = read().map(|o| o.1 - o.0);
        let spans = spans.fold(none, |s, own| (s.0.min(own), s.1.max(own)));
        let reach = range.0.abs().max(range.1.abs()).max(f64::MIN_POSITIVE);
        let mut repeats: Vec<u32> = readings.iter().map(|r| r.repeat).collect();
        repeats.sort_unstable();
        repeats.dedup();
        let mut places: Vec<(Channel, f64)> = readings.iter().map(|r| (r.channel, r.x)).collect();
        places.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        places.dedup();
        let positions = places.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len).max();
        let backward = |r: &Reading| r.direction == Direction::Backward;
        Self {
            convention,
            thickness_fitted,
            channels: observations.channels(),
            repeats,
            both_directions: readings.iter().any(backward) && !readings.iter().all(backward),
            travel,
            positions: positions.unwrap_or(0),
            middle,
            spans,
            range,
            reach,
            duration: times.iter().copied().fold(0.0, f64::max),
            timed: readings.iter().all(|r| r.time.is_some()),
        }
    }

    /// Length of the travel, mm.
    pub fn length(&self) -> f64 {
        self.travel.1 - self.travel.0
    }

    /// Mean distance of neighbouring positions, mm.
    pub fn spacing(&self) -> f64 {
        self.length() / (self.positions.max(2) - 1) as f64
    }

    /// The indicators that read any channel.
    pub fn indicators(&self) -> Vec<Indicator> {
        Indicator::ALL
            .into_iter()
            .filter(|i| self.channels.iter().any(|c| Indicator::of(*c) == *i))
            .collect()
    }
}

/// Seconds since the first reading. Where any reading is without a time, all are taken to follow each
/// other evenly, one a second: first all repeats in the first spindle position, then in the second, each
/// forward and then backward, both indicators at once.
pub fn times(observations: &Observations) -> Vec<f64> {
    let readings = &observations.readings;
    let told: Option<Vec<f64>> = readings.iter().map(|r| r.time).collect();
    if let Some(mut times) = told {
        let first = times.iter().copied().fold(f64::INFINITY, f64::min);
        times.iter_mut().for_each(|t| *t -= first);
        return times;
    }
    let pass = |r: &Reading| {
        let backward = r.direction == Direction::Backward;
        (r.channel.spindle_sign() < 0.0, r.repeat, backward)
    };
    let mut passes: BTreeMap<_, BTreeMap<Channel, Vec<usize>>> = BTreeMap::new();
    for (i, r) in readings.iter().enumerate() {
        let traces = passes.entry(pass(r)).or_default();
        traces.entry(r.channel).or_default().push(i);
    }
    let mut times = vec![0.0; readings.len()];
    let mut began = 0;
    for ((_, _, backward), traces) in passes {
        let mut longest = 0;
        for mut rows in traces.into_values() {
            rows.sort_by(|a, b| readings[*a].x.total_cmp(&readings[*b].x));
            if backward {
                rows.reverse();
            }
            longest = longest.max(rows.len());
            for (step, i) in rows.into_iter().enumerate() {
                times[i] = (began + step) as f64;
            }
        }
        began += longest;
    }
    times
}
