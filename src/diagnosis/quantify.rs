//! How far the gap shrinks: in the readings, on held-out repeats, and in the answers.

use std::collections::{BTreeMap, BTreeSet};

use errsep_models::model::FittedModel;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::noise::{NoiseLaw, NoiseSource};
use super::space::Space;
use super::verdict::{Bias, HeldOut, Size};

/// Draws of the noise for its expected part in a sum of squares.
const DRAWS: usize = 48;
/// Greatest number of ways in which repeats are split.
const SPLITS: usize = 6;

/// The least-squares residual's size against the noise.
pub(super) struct GapMeter {
    space: Space,
    noise: DMatrix<f64>,
    expected: f64,
    spread: f64,
    noise_freedom: f64,
    sigma: f64,
}

impl GapMeter {
    pub fn new<M: FittedModel>(model: &M, law: &NoiseLaw, seed: u64) -> Self {
        let space = Space::new(model, &unit_noise());
        let noise = draws(model, law, seed);
        let freedom = space.degrees_of_freedom().max(1) as f64;
        let (projected, _) = space.forward(noise.clone());
        let sums: Vec<f64> = projected
            .column_iter()
            .map(|c| c.norm_squared() / freedom)
            .collect();
        let expected = sums.iter().sum::<f64>() / DRAWS as f64;
        let variance =
            sums.iter().map(|s| (s - expected).powi(2)).sum::<f64>() / (DRAWS - 1) as f64;
        Self {
            space,
            noise,
            expected,
            spread: variance,
            noise_freedom: law.freedom.max(1.0),
            sigma: law.sigma(),
        }
    }

    /// Root mean square of what the model misses, the noise taken out:
    /// √max(0, RSS/ν − noise²), with `causes` more parameters than the model.
    pub fn size(&self, readings: &DVector<f64>, causes: usize) -> Size {
        let all = self.space.degrees_of_freedom() as f64;
        let freedom = (all - causes as f64).max(1.0);
        let rss = self.space.forward_vector(readings).norm_squared();
        let square = rss / freedom - self.expected;
        // Spread of the residual's own noise, of its product with the gap, of the noise estimate.
        let variance = self.spread
            + 4.0 * square.max(0.0) * self.expected / freedom
            + 2.0 * self.expected * self.expected / self.noise_freedom;
        let reach = 1.96 * variance.sqrt();
        let root = |v: f64| v.max(0.0).sqrt();
        Size {
            rms: root(square),
            ci95: [root(square - reach), root(square + reach)],
        }
    }

    /// What the fit leaves of every reading.
    pub fn residuals(&self, readings: &DVector<f64>) -> Vec<f64> {
        self.space.forward_vector(readings).as_slice().to_vec()
    }

    /// Held-out repeats: fit and amplitudes on half of them, the gap on the others.
    pub fn held_out<M: FittedModel>(
        &self,
        model: &M,
        readings: &DVector<f64>,
        signatures: &DMatrix<f64>,
    ) -> Option<HeldOut> {
        let repeats: Vec<u32> = model
            .places()
            .iter()
            .map(|p| p.repeat)
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect();
        let half = repeats.len() / 2;
        if half == 0 {
            return None;
        }
        let few = self.noise.columns(0, 8).clone_owned();
        let none = DMatrix::zeros(readings.len(), 0);
        let (mut before, mut after, mut floor, mut count) = (0.0, 0.0, 0.0, 0.0);
        for chosen in halves(repeats.len()).into_iter().take(SPLITS) {
            let inside = |t: usize| {
                let repeat = model.places()[model.traces()[t].start].repeat;
                repeats
                    .iter()
                    .position(|r| *r == repeat)
                    .is_some_and(|k| chosen >> k & 1 == 1)
            };
            let split = Split::new(model, inside)?;
            if !split.shows(signatures) {
                continue;
            }
            before += split.mean_square(readings, &none);
            after += split.mean_square(readings, signatures);
            let noise: f64 = few
                .column_iter()
                .map(|z| split.mean_square(&z.clone_owned(), signatures))
                .sum();
            floor += noise / few.ncols() as f64;
            count += 1.0;
        }
        if count == 0.0 {
            return None;
        }
        let gap = |sum: f64| (sum / count - self.sigma * self.sigma).max(0.0).sqrt();
        let (before, after, floor) = (gap(before), gap(after), gap(floor));
        Some(HeldOut {
            before,
            after,
            shrink: shrink(before, after),
            floor,
        })
    }
}

