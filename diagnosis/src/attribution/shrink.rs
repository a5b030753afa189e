//! How far the gap shrinks: in the readings and on held-out repeats.

use std::collections::{BTreeMap, BTreeSet};

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::detection::space::Space;
use crate::noise::contrasts::Contrasts;
use crate::noise::law::{NoiseLaw, NoiseSource, draw_scatter};

/// A root mean square with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Size {
    /// The value.
    pub rms: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

/// Held-out repeats: found and fitted on some, the gap measured on the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HeldOut {
    /// Before the effects are added.
    pub before: f64,
    /// After.
    pub after: f64,
    /// 1 − after / before.
    pub shrink: f64,
    /// What a perfect model would still show, fitted on that many readings.
    pub floor: f64,
}

/// Draws of the noise for its expected part in a sum of squares.
const DRAWS: usize = 48;
/// Draws behind the floor of the held-out repeats.
const FLOOR_DRAWS: usize = 8;
/// Greatest number of ways in which repeats are split.
const SPLITS: usize = 6;

/// The least-squares residual's size against the noise.
pub(crate) struct GapMeter {
    space: Space,
    noise: DMatrix<f64>,
    /// Draws of the scatter that the model expects.
    scatter: DMatrix<f64>,
    expected: f64,
    /// Variance that noise alone gives to the mean square of the residual less its expected value.
    spread: f64,
    sigma: f64,
}

impl GapMeter {
    pub fn new(model: &AnyModel, law: &NoiseLaw, seed: u64) -> Self {
        let space = Space::new(model, &unit_noise());
        // Nearly all of a residual is differences of traces.
        let law = &law.clone().whiter(1.0 / model.noise_allowance());
        let noise = draws(model, law, seed);
        let scatter = scatter_draws(model, seed);
        let freedom = space.degrees_of_freedom().max(1) as f64;
        let mut all = noise.clone();
        if scatter.ncols() > 0 {
            all += &scatter;
        }
        let (projected, _) = space.forward(all);
        let sums: Vec<f64> = projected
            .column_iter()
            .map(|c| c.norm_squared() / freedom)
            .collect();
        let expected = sums.iter().sum::<f64>() / DRAWS as f64;
        let variance =
            sums.iter().map(|s| (s - expected).powi(2)).sum::<f64>() / (DRAWS - 1) as f64;
        // A noise that comes from repeats is a part of the same residual: what the two share is not
        // in their difference. With κ = ν_c/ν the share of the repeats' contrasts, RSS/ν − σ̂² is
        // (1 − κ) times the difference of two independent mean squares, that of the rest and σ̂².
        let estimate = 2.0 * expected * expected / law.freedom.max(1.0);
        let shared = match law.source {
            NoiseSource::Repeats => {
                let contrasts = Contrasts::of(model, model.observed());
                (law.freedom.min(contrasts.count() as f64) / freedom).min(1.0)
            }
            NoiseSource::Stated | NoiseSource::Neighbours | NoiseSource::Residuals => 0.0,
        };
        let rest = 1.0 - shared;
        Self {
            space,
            noise,
            scatter,
            expected,
            spread: rest * variance + rest * rest * estimate,
            sigma: law.sigma(),
        }
    }

    /// Root mean square of what the model misses, the noise taken out:
    /// √max(0, RSS/ν − noise²), with `causes` more parameters than the model.
    pub fn size(&self, readings: &DVector<f64>, causes: usize) -> Size {
        let (square, freedom) = self.square(readings, causes);
        // And what the product of noise and gap adds.
        let variance = self.spread + 4.0 * square.max(0.0) * self.expected / freedom;
        let reach = 1.96 * variance.sqrt();
        let root = |v: f64| v.max(0.0).sqrt();
        Size {
            rms: root(square),
            ci95: [root(square - reach), root(square + reach)],
        }
    }

    /// Mean square of what the model misses less that of the noise, which chance may make negative,
    /// and the degrees of freedom.
    pub fn square(&self, readings: &DVector<f64>, causes: usize) -> (f64, f64) {
        let all = self.space.degrees_of_freedom() as f64;
        let freedom = (all - causes as f64).max(1.0);
        let rss = self.space.forward_vector(readings).norm_squared();
        (rss / freedom - self.expected, freedom)
    }

    /// What the fit leaves of every reading.
    pub fn residuals(&self, readings: &DVector<f64>) -> Vec<f64> {
        self.space.forward_vector(readings).as_slice().to_vec()
    }

