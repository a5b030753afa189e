//! Which of several ways to bind a gap predicts repeats that were held out.

use std::collections::BTreeSet;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;

use crate::detection::space::Space;
use crate::learning::ground::Ground;
use crate::learning::smooth::Smooth;
use crate::levels::{CONFIRMED, NO_WORSE, PLANNED};
use crate::noise::law::NoiseLaw;

/// Ways in which repeats are held out.
const FOLDS: usize = 6;

/// How well a way to bind the gap predicts repeats that were held out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutAlong {
    /// What the curves are functions of.
    pub along: String,
    /// Number of curves.
    pub curves: usize,
    /// Part of the held-out gap, squared, that they predict; below zero: they make it greater.
    pub explained: f64,
    /// By how many standard deviations they predict worse than the best way.
    pub worse: f64,
}

/// All ways on held-out repeats.
pub(super) struct Weighed {
    /// The way that is chosen, by its place, and its size.
    pub chosen: usize,
    pub size: f64,
    /// Every way, the chosen one first.
    pub ways: Vec<HeldOutAlong>,
    /// Part by which the mean square of the held-out residual falls.
    pub fall: f64,
    /// Standard deviations by which it falls.
    pub confirmed: f64,
}

impl Weighed {
    /// Whether repeats that were held out confirm the curves.
    pub fn is_confirmed(&self) -> bool {
        self.confirmed > CONFIRMED
    }
}

/// One way to hold repeats out.
struct Fold {
    learn: Space,
    learn_rows: Vec<usize>,
    test: Space,
    test_rows: Vec<usize>,
    /// What the model alone leaves of either part.
    left: [DVector<f64>; 2],
}

fn folds(model: &AnyModel, law: &NoiseLaw, readings: &DVector<f64>) -> Vec<Fold> {
    let repeats: BTreeSet<u32> = model.places().iter().map(|p| p.repeat).collect();
    let repeats: Vec<u32> = repeats.into_iter().collect();
    // Two repeats are held out together where there are enough: what lies between them shows too. They are
    // not neighbours, so that a function of the time need not be continued far.
    let count = match repeats.len() {
        0 | 1 => 0,
        few @ (2 | 3) => few,
        many => (many / 2).min(FOLDS),
    };
    let held = |fold: usize, t: &usize| {
        let first = model.traces()[*t].start;
        let own = repeats
            .iter()
            .position(|r| *r == model.places()[first].repeat);
        own.is_some_and(|k| k % count == fold)
    };
    let part = |chosen: Vec<usize>| {
        let rows: Vec<usize> = chosen
            .iter()
            .flat_map(|t| model.traces()[*t].clone())
            .collect();
        let space = Space::of_traces_expecting(model, law, &chosen);
        let left = space.forward_vector(&readings.select_rows(&rows));
        (space, rows, left)
    };
    let made = (0..count).into_par_iter().map(|fold| {
        let (test, learn): (Vec<usize>, Vec<usize>) =
            (0..model.traces().len()).partition(|t| held(fold, t));
        let (learn, learn_rows, learnt) = part(learn);
        let (test, test_rows, tested) = part(test);
        Fold {
            learn,
            learn_rows,
            test,
            test_rows,
            left: [learnt, tested],
        }
    });
    made.filter(|fold| fold.test.degrees_of_freedom() > 0)
        .collect()
}

/// A way's predictions of what the model leaves of the held-out repeats, one vector a fold.
fn predicted(
    columns: &DMatrix<f64>,
    prior: &DMatrix<f64>,
    size: f64,
    folds: &[Fold],
) -> Option<Vec<DVector<f64>>> {
    let of = |fold: &Fold| {
        let seen = fold.learn.forward(columns.select_rows(&fold.learn_rows)).0;
        let fit = Smooth::with(&seen, &fold.left[0], prior, size)?;
        let change = columns.select_rows(&fold.test_rows) * fit.coefficients();
        Some(fold.test.forward_vector(&change))
    };
    folds.par_iter().map(of).collect()
}

