//! The evidence for a law.

use std::f64::consts::{E, TAU};

use nalgebra::DMatrix;

use crate::diagnosis::symbolic::bench::tangents;
use crate::diagnosis::symbolic::function::Function;
use crate::diagnosis::symbolic::grammar::Grammar;
use crate::diagnosis::symbolic::view::{Fitted, View};

/// The logarithm of the evidence for a law over that for nothing, by Laplace's method.
///
/// With D what is seen of its k parameters and T what it explains it is ½T + ½k ln 2π − ½ ln det DᵀD − Σ ln w, w
/// the width of each parameter's prior: of an amplitude a normal law that makes of its column what the law as a
/// whole explains, of a shape its range in the grammar, of a step's place the number of places; and all forms of
/// one term have one half of the prior between them, all of two the other.
pub(super) fn evidence(
    grammar: &Grammar,
    view: &View,
    fitted: &Fitted,
    forms: usize,
) -> Option<f64> {
    let seen = tangents(grammar, view, fitted);
    let k = seen.ncols();
    let lengths: Vec<f64> = seen.column_iter().map(|c| c.norm()).collect();
    let unit = DMatrix::from_fn(seen.nrows(), k, |i, j| seen[(i, j)] / lengths[j]);
    let root = unit.tr_mul(&unit).cholesky()?;
    let mut sum = 0.5 * fitted.explained + 0.5 * k as f64 * TAU.ln();
    sum -= root
        .l_dirty()
        .diagonal()
        .iter()
        .map(|d| d.ln())
        .sum::<f64>();
    let amplitudes = fitted.amplitudes.len();
    // ln |d| + ln w of an amplitude: its column drops out.
    sum -= amplitudes as f64 * 0.5 * (TAU * E * fitted.explained).ln();
    let mut shape = amplitudes;
    for term in &fitted.terms {
        let (function, c) = (grammar.function(*term), grammar.coordinate(*term));
        if function == Function::Step {
            sum -= (c.gaps() as f64).ln();
        } else if function.is_shaped() {
            let [low, high] = function.bounds(c);
            sum -= lengths[shape].ln() + (high - low).ln();
            shape += 1;
        }
    }
    let forms = forms.max(1) as f64;
    let ways = if fitted.terms.len() == 1 {
        forms
    } else {
        0.5 * forms * forms
    };
    sum -= (2.0 * ways).ln();
    sum.is_finite().then_some(sum)
}