    /// Held-out repeats: fit and amplitudes on half of them, the gap on the others.
    pub fn held_out(
        &self,
        model: &AnyModel,
        readings: &DVector<f64>,
        signatures: &DMatrix<f64>,
    ) -> Option<HeldOut> {
        let none = DMatrix::zeros(readings.len(), 0);
        let (mut before, mut after, mut floor, mut count) = (0.0, 0.0, 0.0, 0.0);
        let noise = self.sigma * self.sigma;
        for split in splits(model)? {
            let fit = split.fit(signatures);
            let Some(fit) = fit.filter(|fit| fit.shows(signatures)) else {
                continue;
            };
            before += split.square(readings, &split.fit(&none)?.predict(readings), noise);
            after += split.square(readings, &fit.predict(readings), noise);
            // What a perfect model would still show: the prediction made of noise alone, and the
            // scatter that it expects.
            for draw in 0..FLOOR_DRAWS {
                let noise = self.noise.column(draw).clone_owned();
                let square = if self.scatter.ncols() > 0 {
                    let scatter = self.scatter.column(draw).clone_owned();
                    split.square(&scatter, &fit.predict(&(noise + &scatter)), 0.0)
                } else {
                    split.mean(&fit.predict(&noise), |v| v * v)
                };
                floor += square / FLOOR_DRAWS as f64;
            }
            count += 1.0;
        }
        // What happened once is not there to be predicted.
        if before <= 0.0 {
            return None;
        }
        let gap = |sum: f64| (sum / count).max(0.0).sqrt();
        let (before, after, floor) = (gap(before), gap(after), gap(floor));
        Some(HeldOut {
            before,
            after,
            shrink: shrink(before, after),
            floor,
        })
    }
}

/// Mean square of what a model with effects misses of held-out readings, their noise included; nothing where the
/// repeats are too few, or where an effect does not show in every half. (Products of different repeats would be free
/// of the noise, but below zero where what is missed turns its sign from repeat to repeat.)
pub(crate) fn held_out_square(
    model: &AnyModel,
    readings: &DVector<f64>,
    signatures: &DMatrix<f64>,
) -> Option<f64> {
    let mut sum = 0.0;
    let splits = splits(model)?;
    for split in &splits {
        let fit = split.fit(signatures).filter(|fit| fit.shows(signatures))?;
        sum += split.mean_square(readings, &fit.predict(readings));
    }
    Some(sum / splits.len() as f64)
}

/// The ways in which the repeats are split.
fn splits(model: &AnyModel) -> Option<Vec<Split>> {
    let repeats: Vec<u32> = model
        .places()
        .iter()
        .map(|p| p.repeat)
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    if repeats.len() < 2 {
        return None;
    }
    halves(repeats.len())
        .into_iter()
        .take(SPLITS)
        .map(|chosen| {
            Split::new(model, |t: usize| {
                let repeat = model.places()[model.traces()[t].start].repeat;
                repeats
                    .iter()
                    .position(|r| *r == repeat)
                    .is_some_and(|k| chosen >> k & 1 == 1)
            })
        })
        .collect()
}

/// 1 − after / before; zero where there was nothing.
pub(crate) fn shrink(before: f64, after: f64) -> f64 {
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
    /// The cell of each row, counted from zero among those of the chosen traces.
    cells: Vec<usize>,
    counts: Vec<f64>,
    /// Held-out readings that differ in the repeat only: row and cell.
    groups: Vec<Vec<(usize, usize)>>,
}

/// A fit of the chosen traces with effects beside the model.
struct SplitFit<'a> {
    split: &'a Split,
    columns: DMatrix<f64>,
    projected: DMatrix<f64>,
    /// Amplitudes from scores.
    inverse: DMatrix<f64>,
    signatures: &'a DMatrix<f64>,
}

impl Split {
    fn new(model: &AnyModel, inside: impl Fn(usize) -> bool) -> Option<Self> {
        let (chosen, others): (Vec<usize>, Vec<usize>) =
            (0..model.traces().len()).partition(|t| inside(*t));
        if chosen.is_empty() || others.is_empty() {
            return None;
        }
        let rows: Vec<usize> = chosen
            .iter()
            .flat_map(|t| model.traces()[*t].clone())
            .collect();
        let mut known: BTreeMap<usize, usize> = BTreeMap::new();
        let cells: Vec<usize> = rows
            .iter()
            .map(|k| {
                let next = known.len();
                *known.entry(model.places()[*k].cell).or_insert(next)
            })
            .collect();
        let mut counts = vec![0.0; known.len()];
        for cell in &cells {
            counts[*cell] += 1.0;
        }
        let mut groups: BTreeMap<(usize, bool), Vec<(usize, usize)>> = BTreeMap::new();
        for row in others.iter().flat_map(|t| model.traces()[*t].clone()) {
            let place = &model.places()[row];
            if let Some(cell) = known.get(&place.cell) {
                let group = groups
                    .entry((place.cell, place.direction < 0.0))
                    .or_default();
                group.push((row, *cell));
            }
        }
        if groups.is_empty() {
            return None;
        }
        Some(Self {
            space: Space::of_traces(model, &unit_noise(), &chosen),
            rows,
            cells,
            counts,
            groups: groups.into_values().collect(),
        })
    }

