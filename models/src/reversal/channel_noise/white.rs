//! Standard uncertainties under white noise, and the laws of the repeats in its place.

use std::sync::Arc;

use errsep_solvers::loss::Loss;
use errsep_solvers::problem::NoValue;

use super::along::{AlongTraces, AtRest};
use super::gathered::Derivatives;
use super::scatter::Scatter;
use super::settle::{Left, Settled, robust_unit, weighted_squares};
use super::survey::Survey;
use super::{Weighed, freedom_left, rms};
use crate::reversal::simultaneous::{Agreement, Noise, NoiseOrigin};

/// What a fit tells of its noise.
pub struct Told {
    /// What makes standard uncertainties.
    pub scatter: Scatter,
    /// The noise of a channel's readings over the σ of its weight.
    unit: f64,
    /// Variance of the shifts of whole traces, the same in all channels, µm².
    shift_um2: f64,
    /// Where it comes from.
    pub origin: NoiseOrigin,
    /// Whether model and readings agree.
    pub agreement: Agreement,
}

impl Told {
    /// White noise: declared, or from the residuals.
    pub fn white(
        problem: &impl Weighed,
        settled: &Settled,
        sigmas: &[f64],
        noise: Noise,
        loss: Loss,
    ) -> Self {
        let residuals = &settled.residuals;
        let freedom = freedom_left(problem);
        let left = Left::of_residuals(problem, residuals, settled.known);
        let robust = loss != Loss::Quadratic;
        let declared = matches!(noise, Noise::Declared(_));
        // Rows in units of the declared noise have a variance of one, and what the model misses;
        // otherwise their own scatter tells it, with what the model misses in it.
        let variance = match (declared, robust) {
            (_, true) => robust_unit(problem, residuals).powi(2),
            (true, _) => 1.0 + left.variance,
            _ => weighted_squares(residuals, problem.weights()) / freedom,
        };
        Self {
            scatter: Scatter::White {
                variance,
                freedom: if declared && left.variance <= 0.0 {
                    f64::INFINITY
                } else {
                    freedom
                },
            },
            unit: if robust {
                1.0
            } else {
                (variance - left.variance).max(0.0).sqrt()
            },
            shift_um2: 0.0,
            origin: if declared {
                NoiseOrigin::Declared
            } else {
                NoiseOrigin::Residuals
            },
            agreement: Agreement {
                disagree: left.clear,
                missed: left.variance.sqrt() * rms(sigmas),
            },
        }
    }

    /// Standard deviation of one reading of a channel whose weight has this σ, µm.
    pub fn sigma(&self, of_weight: f64) -> f64 {
        (of_weight * self.unit).hypot(self.shift_um2.sqrt())
    }

    /// The laws of noise that repeats allow, or channels against each other where there are none; `None` where they do not
    /// tell.
    ///
    /// # Errors
    /// [`NoValue`] where a reading has no derivatives.
    pub fn along<R: Fn(usize, usize) -> Result<Derivatives, NoValue>>(
        fit: &AtRest<R>,
        survey: &Survey,
        residuals: &[Vec<f64>],
        sigmas: &[f64],
    ) -> Result<Option<Self>, NoValue> {
        let repeated = !survey.repeats.is_empty();
        let found = if repeated {
            AlongTraces::new(fit, survey, residuals)
        } else {
            AlongTraces::between_channels(fit, survey, residuals)
        };
        let Some(along) = found? else {
            return Ok(None);
        };
        let (law, missed) = (along.law(), along.missed_variance());
        let mean_square = rms(sigmas).powi(2);
        Ok(Some(Self {
            unit: law.of_readings().sqrt(),
            shift_um2: law.shift * mean_square,
            origin: if repeated {
                NoiseOrigin::Repeats {
                    law: law.times(mean_square),
                    shared: along.shared(mean_square),
                }
            } else {
                NoiseOrigin::BetweenChannels {
                    law: law.times(mean_square),
                }
            },
            agreement: Agreement {
                disagree: Some(missed > 0.0),
                missed: (missed * mean_square).sqrt(),
            },
            scatter: Scatter::Along(Arc::new(along)),
        }))
    }
}
