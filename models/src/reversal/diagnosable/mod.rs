//! The reversal of the simultaneous fit about its solution, laid open to the diagnosis.
//!
//! What the exact geometry makes of a reading beyond its first order is taken off it at the fitted tilts
//! and forms (`chords.rs`). What is left is linear: of the four channels
//! I = i·M(x) + `S_side(x)` + (iα + pβ + ipγ)·x + b, of another design
//! M·n(φ) + S_ψ(x) + (α·n(φ) + γ·n(ψ) + τ + κ)·x + b. The forms are free at every position and hold
//! no straight line, so nothing about their smoothness is assumed; what the fit leaves is the
//! closure profiles (of four channels the pattern + + − − over 1A 1B 2A 2B, less its line), the slopes
//! that a rigid artefact cannot have, and everything that differs between repeats or directions of one
//! channel.

mod arrangement;
mod between;
mod between_grids;
mod carrier;
mod chords;
mod displaced;
mod edges;
mod filling;
mod fitted;
mod further;
mod gathering;
mod heights;
mod laid;
mod means;
mod missed;
mod reach;
mod rounded;
mod sorting;
mod state;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::DVector;
use thiserror::Error;

use super::designs::{DesignFit, DesignObservations, DesignReading, Zero};
use super::simultaneous::Simultaneous;
use super::smooth_profile::{SmoothProfile, Smoother};
use super::straight_line::StraightLine;
use super::{Convention, Observations, Rounding};
use crate::model::{Column, FittedModel, Place, Record};
pub use arrangement::{Arrangement, Seat, indicator_name};
use carrier::Carrier;
pub use gathering::Gathered;
use heights::Heights;
pub(in crate::reversal) use laid::Laid;
use sorting::Sorted;
use state::ChannelLine;

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
    /// Too few places that all traces have.
    #[error(
        "the traces have fewer than {FEWEST_POSITIONS} places in common, and the diagnosis compares traces along the same stretch"
    )]
    RangesDiffer,
    /// The simultaneous fit that carries readings to common places fails.
    #[error("the readings cannot be fitted: {0}")]
    NoFit(String),
    /// Nothing is left over from the fit.
    #[error("{readings} readings leave nothing over from the fit")]
    NothingLeft {
        /// Number of readings.
        readings: usize,
    },
}

/// The heights of repeats where they are unknowns: not where the indicators keep their zeros.
fn free_heights(sorted: &Sorted, arrangement: &Arrangement) -> Option<Heights> {
    match arrangement.zero() {
        Zero::Reset => Heights::of(sorted, arrangement.seats()),
        Zero::Kept => None,
    }
}

/// Fewest places of a trace.
const FEWEST_POSITIONS: usize = 5;

/// The fitted model, linear about its solution.
#[derive(Debug, Clone)]
pub struct Linearised {
    assumptions: Assumptions,
    record: Record,
    arrangement: Arrangement,
    trace_channels: Vec<usize>,
    positions: Vec<f64>,
    /// The line that forms have none of.
    gauge: StraightLine,
    smoother: Smoother,
    /// By channel.
    lines: Vec<ChannelLine>,
    /// In the order of the arrangement.
    forms: Vec<SmoothProfile>,
    /// The smooth reading of every cell.
    smooth: Vec<f64>,
    /// What effects add to the smooth reading before it is seen, by reading.
    beneath: Option<DVector<f64>>,
    span: f64,
    reach: f64,
    duration: f64,
    repeats: Vec<u32>,
    middle: f64,
    /// The smooth reading of every channel at mid travel.
    mid_readings: Vec<f64>,
    /// Whether the readings came with times.
    pub timed: bool,
    /// Readings at positions that not every trace has: not used.
    pub left_out: usize,
    /// How readings were gathered, where they were.
    pub gathered: Option<Gathered>,
    /// What the forms differ by from channel to channel, where these are read at positions of their own.
    scatter: Arc<[Column]>,
    /// The heights of repeats, where they are unknowns of the fit.
    heights: Option<Heights>,
    /// The greatest of them, µm.
    pub levelled_um: Option<f64>,
    /// Channels of which repeats are off by the same as their readings were rounded.
    pub(super) rounding: Vec<rounded::OfChannel>,
}