    fn fit<'a>(&'a self, signatures: &'a DMatrix<f64>) -> Option<SplitFit<'a>> {
        let columns = signatures.select_rows(&self.rows);
        let (projected, _) = self.space.forward(columns.clone());
        let mut inverse = projected.tr_mul(&projected);
        if !inverse.is_empty() {
            // Signatures have the units of their amplitudes: the rank is that of unit columns.
            let scale = inverse
                .diagonal()
                .map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
            let scaled = |m: DMatrix<f64>| m.map_with_location(|i, j, v| v * scale[i] * scale[j]);
            inverse = scaled(scaled(inverse).pseudo_inverse(1e-9).ok()?);
        }
        Some(SplitFit {
            split: self,
            columns,
            projected,
            inverse,
            signatures,
        })
    }

    /// Mean over the groups of a function of predictions, one a held-out reading.
    fn mean(&self, predicted: &[Vec<f64>], value: impl Fn(f64) -> f64) -> f64 {
        let of =
            |group: &Vec<f64>| group.iter().map(|p| value(*p)).sum::<f64>() / group.len() as f64;
        predicted.iter().map(of).sum::<f64>() / predicted.len() as f64
    }

    /// Mean square of what the predictions miss, with the noise of the held-out readings.
    fn mean_square(&self, readings: &DVector<f64>, predicted: &[Vec<f64>]) -> f64 {
        let of = |(group, predicted): (&Vec<(usize, usize)>, &Vec<f64>)| {
            let missed = group.iter().zip(predicted);
            let squares = missed.map(|((row, _), p)| (readings[*row] - p).powi(2));
            squares.sum::<f64>() / group.len() as f64
        };
        self.groups.iter().zip(predicted).map(of).sum::<f64>() / self.groups.len() as f64
    }

    /// Mean square of what the predictions miss, without the noise of the held-out readings: by
    /// products of different repeats, whose noise is independent; of a single repeat, less the
    /// variance of the noise.
    fn square(&self, readings: &DVector<f64>, predicted: &[Vec<f64>], noise: f64) -> f64 {
        let of = |(group, predicted): (&Vec<(usize, usize)>, &Vec<f64>)| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for ((row, _), p) in group.iter().zip(predicted) {
                let missed = readings[*row] - p;
                sum += missed;
                squares += missed * missed;
            }
            match group.len() as f64 {
                n if n > 1.0 => (sum * sum - squares) / (n * (n - 1.0)),
                _ => squares - noise,
            }
        };
        self.groups.iter().zip(predicted).map(of).sum::<f64>() / self.groups.len() as f64
    }
}

impl SplitFit<'_> {
    /// Whether the chosen traces show every signature: what happened once, in a repeat that is
    /// held out, cannot be predicted.
    fn shows(&self, signatures: &DMatrix<f64>) -> bool {
        self.projected
            .column_iter()
            .zip(signatures.column_iter())
            .all(|(inside, whole)| inside.norm() > 0.05 * whole.norm())
    }

    /// The held-out readings by the fit of the chosen ones.
    fn predict(&self, readings: &DVector<f64>) -> Vec<Vec<f64>> {
        let split = self.split;
        let mut inside = readings.select_rows(&split.rows);
        let mut residual = split.space.forward_vector(&inside);
        let amplitudes = &self.inverse * self.projected.tr_mul(&residual);
        if !amplitudes.is_empty() {
            inside -= &self.columns * &amplitudes;
            residual -= &self.projected * &amplitudes;
        }
        let mut means = vec![0.0; split.counts.len()];
        for ((cell, y), e) in split.cells.iter().zip(inside.iter()).zip(residual.iter()) {
            means[*cell] += (y - e) / split.counts[*cell];
        }
        let effect = |row: usize| -> f64 {
            let signature = self.signatures.row(row);
            signature
                .iter()
                .zip(amplitudes.iter())
                .map(|(s, a)| s * a)
                .sum()
        };
        split
            .groups
            .iter()
            .map(|group| {
                group
                    .iter()
                    .map(|(row, cell)| means[*cell] + effect(*row))
                    .collect()
            })
            .collect()
    }
}

/// Noise of the law for all readings, readings × draws.
fn draws(model: &AnyModel, law: &NoiseLaw, seed: u64) -> DMatrix<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x006e_6f69_7365);
    let columns: Vec<DVector<f64>> = (0..DRAWS).map(|_| law.draw(model, &mut random)).collect();
    DMatrix::from_columns(&columns)
}

/// The scatter that the model expects, readings × draws; no columns where it expects none.
fn scatter_draws(model: &AnyModel, seed: u64) -> DMatrix<f64> {
    let count = if model.expected_scatter().is_empty() {
        0
    } else {
        DRAWS
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0073_6361_7474);
    let mut draws = DMatrix::zeros(model.places().len(), count);
    for mut column in draws.column_iter_mut() {
        column.copy_from(&draw_scatter(model, &mut random));
    }
    draws
}
