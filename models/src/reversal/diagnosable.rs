//! The first-order reversal model, fitted and laid open to the diagnosis.
//!
//! I = i·M(x) + `S_side(x)` + (iα + pβ + ipγ)·x + b. The forms are free at every position and hold
//! no straight line, so nothing about their smoothness is assumed; what the fit leaves is the
//! closure profile (pattern + + − − over 1A 1B 2A 2B, less its line), the fourth slope contrast,
//! and everything that differs between repeats or directions of one channel.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::effects;
use super::smooth_profile::{SmoothProfile, Smoother};
use super::{Channel, Convention, Direction, Observations};
use crate::model::{Effect, FittedModel, Freedom, Pattern, Place, Profile, Profiles, Quantity};

/// What the set-up says of the measurement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Assumptions {
    /// How the slopes are read: the contrast that closes to zero is not fitted.
    pub convention: Convention,
    /// Thickness of the artefact, mm, where it is known and corrected for.
    pub thickness: Option<f64>,
    /// Standard deviation of one reading, µm, where it is stated.
    pub noise: Option<f64>,
}

/// Why readings cannot be diagnosed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NotDiagnosable {
    /// Too few positions that all traces have.
    #[error(
        "only {shared} of {all} positions are read in every trace; the diagnosis compares traces position by position and needs at least 5: measure all traces on the same positions"
    )]
    PositionsDiffer {
        /// Positions read in every trace.
        shared: usize,
        /// All positions.
        all: usize,
    },
    /// Nothing is left over from the fit.
    #[error(
        "{readings} readings leave nothing over from the fit: add the missing channels, the other direction or repeats"
    )]
    NothingLeft {
        /// Number of readings.
        readings: usize,
    },
}

/// Mean profile of one channel with its line.
#[derive(Debug, Clone)]
struct ChannelLine {
    slope: f64,
    offset: f64,
}

/// The fitted first-order model.
#[derive(Debug, Clone)]
pub struct FirstOrder {
    assumptions: Assumptions,
    observed: DVector<f64>,
    places: Vec<Place>,
    traces: Vec<Range<usize>>,
    trace_channels: Vec<Channel>,
    positions: Vec<f64>,
    smoother: Smoother,
    lines: [ChannelLine; 4],
    m: SmoothProfile,
    s_a: SmoothProfile,
    s_b: SmoothProfile,
    present: Vec<Channel>,
    span: f64,
    reach: f64,
    duration: f64,
    repeats: Vec<u32>,
    middle: f64,
    /// Whether the readings came with times.
    pub timed: bool,
    /// Readings at positions that not every trace has: not used.
    pub left_out: usize,
}

/// Seconds between readings where the file has no times.
const ASSUMED_INTERVAL: f64 = 1.0;

impl FirstOrder {
    /// Sorts readings into traces and fits the model.
    ///
    /// # Errors
    /// [`NotDiagnosable`] where the traces do not share positions or the fit takes up everything.
    pub fn new(
        observations: &Observations,
        assumptions: Assumptions,
    ) -> Result<Self, NotDiagnosable> {
        let sorted = Sorted::new(observations)?;
        let smoother = Smoother::new(&sorted.positions).ok_or(NotDiagnosable::PositionsDiffer {
            shared: sorted.positions.len(),
            all: sorted.positions.len(),
        })?;
        let present: Vec<Channel> = Channel::ALL
            .into_iter()
            .filter(|c| sorted.trace_channels.contains(c))
            .collect();
        if present.len() < 4 && sorted.traces.len() == present.len() {
            return Err(NotDiagnosable::NothingLeft {
                readings: sorted.values.len(),
            });
        }
        let n = sorted.positions.len();
        let nothing = SmoothProfile {
            values: DVector::zeros(n),
            slopes: DVector::zeros(n),
        };
        let flat = ChannelLine {
            slope: 0.0,
            offset: 0.0,
        };
        let repeats: BTreeSet<u32> = sorted.places.iter().map(|p| p.repeat).collect();
        let last = sorted.places.iter().map(|p| p.time).fold(0.0, f64::max);
        Ok(Self {
            span: 1.0,
            reach: 1.0,
            duration: last.max(f64::MIN_POSITIVE),
            repeats: repeats.into_iter().collect(),
            middle: sorted.positions.iter().sum::<f64>() / n as f64,
            assumptions,
            observed: DVector::zeros(0),
            places: sorted.places,
            traces: sorted.traces,
            trace_channels: sorted.trace_channels,
            positions: sorted.positions,
            smoother,
            lines: [flat.clone(), flat.clone(), flat.clone(), flat],
            m: nothing.clone(),
            s_a: nothing.clone(),
            s_b: nothing,
            present,
            timed: sorted.timed,
            left_out: sorted.left_out,
        }
        .refit(DVector::from_vec(sorted.values)))
    }

