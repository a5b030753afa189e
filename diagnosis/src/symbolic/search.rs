//! Laws of one term and of two that explain most of a residual.

use nalgebra::{DMatrix, DVector};

use crate::detection::dictionary::surprise;
use crate::symbolic::grammar::{Grammar, Term};
use crate::symbolic::lens::{Lens, Spot, beside, unit};
use crate::symbolic::view::{Fitted, View};

/// Kinds of a first term, and of second ones beside each, that are followed.
const FIRSTS: usize = 10;
const SECONDS: usize = 5;
/// Patterns of a kind that are refined: between two places of the grid another may explain more.
const PATTERNS: usize = 4;
/// Pairs that are refined, and rounds in which either term may be exchanged.
const PAIRS: usize = 14;
const ROUNDS: usize = 2;
/// Pairs that are begun from in a round.
const BEGUN: usize = 2;
/// What a candidate may explain less than the best, in squares of the noise: an allowance and a part.
const WITHIN: (f64, f64) = (60.0, 0.05);

/// A grammar with its grid in the repeats that a law is chosen on.
pub(super) struct Search<'a> {
    pub grammar: &'a Grammar,
    pub lens: &'a Lens,
    pub view: &'a View,
}

impl Search<'_> {
    /// The greatest surprise of one term and of the second beside it, on the grid, of several residuals.
    pub fn surprises(&self, residuals: DMatrix<f64>) -> Vec<f64> {
        let first = self.lens.products(self.view, residuals.clone());
        let of = |k: usize| {
            let most = self.lens.greatest(&first, k, &[]);
            let best = most.into_iter().flatten();
            let Some(best) = best.max_by(|a, b| a.surprise.total_cmp(&b.surprise)) else {
                return 0.0;
            };
            let residual = residuals.column(k).clone_owned();
            let Some((left, basis)) = self.left(&[best.term], &residual) else {
                return best.surprise;
            };
            let (products, others) = self.beside(&left, &basis);
            let order = self.grammar.order(&[best.term]);
            let pairs = self
                .lens
                .greatest(&products, 0, &others)
                .into_iter()
                .flatten();
            let two = pairs.map(|s| {
                surprise(
                    best.statistic + s.statistic,
                    order + self.grammar.order(&[s.term]),
                )
            });
            two.fold(best.surprise, f64::max)
        };
        (0..residuals.ncols()).map(of).collect()
    }

    /// What terms leave of a residual, and the unit vectors of what they explain.
    fn left(
        &self,
        terms: &[Term],
        residual: &DVector<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let basis = unit(&self.view.seen(self.grammar, terms)?);
        Some((beside(residual, &basis), basis))
    }

    fn beside(
        &self,
        left: &DVector<f64>,
        basis: &DMatrix<f64>,
    ) -> (crate::symbolic::lens::Products, Vec<usize>) {
        let vectors = basis.clone().insert_column(0, 0.0);
        let mut vectors = vectors;
        vectors.column_mut(0).copy_from(left);
        let others = (1..vectors.ncols()).collect();
        (self.lens.products(self.view, vectors), others)
    }

    /// The best forms of a further term beside some, no kind of function twice.
    fn further(&self, terms: &[Term], residual: &DVector<f64>, count: usize) -> Vec<Spot> {
        let Some((left, basis)) = self.left(terms, residual) else {
            return Vec::new();
        };
        let (products, others) = self.beside(&left, &basis);
        let mut spots = self.lens.forms_by_surprise(&products, 0, &others);
        let joins = |s: &Spot| terms.iter().all(|t| self.grammar.may_join(*t, s.term));
        spots.retain(joins);
        different(spots, count)
    }

    /// Laws of one term of each kind, refined: of the patterns of a kind those that explain most on the grid.
    pub fn singles(&self, residual: &DVector<f64>) -> Vec<Fitted> {
        let only = DMatrix::from_columns(std::slice::from_ref(residual));
        let products = self.lens.products(self.view, only);
        let spots = self.lens.forms_by_surprise(&products, 0, &[]);
        let firsts = different(spots.clone(), FIRSTS);
        let of_kind = |first: &Spot| {
            let kind = first.term.kind;
            let own = spots.iter().filter(move |s| s.term.kind == kind);
            own.take(PATTERNS)
                .filter_map(|s| self.view.refined(self.grammar, &[s.term], residual))
                .max_by(|a, b| a.explained.total_cmp(&b.explained))
        };
        firsts.iter().filter_map(of_kind).collect()
    }

    /// Laws that explain nearly as much as the best, refined, each form once.
    pub fn candidates(&self, residual: &DVector<f64>) -> Vec<Fitted> {
        let refined = |terms: &[Term]| self.view.refined(self.grammar, terms, residual);
        let singles = self.singles(residual);
        let mut coarse: Vec<(f64, [Term; 2])> = Vec::new();
        for first in &singles {
            let term = first.terms[0];
            for second in self.further(&[term], residual, SECONDS) {
                coarse.push((first.explained + second.statistic, [term, second.term]));
            }
        }
        coarse.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut pairs: Vec<Fitted> = Vec::new();
        add(
            &mut pairs,
            coarse
                .iter()
                .take(PAIRS)
                .filter_map(|(_, terms)| refined(terms)),
        );
        for _ in 0..ROUNDS {
            let best = pairs.first().map_or(0.0, |p| p.explained);
            let mut coarse: Vec<(f64, [Term; 2])> = Vec::new();
            for pair in pairs.iter().take(BEGUN) {
                for kept in &pair.terms {
                    let Some(alone) = self.view.fitted(self.grammar, &[*kept], residual) else {
                        continue;
                    };
                    for other in self.further(&[*kept], residual, SECONDS) {
                        coarse.push((alone.explained + other.statistic, [*kept, other.term]));
                    }
                }
            }
            let known = |terms: &[Term; 2]| pairs.iter().any(|p| same(&p.terms, terms));
            coarse.retain(|(_, terms)| !known(terms));
            coarse.sort_by(|a, b| b.0.total_cmp(&a.0));
            let found: Vec<Fitted> = coarse
                .iter()
                .take(PAIRS / 2)
                .filter_map(|(_, terms)| refined(terms))
                .collect();
            add(&mut pairs, found.into_iter());
            if pairs.first().is_none_or(|p| p.explained < best + 1.0) {
                break;
            }
        }
        let mut all = singles;
        all.extend(pairs);
        let best = all.iter().map(|f| f.explained).fold(0.0, f64::max);
        let least = best - WITHIN.0 - WITHIN.1 * best;
        all.retain(|f| f.explained >= least);
        all
    }
}

/// The best spot of each kind of function, the greatest first.
fn different(spots: Vec<Spot>, count: usize) -> Vec<Spot> {
    let mut kept: Vec<Spot> = Vec::new();
    for spot in spots {
        if kept.len() == count {
            break;
        }
        if !kept.iter().any(|k| k.term.kind == spot.term.kind) {
            kept.push(spot);
        }
    }
    kept
}

fn same(a: &[Term], b: &[Term]) -> bool {
    let (mut a, mut b): (Vec<_>, Vec<_>) = (
        a.iter().map(|t| t.form()).collect(),
        b.iter().map(|t| t.form()).collect(),
    );
    a.sort_unstable();
    b.sort_unstable();
    a == b
}

/// Adds laws, of each form the one that explains most, in the order of what they explain.
fn add(all: &mut Vec<Fitted>, more: impl Iterator<Item = Fitted>) {
    for law in more {
        match all.iter_mut().find(|known| same(&known.terms, &law.terms)) {
            Some(known) if known.explained < law.explained => *known = law,
            Some(_) => {}
            None => all.push(law),
        }
    }
    all.sort_by(|a, b| b.explained.total_cmp(&a.explained));
}
