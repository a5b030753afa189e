//! The simultaneous solution and what can be asked of it.

use std::sync::Arc;

use errsep_solvers::linear::bordered::{BorderedCovariance, Constraints};
use errsep_solvers::outcome::Ending;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Iteration, Parameters};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::along::{AlongTraces, Gathered};
use super::gauge::Axis;
use super::knots::KnotTrial;
use super::noise::Survey;
use super::readings::ChannelReadings;
use super::traces;
use super::unknowns::{Form, Unknowns};
use crate::basis::bspline::{Cubic, CubicBSpline, horner, horner_slope};
use crate::noise::Law;
use crate::reversal::combinations::determined;
use crate::reversal::forward::Attitude;
use crate::reversal::staged::Value;
use crate::reversal::{Channel, Combination, Convention, Observations, Reading};
use crate::units::{UM_PER_MM, mm_from_um};

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
    /// From what differs between repeats: variances of the parts of one reading, µm².
    Repeats(Law),
}

/// What makes a standard uncertainty of a quantity's weights on the readings.
#[derive(Debug, Clone)]
pub(super) enum Scatter {
    /// White noise of this variance, in weighted units.
    White { variance: f64, freedom: f64 },
    /// Noise along traces, as repeats tell.
    Along(Arc<AlongTraces>),
}

impl Scatter {
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
            other => other.clone(),
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
        }
    }
}

/// What the redundancy of four channels says.
#[derive(Debug, Clone, PartialEq)]
pub struct Closure {
    /// The contrast that the convention holds at zero, as the readings would have it, rad.
    pub slope: Value,
    /// Degrees of freedom of its standard uncertainty.
    pub degrees_of_freedom: f64,
    /// Positions of the profile, mm.
    pub x: Vec<f64>,
    /// (R1A + R1B − R2A − R2B)/4 of the residuals, µm.
    pub profile: Vec<f64>,
    /// Its root mean square, µm.
    pub rms: f64,
}

/// Whether there are enough knots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KnotVerdict {
    /// Neighbouring residuals are not correlated.
    Enough,
    /// Neighbouring residuals go together: forms have detail that the knots cannot follow (or the
    /// noise itself is correlated).
    TooFew,
    /// The ladder did better with fewer.
    TooMany,
}

/// The knots of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedKnots {
    /// Break points on the slide's axis, mm.
    pub breaks: Vec<f64>,
    /// The ladder, where the number was chosen from the data.
    pub table: Vec<KnotTrial>,
    /// Correlation of residuals next to each other in a channel.
    pub neighbour_correlation: f64,
    /// That correlation in units of its standard deviation for white noise.
    pub neighbour_z: f64,
    /// What it says.
    pub verdict: KnotVerdict,
}

/// Correlation of neighbours beyond this many standard deviations is told.
const SUSPICIOUS_Z: f64 = 4.0;

impl FittedKnots {
    pub(super) fn new(breaks: Vec<f64>, table: Vec<KnotTrial>, residuals: &[Vec<f64>]) -> Self {
        let sums: Vec<[f64; 3]> = residuals
            .par_iter()
            .map(|channel| {
                let count = channel.len() as f64;
                let scale = channel.iter().map(|r| r * r).sum::<f64>() / count;
                if !(scale > 0.0) {
                    return [0.0; 3];
                }
                let neighbours = channel.windows(2).map(|pair| pair[0] * pair[1]);
                [neighbours.sum::<f64>() / scale, count, count - 1.0]
            })
            .collect();
        let [products, squares, pairs] =
            [0, 1, 2].map(|k| sums.iter().map(|sum| sum[k]).sum::<f64>());
        let correlation = if squares > 0.0 {
            products / squares
        } else {
            0.0
        };
        // A fit with p unknowns leaves neighbours a correlation of about −p/m on average.
        let z = correlation * pairs.sqrt();
        let cells = breaks.len() - 1;
        let best = table.iter().min_by(|a, b| a.aicc.total_cmp(&b.aicc));
        let verdict = if z > SUSPICIOUS_Z {
            KnotVerdict::TooFew
        } else if best.is_some_and(|b| b.cells < cells) {
            KnotVerdict::TooMany
        } else {
            KnotVerdict::Enough
        };
        Self {
            breaks,
            table,
            neighbour_correlation: correlation,
            neighbour_z: z,
            verdict,
        }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.breaks.len() - 1
    }
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
    /// The knots.
    pub knots: FittedKnots,
    /// How the fit went.
    pub convergence: Convergence,
}

