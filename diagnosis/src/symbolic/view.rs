//! Readings of some repeats in units of their noise, and laws fitted to them.

use std::collections::BTreeSet;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::detection::space::Space;
use crate::levels::INVISIBLE;
use crate::noise::law::NoiseLaw;
use crate::search::{Reach, coordinate_search};
use crate::symbolic::function::Function;
use crate::symbolic::grammar::{Grammar, Term};

/// Part of its visible square that a column must keep beside those before it.
const APART: f64 = 1e-4;
/// How far apart from the grid shapes are refined, and how closely.
const REACH: Reach = Reach {
    last: 1e-3,
    ..Reach::WIDE
};
/// Places of a step that are tried on the way to the best between two of the grid.
const PLACES: usize = 24;
/// Rounds of refining smooth shapes and places of steps in turn.
const ROUNDS: usize = 2;

/// Some repeats, seen beside what the model absorbs of them alone.
pub(super) struct View {
    pub space: Space,
    pub rows: Vec<usize>,
}

/// Terms fitted to the readings of a view.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub terms: Vec<Term>,
    pub amplitudes: DVector<f64>,
    /// What they explain, in squares of the noise.
    pub explained: f64,
}

/// Every second repeat and the others, chosen on and held out, both ways; nothing where there are fewer than two.
/// Neighbours are parted, so that a function of the time need not be continued far.
pub(super) fn halves(model: &AnyModel, law: &NoiseLaw) -> Option<[[View; 2]; 2]> {
    let places = model.places();
    let repeats: BTreeSet<u32> = places.iter().map(|p| p.repeat).collect();
    if repeats.len() < 2 {
        return None;
    }
    let second: BTreeSet<u32> = repeats.into_iter().skip(1).step_by(2).collect();
    let held = |t: &usize| second.contains(&places[model.traces()[*t].start].repeat);
    let (held, chosen): (Vec<usize>, Vec<usize>) = (0..model.traces().len()).partition(held);
    let view = |traces: &[usize]| View {
        rows: traces
            .iter()
            .flat_map(|t| model.traces()[*t].clone())
            .collect(),
        space: Space::of_traces_expecting(model, law, traces),
    };
    let way = |a: &[usize], b: &[usize]| [view(a), view(b)];
    let ways = [way(&chosen, &held), way(&held, &chosen)];
    let tells = |view: &View| view.space.degrees_of_freedom() > 0;
    ways[0].iter().all(tells).then_some(ways)
}

impl View {
    /// All readings of a model.
    pub fn whole(model: &AnyModel, law: &NoiseLaw) -> Self {
        Self {
            rows: (0..model.places().len()).collect(),
            space: Space::expecting(model, law),
        }
    }

    /// What the model leaves of all readings, of those seen here.
    pub fn residual(&self, readings: &DVector<f64>) -> DVector<f64> {
        self.space.forward_vector(&readings.select_rows(&self.rows))
    }

    /// The terms' columns as they are seen here; nothing where one is not seen.
    pub fn seen(&self, grammar: &Grammar, terms: &[Term]) -> Option<DMatrix<f64>> {
        let (seen, sizes) = self.space.forward(grammar.columns(terms, &self.rows));
        let shows = |(column, size): (nalgebra::DVectorView<'_, f64>, &f64)| {
            column.norm_squared() > INVISIBLE * size * size
        };
        let finite = seen.iter().all(|v| v.is_finite());
        (finite && seen.column_iter().zip(&sizes).all(shows)).then_some(seen)
    }

