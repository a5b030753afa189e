//! The simultaneous solution and what can be asked of it.

use std::sync::Arc;

use errsep_solvers::linear::bordered::{BorderedCovariance, Constraints};
use errsep_solvers::outcome::{Ending, Iteration};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;
use nalgebra::DMatrix;

use super::effects::{JoinedEffect, times};
use super::fitted_knots::FittedKnots;
use super::gauge::Axis;
use super::joined::Joined;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::told::FittedEffect;
use super::unknowns::Unknowns;
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::noise::Law;
use crate::reversal::channel_noise::scatter::Scatter;
use crate::reversal::channel_noise::supposed::{against_white, counted};
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::traces;
use crate::reversal::combinations::determined;
use crate::reversal::finer_forms::FinerForms;
use crate::reversal::staged::Value;
use crate::reversal::{Channel, Combination, Convention, Observations, Reading, Rounding};

/// A tilt, or a combination of tilts where the channels determine no more.
#[derive(Debug, Clone, PartialEq)]
pub struct Tilt {
    /// Its name in the convention, such as `alpha` or `beta + gamma`.
    pub name: String,
    /// Its coefficients on the convention's tilts and its weights on the channels.
    pub combination: Combination,
    /// Value, rad.
    pub angle: Value,
    /// Degrees of freedom of its standard uncertainty; infinite where the noise is declared.
    pub degrees_of_freedom: f64,
}

/// A form, or a combination of forms, at some positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Its name, such as `M` or `S_A/2 - S_B/2`.
    pub name: String,
    /// Positions, mm.
    pub x: Vec<f64>,
    /// Values, µm, without straight-line part over the measured positions.
    pub values: Vec<f64>,
    /// Standard uncertainties, µm.
    pub std: Vec<f64>,
    /// Degrees of freedom of these: the fewest of any point.
    pub degrees_of_freedom: f64,
}

/// The noise of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelNoise {
    /// Which channel.
    pub channel: Channel,
    /// Number of its readings.
    pub readings: usize,
    /// Root mean square of its residuals, µm.
    pub residual_rms: f64,
    /// Standard deviation of one reading, µm, without what the model misses.
    pub sigma: f64,
    /// Its share of the readings less the unknowns.
    pub degrees_of_freedom: f64,
}

/// Whether model and readings agree within the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Whether they clearly do not; `None` where nothing tells the noise apart from the model.
    pub disagree: Option<bool>,
    /// What the model misses, µm root mean square of the readings; zero where that is not clear.
    pub missed: f64,
}

/// Where the noise comes from that the uncertainties are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseOrigin {
    /// Declared: white.
    Declared,
    /// White, from what the fit leaves of the readings.
    Residuals,
    /// From what channels read against each other, free of forms, where nothing is repeated.
    BetweenChannels {
        /// Variances of the parts of one reading, µm².
        law: Law,
    },
    /// From what differs between repeats.
    Repeats {
        /// Variances of the parts of one reading, µm².
        law: Law,
        /// What opposite indicators share, where that is likelier than that they share nothing.
        shared: Option<SharedNoise>,
    },
}

/// Noise of two opposite indicators that read one pass together; a and b are their readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedNoise {
    /// Correlation of what both read: towards −1 where the slide runs elsewhere in each pass.
    pub correlation: f64,
    /// Law of (a + b)/√2, µm².
    pub together: Law,
    /// Law of (a − b)/√2, µm².
    pub against: Law,
}

/// What the redundancy of four channels says.
#[derive(Debug, Clone, PartialEq)]
pub struct Closure {
    /// The contrast that the convention holds at zero, as the readings would have it, rad; `None` where
    /// an effect in the fit takes it up.
    pub slope: Option<Value>,
    /// Degrees of freedom of its standard uncertainty.
    pub degrees_of_freedom: f64,
    /// Positions of the profile, mm.
    pub x: Vec<f64>,
    /// (R1A + R1B − R2A − R2B)/4 of the residuals, µm.
    pub profile: Vec<f64>,
    /// Its root mean square, µm.
    pub rms: f64,
}

/// How the fit went.
#[derive(Debug, Clone, PartialEq)]
pub struct Convergence {
    /// How it ended.
    pub ending: Ending,
    /// One record a pass over all readings, the rounds of the noise included.
    pub history: Vec<Iteration>,
    /// Iterations of the first of these rounds: from the seed to the minimum.
    pub first_run: usize,
    /// Time of the whole fit.
    pub seconds: f64,
}