    /// Mean profile of every channel over its traces, where it has any.
    fn channel_means(&self, values: &DVector<f64>) -> [Option<DVector<f64>>; 4] {
        let n = self.positions.len();
        let mut sums = [const { None }; 4];
        for channel in &self.present {
            let mut sum = DVector::zeros(n);
            let mut count = 0.0;
            for (trace, _) in self
                .traces
                .iter()
                .zip(&self.trace_channels)
                .filter(|(_, c)| *c == channel)
            {
                sum += values.rows(trace.start, n);
                count += 1.0;
            }
            sums[channel.index()] = Some(sum / count);
        }
        sums
    }

    fn fit(&mut self) {
        let means = self.channel_means(&self.observed);
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let sxx: f64 = self.positions.iter().map(|x| (x - mean_x).powi(2)).sum();
        let mut residual: [Option<DVector<f64>>; 4] = [const { None }; 4];
        for channel in &self.present {
            let k = channel.index();
            let Some(mean) = &means[k] else { continue };
            let level = mean.mean();
            let slope = mean
                .iter()
                .zip(&self.positions)
                .map(|(y, x)| y * (x - mean_x))
                .sum::<f64>()
                / sxx;
            let offset = level - slope * mean_x;
            self.lines[k] = ChannelLine { slope, offset };
            residual[k] = Some(DVector::from_iterator(
                n,
                mean.iter()
                    .zip(&self.positions)
                    .map(|(y, x)| y - offset - slope * x),
            ));
        }
        let raw = forms(&residual, n);
        self.m = self.smoother.smooth(&raw[0]);
        self.s_a = self.smoother.smooth(&raw[1]);
        self.s_b = self.smoother.smooth(&raw[2]);
        self.span = self.find_span();
        self.reach = self
            .places
            .iter()
            .map(|p| self.smooth_reading(p).abs())
            .fold(f64::MIN_POSITIVE, f64::max);
    }

    fn rigid(&self) -> bool {
        self.assumptions.convention == Convention::Rigid
    }

    /// Positions at which every trace was read, mm.
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Length of travel, mm.
    pub fn travel(&self) -> f64 {
        self.positions.last().copied().unwrap_or(0.0)
            - self.positions.first().copied().unwrap_or(0.0)
    }

    /// The channel of a place.
    pub fn channel(&self, place: &Place) -> Channel {
        self.present[place.channel]
    }

    /// The channels with readings.
    pub fn present(&self) -> &[Channel] {
        &self.present
    }

    /// Index of a place among the positions.
    fn at(&self, place: &Place) -> usize {
        place.cell % self.positions.len()
    }

    /// The smooth reading at a place, µm.
    pub fn smooth_reading(&self, place: &Place) -> f64 {
        let (channel, k) = (self.channel(place), self.at(place));
        let line = &self.lines[channel.index()];
        line.offset
            + line.slope * place.x
            + channel.indicator_sign() * self.m.values[k]
            + self.side(channel).values[k]
    }