/// 1 − after / before; zero where there was nothing.
pub(super) fn shrink(before: f64, after: f64) -> f64 {
    if before > 0.0 {
        1.0 - after / before
    } else {
        0.0
    }
}

fn unit_noise() -> NoiseLaw {
    NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated)
}

/// Ways to choose half of the repeats, as bit masks, the first repeat kept inside or not.
fn halves(repeats: usize) -> Vec<u32> {
    let most = repeats.min(16) as u32;
    (0u32..1 << most)
        .filter(|mask| mask.count_ones() == most / 2)
        .collect()
}

/// One split of the traces.
struct Split {
    space: Space,
    rows: Vec<usize>,
    cells: Vec<usize>,
    others: Vec<(usize, usize)>,
}

impl Split {
    fn new<M: FittedModel>(model: &M, inside: impl Fn(usize) -> bool) -> Option<Self> {
        let (chosen, others): (Vec<usize>, Vec<usize>) =
            (0..model.traces().len()).partition(|t| inside(*t));
        if chosen.is_empty() || others.is_empty() {
            return None;
        }
        let rows: Vec<usize> = chosen
            .iter()
            .flat_map(|t| model.traces()[*t].clone())
            .collect();
        let cells: Vec<usize> = rows.iter().map(|k| model.places()[*k].cell).collect();
        let known: BTreeSet<usize> = cells.iter().copied().collect();
        let others: Vec<(usize, usize)> = others
            .iter()
            .flat_map(|t| model.traces()[*t].clone())
            .map(|k| (k, model.places()[k].cell))
            .filter(|(_, cell)| known.contains(cell))
            .collect();
        if others.is_empty() {
            return None;
        }
        Some(Self {
            space: Space::of_traces(model, &unit_noise(), &chosen),
            rows,
            cells,
            others,
        })
    }

    /// Whether the chosen traces show every signature: what happened once, in a repeat that is
    /// held out, cannot be predicted.
    fn shows(&self, signatures: &DMatrix<f64>) -> bool {
        let (projected, _) = self.space.forward(signatures.select_rows(&self.rows));
        projected
            .column_iter()
            .zip(signatures.column_iter())
            .all(|(inside, whole)| inside.norm() > 0.05 * whole.norm())
    }

    /// Mean square of the prediction's error on the other traces.
    fn mean_square(&self, readings: &DVector<f64>, signatures: &DMatrix<f64>) -> f64 {
        let mut inside = readings.select_rows(&self.rows);
        let mut amplitudes = DVector::zeros(signatures.ncols());
        if signatures.ncols() > 0 {
            let columns = signatures.select_rows(&self.rows);
            let (projected, _) = self.space.forward(columns.clone());
            let residual = self.space.forward_vector(&inside);
            if let Ok(pseudo) = (projected.tr_mul(&projected)).pseudo_inverse(1e-9) {
                amplitudes = pseudo * projected.tr_mul(&residual);
            }
            inside -= &columns * &amplitudes;
        }
        let fitted = &inside - self.space.forward_vector(&inside);
        let mut by_cell: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (cell, value) in self.cells.iter().zip(fitted.iter()) {
            let sum = by_cell.entry(*cell).or_default();
            sum.0 += value;
            sum.1 += 1.0;
        }
        let sum: f64 = self
            .others
            .iter()
            .filter_map(|(row, cell)| {
                let (total, count) = by_cell.get(cell)?;
                let effect = (signatures.row(*row) * &amplitudes)[(0, 0)];
                Some((readings[*row] - total / count - effect).powi(2))
            })
            .sum();
        sum / self.others.len() as f64
    }
}

