//! The standard deviation of one reading: declared, or estimated from what the data repeat.

use serde::{Deserialize, Serialize};

use super::line::Line;
use super::trace::Trace;
use crate::reversal::{Channel, Observations, Rounding};
use crate::uncertainty::{DegreesOfFreedom, Disagreement, TOLD_BELOW};

/// Where a noise figure comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseSource {
    /// Given in the set-up.
    Declared,
    /// Scatter of repeats at the same position, direction and channel.
    Repeats,
    /// The closure profile, the one redundancy of four channels.
    Closure,
    /// Each reading against its two neighbours: holds the curvature of the forms too, so that it is
    /// too large rather than too small.
    Neighbours,
}

impl NoiseSource {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Declared => "declared in the set-up",
            Self::Repeats => "from the scatter of repeats, each brought to one height",
            Self::Closure => "from the closure profile",
            Self::Neighbours => "from each reading against its neighbours (an upper bound)",
        }
    }
}

/// A noise figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard deviation of one reading, µm.
    pub sigma: f64,
    /// Where it comes from.
    pub source: NoiseSource,
    /// Degrees of freedom; absent where declared.
    pub degrees_of_freedom: Option<f64>,
}

impl Noise {
    /// What it is where the means at each position are off as far as they are by noise and by what repeats have in common of their
    /// rounding, `rounding`; that is in a figure from the closure or from neighbours already.
    pub(super) fn beside(&self, rounding: Option<&Rounding>, traces: &[Trace]) -> Self {
        let told = matches!(self.source, NoiseSource::Declared | NoiseSource::Repeats);
        let Some(rounding) = rounding.filter(|_| told) else {
            return *self;
        };
        let places: usize = traces.iter().map(|t| t.count.len()).sum();
        let readings: f64 = traces.iter().flat_map(|t| &t.count).sum();
        let repeats = readings / places.max(1) as f64;
        let sigma = self.sigma.hypot(repeats.sqrt() * rounding.std());
        // Welch and Satterthwaite: how great the rounding is, is known.
        let share = (self.sigma / sigma).powi(2);
        Self {
            sigma,
            degrees_of_freedom: self.degrees_of_freedom.map(|own| own / (share * share)),
            ..*self
        }
    }

    /// The scatter of another figure where it is clearly larger than this one.
    pub fn exceeded_by(&self, other: &Self) -> Option<Disagreement> {
        let freedom = other.degrees_of_freedom?;
        let degrees = self
            .degrees_of_freedom
            .map_or(DegreesOfFreedom::Infinite, DegreesOfFreedom::Finite);
        let squares = freedom * other.sigma * other.sigma;
        Disagreement::of(squares, freedom, self.sigma, degrees)
    }
}

/// A channel whose traces moved between their repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// Which channel.
    pub channel: Channel,
    /// Standard deviation of a reading by its repeats, µm.
    pub repeats: f64,
    /// The same by its neighbours, µm.
    pub neighbours: f64,
    /// Whether they moved as a whole alone: brought to one height, repeats differ no more than neighbours.
    pub in_height: bool,
    /// Probability that independent noise alone shows as much, in any channel.
    pub p_value: f64,
}

/// The channel whose repeats differ most clearly by more than its neighbouring readings do, which independent noise has alike:
/// brought to one height or, where none does then, as they are. Channels are compared each with itself: their noise may differ.
pub fn moved(observations: &Observations) -> Option<Moved> {
    let (level, _) = Trace::all(observations);
    let read = || {
        let all = Channel::ALL.into_iter();
        all.filter_map(|c| Trace::of(observations, c))
            .collect::<Vec<_>>()
    };
    most_moved(&level, false).or_else(|| most_moved(&read(), true))
}

fn most_moved(traces: &[Trace], in_height: bool) -> Option<Moved> {
    let of = |trace: &Trace| {
        let trace = std::slice::from_ref(trace);
        let (repeats, neighbours) = (from_repeats(trace)?, from_neighbours(trace)?);
        let p_value = traces.len() as f64 * neighbours.exceeded_by(&repeats)?.p_value;
        (p_value < TOLD_BELOW).then_some(Moved {
            channel: trace[0].channel,
            repeats: repeats.sigma,
            neighbours: neighbours.sigma,
            in_height,
            p_value,
        })
    };
    let all = traces.iter().filter_map(of);
    all.min_by(|a, b| a.p_value.total_cmp(&b.p_value))
}

/// From the scatter of repeats, if there are any.
pub fn from_repeats(traces: &[Trace]) -> Option<Noise> {
    let squares = traces.iter().map(|t| t.scatter).sum::<f64>();
    let freedom = traces.iter().map(|t| t.scatter_freedom).sum::<usize>();
    (freedom > 0).then(|| Noise {
        sigma: (squares / freedom as f64).sqrt(),
        source: NoiseSource::Repeats,
        degrees_of_freedom: Some(freedom as f64),
    })
}

/// From the closure profile (line removed) and the variance that one unit of noise gives it at each
/// position.
pub fn from_closure(closure: &[f64], unit_variance: &[f64]) -> Option<Noise> {
    let expected = unit_variance.iter().sum::<f64>();
    let freedom = closure.len().checked_sub(2).filter(|&f| f > 0)?;
    (expected > 0.0).then(|| Noise {
        sigma: (closure.iter().map(|c| c * c).sum::<f64>() / expected).sqrt(),
        source: NoiseSource::Closure,
        degrees_of_freedom: Some(freedom as f64),
    })
}

/// From each mean reading against the straight line between its neighbours.
///
/// The second differences of n independent values have about (n − 2)·18/35 degrees of freedom
/// (von Neumann's ratio for second differences).
pub fn from_neighbours(traces: &[Trace]) -> Option<Noise> {
    let (mut squares, mut n) = (0.0, 0.0);
    for trace in traces {
        let Some(line) = Line::fit(&trace.x, &trace.mean, &trace.count) else {
            continue;
        };
        for k in 1..trace.x.len().saturating_sub(1) {
            let (x, count) = (&trace.x, &trace.count);
            let right = (x[k] - x[k - 1]) / (x[k + 1] - x[k - 1]);
            let left = 1.0 - right;
            let rest = |j: usize| trace.mean[j] - line.at(x[j]);
            let difference = rest(k) - left * rest(k - 1) - right * rest(k + 1);
            let variance =
                1.0 / count[k] + left * left / count[k - 1] + right * right / count[k + 1];
            squares += difference * difference / variance;
            n += 1.0;
        }
    }
    (n > 0.0).then(|| Noise {
        sigma: f64::sqrt(squares / n),
        source: NoiseSource::Neighbours,
        degrees_of_freedom: Some(n * 18.0 / 35.0),
    })
}