    /// The amplitudes of terms; nothing where these readings do not tell them apart.
    pub fn fitted(
        &self,
        grammar: &Grammar,
        terms: &[Term],
        residual: &DVector<f64>,
    ) -> Option<Fitted> {
        let seen = self.seen(grammar, terms)?;
        let lengths: Vec<f64> = seen.column_iter().map(|c| c.norm()).collect();
        let unit = DMatrix::from_fn(seen.nrows(), seen.ncols(), |i, j| seen[(i, j)] / lengths[j]);
        let root = unit.tr_mul(&unit).cholesky()?;
        if root.l_dirty().diagonal().iter().any(|d| d * d < APART) {
            return None;
        }
        let score = unit.tr_mul(residual);
        let mut amplitudes = root.solve(&score);
        let explained = amplitudes.dot(&score);
        amplitudes
            .iter_mut()
            .zip(&lengths)
            .for_each(|(a, l)| *a /= l);
        Some(Fitted {
            terms: terms.to_vec(),
            amplitudes,
            explained,
        })
    }

    /// The same with shapes refined.
    pub fn refined(
        &self,
        grammar: &Grammar,
        terms: &[Term],
        residual: &DVector<f64>,
    ) -> Option<Fitted> {
        let mut best = self.fitted(grammar, terms, residual)?;
        let steps = terms.iter().any(|t| grammar.function(*t) == Function::Step);
        let rounds = if steps { ROUNDS } else { 1 };
        for _ in 0..rounds {
            for k in 0..terms.len() {
                if grammar.function(terms[k]) == Function::Step {
                    best = self.step_placed(grammar, best, k, residual);
                }
            }
            best = self.smoothly(grammar, best, residual);
        }
        Some(best)
    }

    fn smoothly(&self, grammar: &Grammar, start: Fitted, residual: &DVector<f64>) -> Fitted {
        let smooth = |t: &Term| {
            let function = grammar.function(*t);
            function.is_shaped() && function != Function::Step
        };
        let moved: Vec<usize> = (0..start.terms.len())
            .filter(|k| smooth(&start.terms[*k]))
            .collect();
        if moved.is_empty() {
            return start;
        }
        let put = |shapes: &[f64]| {
            let mut terms = start.terms.clone();
            for (k, shape) in moved.iter().zip(shapes) {
                terms[*k].shape = *shape;
            }
            terms
        };
        let allowed = |term: Term| {
            let [low, high] = grammar.function(term).bounds(grammar.coordinate(term));
            term.shape >= low && term.shape <= high
        };
        let value = |shapes: &[f64]| {
            let terms = put(shapes);
            if !terms.iter().filter(|t| smooth(t)).all(|t| allowed(*t)) {
                return f64::INFINITY;
            }
            let fit = self.fitted(grammar, &terms, residual);
            fit.map_or(f64::INFINITY, |f| -f.explained)
        };
        let shapes: Vec<f64> = moved.iter().map(|k| start.terms[*k].shape).collect();
        let step = |k: &usize| {
            let term = start.terms[*k];
            0.5 * grammar.function(term).step(grammar.coordinate(term))
        };
        let steps: Vec<f64> = moved.iter().map(step).collect();
        let (found, _) = coordinate_search(&shapes, &steps, REACH, value);
        self.fitted(grammar, &put(&found), residual)
            .unwrap_or(start)
    }

    /// A step moved to where it explains most, among all places between readings on the way to the next of the
    /// grid.
    fn step_placed(
        &self,
        grammar: &Grammar,
        start: Fitted,
        which: usize,
        residual: &DVector<f64>,
    ) -> Fitted {
        let term = start.terms[which];
        let c = grammar.coordinate(term);
        let mut reach = Function::Step.step(c);
        let mut best = start;
        loop {
            let centre = best.terms[which].shape;
            let places = c.between(centre - reach, centre + reach);
            let each = places.len().div_ceil(PLACES).max(1);
            for place in places.iter().step_by(each) {
                let mut terms = best.terms.clone();
                terms[which].shape = *place;
                let fit = self.fitted(grammar, &terms, residual);
                if let Some(fit) = fit.filter(|f| f.explained > best.explained) {
                    best = fit;
                }
            }
            if each == 1 {
                return best;
            }
            reach = 2.0 * reach * each as f64 / places.len() as f64;
        }
    }
}