/// Names of the forms, in the order of their columns.
const FORMS: [&str; 3] = ["M", "S_A", "S_B"];

impl Simultaneous {
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
    fn tilt_combinations(&self) -> Vec<(String, Combination)> {
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
    fn tilt_weights(&self, combination: &Combination) -> Vec<f64> {
        let mut border = vec![0.0; self.unknowns.border_count()];
        for (c, weight) in combination.weights.iter().enumerate() {
            for (j, sign) in self.unknowns.slope_signs(c).into_iter().enumerate() {
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

    /// The slope of a channel's trace, rad; `None` for a channel that was not read.
    pub fn slope(&self, channel: Channel) -> Option<f64> {
        let c = self.channels().iter().position(|k| *k == channel)?;
        Some(self.unknowns.slope(c, &self.parameters.border))
    }

    /// Value, standard uncertainty and degrees of freedom of a combination of border unknowns.
    fn border_combination(&self, weights: &[f64]) -> (Value, f64) {
        let terms = terms(weights);
        let (std, freedom) = self.scatter.spread(&self.covariance, &[], &terms);
        let value = terms
            .iter()
            .map(|(j, w)| w * self.parameters.border[*j])
            .sum();
        (Value { value, std }, freedom)
    }

    /// The forms, or the combinations of forms which the channels determine, at positions (mm):
    /// M on the slide, S_A and S_B on the artefact's own axis.
    pub fn forms(&self, x: &[f64]) -> Vec<Profile> {
        self.determined_forms()
            .into_iter()
            .map(|(name, weights)| {
                let spread: Vec<(f64, f64)> =
                    x.par_iter().map(|x| self.form_std(&weights, *x)).collect();
                Profile {
                    name,
                    x: x.to_vec(),
                    values: x.iter().map(|x| self.form_value(&weights, *x)).collect(),
                    std: spread.iter().map(|s| s.0).collect(),
                    degrees_of_freedom: spread.iter().fold(f64::INFINITY, |m, s| m.min(s.1)),
                }
            })
            .collect()
    }

    /// Names and values of the forms at positions, without their uncertainty.
    pub(super) fn form_values(&self, x: &[f64]) -> Vec<(String, Vec<f64>)> {
        self.determined_forms()
            .into_iter()
            .map(|(name, weights)| {
                let values = x.iter().map(|x| self.form_value(&weights, *x)).collect();
                (name, values)
            })
            .collect()
    }

    /// Name and weights on the fitted forms of every combination that the channels determine.
    fn determined_forms(&self) -> Vec<(String, Vec<f64>)> {
        let channels = self.channels();
        let design = DMatrix::from_fn(channels.len(), 3, |r, c| match c {
            0 => channels[r].indicator_sign(),
            1 => f64::from(u8::from(channels[r].is_side_a())),
            _ => f64::from(u8::from(!channels[r].is_side_a())),
        });
        determined(&design, &[1, 2])
            .into_iter()
            .map(|combination| {
                // Σ weight·channel, each channel a sum of the fitted forms.
                let mut weights = vec![0.0; self.unknowns.forms.len()];
                for (channel, weight) in channels.iter().zip(&combination.weights) {
                    weights[self.unknowns.side_of(*channel)] += weight;
                    if let Some(slide) = self.unknowns.place(Form::Slide) {
                        weights[slide] += weight * channel.indicator_sign();
                    }
                }
                // Weights are sums of halves and quarters: less is rounding.
                for weight in &mut weights {
                    if weight.abs() < 1e-12 {
                        *weight = 0.0;
                    }
                }
                (combination.name(&FORMS), weights)
            })
            .collect()
    }

    fn form_value(&self, weights: &[f64], x: f64) -> f64 {
        weights
            .iter()
            .enumerate()
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(form, weight)| weight * self.value_of(form, x).0)
            .sum()
    }

    /// Standard uncertainty of a form and its degrees of freedom. What the model misses may lie in the
    /// form itself, finer than the knots.
    fn form_std(&self, weights: &[f64], x: f64) -> (f64, f64) {
        let (mut band, mut border) = (Vec::with_capacity(12), Vec::with_capacity(6));
        for (form, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            self.push_basis(form, x, *weight, &mut band);
            let [height, slope] = self.unknowns.line(form);
            border.push((height, -weight));
            border.push((slope, -weight * self.axis.xi(x)));
        }
        let (std, freedom) = self.scatter.spread(&self.covariance, &band, &border);
        (std.hypot(self.agreement.missed), freedom)
    }

    /// By what factor the standard uncertainty of each of [`Self::tilts`] would change if that share of
    /// the noise's variance were correlated along the traces over a length, mm, instead of white.
    ///
    /// # Errors
    /// [`NoValue`] where a probe touches in two places.
    pub fn if_correlated(
        &self,
        observations: &Observations,
        share: f64,
        length: f64,
    ) -> Result<Vec<f64>, NoValue> {
        let channels = ChannelReadings::sort(observations);
        let survey = Survey::new(&channels, observations);
        let groups = traces::grouped(&channels, &survey.traces);
        let gathered = Gathered::new(self, &survey, &groups, &self.weights)?;
        let factors = self.tilt_terms().into_iter().map(|(_, terms)| {
            gathered
                .against_white(&self.covariance, &terms, share, length)
                .sqrt()
        });
        Ok(factors.collect())
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

    /// What a channel would read at a slide position, µm, with the derivatives by the unknowns of
    /// band and border.
    ///
    /// # Errors
    /// [`NoValue`] for a channel that was not read, or where the probe touches in two places.
    pub fn predict(&self, channel: Channel, x: f64) -> Result<Prediction, NoValue> {
        let c = self
            .channels()
            .iter()
            .position(|k| *k == channel)
            .ok_or_else(|| NoValue::new(format!("channel {} was not read", channel.name())))?;
        let attitude = Attitude::new(
            self.unknowns.slope(c, &self.parameters.border),
            self.thickness_mm / 2.0,
        )?;
        let side = self.unknowns.side_of(channel);
        let height_of = |u: f64| self.value_of(side, u);
        let u = attitude.contact(x, |u| {
            let (height, slope) = height_of(u);
            (mm_from_um(height), mm_from_um(slope))
        })?;
        let (height, slope) = height_of(u);
        let (height, slope) = (mm_from_um(height), mm_from_um(slope));
        let (sin, cos) = (attitude.sin, attitude.cos);
        let q = 1.0 / (cos - slope * sin);
        let across = u * sin + (attitude.half_mm + height) * cos;
        let mut border = vec![0.0; self.unknowns.border_count()];
        let turn = UM_PER_MM * (x + (sin + slope * cos) * across * q);
        for (j, sign) in self.unknowns.slope_signs(c).into_iter().enumerate() {
            border[j] = sign * turn;
        }
        border[self.unknowns.offset(c)] = 1.0;
        let mut line = |form: usize, factor: f64, at: f64| {
            let [height, slope] = self.unknowns.line(form);
            border[height] = -factor;
            border[slope] = -factor * self.axis.xi(at);
        };
        line(side, q, u);
        let mut value = UM_PER_MM * attitude.reading_mm(u, height)
            + self.parameters.border[self.unknowns.offset(c)];
        let mut band = Vec::with_capacity(8);
        if let Some(slide) = self.unknowns.place(Form::Slide) {
            let sign = channel.indicator_sign();
            value += sign * self.value_of(slide, x).0;
            line(slide, sign, x);
            self.push_basis(slide, x, sign, &mut band);
        }
        self.push_basis(side, u, q, &mut band);
        if let Some(thickness) = self.unknowns.thickness_index() {
            border[thickness] = 0.5 * UM_PER_MM * (q - 1.0);
        }
        Ok(Prediction {
            value,
            band,
            border,
        })
    }

    fn value_of(&self, form: usize, at: f64) -> (f64, f64) {
        let basis = &self.bases[form];
        let k = basis.cell_of(at);
        let (left, width) = basis.cell(k);
        let (cubic, t) = (&self.cubics[form][k], (at - left) / width);
        (horner(cubic, t), horner_slope(cubic, t) / width)
    }

    fn push_basis(&self, form: usize, at: f64, factor: f64, band: &mut Vec<(usize, f64)>) {
        let (k, functions) = self.bases[form].values(at);
        for (l, function) in functions.into_iter().enumerate() {
            if let Some(j) = self.unknowns.coefficient(form, k + l) {
                band.push((j, factor * function));
            }
        }
    }

    /// The derivatives of all readings' predictions by the free unknowns (µm over the unknown's
    /// unit), dense, readings × unknowns: coefficients of the forms with the gauge taken into
    /// account, then tilts (rad), offsets (µm) and, where fitted, the thickness (mm).
    ///
    /// # Errors
    /// [`NoValue`] beyond [`MOST_DENSE_READINGS`] readings: such a matrix has no place in memory.
    pub fn jacobian(&self, observations: &Observations) -> Result<DMatrix<f64>, NoValue> {
        let rows = observations.readings.len();
        if rows > MOST_DENSE_READINGS {
            return Err(NoValue::new(format!(
                "a dense Jacobian is made for at most {MOST_DENSE_READINGS} readings, here are {rows}"
            )));
        }
        let n = self.unknowns.band_count();
        let (lines, kept) = (self.unknowns.lines(), self.unknowns.kept());
        let mut jacobian = DMatrix::zeros(rows, n + kept.len());
        for (i, reading) in observations.readings.iter().enumerate() {
            let prediction = self.predict(reading.channel, reading.x)?;
            for (j, value) in &prediction.band {
                jacobian[(i, *j)] += value;
            }
            for (line, column) in lines.iter().zip(&self.gauge.band) {
                let through = prediction.border[*line];
                if through != 0.0 {
                    for (j, w) in column.iter().enumerate() {
                        jacobian[(i, j)] += through * w;
                    }
                }
            }
            for (l, j) in kept.iter().enumerate() {
                jacobian[(i, n + l)] = prediction.border[*j];
            }
        }
        Ok(jacobian)
    }

    /// The names of the columns of [`Self::jacobian`].
    pub fn jacobian_names(&self) -> Vec<String> {
        let band =
            (0..self.unknowns.band_count()).map(|j| self.unknowns.band_name(j, &self.knots.breaks));
        let border = self
            .unknowns
            .kept()
            .into_iter()
            .map(|j| self.unknowns.border_name(j));
        band.chain(border).collect()
    }
}

/// The entries that are not zero.
fn terms(weights: &[f64]) -> Vec<(usize, f64)> {
    let entries = weights.iter().copied().enumerate();
    entries.filter(|(_, w)| *w != 0.0).collect()
}

/// Most readings for which a dense Jacobian is handed out.
pub const MOST_DENSE_READINGS: usize = 20_000;

/// A prediction and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// What the channel would read, µm.
    pub value: f64,
    /// Derivatives by unknowns of the band; an unknown may appear once a form.
    pub band: Vec<(usize, f64)>,
    /// Derivatives by all unknowns of the border.
    pub border: Vec<f64>,
}
