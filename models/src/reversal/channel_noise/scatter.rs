//! From the weights of a quantity on the readings to its standard uncertainty.

use std::sync::Arc;

use errsep_solvers::linear::bordered::BorderedCovariance;

use super::along::AlongTraces;
use super::rounded::Rounded;
use crate::noise::Law;
use crate::reversal::Rounding;

/// What makes a standard uncertainty of a quantity's weights on the readings.
#[derive(Debug, Clone)]
pub enum Scatter {
    /// White noise of this variance, in weighted units.
    White { variance: f64, freedom: f64 },
    /// Noise along traces, as repeats tell.
    Along(Arc<AlongTraces>),
    /// Noise, and the rounding that repeats have in common.
    Rounded(Box<Self>, Arc<Rounded>),
}

impl Scatter {
    /// The same beside rounding, where that matters.
    pub fn beside(self, rounded: Option<Rounded>) -> Self {
        match rounded {
            Some(rounded) => Self::Rounded(Box::new(self), Arc::new(rounded)),
            None => self,
        }
    }

    /// The same after a further unknown has taken so much of the weighted sum of squares.
    pub fn released(&self, taken: f64) -> Self {
        match self {
            Self::White { variance, freedom } if freedom.is_finite() && *freedom > 1.0 => {
                let left = freedom - 1.0;
                Self::White {
                    variance: ((variance * freedom - taken) / left).max(0.0),
                    freedom: left,
                }
            }
            Self::Rounded(noise, rounded) => {
                Self::Rounded(Box::new(noise.released(taken)), Arc::clone(rounded))
            }
            other => other.clone(),
        }
    }

    /// Variance of white noise in weighted units, and its degrees of freedom.
    pub fn white(&self) -> Option<(f64, f64)> {
        match self {
            Self::White { variance, freedom } => Some((*variance, *freedom)),
            Self::Along(_) | Self::Rounded(..) => None,
        }
    }

    /// How readings were rounded where that matters: the channel of which repeats have most of it in common.
    pub fn rounding(&self) -> Option<Rounding> {
        match self {
            Self::Rounded(_, rounded) => rounded.greatest,
            _ => None,
        }
    }

    /// The law of a reading in weighted units, where noise is probably correlated along traces.
    pub fn correlated(&self) -> Option<Law> {
        match self {
            Self::White { .. } => None,
            Self::Along(along) => along.is_correlated().then(|| along.law()),
            Self::Rounded(noise, _) => noise.correlated(),
        }
    }

    /// Standard uncertainty of a combination of unknowns, and its degrees of freedom.
    pub fn spread(
        &self,
        covariance: &BorderedCovariance,
        band: &[(usize, f64)],
        border: &[(usize, f64)],
    ) -> (f64, f64) {
        match self {
            Self::White { variance, freedom } => (
                (variance * covariance.variance(band, border)).sqrt(),
                *freedom,
            ),
            Self::Along(along) => {
                let (variance, freedom) = along.variance(covariance, band, border);
                (variance.max(0.0).sqrt(), freedom)
            }
            Self::Rounded(noise, rounded) => {
                let (std, freedom) = noise.spread(covariance, band, border);
                let more = rounded.variance(covariance, band, border);
                let whole = std * std + more;
                // Welch and Satterthwaite: how great the rounding is, is known.
                let share = std * std / whole.max(f64::MIN_POSITIVE);
                (
                    whole.sqrt(),
                    freedom / (share * share).max(f64::MIN_POSITIVE),
                )
            }
        }
    }
}
