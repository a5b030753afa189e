//! What else than a law may have made a gap: smooth curves, by their evidence.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use crate::catalogue::curve::Along;
use crate::symbolic::function::Coordinate;
use crate::symbolic::grammar::Grammar;
use crate::symbolic::view::View;

/// *Limit.* Nodes of one curve, and unknowns of all curves together.
const MOST_NODES: usize = 36;
const MOST_UNKNOWNS: usize = 180;
/// Nodes a length, in the middle of the range, without which a curve of that length is not told.
const FINENESS: f64 = 2.5;
/// Lengths of the curves in ranges.
const LENGTHS: [f64; 6] = [1.0, 0.6, 0.35, 0.2, 0.12, 0.07];
/// Sizes among which the likeliest is taken, ln of their square over that of the noise in what is seen best.
const SIZES: [f64; 3] = [-4.0, 26.0, 0.5];
/// Part of the greatest eigenvalue below which a mode is none.
const NONE: f64 = 1e-13;

/// Curves along one coordinate, Gaussian processes of squared-exponential covariance, one for all readings or
/// each of some readings.
struct Ground {
    /// Products of the curves' coefficients with what is seen.
    seen: DMatrix<f64>,
    /// For each length: coefficients of independent modes, and the visible square of each.
    lengths: Vec<(DMatrix<f64>, DVector<f64>)>,
}

/// All smooth curves.
pub(super) struct Smooths(Vec<Ground>);

impl Smooths {
    pub fn new(grammar: &Grammar, view: &View) -> Self {
        let channels = grammar.blocks.iter().any(|b| *b > 1);
        let both =
            grammar.blocks.iter().any(|b| b % 2 == 1) && grammar.blocks.iter().any(|b| b % 2 == 0);
        let mut ways = Vec::new();
        for c in &grammar.coordinates {
            for by_channel in [false, true] {
                for by_direction in [false, true] {
                    let turns = both && c.along == Along::Position;
                    if (channels || !by_channel) && (turns || !by_direction) {
                        ways.push((c, by_channel, by_direction));
                    }
                }
            }
        }
        let made = ways.par_iter().filter_map(|(c, by_channel, by_direction)| {
            let curve = |block: usize| match (by_channel, by_direction) {
                (false, false) => 0,
                (false, true) => block % 2,
                (true, false) => block / 2,
                (true, true) => block,
            };
            let of: Vec<usize> = grammar.blocks.iter().map(|b| curve(*b)).collect();
            Ground::new(c, &of, view)
        });
        Self(made.collect())
    }

    /// The logarithm of the evidence for curves over that for nothing: every way to bind them and every length
    /// with the same prior.
    pub fn evidence(&self, residual: &DVector<f64>) -> f64 {
        let all = self.each(residual);
        let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = all.iter().map(|e| (e - most).exp()).sum();
        if all.is_empty() {
            0.0
        } else {
            most + (sum / all.len() as f64).ln()
        }
    }

    /// The greatest over the ways and lengths; never below zero.
    pub fn greatest(&self, residual: &DVector<f64>) -> f64 {
        self.each(residual).into_iter().fold(0.0, f64::max)
    }

    fn each(&self, residual: &DVector<f64>) -> Vec<f64> {
        self.0
            .par_iter()
            .flat_map_iter(|ground| ground.evidence(residual))
            .collect()
    }
}

impl Ground {
    fn new(c: &Coordinate, curve_of: &[usize], view: &View) -> Option<Self> {
        let mut curves: Vec<usize> = curve_of.to_vec();
        curves.sort_unstable();
        curves.dedup();
        let nodes = nodes(MOST_NODES.min(MOST_UNKNOWNS / curves.len()));
        let each = nodes.len();
        let mut columns = DMatrix::zeros(view.rows.len(), each * curves.len());
        for (k, row) in view.rows.iter().enumerate() {
            let at = curves.binary_search(&curve_of[*row]).ok()?;
            let t = 2.0 * (c.values[*row] - c.low()) / c.range() - 1.0;
            for (j, v) in between(&nodes, t).into_iter().enumerate() {
                columns[(k, at * each + j)] = v;
            }
        }
        let seen = view.space.forward(columns).0;
        let gram = seen.tr_mul(&seen);
        let lengths = LENGTHS
            .iter()
            .filter(|length| **length * each as f64 >= FINENESS)
            .filter_map(|length| modes(&gram, &nodes, 2.0 * length))
            .collect();
        Some(Self { seen, lengths })
    }