    /// Slope of the smooth reading along the travel, µm/mm.
    pub fn reading_slope(&self, place: &Place) -> f64 {
        let (channel, k) = (self.channel(place), self.at(place));
        self.lines[channel.index()].slope
            + channel.indicator_sign() * self.m.slopes[k]
            + self.side(channel).slopes[k]
    }

    /// Slope of the artefact's form under a channel, µm/mm.
    pub fn side_slope(&self, place: &Place) -> f64 {
        self.side(self.channel(place)).slopes[self.at(place)]
    }

    /// Change of the artefact's form under a channel when the probed point moves along it by
    /// `shift` mm, per mm.
    pub fn side_chord(&self, place: &Place, shift: f64) -> f64 {
        if shift.abs() < 1e-9 * self.travel() {
            return self.side_slope(place);
        }
        let side = self.side(self.channel(place));
        let moved = side.at(&self.positions, place.x + shift);
        (moved - side.values[self.at(place)]) / shift
    }

    /// The tilt of a channel, mm/mm.
    pub fn tilt(&self, channel: Channel) -> f64 {
        self.lines[channel.index()].slope * 1e-3
    }

    fn side(&self, channel: Channel) -> &SmoothProfile {
        if channel.is_side_a() {
            &self.s_a
        } else {
            &self.s_b
        }
    }

    /// Smallest to greatest smooth reading of all channels about their middles, µm.
    pub fn reading_span(&self) -> f64 {
        self.span
    }

    /// A profile over the positions, smoothed, with its slopes.
    pub(super) fn smoothed(&self, profile: &DVector<f64>) -> SmoothProfile {
        self.smoother.smooth(profile)
    }

    /// Greatest smooth reading off the indicator's zero, µm.
    pub fn reading_reach(&self) -> f64 {
        self.reach
    }

    /// Time of the last reading, s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The repeat numbers, ascending.
    pub fn repeats(&self) -> &[u32] {
        &self.repeats
    }

    fn find_span(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for place in &self.places {
            let value = self.smooth_reading(place) - self.mid_reading(place);
            low = low.min(value);
            high = high.max(value);
        }
        (high - low).max(f64::MIN_POSITIVE)
    }

    /// The smooth reading of a place's channel at mid travel, by its line, µm.
    pub fn mid_reading(&self, place: &Place) -> f64 {
        let line = &self.lines[self.channel(place).index()];
        line.offset + line.slope * self.middle
    }
}

/// M, `S_A` and `S_B` from the channels' residuals; with fewer channels the part that they show.
fn forms(residual: &[Option<DVector<f64>>; 4], n: usize) -> [DVector<f64>; 3] {
    let [a1, b1, a2, b2] = residual;
    let mean = |first: &Option<DVector<f64>>, second: &Option<DVector<f64>>| match (first, second) {
        (Some(p), Some(q)) => (p + q) / 2.0,
        (Some(p), None) | (None, Some(p)) => p.clone(),
        (None, None) => DVector::zeros(n),
    };
    let s_a = mean(a1, a2);
    let s_b = mean(b1, b2);
    let m = match (a1, b1, a2, b2) {
        (Some(a1), Some(b1), Some(a2), Some(b2)) => (a1 - b1 - a2 + b2) / 4.0,
        (Some(a1), _, Some(a2), _) => (a1 - a2) / 2.0,
        (_, Some(b1), _, Some(b2)) => (b2 - b1) / 2.0,
        _ => DVector::zeros(n),
    };
    [m, s_a, s_b]
}

/// Channel, repeat, and whether it runs backward.
type TraceKey = (Channel, u32, bool);

/// Readings in traces.
struct Sorted {
    values: Vec<f64>,
    places: Vec<Place>,
    traces: Vec<Range<usize>>,
    trace_channels: Vec<Channel>,
    positions: Vec<f64>,
    timed: bool,
    left_out: usize,
}

/// Position (mm), value (µm) and time (s) of a reading.
type Sample = (f64, f64, Option<f64>);

