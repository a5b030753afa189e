//! Noise first: the covariance of the readings from repeats alone.
//!
//! One reading = white noise + a part correlated along its trace (Ornstein–Uhlenbeck: variance
//! o, correlation exp(−|Δx|/ℓ)) + a shift of the whole trace + a drift of the whole trace by a slope of its own, where
//! that explains the repeats better than causes do (`attribution/drifting.rs`). Repeats of a trace differ by noise,
//! but also by whatever drifts steadily between them; contrasts orthogonal to {1, t} hold neither
//! the model nor the drift, so their likelihood estimates the noise alone.

use std::sync::Arc;

use errsep_models::model::{AnyModel, FittedModel};
use errsep_models::noise::{Law, about_middle};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal, StudentT};

use crate::levels::FEWEST_CONTRASTS;
use crate::noise::contrasts::Contrasts;
use crate::noise::posterior::Allowed;
use crate::noise::spikes::{Spikes, Tails};

/// Seed of the laws drawn from the repeats: an estimate must not depend on the user's seed.
pub(crate) const SEED: u64 = 0x6c61_7773;

/// How far the noise is known from the readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// From repeats.
    Repeats,
    /// Stated in the set-up.
    Stated,
    /// From differences of neighbouring readings: effects rougher than the spacing count as noise.
    Neighbours,
    /// From all that the fit leaves: effects count as noise that is correlated.
    Residuals,
}

/// Whether whole traces may drift, each by a slope of its own, as noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drifts {
    /// What drifts is no noise.
    Never,
    /// The repeats decide.
    Possible,
}

/// The law of the noise.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseLaw {
    /// Variances of its parts, in the square of the reading's unit.
    pub parts: Law,
    /// Degrees of freedom behind the variance of one reading.
    pub freedom: f64,
    /// Where it comes from.
    pub source: NoiseSource,
    /// Whether drifts of whole traces were among the laws that it is the mean of.
    pub(crate) drifts: Drifts,
    /// Laws drawn from what the repeats allow; empty where only the white variance is in doubt.
    possible: Arc<Vec<Law>>,
    /// Heavy tails of the single readings.
    tails: Option<Tails>,
    /// Logarithm of how likely all laws together make the repeats from which it is learnt, to a constant of their places.
    pub(crate) log_evidence: Option<f64>,
}

impl NoiseLaw {
    /// White noise of a known standard deviation.
    pub fn white(sigma: f64, freedom: f64, source: NoiseSource) -> Self {
        Self {
            parts: Law::of_white(sigma * sigma),
            freedom,
            source,
            drifts: Drifts::Never,
            possible: Arc::new(Vec::new()),
            tails: None,
            log_evidence: None,
        }
    }

    /// A law that is known from elsewhere.
    pub fn stated(parts: Law) -> Self {
        Self {
            parts,
            ..Self::white(1.0, f64::INFINITY, NoiseSource::Stated)
        }
    }

    /// A law of given parts.
    #[cfg(test)]
    pub(crate) fn of(white: f64, correlated: f64, length: f64, shift: f64) -> Self {
        Self::stated(Law {
            white,
            correlated,
            length,
            shift,
            drift: 0.0,
        })
    }

    /// The mean of laws drawn from what the repeats allow.
    pub(crate) fn mean_of(
        Allowed { laws, log_evidence }: Allowed,
        drifts: Drifts,
        source: NoiseSource,
    ) -> Self {
        let count = laws.len().max(1) as f64;
        let mean = |value: fn(&Law) -> f64| laws.iter().map(value).sum::<f64>() / count;
        let whole = mean(Law::variance);
        let variance = laws
            .iter()
            .map(|l| (l.variance() - whole).powi(2))
            .sum::<f64>()
            / (count - 1.0).max(1.0);
        let correlated = mean(|l| l.correlated);
        let length = if correlated > 0.0 {
            (mean(|l| l.correlated * l.length.ln()) / correlated).exp()
        } else {
            1.0
        };
        Self {
            parts: Law {
                white: mean(|l| l.white),
                correlated,
                length,
                shift: mean(|l| l.shift),
                drift: mean(|l| l.drift),
            },
            drifts,
            freedom: (2.0 * whole * whole / variance.max(f64::MIN_POSITIVE)).clamp(1.0, 1e9),
            source,
            possible: Arc::new(laws),
            tails: None,
            log_evidence: Some(log_evidence),
        }
    }

    /// Whether its repeats are likelier than those of another law by more than a logarithm, where both tell.
    pub(crate) fn is_likelier(&self, other: &Self, by: f64) -> bool {
        let both = self.log_evidence.zip(other.log_evidence);
        both.is_some_and(|(own, other)| own - other > by)
    }

