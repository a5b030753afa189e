//! What the greatest score of each family does when nothing is there.
//!
//! Draws of the noise, seen through the same projection and the same signatures,
//! give the law of the greatest score over every shape and place looked at (Westfall and Young's
//! max-T); the smallest tail probability over the families gives one verdict (min-P). The law of the
//! noise is itself an estimate: each draw is made by a law that the repeats allow (`posterior.rs`)
//! and seen through the whitening of the estimated one.

use std::collections::BTreeMap;

use errsep_models::model::AnyModel;
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::detection::calm::spikes_of_draws;
use crate::detection::dictionary::{Dictionary, Family, inverse, surprise};
use crate::detection::folding::Sums;
use crate::detection::space::Space;
use crate::noise::law::{NoiseLaw, draw_scatter};
use crate::noise::spikes::Spikes;

/// Parts of the draws of which each is judged by the tails of the others: of two, whose tails know half as much as
/// those of all draws, the law of the smallest tail probability would be too wide.
const PARTS: usize = 10;
/// Draws handled at once.
pub(crate) const BATCH: usize = 64;

/// The law of the greatest score of every family, of the misfit as a whole, and of the smallest tail
/// probability among them.
#[derive(Debug, Clone)]
pub struct NullLaw {
    tails: Tails,
    /// Over the families.
    smallest: Tail,
    /// Over the families and the misfit.
    any: Tail,
}

/// The tails of each.
#[derive(Debug, Clone)]
struct Tails {
    families: Vec<Tail>,
    /// Of the sum of squares that the fit leaves, in units of the noise.
    misfit: Tail,
}

/// A sorted sample with an exponential tail fitted to its upper tenth.
#[derive(Debug, Clone)]
pub(crate) struct Tail {
    sorted: Vec<f64>,
    from: f64,
    scale: f64,
}

impl Tail {
    pub fn new(mut sample: Vec<f64>) -> Self {
        sample.sort_by(f64::total_cmp);
        let start = sample.len() * 9 / 10;
        let from = sample.get(start).copied().unwrap_or(0.0);
        let excess: f64 = sample[start..].iter().map(|s| s - from).sum();
        let scale = (excess / (sample.len() - start).max(1) as f64).max(1e-9);
        Self {
            sorted: sample,
            from,
            scale,
        }
    }

    /// Probability of a value as great.
    pub fn beyond(&self, value: f64) -> f64 {
        // A family that showed nothing in any draw was not there to be judged.
        if self.from <= 0.0 {
            return 1.0;
        }
        if value > self.from {
            return 0.1 * (-(value - self.from) / self.scale).exp();
        }
        let below = self.sorted.partition_point(|s| *s < value);
        (self.sorted.len() - below) as f64 / self.sorted.len() as f64
    }
}

impl Tails {
    /// From draws: a row holds the families' greatest scores and, last, the misfit.
    fn new<'r>(rows: impl Iterator<Item = &'r Vec<f64>> + Clone) -> Self {
        let of = |place: usize| Tail::new(rows.clone().map(|row| row[place]).collect());
        let families = rows.clone().next().map_or(0, |row| row.len() - 1);
        Self {
            families: (0..families).map(of).collect(),
            misfit: of(families),
        }
    }

    fn family(&self, family: usize, surprise: f64) -> f64 {
        self.families
            .get(family)
            .map_or(1.0, |t| t.beyond(surprise))
    }

    fn smallest_of(&self, surprises: &[f64]) -> f64 {
        surprises
            .iter()
            .enumerate()
            .map(|(family, s)| self.family(family, *s))
            .fold(1.0, f64::min)
            .max(f64::MIN_POSITIVE)
    }
}

impl NullLaw {
    /// The law under a space and a dictionary, from a number of draws.
    pub fn simulate(
        model: &AnyModel,
        dictionary: &Dictionary,
        space: &Space,
        law: &NoiseLaw,
        draws: usize,
        seed: u64,
    ) -> Self {
        let spikes = spikes_of_draws(model, law);
        let batches = draws.div_ceil(BATCH);
        let all: Vec<Vec<Vec<f64>>> = (0..batches)
            .into_par_iter()
            .map(|batch| {
                greatest(
                    model,
                    dictionary,
                    space,
                    (law, spikes.as_ref()),
                    seed,
                    batch,
                )
            })
            .collect();
        let rows: Vec<Vec<f64>> = all.into_iter().flatten().collect();
        // Tails judged by the draws that made them would look better than they are: each part of the
        // draws is judged by the tails of the others.
        let part = rows.len().div_ceil(PARTS).max(1);
        let least: Vec<[f64; 2]> = (0..rows.len())
            .step_by(part)
            .flat_map(|start| {
                let (before, from) = rows.split_at(start);
                let (own, after) = from.split_at(part.min(from.len()));
                let tails = Tails::new(before.iter().chain(after));
                let judged = |row: &Vec<f64>| {
                    let (misfit, families) = row.split_last().unwrap_or((&0.0, &[]));
                    let least = tails.smallest_of(families);
                    [least, least.min(tails.misfit.beyond(*misfit))].map(|p| -2.0 * p.ln())
                };
                own.iter().map(judged).collect::<Vec<_>>()
            })
            .collect();
        Self {
            tails: Tails::new(rows.iter()),
            smallest: Tail::new(least.iter().map(|pair| pair[0]).collect()),
            any: Tail::new(least.iter().map(|pair| pair[1]).collect()),
        }
    }