/// Sums over the folds of |a − b|².
fn apart(a: &[DVector<f64>], b: &[DVector<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum()
}

/// The ways to bind what a space leaves of readings, on held-out repeats. Nothing where there are fewer than
/// two repeats, or where no way sees anything.
///
/// The residual e of a held-out part has unit noise, so of two predictions a and b that are equally far from
/// the truth |e − a|² − |e − b|² has the standard deviation 2 |a − b|. Of the ways that are no worse than the
/// best by more than that, the one of fewest curves is chosen (one standard error: Breiman and others,
/// *Classification and Regression Trees* (1984), 3.4.3).
pub(super) fn weighed(
    model: &AnyModel,
    law: &NoiseLaw,
    space: &Space,
    grounds: &[Ground],
    readings: &DVector<f64>,
) -> Option<Weighed> {
    let folds = folds(model, law, readings);
    if folds.is_empty() {
        return None;
    }
    let residual = space.forward_vector(readings);
    let tried = |(k, ground): (usize, &Ground)| {
        let columns = ground.columns();
        let (seen, prior) = seen_with_prior(space, ground)?;
        let fit = Smooth::likeliest(&seen, &residual, &prior)?;
        Some((k, fit.size, predicted(&columns, &prior, fit.size, &folds)?))
    };
    let ways: Vec<(usize, f64, Vec<DVector<f64>>)> =
        grounds.par_iter().enumerate().filter_map(tried).collect();
    let held: Vec<DVector<f64>> = folds.iter().map(|f| f.left[1].clone()).collect();
    let none: Vec<DVector<f64>> = held.iter().map(|e| DVector::zeros(e.len())).collect();
    let missed: Vec<f64> = ways.iter().map(|way| apart(&held, &way.2)).collect();
    let best = (0..ways.len()).min_by(|a, b| missed[*a].total_cmp(&missed[*b]))?;
    let worse = |a: usize, b: usize| {
        let reach = 2.0 * apart(&ways[a].2, &ways[b].2).sqrt();
        (missed[a] - missed[b]) / reach.max(f64::MIN_POSITIVE)
    };
    let curves = |k: usize| grounds[ways[k].0].curves.len();
    let chosen = (0..ways.len())
        .filter(|k| *k == best || worse(*k, best) <= NO_WORSE)
        // `grounds` begins with what changes least from campaign to campaign.
        .min_by_key(|k| (curves(*k), ways[*k].0))?;
    let before = apart(&held, &none);
    let freedom: usize = folds.iter().map(|f| f.test.degrees_of_freedom()).sum();
    let gap = (before - freedom as f64).max(f64::MIN_POSITIVE);
    let mut order: Vec<usize> = (0..ways.len()).filter(|k| *k != chosen).collect();
    order.sort_by(|a, b| missed[*a].total_cmp(&missed[*b]));
    order.insert(0, chosen);
    let told = |k: &usize| HeldOutAlong {
        along: grounds[ways[*k].0].name(),
        curves: curves(*k),
        explained: ((before - missed[*k]) / gap).clamp(-1.0, 1.0),
        worse: if *k == best { 0.0 } else { worse(*k, best) },
    };
    let size = apart(&ways[chosen].2, &none).sqrt();
    Some(Weighed {
        chosen: ways[chosen].0,
        size: ways[chosen].1,
        ways: order.iter().map(told).collect(),
        fall: (before - missed[chosen]) / before.max(f64::MIN_POSITIVE),
        confirmed: (before - missed[chosen]) / (2.0 * size).max(f64::MIN_POSITIVE),
    })
}

/// What a space sees of a way's coefficients, and those that are of one standard deviation each, without what
/// the model absorbs.
pub(super) fn seen_with_prior(
    space: &Space,
    ground: &Ground,
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let columns = ground.columns();
    let seen = space.forward(columns.clone()).0;
    let mut raw = columns;
    space.whiten(&mut raw);
    let prior = visible_part(&raw, &seen, PLANNED)? * ground.prior()?;
    Some((seen, prior))
}

/// The coefficients less what the model absorbs of them: of all that change the readings' residual alike,
/// those that change the readings least. `raw`: whitened columns; `seen`: these, projected.
///
/// With rawᵀ raw = CᵀC and U the eigenvectors of C⁻ᵀ seenᵀ seen C⁻¹ of which more than `least` is visible,
/// it is C⁻¹ U Uᵀ C.
fn visible_part(raw: &DMatrix<f64>, seen: &DMatrix<f64>, least: f64) -> Option<DMatrix<f64>> {
    let n = raw.ncols();
    let mut whole = raw.tr_mul(raw);
    // Functions that no reading is at.
    let ridge = 1e-10 * whole.trace() / n.max(1) as f64;
    whole += DMatrix::identity(n, n) * ridge;
    let root = whole.cholesky()?.l().transpose();
    let inverse = root.solve_upper_triangular(&DMatrix::identity(n, n))?;
    let scaled = seen * &inverse;
    let eigen = nalgebra::SymmetricEigen::new(scaled.tr_mul(&scaled));
    let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > least).collect();
    let visible = eigen.eigenvectors.select_columns(&kept);
    Some(inverse * &visible * visible.tr_mul(&root))
}