/// Noise of the law for all readings, readings × draws.
fn draws<M: FittedModel>(model: &M, law: &NoiseLaw, seed: u64) -> DMatrix<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x006e_6f69_7365);
    let mut noise = DMatrix::zeros(model.places().len(), DRAWS);
    for trace in model.traces() {
        let x: Vec<f64> = model.places()[trace.clone()].iter().map(|p| p.x).collect();
        for draw in 0..DRAWS {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let shift = law.shift.sqrt() * normal();
            let mut state = law.correlated.sqrt() * normal();
            for (k, row) in trace.clone().enumerate() {
                if k > 0 {
                    let decay = (-(x[k] - x[k - 1]).abs() / law.length).exp();
                    state =
                        decay * state + (law.correlated * (1.0 - decay * decay)).sqrt() * normal();
                }
                noise[(row, draw)] = shift + state + law.white.sqrt() * normal();
            }
        }
    }
    noise
}

/// A profile by name, before and after.
type MovedProfile = (String, Vec<f64>, Vec<f64>);

/// How the quantities move when `change` is taken out of readings, and the profiles with them.
pub(super) fn biases<M: FittedModel>(
    model: &M,
    law: &NoiseLaw,
    observed: &DVector<f64>,
    change: &DVector<f64>,
) -> (Vec<Bias>, Vec<MovedProfile>) {
    let corrected = observed - change;
    let mut profiles = Vec::new();
    let mut biases: Vec<Bias> = model
        .quantities()
        .into_iter()
        .map(|quantity| {
            let before = quantity.weights.dot(observed);
            let after = quantity.weights.dot(&corrected);
            Bias {
                quantity: quantity.name,
                before,
                after,
                moved: after - before,
                std: weighted_std(model, law, &quantity.weights),
                unit: quantity.unit.to_owned(),
            }
        })
        .collect();
    let rms = |v: &DVector<f64>| v.norm() / (v.len().max(1) as f64).sqrt();
    let before = model.refit(observed.clone()).profiles();
    let after = model.refit(corrected).profiles();
    for (b, a) in before.into_iter().zip(after) {
        profiles.push((
            b.name.clone(),
            b.values.as_slice().to_vec(),
            a.values.as_slice().to_vec(),
        ));
        biases.push(Bias {
            quantity: b.name,
            before: rms(&b.values),
            after: rms(&a.values),
            moved: rms(&(a.values - &b.values)),
            std: b.noise_gain * law.sigma(),
            unit: b.unit.to_owned(),
        });
    }
    (biases, profiles)
}

/// √(wᵀ V w).
pub(super) fn weighted_std<M: FittedModel>(
    model: &M,
    law: &NoiseLaw,
    weights: &DVector<f64>,
) -> f64 {
    let mut variance = 0.0;
    for trace in model.traces() {
        let w = weights.rows(trace.start, trace.len());
        let x: Vec<f64> = model.places()[trace.clone()].iter().map(|p| p.x).collect();
        variance += law.white * w.norm_squared() + law.shift * w.sum().powi(2);
        if law.correlated > 0.0 {
            // Σ wᵢ wⱼ exp(−|xᵢ − xⱼ|/ℓ) by its recursion along the trace.
            let mut behind = 0.0;
            for k in 0..w.len() {
                if k > 0 {
                    behind *= (-(x[k] - x[k - 1]).abs() / law.length).exp();
                }
                variance += law.correlated * w[k] * (w[k] + 2.0 * behind);
                behind += w[k];
            }
        }
    }
    variance.max(0.0).sqrt()
}
