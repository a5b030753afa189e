//! The evidence for a law.

use nalgebra::DMatrix;

use crate::symbolic::bench::tangents;
use crate::symbolic::function::Function;
use crate::symbolic::grammar::Grammar;
use crate::symbolic::view::{Fitted, View};

/// The logarithm of the evidence for a law over that for nothing, by Laplace's method.
///
/// With D what is seen of its parameters, S the standard deviations of their priors and T what it explains it is
/// ½T − ½ ln det(I + S DᵀD S) less ½ for each amplitude. The prior of an amplitude makes of its column alone what
/// the law as a whole explains, that of a shape is its range in the grammar over √12; a step's place is one of
/// as many as there are. All laws of one term have one half of the prior between them, all of two the other.
/// `prior`: ln of the probability of its form. (A shape that the model absorbs is as open afterwards as before, and costs nothing.)
pub(super) fn evidence(grammar: &Grammar, view: &View, fitted: &Fitted, prior: f64) -> Option<f64> {
    let seen = tangents(grammar, view, fitted);
    let amplitudes = fitted.amplitudes.len();
    let mut scales: Vec<f64> = seen
        .column_iter()
        .take(amplitudes)
        .map(|c| fitted.explained.sqrt() / c.norm())
        .collect();
    let mut sum = 0.5 * fitted.explained - 0.5 * amplitudes as f64;
    for term in &fitted.terms {
        let (function, c) = (grammar.function(*term), grammar.coordinate(*term));
        if function == Function::Step {
            sum -= (c.gaps() as f64).ln();
        } else if function.is_shaped() {
            let [low, high] = function.bounds(c);
            scales.push((high - low) / 12f64.sqrt());
        }
    }
    let scaled = DMatrix::from_fn(seen.nrows(), seen.ncols(), |i, j| seen[(i, j)] * scales[j]);
    let whole = DMatrix::identity(seen.ncols(), seen.ncols()) + scaled.tr_mul(&scaled);
    let root = whole.cholesky()?;
    let diagonal = root.l_dirty().diagonal();
    sum -= diagonal.iter().map(|d| d.ln()).sum::<f64>();
    sum += prior;
    sum.is_finite().then_some(sum)
}