    /// Probability that any family or the misfit as a whole would stand out as much with nothing
    /// there: the one test of whether there is a gap.
    pub fn detection(&self, surprises: &[f64], misfit: f64) -> f64 {
        let least = self
            .tails
            .smallest_of(surprises)
            .min(self.tails.misfit.beyond(misfit))
            .max(f64::MIN_POSITIVE);
        self.any.beyond(-2.0 * least.ln())
    }

    /// Probability that the greatest score of a family would be as great with nothing there.
    pub fn family(&self, family: usize, surprise: f64) -> f64 {
        self.tails.family(family, surprise)
    }

    /// The statistic of so many degrees of freedom whose surprise a family exceeds with a probability.
    pub fn threshold(&self, family: usize, probability: f64, freedom: usize) -> f64 {
        let (mut low, mut high) = (0.0, 1e3);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.family(family, surprise(middle, freedom)) > probability {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// The tail probability of one family at which a gap is detected with a probability.
    pub fn level(&self, probability: f64) -> f64 {
        let (mut low, mut high) = (-700.0, 0.0);
        for _ in 0..60 {
            let middle: f64 = 0.5 * (low + high);
            if self.any.beyond(-2.0 * middle) > probability {
                high = middle;
            } else {
                low = middle;
            }
        }
        low.exp()
    }

    /// Probability that any family would stand out as much, from the greatest scores of all.
    pub fn global(&self, surprises: &[f64]) -> f64 {
        self.smallest
            .beyond(-2.0 * self.tails.smallest_of(surprises).ln())
    }

    /// The same where one family stands out and no other does by more.
    pub fn global_of(&self, family: usize, surprise: f64) -> f64 {
        let least = self.family(family, surprise).max(f64::MIN_POSITIVE);
        self.smallest.beyond(-2.0 * least.ln())
    }
}

/// The greatest score of each family, and last the misfit, in each draw of one batch.
fn greatest(
    model: &AnyModel,
    dictionary: &Dictionary,
    space: &Space,
    (law, spikes): (&NoiseLaw, Option<&Spikes>),
    seed: u64,
    batch: usize,
) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(batch as u64 + 1);
    let mut draws = DMatrix::zeros(space.readings(), BATCH);
    for (k, mut column) in draws.column_iter_mut().enumerate() {
        let noise = law.draw_possible(model, spikes, batch * BATCH + k, &mut random);
        column.copy_from(&(noise + draw_scatter(model, &mut random)));
    }
    let (left, _) = space.forward(draws);
    rows_of(dictionary, space, left)
}

/// The greatest score of each family, and last the misfit, of `BATCH` whitened, projected residuals.
pub(crate) fn rows_of(dictionary: &Dictionary, space: &Space, left: DMatrix<f64>) -> Vec<Vec<f64>> {
    let misfits: Vec<f64> = left.column_iter().map(|c| c.norm_squared()).collect();
    let adjoint = seen(dictionary, space, left);
    let mut rows: Vec<Vec<f64>> = vec![vec![0.0; dictionary.families.len()]; BATCH];
    for family in 0..dictionary.families.len() {
        add_surprises(dictionary, family, &adjoint, &mut rows);
    }
    for (row, misfit) in rows.iter_mut().zip(misfits) {
        row.push(misfit);
    }
    rows
}

/// Sets the surprise of one family in the row of each residual.
pub(crate) fn add_surprises(
    dictionary: &Dictionary,
    family: usize,
    adjoint: &Sums<f32, BATCH>,
    rows: &mut [Vec<f64>],
) {
    for (order, most) in statistics(dictionary, &dictionary.families[family], adjoint) {
        for (row, t) in rows.iter_mut().zip(most) {
            row[family] = row[family].max(surprise(t, order));
        }
    }
}

/// Residuals as signatures see them. Single precision: this is for laws found by drawing, and
/// signatures of which less than 10⁻⁴ is visible are not drawn.
pub(crate) fn seen(dictionary: &Dictionary, space: &Space, left: DMatrix<f64>) -> Sums<f32, BATCH> {
    dictionary.places.sums(space.adjoint(left).as_view())
}

/// The greatest statistic of a family in each residual, by the number of columns: signatures of one,
/// two … columns are weighed each by its own law.
pub(crate) fn statistics(
    dictionary: &Dictionary,
    family: &Family,
    adjoint: &Sums<f32, BATCH>,
) -> BTreeMap<usize, [f64; BATCH]> {
    let mut greatest: BTreeMap<usize, [f64; BATCH]> = BTreeMap::new();
    for entry in &dictionary.entries[family.entries.clone()] {
        let most = greatest.entry(entry.order()).or_insert([0.0; BATCH]);
        let products = entry.products(adjoint);
        let inverse = inverse(&entry.gram);
        for (draw, most) in most.iter_mut().enumerate() {
            let score = |k: usize| f64::from(products[k][draw]);
            let t = if entry.positive && score(0) <= 0.0 {
                0.0
            } else {
                (0..products.len())
                    .flat_map(|i| (0..products.len()).map(move |j| (i, j)))
                    .map(|(i, j)| score(i) * inverse[(i, j)] * score(j))
                    .sum()
            };
            *most = most.max(t);
        }
    }
    greatest
}
