//! The law of the noise as readings tell it: from repeats, or from neighbours where there are none.

use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::detection::space::Space;
use crate::levels::{FEWEST_CONTRASTS, LIKELIER, LIKELIER_BY_JUMPS, MOST_JUMPS};
use crate::noise::contrasts::Contrasts;
use crate::noise::jumps::without_jump;
use crate::noise::law::{Drifts, NoiseLaw, NoiseSource, SEED};
use crate::noise::posterior::allowed;
use crate::noise::steps::levelled;

/// Draws behind what neighbours tell of the noise.
const NEIGHBOUR_DRAWS: usize = 64;

/// The law that is stated, or that the repeats of a model's readings follow, or what stands in
/// for it.
pub(crate) fn estimate(model: &AnyModel, readings: &DVector<f64>) -> NoiseLaw {
    estimate_where(model, readings, Drifts::Never)
}

/// The same where whole traces may drift, or may not.
pub(crate) fn estimate_where(
    model: &AnyModel,
    readings: &DVector<f64>,
    drifts: Drifts,
) -> NoiseLaw {
    shown(model, readings, drifts).whiter(model.noise_allowance())
}

/// The same as the differences of traces show it.
fn shown(model: &AnyModel, readings: &DVector<f64>, drifts: Drifts) -> NoiseLaw {
    if let Some(sigma) = model.stated_noise() {
        return NoiseLaw::white(sigma, f64::INFINITY, NoiseSource::Stated);
    }
    let floor = model.rounding().max(f64::MIN_POSITIVE.sqrt());
    without_jumps(model, levelled(model, readings), drifts, floor).1
}

/// Whether readings are likelier without their steps and jumps than without causes, by twenty to one: something that jumps
/// would make their repeats more alike than the causes do.
pub(crate) fn jumps_instead(
    model: &AnyModel,
    readings: &DVector<f64>,
    without_causes: &DVector<f64>,
    drifts: Drifts,
) -> bool {
    let floor = model.rounding().max(f64::MIN_POSITIVE.sqrt());
    let (without, jumps) = without_jumps(model, levelled(model, readings), drifts, floor);
    let own = || of_repeats(model, &levelled(model, without_causes), drifts, floor);
    without != *readings && jumps.is_likelier(&own(), LIKELIER_BY_JUMPS)
}

/// Logarithm of how likely readings without their jumps are where whole traces may drift, or may not, to a constant of
/// their places; none where repeats do not tell the noise.
pub(crate) fn evidence(model: &AnyModel, readings: &DVector<f64>, drifts: Drifts) -> Option<f64> {
    let floor = model.rounding().max(f64::MIN_POSITIVE.sqrt());
    without_jumps(model, levelled(model, readings), drifts, floor)
        .1
        .log_evidence
}

/// Readings without the jumps that make them likelier, each at the laws that they allow themselves, and their law. What
/// jumps again and again is nothing that jumps and stays; of that nothing is taken out.
fn without_jumps(
    model: &AnyModel,
    level: DVector<f64>,
    drifts: Drifts,
    floor: f64,
) -> (DVector<f64>, NoiseLaw) {
    let law = of_repeats(model, &level, drifts, floor);
    let as_read = (level, law);
    let mut last = as_read.clone();
    for _ in 0..=MOST_JUMPS {
        let next = without_jump(model, &last.0, &last.1).map(|level| {
            let law = of_repeats(model, &level, drifts, floor);
            (level, law)
        });
        match next.filter(|(_, law)| law.is_likelier(&last.1, LIKELIER)) {
            Some(next) => last = next,
            None => return last,
        }
    }
    as_read
}

/// The law as the differences of repeats show it, or neighbours where there are none.
fn of_repeats(model: &AnyModel, readings: &DVector<f64>, drifts: Drifts, floor: f64) -> NoiseLaw {
    let contrasts = Contrasts::of(model, readings);
    if contrasts.count() < FEWEST_CONTRASTS {
        return neighbours(model, readings, floor);
    }
    let (variance, freedom) = contrasts.scatter();
    if variance > floor * floor
        && model.correlated_noise()
        && let Some(allowed) = allowed(&contrasts, drifts, SEED)
    {
        return NoiseLaw::mean_of(allowed, drifts, NoiseSource::Repeats);
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
    let along = (-spacing / law.parts.length).exp();
    // Variance of (e₋ − 2e₀ + e₊)/√6 under the law; the fit has taken its part of the white noise.
    let correlated = law.parts.correlated * (6.0 - 8.0 * along + 2.0 * along * along) / 6.0;
    let kept = space.degrees_of_freedom() as f64 / space.readings().max(1) as f64;
    let white = law.parts.white / model.noise_allowance();
    Some(Scatter {
        seen,
        expected: (kept * (white + correlated)).sqrt(),
        relative_std: (0.5 / freedom + 0.5 / law.freedom.max(1.0)).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};

    fn made(correlated: f64, seed: u64) -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = SceneNoise {
            white: 0.1,
            correlated,
            length: 20.0,
            shift: correlated,
        };
        let scene = Scene::random(80, 4, 1e-5, 2.0, noise, &mut random);
        AnyModel::new(&Linearised::new(&scene.measured(seed), Assumptions::default()).unwrap())
    }

    /// A zero that jumps within a trace and stays, by so little that no step is seen and the law of the noise takes it for noise
    /// that is correlated or shifts the traces. k·u: the readings on either side, 320, know it to
    /// 0.1 √(2/320) = 0.008 µm; six readings off its moment, of 640, leave 0.1·0.25 µm RMS, as the square root of their
    /// share; both.
    #[test]
    fn a_jump_that_the_law_would_take_for_noise_is_taken_out() {
        for seed in 0..5 {
            let model = made(0.0, seed);
            let of_channel: Vec<usize> = (0..model.places().len())
                .filter(|k| model.places()[*k].channel == 1)
                .collect();
            let mut times: Vec<f64> = of_channel.iter().map(|k| model.places()[*k].time).collect();
            times.sort_by(f64::total_cmp);
            // Within the second repeat of the four.
            let moment = times[times.len() * 7 / 16];
            let mut stepped = model.observed().clone();
            let beyond = of_channel
                .iter()
                .filter(|k| model.places()[**k].time > moment);
            beyond.for_each(|k| stepped[*k] += 0.25);
            assert_eq!(levelled(&model, &stepped), stepped, "{seed}");
            let (level, _) = without_jumps(&model, stepped, Drifts::Never, 0.0);
            let away: Vec<f64> = of_channel
                .iter()
                .map(|k| level[*k] - model.observed()[*k])
                .collect();
            let mean = away.iter().sum::<f64>() / away.len() as f64;
            let rms = away.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / away.len() as f64;
            assert!(rms.sqrt() < 0.033, "{seed}: {}", rms.sqrt());
        }
    }

    /// Correlated noise and shifts have no jumps.
    #[test]
    fn noise_has_no_jumps() {
        for seed in 0..20 {
            let model = made(0.2, seed);
            let readings = model.observed();
            let (level, _) = without_jumps(&model, readings.clone(), Drifts::Never, 0.0);
            assert_eq!(level, *readings, "{seed}");
        }
    }
}