impl Convergence {
    /// Number of iterations.
    pub fn iterations(&self) -> usize {
        self.history.len()
    }
}

/// One reading beside the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualRecord {
    /// The reading.
    pub reading: Reading,
    /// What the model says, µm.
    pub model: f64,
    /// Reading less model, µm.
    pub residual: f64,
    /// Residual in units of the channel's noise.
    pub standardised: f64,
}

/// The simultaneous solution.
#[derive(Debug, Clone)]
pub struct Simultaneous {
    /// How the slopes were read.
    pub convention: Convention,
    pub(super) unknowns: Unknowns,
    pub(super) bases: Vec<CubicBSpline>,
    pub(super) axis: Axis,
    pub(super) thickness_mm: f64,
    pub(super) cubics: Vec<Vec<Cubic>>,
    /// The forms on the knots and on finer ones, where the knots were chosen.
    pub(super) finer: Option<FinerForms>,
    pub(super) gauge: Constraints,
    pub(super) parameters: Parameters,
    pub(super) covariance: BorderedCovariance,
    pub(super) scatter: Scatter,
    pub(super) weights: Vec<f64>,
    /// Noise of the channels.
    pub noise: Vec<ChannelNoise>,
    /// Where the noise comes from.
    pub noise_origin: NoiseOrigin,
    /// Whether model and readings agree.
    pub agreement: Agreement,
    /// Reading less model, µm, in the order of the observations.
    pub residuals: Vec<f64>,
    /// Readings less unknowns.
    pub degrees_of_freedom: f64,
    /// The closure, where all four channels were read.
    pub closure: Option<Closure>,
    /// The effects in the fit, in the order in which they were asked for.
    pub effects: Vec<FittedEffect>,
    /// What the effects change in each reading, µm, in the order of the observations: f(β̂, a) − f(β̂, 0).
    /// Empty without effects.
    pub effect_changes: Vec<f64>,
    /// Whether an effect goes by time though not every reading has one: they are taken to follow each
    /// other evenly.
    pub times_assumed: bool,
    /// The greatest height taken out of a trace, µm, where repeats that stand apart were brought to one height for the fit.
    pub levelled_um: Option<f64>,
    pub(super) joined: Vec<(&'static str, Arc<dyn JoinedEffect>)>,
    /// The knots.
    pub knots: FittedKnots,
    /// How the fit went.
    pub convergence: Convergence,
}

impl Simultaneous {
    /// How readings were rounded where that is more coarsely than they scatter: the channel of which repeats have most of it in
    /// common. It is in the uncertainties.
    pub fn rounding(&self) -> Option<Rounding> {
        self.scatter.rounding()
    }

    /// The channels that were read.
    pub fn channels(&self) -> &[Channel] {
        &self.unknowns.channels
    }

    /// The tilts, or the combinations of tilts which the channels determine.
    pub fn tilts(&self) -> Vec<Tilt> {
        self.tilt_combinations()
            .into_iter()
            .map(|(name, combination)| {
                let border = self.tilt_weights(&combination);
                let (angle, degrees_of_freedom) = self.border_combination(&border);
                Tilt {
                    name,
                    angle,
                    degrees_of_freedom,
                    combination,
                }
            })
            .collect()
    }

    /// The combinations of tilts that the channels determine, by name.
    pub(super) fn tilt_combinations(&self) -> Vec<(String, Combination)> {
        let contrasts = self.convention.tilts();
        let channels = self.channels();
        let design = DMatrix::from_fn(channels.len(), 3, |r, c| contrasts[c].sign(channels[r]));
        let names = contrasts.map(|c| c.name(self.convention));
        determined(&design, &[])
            .into_iter()
            .map(|combination| (combination.name(&names), combination))
            .collect()
    }

    /// The same with their weights on the border's unknowns.
    pub(super) fn tilt_terms(&self) -> Vec<(String, Vec<(usize, f64)>)> {
        self.tilt_combinations()
            .into_iter()
            .map(|(name, combination)| (name, terms(&self.tilt_weights(&combination))))
            .collect()
    }

    /// Σ weight·slope, each slope a sum of the fitted tilts: weights on the border's unknowns.
    pub(super) fn tilt_weights(&self, combination: &Combination) -> Vec<f64> {
        let mut border = vec![0.0; self.unknowns.border_count()];
        for (c, weight) in combination.weights.iter().enumerate() {
            for (j, sign) in self.unknowns.slope_signs(c).enumerate() {
                border[j] += weight * sign;
            }
        }
        border
    }