impl Sorted {
    fn new(observations: &Observations) -> Result<Self, NotDiagnosable> {
        use std::collections::BTreeMap;
        let mut traces: BTreeMap<TraceKey, BTreeMap<i64, Sample>> = BTreeMap::new();
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        for reading in &observations.readings {
            let key = (
                reading.channel,
                reading.repeat,
                reading.direction == Direction::Backward,
            );
            let place = position_key(reading.x);
            let trace = traces.entry(key).or_default();
            if trace
                .insert(place, (reading.x, reading.value, reading.time))
                .is_none()
            {
                *counts.entry(place).or_default() += 1;
            }
        }
        let shared: Vec<i64> = counts
            .iter()
            .filter(|(_, count)| **count == traces.len())
            .map(|(place, _)| *place)
            .collect();
        if shared.len() < 5 {
            return Err(NotDiagnosable::PositionsDiffer {
                shared: shared.len(),
                all: counts.len(),
            });
        }
        let n = shared.len();
        let timed = observations.readings.iter().all(|r| r.time.is_some());
        let order = assumed_order(traces.keys());
        let present: Vec<Channel> = observations.channels();
        let mut sorted = Self {
            values: Vec::new(),
            places: Vec::new(),
            traces: Vec::new(),
            trace_channels: Vec::new(),
            positions: Vec::new(),
            timed,
            left_out: 0,
        };
        for (key, trace) in &traces {
            let (channel, repeat, backward) = *key;
            let channel_index = present.iter().position(|c| *c == channel).unwrap_or(0);
            let start = sorted.values.len();
            for (k, place) in shared.iter().enumerate() {
                let Some(&(x, value, time)) = trace.get(place) else {
                    continue;
                };
                let step = if backward { n - 1 - k } else { k };
                let assumed = (order[key] * n + step) as f64 * ASSUMED_INTERVAL;
                sorted.values.push(value);
                sorted.places.push(Place {
                    channel: channel_index,
                    x,
                    time: if timed {
                        time.unwrap_or(assumed)
                    } else {
                        assumed
                    },
                    repeat,
                    direction: if backward { -1.0 } else { 1.0 },
                    cell: channel_index * n + k,
                });
                if sorted.traces.is_empty() {
                    sorted.positions.push(x);
                }
            }
            sorted.traces.push(start..sorted.values.len());
            sorted.trace_channels.push(channel);
        }
        sorted.left_out = observations.readings.len() - sorted.values.len();
        Ok(sorted)
    }
}

/// Positions closer than 0.1 µm are the same.
fn position_key(x: f64) -> i64 {
    (x * 1e4).round() as i64
}

/// The order in which traces are taken where no times are given: first all repeats in the first
/// spindle position, then in the second, each forward and then backward, both indicators at once.
fn assumed_order<'a>(
    keys: impl Iterator<Item = &'a TraceKey> + Clone,
) -> std::collections::BTreeMap<TraceKey, usize> {
    let pass = |key: &TraceKey| (key.0.spindle_sign() < 0.0, key.1, key.2);
    let mut passes: Vec<_> = keys.clone().map(pass).collect();
    passes.sort_unstable();
    passes.dedup();
    keys.map(|key| (*key, passes.partition_point(|p| *p < pass(key))))
        .collect()
}

