//! The simultaneous fit that carries readings to common places.

use std::borrow::Cow;

use super::arrangement::Arrangement;
use super::{Assumptions, NotDiagnosable};
use crate::reversal::designs::{
    self, DesignFit, DesignObservations, DesignOptions, DesignReading, Zero,
};
use crate::reversal::simultaneous::knots::{NoiseOfWaves, trial};
use crate::reversal::simultaneous::{self, Knots, Noise, Options, Simultaneous, Thickness};
use crate::reversal::{Channel, Observations, Reading};

/// From one number of cells to the next, about.
const FINER: f64 = 1.2;
/// Positions of a channel a cell, at least, of the fit that is refined: with fewer forms swing between the positions.
const POSITIONS_A_CELL: usize = 3;
/// An end cell longer than so many others is long.
const LONG: f64 = 1.5;

/// A simultaneous fit of the readings.
pub(super) enum Carrier<'a> {
    /// Of the four channels.
    Four(Box<Cow<'a, Simultaneous>>),
    /// Of another design.
    Design(Box<Cow<'a, DesignFit>>),
}

/// From where a channel's readings in a cell are carried to where, mm.
pub(super) struct Route {
    pub channel: String,
    pub from: f64,
    pub to: f64,
    /// Number of traces of the channel.
    pub traces: f64,
}

impl Carrier<'_> {
    /// The fit under the same assumptions.
    pub fn new(
        observations: &DesignObservations,
        arrangement: &Arrangement,
        assumptions: Assumptions,
    ) -> Result<Self, NotDiagnosable> {
        if arrangement.is_four() {
            let fit = fit_four(&as_four(observations), assumptions, Knots::Chosen)?;
            return Ok(Self::Four(Box::new(Cow::Owned(fit))));
        }
        let fit = fit_design(observations, arrangement.zero(), assumptions)?;
        Ok(Self::Design(Box::new(Cow::Owned(fit))))
    }

    /// The same of four channels with more cells, at most so many, as long as the criterion that chose the knots
    /// says that it is better.
    ///
    /// It begins where a channel has three positions a cell, as forms that are finer swing between its positions, and at
    /// most with as many cells as places, where each trace has positions of its own. Channels
    /// read at positions of their own tell the forms between those of each: what a finer form is there need not be told
    /// well, as long as `routes`, over less than a spacing, are.
    pub fn refined(
        self,
        observations: &DesignObservations,
        assumptions: Assumptions,
        most: usize,
        routes: &[Route],
    ) -> Self {
        match self {
            Self::Four(fit) if fit.effects.is_empty() => {
                let coarsest = (positions_a_channel(observations) / POSITIONS_A_CELL).min(most);
                let observations = as_four(observations);
                // What the model misses would be taken up by finer forms as long as it counts more than the noise.
                let agrees = fit.agreement.disagree != Some(true);
                let waves = fit.knots.waves.filter(|_| agrees);
                let first = if cells_of(&fit) > coarsest.max(1) {
                    let coarser = fit_four(&observations, assumptions, Knots::Cells(coarsest));
                    coarser.map_or(*fit, Cow::Owned)
                } else {
                    *fit
                };
                let refined = finer(first, &observations, assumptions, (most, routes), waves);
                Self::Four(Box::new(refined))
            }
            other => other,
        }
    }

    /// From where to where the forms' cells are as narrow as elsewhere, mm: beyond what all traces have few channels
    /// tell the forms, and the last cells are long.
    pub fn told(&self) -> [f64; 2] {
        let breaks = match self {
            Self::Four(fit) => &fit.knots.breaks,
            Self::Design(fit) => &fit.knots.breaks,
        };
        let n = breaks.len();
        if n < 4 {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let wide = LONG * (breaks[n - 2] - breaks[1]) / (n - 3) as f64;
        let low = if breaks[1] - breaks[0] > wide {
            breaks[1]
        } else {
            f64::NEG_INFINITY
        };
        let high = if breaks[n - 1] - breaks[n - 2] > wide {
            breaks[n - 2]
        } else {
            f64::INFINITY
        };
        [low, high]
    }

    /// What a channel would read at a slide position, µm.
    pub fn predict(&self, channel: usize, name: &str, x: f64) -> Result<f64, NotDiagnosable> {
        let predicted = match self {
            Self::Design(fit) => fit.predict(channel, x),
            Self::Four(fit) => match Channel::from_name(name) {
                Some(four) => fit.predict(four, x).map(|there| there.value),
                None => return Err(NotDiagnosable::NoFit(format!("{name} is no channel of it"))),
            },
        };
        predicted.map_err(|why| NotDiagnosable::NoFit(why.to_string()))
    }

    /// Whether the model clearly misses more than the noise.
    pub fn disagrees(&self) -> bool {
        let agreement = match self {
            Self::Four(fit) => fit.agreement,
            Self::Design(fit) => fit.agreement,
        };
        agreement.disagree == Some(true)
    }

    /// Reading less model, µm.
    pub fn residuals(&self) -> &[f64] {
        match self {
            Self::Four(fit) => &fit.residuals,
            Self::Design(fit) => &fit.residuals,
        }
    }
}

/// The fit with more cells as long as that is better and carries readings as surely as they are.
fn finer<'a>(
    first: Cow<'a, Simultaneous>,
    observations: &Observations,
    assumptions: Assumptions,
    (most, routes): (usize, &[Route]),
    waves: Option<NoiseOfWaves>,
) -> Cow<'a, Simultaneous> {
    let mut best = first;
    loop {
        let cells = most.min((FINER * cells_of(&best) as f64).round() as usize);
        if cells <= cells_of(&best) {
            return best;
        }
        let Ok(finer) = fit_four(observations, assumptions, Knots::Cells(cells)) else {
            return best;
        };
        let better = criterion(&finer, waves) < criterion(&best, waves) && carries(&finer, routes);
        if cells_of(&finer) <= cells_of(&best) || !better {
            return best;
        }
        best = Cow::Owned(finer);
    }
}