impl Linearised {
    /// Sorts readings into traces and fits the model. Traces of their own positions, and very long
    /// ones, are gathered into common cells by the simultaneous fit.
    ///
    /// # Errors
    /// [`NotDiagnosable`] where the traces have too little in common or the fit takes up everything.
    pub fn new(
        observations: &Observations,
        assumptions: Assumptions,
    ) -> Result<Self, NotDiagnosable> {
        Self::four(observations, assumptions, None)
    }

    /// The same where the readings have been fitted already.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_fit(
        observations: &Observations,
        fit: &Simultaneous,
        assumptions: Assumptions,
    ) -> Result<Self, NotDiagnosable> {
        Self::four(observations, assumptions, Some(fit))
    }

    /// The same of any design, with the fit of its readings where there is one; a rigid artefact
    /// whatever the convention of the assumptions.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_design(
        observations: &DesignObservations,
        zero: Zero,
        fit: Option<&DesignFit>,
        assumptions: Assumptions,
    ) -> Result<Self, NotDiagnosable> {
        let arrangement = Arrangement::new(observations.design.clone(), zero, None);
        let carrier = fit.map(|fit| Carrier::Design(Box::new(Cow::Borrowed(fit))));
        Self::beside(observations, arrangement, assumptions, carrier)
    }

    fn four(
        observations: &Observations,
        assumptions: Assumptions,
        fit: Option<&Simultaneous>,
    ) -> Result<Self, NotDiagnosable> {
        let present = observations.channels();
        let design = arrangement::of_four(&present).ok_or(NotDiagnosable::RangesDiffer)?;
        let reading = |r: &super::Reading| DesignReading {
            channel: present.iter().position(|c| *c == r.channel).unwrap_or(0),
            repeat: r.repeat,
            direction: r.direction,
            time: r.time,
            x: r.x,
            value: r.value,
        };
        let observations = DesignObservations {
            design: design.clone(),
            readings: observations.readings.iter().map(reading).collect(),
        };
        let arrangement = Arrangement::new(design, Zero::Reset, Some(assumptions.convention));
        let carrier = fit.map(|fit| Carrier::Four(Box::new(Cow::Borrowed(fit))));
        Self::beside(&observations, arrangement, assumptions, carrier)
    }

    fn beside(
        observations: &DesignObservations,
        arrangement: Arrangement,
        assumptions: Assumptions,
        fit: Option<Carrier<'_>>,
    ) -> Result<Self, NotDiagnosable> {
        let traces = gathering::traces_of(observations);
        let shared = sorting::shared(observations, traces.len());
        let positions: Vec<usize> = arrangement.seats().iter().map(|s| s.position).collect();
        let steps = rounded::steps(&observations.readings, positions.len());
        if !gathering::is_needed(traces.len(), shared.len(), observations.readings.len()) {
            let sorted = Sorted::new(observations, &positions, &shared);
            return Self::sorted(sorted, arrangement, assumptions, None, &steps);
        }
        let fit = match fit {
            Some(fit) => fit,
            None => Carrier::new(observations, &arrangement, assumptions)?,
        };
        let gather = |observations: &DesignObservations, traces, fit| {
            let (made, gathered) =
                gathering::gather(observations, traces, fit, &arrangement, assumptions)?;
            let shared = sorting::shared(&made, gathering::traces_of(&made).len());
            Ok((Sorted::new(&made, &positions, &shared), gathered))
        };
        let (sorted, gathered) = gather(observations, traces.clone(), fit)?;
        let Some(heights) = free_heights(&sorted, &arrangement) else {
            return Self::sorted(sorted, arrangement, assumptions, Some(gathered), &steps);
        };
        // Whether finer forms carry the readings better shows beside heights least of all.
        let (level, greatest) = heights.taken_from(observations, &sorted);
        let fit = Carrier::new(&level, &arrangement, assumptions)?;
        let (sorted, gathered) = gather(&level, traces, fit)?;
        // Where in its step a reading stood goes with the height that was taken from it.
        let model = Self::sorted(sorted, arrangement, assumptions, Some(gathered), &[])?;
        Ok(model.with_heights(heights, greatest))
    }

    fn sorted(
        sorted: Sorted,
        arrangement: Arrangement,
        assumptions: Assumptions,
        gathered: Option<Gathered>,
        steps: &[Option<f64>],
    ) -> Result<Self, NotDiagnosable> {
        if sorted.positions.len() < FEWEST_POSITIONS {
            return Err(NotDiagnosable::RangesDiffer);
        }
        let smoother = Smoother::new(&sorted.positions).ok_or(NotDiagnosable::RangesDiffer)?;
        let channels = arrangement.seats().len();
        // Nothing closes, and nothing is read twice.
        let (patterns, withheld) = arrangement.patterns();
        let closes = patterns.ncols() < channels || !withheld.is_empty();
        let spare = if arrangement.is_four() {
            channels == 4
        } else {
            closes
        };
        if !spare && sorted.traces.len() == channels {
            return Err(NotDiagnosable::NothingLeft {
                readings: sorted.values.len(),
            });
        }
        let n = sorted.positions.len();
        let nothing = SmoothProfile::zero(n);
        let flat = ChannelLine {
            slope: 0.0,
            offset: 0.0,
        };
        let repeats: BTreeSet<u32> = sorted.places.iter().map(|p| p.repeat).collect();
        let scatter = (gathered.as_ref()).map_or_else(Vec::new, |gathered| {
            between_grids::scatter(&sorted, &arrangement, gathered)
        });
        let last = sorted.places.iter().map(|p| p.time).fold(0.0, f64::max);
        let gauge = (gathered.as_ref()).map_or_else(
            || StraightLine::of(&sorted.positions),
            |gathered| gathered.gauge.clone(),
        );
        let heights = free_heights(&sorted, &arrangement);
        let in_each = (gathered.as_ref()).map_or(1.0, |gathered| gathered.readings_per_cell);
        let rounding = rounded::found(&sorted, steps, in_each);
        let values = sorted.values;
        let model = Self {
            span: 1.0,
            reach: 1.0,
            duration: last.max(f64::MIN_POSITIVE),
            repeats: repeats.into_iter().collect(),
            middle: sorted.positions.iter().sum::<f64>() / n as f64,
            mid_readings: vec![0.0; channels],
            assumptions,
            record: Record::new(sorted.places, sorted.traces, DVector::zeros(0)),
            trace_channels: sorted.trace_channels,
            positions: sorted.positions,
            gauge,
            smoother,
            lines: vec![flat; channels],
            forms: vec![nothing; arrangement.form_names().len()],
            arrangement,
            smooth: Vec::new(),
            beneath: None,
            timed: sorted.timed,
            left_out: (gathered.as_ref()).map_or(sorted.left_out, |gathered| gathered.beyond),
            gathered,
            scatter: scatter.into(),
            heights: None,
            levelled_um: None,
            rounding,
        };
        let observed = DVector::from_vec(values);
        let mut model = match heights {
            None => model.refit(observed.clone()),
            Some(heights) => model.refit(observed.clone()).with_heights(heights, 0.0),
        };
        if !model.rounding.is_empty() {
            let level = |trace: &Range<usize>| {
                let above = trace.clone().map(|k| observed[k] - model.cell_reading(k));
                above.sum::<f64>() / trace.len() as f64
            };
            let levels: Vec<f64> = model.record.traces.iter().map(level).collect();
            let columns = model.scatter_of_rounding(&model.rounding, &levels);
            model.scatter = model.scatter.iter().cloned().chain(columns).collect();
        }
        Ok(model)
    }

    /// The same model with the heights of its repeats as unknowns, of which `greatest` (µm) has been taken out already.
    fn with_heights(mut self, heights: Heights, greatest: f64) -> Self {
        let traces = &self.record.traces;
        let above = heights.above(&self.record.observed, traces, &self.trace_channels);
        let level = heights::levelled(&self.record.observed, traces, &above);
        let greatest = above.iter().fold(greatest, |most, h| most.max(h.abs()));
        self.heights = Some(heights);
        self.levelled_um = Some(greatest);
        self.refit(level)
    }

    /// The same model with heights that are unknowns where another's are.
    #[must_use]
    pub fn with_heights_as(self, other: &Self) -> Self {
        match (&self.heights, &other.heights) {
            (None, Some(known)) => {
                let (places, traces) = (&self.record.places, &self.record.traces);
                let heights = Heights::free(places, traces, known.by_pass());
                self.with_heights(heights, 0.0)
            }
            _ => self,
        }
    }

    /// How readings were rounded where that is more coarsely than they scatter: of the channel of which repeats have most of it in
    /// common.
    pub fn rounded_to(&self) -> Option<Rounding> {
        let all = self.rounding.iter().map(|(_, own)| *own);
        all.max_by(|a, b| a.std().total_cmp(&b.std()))
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
    pub fn seat(&self, place: &Place) -> &Seat {
        &self.arrangement.seats()[place.channel]
    }

    /// The channels with readings.
    pub fn present(&self) -> &[Seat] {
        self.arrangement.seats()
    }

    /// The channels and what they have in common.
    pub fn arrangement(&self) -> &Arrangement {
        &self.arrangement
    }

    /// Index of a place among the positions.
    fn at(&self, place: &Place) -> usize {
        place.cell % self.positions.len()
    }

    /// The smooth value of a reading, µm.
    pub fn smooth_reading(&self, reading: usize) -> f64 {
        let added = self.beneath.as_ref().map_or(0.0, |b| b[reading]);
        self.smooth[self.record.places[reading].cell] + added
    }

    /// The smooth value of a reading of its cell, without what effects add to it before it is seen, µm.
    pub(super) fn cell_reading(&self, reading: usize) -> f64 {
        self.smooth[self.record.places[reading].cell]
    }

    /// Where a reading was taken, mm: at its place, or where the readings were that were gathered into it.
    pub(super) fn taken_at(&self, reading: usize) -> f64 {
        let offsets = self.gathered.as_ref().map_or(&[][..], |g| &g.offsets);
        self.record.places[reading].x + offsets.get(reading).copied().unwrap_or(0.0)
    }

    /// The share of a reading that was taken after a moment, s: none or all of it, or of the readings
    /// that were gathered into it.
    pub(super) fn share_after(&self, reading: usize, time: f64) -> f64 {
        let at = self.record.places[reading].time;
        let span = self
            .gathered
            .as_ref()
            .and_then(|gathered| gathered.spans.get(reading))
            .copied()
            .unwrap_or(0.0);
        if span > 0.0 {
            (0.5 + (at - time) / span).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(at > time))
        }
    }

    /// Whether effects add to the smooth reading before it is seen.
    pub fn lies_beneath(&self) -> bool {
        self.beneath.is_some()
    }

    /// A function of the smooth reading, for every reading.
    pub(super) fn of_reading(&self, value: impl Fn(f64) -> f64) -> Column {
        if self.beneath.is_some() {
            return Column::from_places(&self.record.places, |k, _| value(self.smooth_reading(k)));
        }
        let values: Vec<f64> = self.smooth.iter().map(|reading| value(*reading)).collect();
        Column::from_places(&self.record.places, |_, place| values[place.cell])
    }

    /// A function that is the same for all readings of a cell in one direction, for every reading.
    pub(super) fn of_cell(&self, value: impl Fn(usize, &Place) -> f64) -> Column {
        let slot = |place: &Place| 2 * place.cell + usize::from(place.direction < 0.0);
        let mut values = vec![None; 2 * self.smooth.len()];
        for (k, place) in self.record.places.iter().enumerate() {
            values[slot(place)].get_or_insert_with(|| value(k, place));
        }
        Column::from_places(&self.record.places, |_, place| {
            values[slot(place)].unwrap_or(0.0)
        })
    }

    /// Slope of the smooth reading along the travel, µm/mm.
    pub fn reading_slope(&self, place: &Place) -> f64 {
        let (channel, k) = (place.channel, self.at(place));
        self.lines[channel].slope
            + self.slide_sum(channel, |form| form.slopes[k])
            + self.side(channel).slopes[k]
    }

    /// Slope of the artefact's form under a channel, µm/mm.
    pub fn side_slope(&self, place: &Place) -> f64 {
        self.side(place.channel).slopes[self.at(place)]
    }

    /// The tilt of a place's channel, mm/mm.
    pub fn tilt(&self, place: &Place) -> f64 {
        self.lines[place.channel].slope * 1e-3
    }

    /// Smallest to greatest smooth reading of all channels about their middles, µm.
    pub fn reading_span(&self) -> f64 {
        self.span
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

    /// The smooth reading of a place's channel at mid travel, µm.
    pub fn mid_reading(&self, place: &Place) -> f64 {
        self.mid_readings[place.channel]
    }
}