impl FittedModel for FirstOrder {
    fn name(&self) -> &'static str {
        "reversal"
    }

    fn reading_unit(&self) -> &'static str {
        "um"
    }

    fn places(&self) -> &[Place] {
        &self.places
    }

    fn traces(&self) -> &[Range<usize>] {
        &self.traces
    }

    fn observed(&self) -> &DVector<f64> {
        &self.observed
    }

    fn freedom(&self) -> Freedom {
        let traces = self.traces.len();
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let mut patterns = DMatrix::zeros(traces, 3);
        for (t, channel) in self.trace_channels.iter().enumerate() {
            patterns[(t, 0)] = channel.indicator_sign();
            patterns[(t, 1)] = channel.side_sign();
            patterns[(t, 2)] = 1.0;
        }
        let line = DVector::from_iterator(n, self.positions.iter().map(|x| x - mean_x));
        let offsets = self.present.len();
        let mut columns = DMatrix::zeros(self.places.len(), offsets + usize::from(!self.rigid()));
        for (k, place) in self.places.iter().enumerate() {
            columns[(k, place.channel)] = 1.0;
            if !self.rigid() {
                columns[(k, offsets)] = self.channel(place).spindle_sign() * (place.x - mean_x);
            }
        }
        // M's line is α and the line of S_A − S_B is γ, so those two functions may hold one; that
        // of S_A + S_B is the cone, which only the rigid convention has.
        let withheld = if self.rigid() {
            Vec::new()
        } else {
            vec![(2, line)]
        };
        Freedom {
            columns,
            profiles: Some(Profiles { patterns, withheld }),
        }
    }

    fn linearised(&self) -> DVector<f64> {
        let half = self.assumptions.thickness.map_or(0.0, |d| d / 2.0);
        DVector::from_iterator(
            self.places.len(),
            self.places
                .iter()
                .zip(self.observed.iter())
                .map(|(place, value)| {
                    let slope = self.tilt(self.channel(place));
                    // A channel tilted by ψ climbs tan ψ per length, and its probe point lies h·ψ
                    // further along the artefact.
                    let climb = (slope - slope.atan()) * 1e3 * place.x;
                    value - climb - self.side_slope(place) * half * slope
                }),
        )
    }

    fn channel_names(&self) -> Vec<String> {
        self.present.iter().map(|c| c.name().to_owned()).collect()
    }

    fn patterns(&self) -> Vec<Pattern> {
        let pattern = |name: &str, weight: fn(Channel) -> f64| Pattern {
            name: name.to_owned(),
            weights: self.present.iter().map(|c| weight(*c)).collect(),
        };
        vec![
            pattern("closure", Channel::spindle_sign),
            pattern("M", Channel::indicator_sign),
            pattern("S_A - S_B", Channel::side_sign),
            pattern("S_A + S_B", |_| 1.0),
        ]
    }

    fn quantities(&self) -> Vec<Quantity> {
        if self.present.len() < 4 {
            return Vec::new();
        }
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let sxx: f64 = self.positions.iter().map(|x| (x - mean_x).powi(2)).sum();
        let contrast = |name: &str, sign: fn(Channel) -> f64| Quantity {
            name: name.to_owned(),
            unit: "rad",
            weights: DVector::from_iterator(
                self.places.len(),
                self.places.iter().map(|place| {
                    let channel = self.channel(place);
                    let traces = self
                        .trace_channels
                        .iter()
                        .filter(|c| **c == channel)
                        .count() as f64;
                    // µm per mm is 10⁻³ rad.
                    1e-3 * sign(channel) * (place.x - mean_x) / (4.0 * sxx * traces)
                }),
            ),
        };
        if self.rigid() {
            vec![
                contrast("alpha", Channel::indicator_sign),
                contrast("setup", Channel::side_sign),
                contrast("cone", |_| 1.0),
            ]
        } else {
            vec![
                contrast("alpha", Channel::indicator_sign),
                contrast("beta", Channel::spindle_sign),
                contrast("gamma", Channel::side_sign),
            ]
        }
    }

    fn profiles(&self) -> Vec<Profile> {
        let per_channel = self.traces.len() as f64 / self.present.len() as f64;
        let profile = |name: &str, form: &SmoothProfile, gain: f64| Profile {
            name: name.to_owned(),
            unit: "um",
            positions: self.positions.clone(),
            values: form.values.clone(),
            noise_gain: gain / per_channel.sqrt(),
        };
        vec![
            profile("M", &self.m, 0.5),
            profile("S_A", &self.s_a, 0.5f64.sqrt()),
            profile("S_B", &self.s_b, 0.5f64.sqrt()),
        ]
    }

    fn stated_noise(&self) -> Option<f64> {
        self.assumptions.noise
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        let mut fitted = self.clone();
        fitted.observed = observed;
        fitted.fit();
        fitted
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }
}