/// Different positions of the channel that has most.
fn positions_a_channel(observations: &DesignObservations) -> usize {
    let channels = 0..observations.design.channels().len();
    let of = |channel: usize| {
        let own = observations
            .readings
            .iter()
            .filter(|r| r.channel == channel);
        let mut positions: Vec<f64> = own.map(|r| r.x).collect();
        positions.sort_unstable_by(f64::total_cmp);
        positions.dedup();
        positions.len()
    };
    channels.map(of).max().unwrap_or(0)
}

fn cells_of(fit: &Simultaneous) -> usize {
    fit.knots.breaks.len().saturating_sub(1).max(1)
}

/// The corrected Akaike criterion, as the number of knots is chosen by: for white noise, or by its waves.
fn criterion(fit: &Simultaneous, waves: Option<NoiseOfWaves>) -> f64 {
    let squares: f64 = fit.residuals.iter().map(|r| r * r).sum();
    let readings = fit.residuals.len();
    let unknowns = (readings as f64 - fit.degrees_of_freedom).round() as usize;
    let own = trial(cells_of(fit), readings, unknowns, squares);
    let under = |waves: NoiseOfWaves| {
        let more = fit.form_count() as f64 * waves.more(own.cells);
        own.taking_up(readings, more, waves.variance())
    };
    waves.map_or(own, under).aicc
}

/// Whether a fit carries what the traces of a channel have in common no less surely than these tell it.
fn carries(fit: &Simultaneous, routes: &[Route]) -> bool {
    routes.iter().all(|route| {
        let noise = fit
            .noise
            .iter()
            .find(|own| own.channel.name() == route.channel);
        noise.is_some_and(|own| {
            let std = fit.difference_std(own.channel, route.from, route.to);
            std.is_ok_and(|std| std <= own.sigma / route.traces.sqrt())
        })
    })
}

/// The simultaneous fit of the four channels under the same assumptions.
fn fit_four(
    observations: &Observations,
    assumptions: Assumptions,
    knots: Knots,
) -> Result<Simultaneous, NotDiagnosable> {
    let options = Options {
        convention: assumptions.convention,
        thickness: assumptions
            .thickness
            .map_or(Thickness::NotKnown, Thickness::Known),
        noise: assumptions.noise.map_or(Noise::Estimated, Noise::Declared),
        knots,
        ..Options::default()
    };
    simultaneous::fit(observations, &options).map_err(|why| NotDiagnosable::NoFit(why.to_string()))
}

/// Readings of 1A, 1B, 2A, 2B as theirs.
fn as_four(observations: &DesignObservations) -> Observations {
    let channels = observations.design.channels();
    let reading = |r: &DesignReading| {
        Some(Reading {
            channel: Channel::from_name(&channels[r.channel].name)?,
            repeat: r.repeat,
            direction: r.direction,
            time: r.time,
            x: r.x,
            value: r.value,
        })
    };
    Observations {
        readings: observations.readings.iter().filter_map(reading).collect(),
    }
}

/// The simultaneous fit of another design.
fn fit_design(
    observations: &DesignObservations,
    zero: Zero,
    assumptions: Assumptions,
) -> Result<DesignFit, NotDiagnosable> {
    let mut options = DesignOptions {
        zero,
        thickness_mm: assumptions.thickness.unwrap_or(0.0),
        noise: assumptions.noise.map_or(Noise::Estimated, Noise::Declared),
        ..DesignOptions::default()
    };
    let fitted = |options: &DesignOptions| {
        designs::fit(observations, options).map_err(|why| NotDiagnosable::NoFit(why.to_string()))
    };
    let chosen = fitted(&options)?;
    let most = (positions_a_channel(observations) / POSITIONS_A_CELL).max(1);
    if chosen.cells().iter().all(|(_, cells)| *cells <= most) {
        return Ok(chosen);
    }
    options.knots = Knots::Cells(most);
    fitted(&options).or(Ok(chosen))
}
