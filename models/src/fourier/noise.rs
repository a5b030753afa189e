//! The standard deviation of one reading, found from the scans themselves.

use super::group::Group;
use super::steps::disagreement;
use crate::uncertainty::DegreesOfFreedom;
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Where the standard deviation of one reading came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// Given in the set-up.
    Given,
    /// Scatter of repeats of one spacing.
    Repeats,
    /// Disagreement of the spacings, whatever the form of the workpiece.
    Spacings,
    /// Difference signal in the finer half of the orders beyond those kept: an upper bound, it holds
    /// the form of that fineness too.
    BeyondOrders,
}

/// Below this many degrees of freedom an estimate is refused: half of all estimates from two are off
/// by more than a third.
pub(super) const LEAST_FREEDOM: f64 = 3.0;

/// A sum of squares in units of the variance of a reading, and its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    pub squares: f64,
    pub freedom: f64,
}

impl Scatter {
    /// The standard deviation of a reading, µm.
    pub fn sigma(self) -> f64 {
        (self.squares / self.freedom).sqrt()
    }
}

/// What the scans tell of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimates {
    /// Between repeats, zero and step of each scan free.
    pub repeats: Option<Scatter>,
    /// Between spacings, step of each and the form in every order free.
    pub spacings: Option<Scatter>,
    /// Beyond the orders kept.
    pub beyond: Option<Scatter>,
}

impl Estimates {
    /// Measures all three; none of them depends on how the joint is compensated.
    pub fn new(groups: &[Group], spectra: &[Vec<Complex64>], orders: usize) -> Self {
        Self {
            repeats: of_repeats(groups, spectra),
            spacings: of_spacings(groups, orders),
            beyond: beyond(groups, orders),
        }
    }

    /// The best that there is, and how well it is known.
    pub fn best(self) -> Option<(f64, NoiseSource, DegreesOfFreedom)> {
        [
            (self.repeats, NoiseSource::Repeats),
            (self.spacings, NoiseSource::Spacings),
            (self.beyond, NoiseSource::BeyondOrders),
        ]
        .into_iter()
        .find_map(|(scatter, source)| {
            let scatter = scatter?;
            let degrees = DegreesOfFreedom::new(scatter.freedom).ok()?;
            Some((scatter.sigma(), source, degrees))
        })
    }
}

impl Estimates {
    /// What scatters apart from where the noise was taken: repeats and spacings beside a given noise,
    /// the spacings beside the repeats.
    pub fn apart_from(self, source: NoiseSource) -> Option<Scatter> {
        match source {
            NoiseSource::Given => match (self.repeats, self.spacings) {
                (Some(a), Some(b)) => Some(Scatter {
                    squares: a.squares + b.squares,
                    freedom: a.freedom + b.freedom,
                }),
                (a, b) => a.or(b),
            },
            NoiseSource::Repeats => self.spacings,
            NoiseSource::Spacings | NoiseSource::BeyondOrders => None,
        }
    }
}

fn enough(squares: f64, freedom: f64) -> Option<Scatter> {
    (freedom >= LEAST_FREEDOM).then_some(Scatter { squares, freedom })
}

/// Repeats share the workpiece in every order; their zeros and their steps may differ. A difference that was taken from
/// the others scatters by nothing.
fn of_repeats(groups: &[Group], spectra: &[Vec<Complex64>]) -> Option<Scatter> {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for g in groups.iter().filter(|g| g.scans.len() > 1) {
        let known: f64 = g.step.iter().skip(1).map(Complex64::norm_sqr).sum();
        for own in g.scans.iter().filter_map(|&i| spectra.get(i)) {
            let pairs = || own.iter().zip(&g.mean).zip(&g.step).skip(1);
            let along: f64 = pairs()
                .map(|((m, mean), h)| (h.conj() * (m - mean)).re)
                .sum();
            let step = if g.has_step() { along / known } else { 0.0 };
            squares += g.samples as f64
                * pairs()
                    .map(|((m, mean), h)| (m - mean - step * h).norm_sqr())
                    .sum::<f64>();
        }
        let unknowns = if g.has_step() { 1.0 } else { 0.0 };
        freedom += (g.repeats() - 1.0) * (2.0 * g.highest() as f64 - unknowns) - g.filled as f64;
    }
    enough(squares, freedom)
}

/// What lies between the grid points comes back, mirrored at half the number of readings, with
/// another spacing's phase; the coarser half of the orders is far from the mirror.
fn of_spacings(groups: &[Group], orders: usize) -> Option<Scatter> {
    if groups.len() < 2 {
        return None;
    }
    let highest = groups.iter().map(Group::highest).max().unwrap_or(0);
    let (squares, freedom) = disagreement(groups, orders.max(highest / 2));
    enough(squares, freedom)
}

/// The finer half of the orders beyond those kept, less a step.
fn beyond(groups: &[Group], orders: usize) -> Option<Scatter> {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for g in groups {
        let from = finer_half(orders, g.highest());
        let pairs = || g.mean.iter().zip(&g.step).skip(from);
        let known: f64 = pairs().map(|(_, h)| h.norm_sqr()).sum();
        let along: f64 = pairs().map(|(m, h)| (h.conj() * m).re).sum();
        let step = if g.has_step() { along / known } else { 0.0 };
        squares += g.weight() * pairs().map(|(m, h)| (m - step * h).norm_sqr()).sum::<f64>();
        freedom += 2.0 * pairs().count() as f64 - if g.has_step() { 1.0 } else { 0.0 };
    }
    enough(squares, freedom)
}

/// First order of the finer half of those beyond the orders kept.
pub(super) fn finer_half(orders: usize, highest: usize) -> usize {
    orders + 1 + highest.saturating_sub(orders) / 2
}
