//! What the model misses of readings that are carried, smooth along each channel.
//!
//! Where channels are read at positions of their own, forms on fine knots swing between the positions of one and those of
//! another, and at the ends beyond them, and take up what the model misses there: what they carry is off by that. So what is
//! left along each channel is smoothed over the cells, and the forms are fitted once more to the readings without it.

use nalgebra::DVector;
use statrs::statistics::{Data, OrderStatistics};

use super::Assumptions;
use super::arrangement::Arrangement;
use super::carrier::{Carrier, Route};
use super::gathering::mean;
use super::sorting::TraceKey;
use crate::reversal::designs::{DesignObservations, DesignReading};
use crate::reversal::smooth_profile::{SmoothProfile, Smoother, Spot};

/// Times that forms are fitted to readings without it, at most.
const ROUNDS: usize = 3;
/// Cells at either end that do not say what is missed: the forms are free there.
const ENDS: usize = 2;

/// The readings of each trace by cell.
pub(super) type Members<'t> = [(TraceKey, Vec<&'t [usize]>)];

/// What is missed along each channel.
#[derive(Default)]
pub(super) struct Missed {
    centres: Vec<f64>,
    /// By round and channel.
    found: Vec<Vec<SmoothProfile>>,
}

impl Missed {
    /// What the model misses of a channel at a place, µm.
    pub fn at(&self, channel: usize, x: f64) -> f64 {
        if self.found.is_empty() {
            return 0.0;
        }
        let spot = Spot::new(&self.centres, self.centres.len() / 2, x);
        self.found
            .iter()
            .map(|round| round[channel].at(&spot))
            .sum()
    }

    /// The readings without it.
    fn taken_from(&self, observations: &DesignObservations) -> DesignObservations {
        let mut without = observations.clone();
        for reading in &mut without.readings {
            reading.value -= self.at(reading.channel, reading.x);
        }
        without
    }
}

/// What carrying is about.
pub(super) struct Carrying<'c> {
    pub observations: &'c DesignObservations,
    pub arrangement: &'c Arrangement,
    pub assumptions: Assumptions,
    /// Most cells of the forms.
    pub most: usize,
    pub routes: &'c [Route],
    /// Of the cells, mm.
    pub centres: &'c [f64],
}

impl Carrying<'_> {
    /// The fit with more cells as long as that is better.
    pub fn refined<'f>(&self, fit: Carrier<'f>) -> Carrier<'f> {
        self.finer(fit, self.observations)
    }

    /// The same fit to readings without what the model misses of them, where it does and channels are read at positions of their own.
    pub fn beside_misfit<'f>(
        &self,
        mut fit: Carrier<'f>,
        members: &Members,
    ) -> (Carrier<'f>, Missed) {
        let n = self.centres.len();
        let inner = ENDS.min(n)..n.saturating_sub(ENDS).max(ENDS.min(n));
        let mut missed = Missed {
            centres: self.centres[inner.clone()].to_vec(),
            found: Vec::new(),
        };
        let Some(smoother) = Smoother::new(&missed.centres) else {
            return (fit, missed);
        };
        for _ in 0..ROUNDS {
            if !fit.disagrees() {
                break;
            }
            let residuals = fit.residuals();
            let of = |channel: usize| {
                let own: Vec<_> = members.iter().filter(|(key, _)| key.0 == channel).collect();
                // What is in single traces alone goes with none of the others.
                let usual = inner.clone().map(|cell| {
                    let left = own.iter().map(|(_, inside)| inside[cell]);
                    let left = left.filter_map(|rows| mean(rows, |k| residuals[k]));
                    Data::new(left.collect::<Vec<f64>>()).median()
                });
                smoother.smooth(&DVector::from_iterator(inner.len(), usual))
            };
            let channels = 0..self.observations.design.channels().len();
            missed.found.push(channels.map(of).collect());
            let without = missed.taken_from(self.observations);
            match Carrier::new(&without, self.arrangement, self.assumptions) {
                Ok(next) => fit = self.finer(next, &without),
                Err(_) => {
                    missed.found.pop();
                    break;
                }
            }
        }
        (fit, missed)
    }

    fn finer<'f>(&self, fit: Carrier<'f>, observations: &DesignObservations) -> Carrier<'f> {
        fit.refined(observations, self.assumptions, self.most, self.routes)
    }
}

/// Whether channels are read at positions of their own: the mean distance of one's readings from the centres of the cells, root mean
/// square, is more than this many mm.
pub(super) fn are_apart(
    members: &Members,
    readings: &[DesignReading],
    centres: &[f64],
    more_than_mm: f64,
) -> bool {
    let channels = members.iter().map(|(key, _)| key.0 + 1).max().unwrap_or(0);
    (0..channels).any(|channel| {
        let own = || members.iter().filter(|(key, _)| key.0 == channel);
        let squares: f64 = (centres.iter().enumerate())
            .map(|(cell, centre)| {
                let rows: Vec<usize> = own().flat_map(|(_, c)| c[cell]).copied().collect();
                mean(&rows, |k| readings[k].x - centre).map_or(0.0, |off| off * off)
            })
            .sum();
        squares > more_than_mm.powi(2) * centres.len() as f64
    })
}
