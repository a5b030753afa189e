//! The law of the noise as readings tell it: from repeats, or from neighbours where there are none.

use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::detection::space::Space;
use crate::levels::FEWEST_CONTRASTS;
use crate::noise::contrasts::Contrasts;
use crate::noise::law::{NoiseLaw, NoiseSource, SEED};
use crate::noise::posterior::possible_laws;
use crate::noise::steps::levelled;

/// Draws behind what neighbours tell of the noise.
const NEIGHBOUR_DRAWS: usize = 64;

/// The law that is stated, or that the repeats of a model's readings follow, or what stands in
/// for it.
pub(crate) fn estimate(model: &AnyModel, readings: &DVector<f64>) -> NoiseLaw {
    shown(model, readings).whiter(model.noise_allowance())
}

/// The same as the differences of traces show it.
fn shown(model: &AnyModel, readings: &DVector<f64>) -> NoiseLaw {
    if let Some(sigma) = model.stated_noise() {
        return NoiseLaw::white(sigma, f64::INFINITY, NoiseSource::Stated);
    }
    let floor = model.rounding().max(f64::MIN_POSITIVE.sqrt());
    let level = levelled(model, readings);
    let contrasts = Contrasts::new(model.places(), model.traces(), &level);
    if contrasts.count() < FEWEST_CONTRASTS {
        return neighbours(model, readings, floor);
    }
    let (variance, freedom) = contrasts.scatter();
    if variance > floor * floor && model.correlated_noise() {
        let laws = possible_laws(&contrasts, SEED);
        if !laws.is_empty() {
            return NoiseLaw::mean_of(laws);
        }
    }
    NoiseLaw::white(variance.sqrt().max(floor), freedom, NoiseSource::Repeats)
}

/// White noise from second differences of the residuals, (e₋ − 2e₀ + e₊)/√6, by their median. What
/// the fit leaves of white noise in them, and how well they tell it, is drawn.
fn neighbours(model: &AnyModel, readings: &DVector<f64>, floor: f64) -> NoiseLaw {
    let space = Space::new(
        model,
        &NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated),
    );
    let seen =
        |values: &DVector<f64>| second_differences(model.traces(), &space.forward_vector(values)).0;
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let squares: Vec<f64> = (0..NEIGHBOUR_DRAWS)
        .map(|_| {
            let noise = (0..readings.len()).map(|_| StandardNormal.sample(&mut random));
            seen(&DVector::from_iterator(readings.len(), noise)).powi(2)
        })
        .collect();
    let count = squares.len() as f64;
    let kept = squares.iter().sum::<f64>() / count;
    let variance = squares.iter().map(|s| (s - kept).powi(2)).sum::<f64>() / (count - 1.0);
    let freedom = 2.0 * kept * kept / variance.max(f64::MIN_POSITIVE);
    let sigma = if kept > 0.0 {
        seen(readings) / kept.sqrt()
    } else {
        0.0
    };
    NoiseLaw::white(sigma.max(floor), freedom.max(1.0), NoiseSource::Neighbours)
}

/// Standard deviation of the residuals as neighbours tell it, and its degrees of freedom.
fn second_differences(traces: &[Range<usize>], residual: &DVector<f64>) -> (f64, f64) {
    let mut differences: Vec<f64> = traces
        .iter()
        .flat_map(|trace| {
            let e = residual.rows(trace.start, trace.len());
            (2..trace.len()).map(move |k| (e[k - 2] - 2.0 * e[k - 1] + e[k]).abs() / 6f64.sqrt())
        })
        .collect();
    differences.sort_by(f64::total_cmp);
    let median = differences
        .get(differences.len() / 2)
        .copied()
        .unwrap_or(0.0);
    // 0.6745: the median of the absolute value of a standard normal number. The median uses 37 %
    // of the information of overlapping differences, which hold 35/18 times that of one reading.
    let freedom = 0.37 * differences.len() as f64 * 18.0 / 35.0;
    (median / 0.6745, freedom.max(1.0))
}

/// The scatter of neighbouring readings against what the repeats say of it.
pub(crate) struct Scatter {
    pub seen: f64,
    pub expected: f64,
    /// Of their ratio.
    pub relative_std: f64,
}

/// The scatter of neighbours in readings free of causes, where there are enough of them.
pub(crate) fn neighbour_scatter(
    model: &AnyModel,
    law: &NoiseLaw,
    clean: &DVector<f64>,
) -> Option<Scatter> {
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let space = Space::new(model, &unit);
    let residual = space.forward_vector(clean);
    let (seen, freedom) = second_differences(model.traces(), &residual);
    let gaps: Vec<f64> = model
        .traces()
        .iter()
        .flat_map(|t| {
            model.places()[t.clone()]
                .windows(2)
                .map(|w| (w[1].x - w[0].x).abs())
        })
        .collect();
    if freedom < 20.0 || gaps.is_empty() {
        return None;
    }
    let spacing = gaps.iter().sum::<f64>() / gaps.len() as f64;
    let along = (-spacing / law.length).exp();
    // Variance of (e₋ − 2e₀ + e₊)/√6 under the law; the fit has taken its part of the white noise.
    let correlated = law.correlated * (6.0 - 8.0 * along + 2.0 * along * along) / 6.0;
    let kept = space.degrees_of_freedom() as f64 / space.readings().max(1) as f64;
    let white = law.white / model.noise_allowance();
    Some(Scatter {
        seen,
        expected: (kept * (white + correlated)).sqrt(),
        relative_std: (0.5 / freedom + 0.5 / law.freedom.max(1.0)).sqrt(),
    })
}
