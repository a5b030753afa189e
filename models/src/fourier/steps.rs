//! The steps at the joints as unknowns of the fit.
//!
//! On an even grid the waves of the workpiece are orthogonal, so that each order is eliminated by
//! itself and what is left are the normal equations of the steps alone, one unknown a spacing:
//!
//!   A_gh = δ_gh Σ N |H_g|² − Σ_kept N_g N_h Re(H_g* T_g T_h* H_h)/Σ N |T|²
//!   b_g = Σ N_g Re(H_g* M_g) − Σ_kept N_g Re(H_g* T_g F)
//!
//! with H_g the spectrum of a step of one at the joint and F the order's coefficient from M alone. The
//! sums run over all orders of the grid, the second ones over those in which the workpiece is free.
//! Every real part of √N M has the variance σ², so that σ² A⁻¹ is the covariance of the steps.

use super::group::{Group, common, information};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use realfft::num_complex::Complex64;

/// Eigenvalues of the normal equations below this share of the greatest belong to steps that the form
/// takes over entirely: rounding of sums of squares leaves 1e-13 or so.
const UNSEEN: f64 = 1e-9;

/// Fitted steps, one a group; zero for a group without a joint.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    /// A2 − A3 and the rise of the workpiece together, µm.
    pub values: Vec<f64>,
    /// Columns whose sum of outer products is the covariance for unit σ.
    pub roots: Vec<DVector<f64>>,
    /// Steps, or differences of steps, that the readings tell.
    pub rank: usize,
    /// Groups where P3 takes over inside the section.
    pub unknowns: usize,
}

impl Steps {
    /// Standard uncertainty of the step of a group for unit σ.
    pub fn std(&self, group: usize) -> f64 {
        self.roots
            .iter()
            .filter_map(|root| root.get(group))
            .map(|part| part * part)
            .sum::<f64>()
            .sqrt()
    }

    /// Takes over the step of one group that was fitted alone.
    pub fn insert(&mut self, place: usize, alone: &Self) {
        if let (Some(own), Some(value)) = (self.values.get_mut(place), alone.values.first()) {
            *own = *value;
        }
        for root in &alone.roots {
            let mut wide: DVector<f64> = DVector::zeros(self.values.len());
            if let (Some(own), Some(part)) = (wide.get_mut(place), root.get(0)) {
                *own = *part;
            }
            self.roots.push(wide);
        }
        self.rank += alone.rank;
        self.unknowns += alone.unknowns;
    }

    /// No step anywhere.
    pub fn none(groups: usize) -> Self {
        Self {
            values: vec![0.0; groups],
            roots: Vec::new(),
            rank: 0,
            unknowns: 0,
        }
    }
}

/// Fits the steps with the workpiece free in the orders 1 to `form`, by the orders 1 to `upto`. Where
/// `rank` is less than `unknowns` the steps have the least norm.
pub(super) fn fit_steps(groups: &[Group], form: usize, upto: usize) -> Steps {
    let places: Vec<usize> = (0..groups.len())
        .filter(|&g| groups.get(g).is_some_and(Group::has_step))
        .collect();
    if places.is_empty() {
        return Steps::none(groups.len());
    }
    let count = places.len();
    let own: Vec<&Group> = places.iter().filter_map(|&g| groups.get(g)).collect();
    let nothing = vec![0.0; groups.len()];
    let mut a = DMatrix::<f64>::zeros(count, count);
    let mut b = DVector::<f64>::zeros(count);
    let highest = own.iter().map(|g| g.highest()).max().unwrap_or(0).min(upto);
    for order in 1..=highest {
        let kept = if order <= form {
            information(groups, order, |_| true).zip(common(groups, &nothing, order))
        } else {
            None
        };
        // √N H* T of each group, the part of a step that the workpiece takes over.
        let mut taken = Vec::with_capacity(count);
        for (i, g) in own.iter().enumerate() {
            let (Some(step), Some(passed)) = (g.step.get(order), g.transfer.get(order)) else {
                taken.push(Complex64::default());
                continue;
            };
            let mut left = g.mean.get(order).copied().unwrap_or_default();
            if let Some((_, coefficient)) = kept {
                left -= passed * coefficient;
            }
            a[(i, i)] += g.weight() * step.norm_sqr();
            b[i] += g.weight() * (step.conj() * left).re;
            taken.push(g.weight() * step.conj() * passed);
        }
        if let Some((information, _)) = kept {
            for (i, left) in taken.iter().enumerate() {
                for (j, right) in taken.iter().enumerate() {
                    a[(i, j)] -= (left * right.conj()).re / information;
                }
            }
        }
    }
    let scale: f64 = own
        .iter()
        .map(|g| g.weight() * g.step.iter().skip(1).map(Complex64::norm_sqr).sum::<f64>())
        .fold(0.0, f64::max);
    let eigen = SymmetricEigen::new(a);
    let mut values = vec![0.0; groups.len()];
    let mut roots = Vec::new();
    for (value, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if !(*value > UNSEEN * scale) {
            continue;
        }
        let amount = vector.dot(&b) / value;
        let mut root: DVector<f64> = DVector::zeros(groups.len());
        for (&place, part) in places.iter().zip(vector.iter()) {
            if let Some(sum) = values.get_mut(place) {
                *sum += amount * part;
            }
            if let Some(own) = root.get_mut(place) {
                *own = part / value.sqrt();
            }
        }
        roots.push(root);
    }
    Steps {
        values,
        rank: roots.len(),
        unknowns: count,
        roots,
    }
}

/// Σ N |M − T F − step H|² over the orders 1 to `upto` with the workpiece free in all of them, and its
/// degrees of freedom: what the spacings disagree by, whatever the form.
pub(super) fn disagreement(groups: &[Group], upto: usize) -> (f64, f64) {
    let steps = fit_steps(groups, upto, upto);
    let (mut sum, mut freedom) = (0.0, 0.0);
    for order in 1..=upto {
        let form = common(groups, &steps.values, order);
        for (g, &step) in groups.iter().zip(&steps.values) {
            let (Some(left), Some(passed)) = (g.without_step(order, step), g.transfer.get(order))
            else {
                continue;
            };
            sum += g.weight() * (left - passed * form.unwrap_or_default()).norm_sqr();
            freedom += 2.0;
        }
        if form.is_some() {
            freedom -= 2.0;
        }
    }
    (sum, freedom - steps.rank as f64)
}