    /// The offset of each channel, µm.
    pub fn offsets(&self) -> Vec<(Channel, Value)> {
        (0..self.channels().len())
            .map(|c| {
                let mut border = vec![0.0; self.unknowns.border_count()];
                border[self.unknowns.offset(c)] = 1.0;
                (self.channels()[c], self.border_combination(&border).0)
            })
            .collect()
    }

    /// The thickness used, mm; with its uncertainty where it was fitted.
    pub fn thickness(&self) -> Value {
        match self.unknowns.thickness_index() {
            None => Value {
                value: self.thickness_mm,
                std: 0.0,
            },
            Some(j) => {
                let mut border = vec![0.0; self.unknowns.border_count()];
                border[j] = 1.0;
                self.border_combination(&border).0
            }
        }
    }

    /// Number of fitted forms.
    pub(in crate::reversal) fn form_count(&self) -> usize {
        self.unknowns.forms.len()
    }

    /// The slope of a channel's trace, rad; `None` for a channel that was not read.
    pub fn slope(&self, channel: Channel) -> Option<f64> {
        let c = self.channels().iter().position(|k| *k == channel)?;
        Some(self.unknowns.slope(c, &self.parameters.border))
    }

    /// Value, standard uncertainty and degrees of freedom of a combination of border unknowns.
    pub(super) fn border_combination(&self, weights: &[f64]) -> (Value, f64) {
        let terms = terms(weights);
        let (std, freedom) = self.scatter.spread(&self.covariance, &[], &terms);
        let value = terms
            .iter()
            .map(|(j, w)| w * self.parameters.border[*j])
            .sum();
        (Value { value, std }, freedom)
    }

    /// By what factor the standard uncertainty of each of the first `most` of [`Self::tilts`] would change if
    /// that share of the noise's variance were correlated along the traces over a length, mm, instead of white.
    ///
    /// # Errors
    /// [`NoValue`] where a probe touches in two places.
    pub fn if_correlated(
        &self,
        observations: &Observations,
        most: usize,
        (share, length): (f64, f64),
    ) -> Result<Vec<f64>, NoValue> {
        let channels = ChannelReadings::sort(observations);
        let survey = Survey::new(&channels, |i| observations.taken(i));
        let groups = traces::grouped(&survey.x, &survey.traces);
        let times = if self.joined.is_empty() {
            Vec::new()
        } else {
            times(observations)
        };
        let joined = self.joined(observations, &times);
        let problem = self.problem(&channels, joined.as_ref());
        let combinations: Vec<_> = self
            .tilt_terms()
            .into_iter()
            .take(most)
            .map(|(_, terms)| self.covariance.times(&[], &terms))
            .collect();
        let counting = problem.counting(&self.parameters, &combinations)?;
        let factors = counting.iter().map(|by_channel| {
            let counted = counted(&survey, &groups, by_channel);
            against_white(&counted, share, length).sqrt()
        });
        Ok(factors.collect())
    }

    /// The effects of the fit over readings of the same measurement.
    pub(super) fn joined<'o>(
        &self,
        observations: &'o Observations,
        times: &'o [f64],
    ) -> Option<Joined<'o>> {
        (!self.joined.is_empty()).then(|| Joined::new(observations, times, &self.joined))
    }

    /// The problem that was solved, over readings of the same channels.
    pub(super) fn problem<'c>(
        &self,
        channels: &'c [ChannelReadings],
        joined: Option<&Joined<'c>>,
    ) -> Reversal<'c> {
        let weights = self.weights.clone();
        Reversal::new(
            channels,
            self.unknowns.clone(),
            self.bases.clone(),
            self.axis,
            self.thickness_mm,
            weights,
        )
        .joining(joined)
    }

    /// The residuals with their readings.
    pub fn records<'a>(
        &'a self,
        observations: &'a Observations,
    ) -> impl Iterator<Item = ResidualRecord> + 'a {
        observations
            .readings
            .iter()
            .zip(&self.residuals)
            .map(|(reading, residual)| {
                let sigma = self
                    .noise
                    .iter()
                    .find(|n| n.channel == reading.channel)
                    .map_or(1.0, |n| n.sigma);
                ResidualRecord {
                    reading: *reading,
                    model: reading.value - residual,
                    residual: *residual,
                    standardised: residual / sigma,
                }
            })
    }
}

/// The entries that are not zero.
fn terms(weights: &[f64]) -> Vec<(usize, f64)> {
    let entries = weights.iter().copied().enumerate();
    entries.filter(|(_, w)| *w != 0.0).collect()
}