    /// The law with another white variance, by a factor.
    pub(crate) fn whiter(mut self, factor: f64) -> Self {
        if factor != 1.0 {
            self.parts.white *= factor;
            let mut laws = self.possible.to_vec();
            laws.iter_mut().for_each(|law| law.white *= factor);
            self.possible = Arc::new(laws);
        }
        self
    }

    /// The law with heavy tails of the single readings.
    pub(crate) fn with_tails(mut self, tails: Option<Tails>) -> Self {
        self.tails = tails;
        match (self.source, tails) {
            (NoiseSource::Neighbours, Some(tails)) => self.whiter(tails.by_neighbours),
            _ => self,
        }
    }

    /// The law with the tails of another one.
    pub(crate) fn with_tails_of(self, other: &Self) -> Self {
        self.with_tails(other.tails)
    }

    /// Noise of all readings of a model.
    pub(crate) fn draw(&self, model: &AnyModel, random: &mut ChaCha8Rng) -> DVector<f64> {
        draw_all(&self.parts, model, random)
    }

    /// Whether single readings have heavy tails.
    pub(crate) fn has_tails(&self) -> bool {
        self.tails.is_some()
    }

    /// Noise of all readings for a draw of the null law: by a law that the readings allow, with
    /// the tails of the readings, its spikes (`spikes`: where they are looked for, of heavy tails) pulled in.
    pub(crate) fn draw_possible(
        &self,
        model: &AnyModel,
        spikes: Option<&Spikes>,
        draw: usize,
        random: &mut ChaCha8Rng,
    ) -> DVector<f64> {
        let law = self.possible(draw, random);
        let student = |t: Tails| Some((t, StudentT::new(t.freedom).ok()?));
        let Some(((tails, student), spikes)) = self.tails.and_then(student).zip(spikes) else {
            return draw_all(&law, model, random);
        };
        let scale = (law.white / tails.variance).sqrt();
        let mut noise = draw_all(&Law { white: 0.0, ..law }, model, random);
        for value in noise.iter_mut() {
            *value += scale * student.sample(random);
        }
        spikes.pull_in(&mut noise);
        noise
    }

    /// A law that the readings allow.
    pub(crate) fn possible(&self, draw: usize, random: &mut ChaCha8Rng) -> Law {
        match self.possible.get(draw % self.possible.len().max(1)) {
            Some(law) => *law,
            None => self.rescaled(random),
        }
    }

    /// The white variance drawn from what its degrees of freedom allow.
    fn rescaled(&self, random: &mut ChaCha8Rng) -> Law {
        let mut law = self.parts;
        if let (true, Ok(chi)) = (self.freedom < 1e6, ChiSquared::new(self.freedom)) {
            law.white *= self.freedom / chi.sample(random);
        }
        law
    }

    /// Standard deviation of one reading, in the middle of its trace where that may drift.
    pub fn sigma(&self) -> f64 {
        self.parts.variance().sqrt()
    }

    /// Covariance of the readings of one trace.
    pub fn covariance(&self, positions: &[f64]) -> DMatrix<f64> {
        let law = &self.parts;
        let places = about_middle(positions);
        DMatrix::from_fn(positions.len(), positions.len(), |i, j| {
            let apart = (positions[i] - positions[j]).abs();
            let same = if i == j { law.white } else { 0.0 };
            let whole = law.shift + law.drift * places[i] * places[j];
            same + law.correlated * (-apart / law.length).exp() + whole
        })
    }
}

/// Noise of all readings of a model, of a law.
pub(crate) fn draw_all(law: &Law, model: &AnyModel, random: &mut ChaCha8Rng) -> DVector<f64> {
    let mut noise = DVector::zeros(model.places().len());
    for trace in model.traces() {
        let x: Vec<f64> = model.places()[trace.clone()].iter().map(|p| p.x).collect();
        law.draw(&x, random, &mut noise.as_mut_slice()[trace.clone()]);
    }
    noise
}

/// A draw of the scatter that the model expects beside the noise.
pub(crate) fn draw_scatter(model: &AnyModel, random: &mut ChaCha8Rng) -> DVector<f64> {
    let mut scatter = DVector::zeros(model.places().len());
    for column in model.expected_scatter() {
        let size: f64 = StandardNormal.sample(random);
        for (&row, value) in column.rows.iter().zip(&column.values) {
            scatter[row] += size * value;
        }
    }
    scatter
}

/// What the repeats say of a single reading's noise where it is stated: standard deviation and
/// degrees of freedom.
pub(crate) fn of_repeats(model: &AnyModel, readings: &DVector<f64>) -> Option<(f64, f64)> {
    let contrasts = Contrasts::of(model, readings);
    (contrasts.count() >= FEWEST_CONTRASTS).then(|| {
        let (variance, freedom) = contrasts.scatter();
        (variance.sqrt(), freedom)
    })
}
