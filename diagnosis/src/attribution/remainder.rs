//! What remains beside causes, and whether it is more than noise.

use std::sync::OnceLock;

use errsep_models::model::Shape;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context, span};
use crate::attribution::doubt::{DRAWS, Doubt, FEW_DRAWS};
use crate::detection::basis::inner_products;
use crate::detection::dictionary::{Entry, Meaning, statistic, surprise};
use crate::detection::folding::Sums;
use crate::levels::{ADEQUATE, FAR, PAST_DOUBT, SEPARABLE, SUSPECT};

/// Vectors that signatures are multiplied with at once.
const WIDTH: usize = 8;

/// What remains beside some causes.
pub(crate) struct Remainder {
    pub residual: DVector<f64>,
    /// Its square, as far as it is trusted.
    pub square: f64,
    /// The residual as it is trusted, then the directions that are not looked along, as signatures see
    /// them.
    seen: Vec<Sums<f64, WIDTH>>,
    directions: usize,
    /// Families that stood out before it was doubted, and the entries where they did.
    suspects: Vec<(usize, usize)>,
    /// Greatest score of each family and the entry where it is, once it has been asked for.
    best: Vec<OnceLock<(f64, Option<usize>)>>,
}

impl Context<'_> {
    /// Scores of everything beside some causes.
    pub fn remainder(&self, readings: &DVector<f64>, causes: &[Cause]) -> Remainder {
        let basis = span(causes, self.space.readings());
        self.scores(readings, &basis, &Doubt::default())
    }

    /// The same with the doubt about the state at which the causes' signatures are taken, where
    /// that can make the difference.
    pub fn judged(&self, readings: &DVector<f64>, causes: &[Cause]) -> Remainder {
        self.judged_by(readings, causes, DRAWS)
    }

    /// The same with the doubt by a number of draws of the state.
    pub fn judged_by(&self, readings: &DVector<f64>, causes: &[Cause], draws: usize) -> Remainder {
        let plain = self.remainder(readings, causes);
        if causes.is_empty() || self.adequate(causes, &plain) {
            return plain;
        }
        if draws > FEW_DRAWS {
            let Some(few) = self.doubted(readings, causes, &plain, FEW_DRAWS) else {
                return plain;
            };
            if self.suspected(&few, PAST_DOUBT * least_chance(causes)) {
                return few;
            }
        }
        let all = self.doubted(readings, causes, &plain, draws);
        all.unwrap_or(plain)
    }

    /// What remains beside causes, with the doubt about the state; nothing where that excuses none of it.
    fn doubted(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        plain: &Remainder,
        draws: usize,
    ) -> Option<Remainder> {
        let basis = span(causes, self.space.readings());
        let freedom = self.space.degrees_of_freedom() as f64;
        let most = freedom + FAR * (2.0 * freedom).sqrt();
        let mut open = self.open(readings, causes);
        let along = inner_products(&basis, &open);
        open.gemm(-1.0, &basis, &along, 1.0);
        let far = |residual: &DVector<f64>| plain.residual.dot(residual) > most;
        if far(&plain.residual) && far(&Doubt::of_open(&open).trusted(&plain.residual)) {
            return None;
        }
        let doubt = self.doubt(readings, (causes, &basis), open, draws);
        (!doubt.weights.is_empty()).then(|| {
            let mut left = self.scores(readings, &basis, &doubt);
            let known = plain.best.iter().enumerate();
            let known = known.filter_map(|(family, best)| Some((family, best.get()?.1?)));
            left.suspects = known.collect();
            left
        })
    }

    /// Probability that as much would stand out with nothing there: in any effect, at any place or
    /// in the misfit as a whole.
    pub fn detection(&self, left: &Remainder) -> f64 {
        self.null.detection(&self.surprises(left), left.square)
    }

    /// Probability that as much as causes leave would stand out with nothing else there, with the doubt about the
    /// state where that can make the difference.
    pub fn chance_beside(&self, readings: &DVector<f64>, causes: &[Cause]) -> f64 {
        let plain = self.remainder(readings, causes);
        let chance = self.detection(&plain);
        if chance > SUSPECT {
            return chance;
        }
        let doubted = self.doubted(readings, causes, &plain, DRAWS);
        doubted.map_or(chance, |left| self.detection(&left))
    }

    /// Probability that any family would stand out as much with nothing else there.
    pub fn global(&self, remainder: &Remainder) -> f64 {
        self.null.global(&self.surprises(remainder))
    }

    /// Whether causes leave nothing that stands out.
    pub fn adequate(&self, causes: &[Cause], left: &Remainder) -> bool {
        self.exceeds(left, least_chance(causes))
    }

    /// Whether an effect stands out beside causes, by what they leave.
    pub fn stands_out(&self, left: &Remainder, causes: &[Cause], effect: usize) -> bool {
        self.family_of(effect).is_some_and(|family| {
            self.null.global_of(family, self.best(left, family).0) <= least_chance(causes)
        })
    }

    /// Whether as much as remains of any family would stand out with nothing there in more than a part of all cases.
    fn exceeds(&self, left: &Remainder, least: f64) -> bool {
        let mut families = 0..self.dictionary.families.len();
        // The probability of all falls with that of each.
        !self.suspected(left, least)
            && families.all(|k| self.null.global_of(k, self.best(left, k).0) > least)
    }

    /// Whether, of what stood out before it was doubted, as much would stand out with nothing there in no more than a
    /// part of all cases.
    fn suspected(&self, left: &Remainder, least: f64) -> bool {
        left.suspects.iter().any(|(family, entry)| {
            let surprise = self.surprise(&self.dictionary.entries[*entry], left);
            self.null.global_of(*family, surprise) <= least
        })
    }

    /// Greatest score of a family beside what the remainder is beside, and the entry where it is.
    pub fn best(&self, remainder: &Remainder, family: usize) -> (f64, Option<usize>) {
        let known = &remainder.best[family];
        if let Some(best) = known.get() {
            return *best;
        }
        // Not held locked meanwhile: a thread that waits for the others' share of the search may be given
        // a task that asks for the same.
        let best = self.greatest(remainder, family);
        let _ = known.set(best);
        best
    }

    fn surprises(&self, remainder: &Remainder) -> Vec<f64> {
        let families = 0..self.dictionary.families.len();
        families.map(|k| self.best(remainder, k).0).collect()
    }

    fn greatest(&self, remainder: &Remainder, family: usize) -> (f64, Option<usize>) {
        let range = self.dictionary.families[family].entries.clone();
        let surprise_of = |k: usize| (self.surprise(&self.dictionary.entries[k], remainder), k);
        range
            .into_par_iter()
            .map(surprise_of)
            .filter(|(surprise, _)| *surprise > 0.0)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map_or((0.0, None), |(surprise, k)| (surprise, Some(k)))
    }

    fn surprise(&self, entry: &Entry, remainder: &Remainder) -> f64 {
        let products: Vec<Vec<[f64; WIDTH]>> =
            remainder.seen.iter().map(|s| entry.products(s)).collect();
        let product = |k: usize, j: usize| products[j / WIDTH][k][j % WIDTH];
        let score = DVector::from_fn(entry.order(), |k, _| product(k, 0));
        if remainder.directions == 0 {
            return surprise(
                statistic(&entry.gram, &score, entry.positive),
                entry.order(),
            );
        }
        let overlap = DMatrix::from_fn(entry.order(), remainder.directions, |k, j| {
            product(k, j + 1)
        });
        let left = &entry.gram - &overlap * overlap.transpose();
        if left.trace() < SEPARABLE * entry.gram.trace() {
            return 0.0;
        }
        surprise(statistic(&left, &score, entry.positive), entry.order())
    }

    fn scores(&self, readings: &DVector<f64>, basis: &DMatrix<f64>, doubt: &Doubt) -> Remainder {
        let whole = self.residual(readings);
        let residual = &whole - basis * basis.tr_mul(&whole);
        let trusted = doubt.trusted(&residual);
        let mut spans: Vec<DVector<f64>> = basis.column_iter().map(|c| c.clone_owned()).collect();
        // A part w of a product is taken away by √w of the direction.
        let halves = doubt.directions.iter().zip(&doubt.weights);
        spans.extend(halves.map(|(direction, weight)| direction * weight.sqrt()));
        let directions = spans.len();
        spans.insert(0, trusted);
        let adjoint = self.space.adjoint(DMatrix::from_columns(&spans));
        let batches = (0..adjoint.ncols()).step_by(WIDTH);
        let seen = batches.map(|from| {
            let width = WIDTH.min(adjoint.ncols() - from);
            self.dictionary
                .places
                .sums(adjoint.columns(from, width).as_view())
        });
        Remainder {
            square: residual.dot(&spans[0]),
            residual,
            seen: seen.collect(),
            directions,
            suspects: Vec::new(),
            best: vec![OnceLock::new(); self.dictionary.families.len()],
        }
    }

    /// The start of an effect's search beside other causes: the best entry of its family.
    pub fn start(&self, remainder: &Remainder, effect: usize) -> Option<&Shape> {
        let family = self.family_of(effect)?;
        let entry = self.best(remainder, family).1?;
        match &self.dictionary.entries[entry].meaning {
            Meaning::Effect(shape) => Some(shape),
            Meaning::Place(_) => None,
        }
    }

    /// Tail probability of an effect's greatest score.
    pub fn p_value(&self, remainder: &Remainder, effect: usize) -> f64 {
        self.family_of(effect)
            .map_or(1.0, |f| self.null.family(f, self.best(remainder, f).0))
    }
}

/// Probability of what remains above which causes are adequate.
fn least_chance(causes: &[Cause]) -> f64 {
    ADEQUATE[causes.len().clamp(1, ADEQUATE.len()) - 1]
}