    /// With z independent modes of variance τ², visible squares γ² and s their products with the residual, the
    /// logarithm of the evidence is −½ Σ ln(1 + γ²τ²) − τ²s²/(1 + γ²τ²), the noise known; greatest over τ, for
    /// each length.
    fn evidence(&self, residual: &DVector<f64>) -> Vec<f64> {
        let products = self.seen.tr_mul(residual);
        let of_length = |(modes, squares): &(DMatrix<f64>, DVector<f64>)| {
            let score = modes.tr_mul(&products);
            let at = |size: f64| {
                let variance = (size - squares.max().ln()).exp();
                let of = |(square, s): (&f64, &f64)| {
                    let whole = 1.0 + square * variance;
                    variance * s * s / whole - whole.ln()
                };
                0.5 * squares.iter().zip(score.iter()).map(of).sum::<f64>()
            };
            let [first, last, step] = SIZES;
            let count = ((last - first) / step) as usize;
            let sizes = (0..=count).map(|k| first + step * k as f64);
            sizes.map(at).fold(f64::NEG_INFINITY, f64::max)
        };
        self.lengths.iter().map(of_length).collect()
    }
}

/// Chebyshev's nodes in −1 to 1. Between them the polynomial through the values at the nodes follows any curve whose
/// length is well above their distance.
fn nodes(count: usize) -> Vec<f64> {
    let at = |k: usize| (std::f64::consts::PI * (2 * k + 1) as f64 / (2 * count) as f64).cos();
    (0..count).map(at).collect()
}

/// The weights of the values at the nodes at a place, by the barycentric formula of these nodes (Berrut and Trefethen,
/// SIAM Rev. 46 (2004) 501, 5.3).
fn between(nodes: &[f64], t: f64) -> Vec<f64> {
    if let Some(hit) = nodes.iter().position(|node| (t - node).abs() < 1e-14) {
        return (0..nodes.len())
            .map(|k| f64::from(u8::from(k == hit)))
            .collect();
    }
    let part = |(k, node): (usize, &f64)| {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sign * (1.0 - node * node).sqrt() / (t - node)
    };
    let parts: Vec<f64> = nodes.iter().enumerate().map(part).collect();
    let sum: f64 = parts.iter().sum();
    parts.into_iter().map(|p| p / sum).collect()
}

/// Independent modes of curves of one length: values at the nodes one standard deviation each, and their visible
/// squares.
fn modes(gram: &DMatrix<f64>, nodes: &[f64], length: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let each = nodes.len();
    let kernel = DMatrix::from_fn(each, each, |i, j| {
        let apart = (nodes[i] - nodes[j]) / length;
        (-0.5 * apart * apart).exp()
    });
    let eigen = SymmetricEigen::new(kernel);
    let kept = |values: &DVector<f64>| -> Vec<usize> {
        let least = NONE * values.max();
        (0..values.len()).filter(|k| values[*k] > least).collect()
    };
    let own = kept(&eigen.eigenvalues);
    let root = DMatrix::from_fn(each, own.len(), |i, j| {
        eigen.eigenvectors[(i, own[j])] * eigen.eigenvalues[own[j]].sqrt()
    });
    let curves = gram.nrows() / each;
    let mut all = DMatrix::zeros(gram.nrows(), curves * own.len());
    for k in 0..curves {
        all.view_mut((k * each, k * own.len()), (each, own.len()))
            .copy_from(&root);
    }
    let visible = all.tr_mul(&(gram * &all));
    if !(visible.trace() > 0.0 && visible.iter().all(|v| v.is_finite())) {
        return None;
    }
    let eigen = SymmetricEigen::new(visible);
    let seen = kept(&eigen.eigenvalues);
    let squares = DVector::from_iterator(seen.len(), seen.iter().map(|k| eigen.eigenvalues[*k]));
    Some((all * eigen.eigenvectors.select_columns(&seen), squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_between_nodes_is_the_curve() {
        let nodes = nodes(36);
        let curve = |t: f64| (3.0 * t).sin() * (-t).exp() + (t - 0.3).powi(3);
        for k in 0..=40 {
            let t = -1.0 + f64::from(k) / 20.0;
            let weights = between(&nodes, t);
            let found: f64 = nodes.iter().zip(weights).map(|(n, w)| w * curve(*n)).sum();
            // Epsilons: the polynomial of degree 35 is exact to rounding, which its Lebesgue constant of 3 keeps.
            assert!((found - curve(t)).abs() < 1e-12, "{t}: {found}");
        }
    }
}
