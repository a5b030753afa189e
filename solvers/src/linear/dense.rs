//! The dense linear model: pivoted QR of the Jacobian, optionally the SVD of its triangle.

use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::jacobi_svd::JacobiSvd;
use super::pivoted_qr::{PivotedQr, norm};
use super::triangle::Triangle;
use super::{DampedStep, LinearModel};

/// How a dense Jacobian is decomposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Factorization {
    /// Householder QR with column pivoting: the fast and usual way.
    #[default]
    Qr,
    /// The singular value decomposition of the QR's triangle: where rank is lacking the step is
    /// the shortest one (in columns scaled to unit length) instead of a basic one.
    Svd,
}

/// A dense Jacobian and residuals, factored.
#[derive(Debug, Clone)]
pub struct DenseModel {
    /// `None` for a model restricted to some of the parameters: its rows are those of a triangle.
    qr: Option<PivotedQr>,
    triangle: Triangle,
    /// Qᵀ r, first n entries.
    rhs: DVector<f64>,
    gradient: DVector<f64>,
    norms: DVector<f64>,
    factorization: Factorization,
    rank_tolerance: f64,
    svd: RefCell<Option<ScaledSvd>>,
}

/// The decomposition of J D⁻¹ for the D it was asked with last.
#[derive(Debug, Clone)]
struct ScaledSvd {
    scale: DVector<f64>,
    svd: JacobiSvd,
}

impl DenseModel {
    /// Factors `jacobian` (m × n, m ≥ n) in its own storage, for residuals of length m.
    ///
    /// Columns are first scaled to unit length; singular values below `rank_tolerance` times the
    /// largest count as zero.
    pub fn new(
        mut jacobian: DMatrix<f64>,
        residuals: &DVector<f64>,
        factorization: Factorization,
        rank_tolerance: f64,
    ) -> Self {
        let n = jacobian.ncols();
        let norms = DVector::from_fn(n, |j, _| norm(jacobian.column(j).as_slice()));
        let units = norms.map(|length| if length > 0.0 { length } else { 1.0 });
        for (mut column, unit) in jacobian.column_iter_mut().zip(units.iter()) {
            column /= *unit;
        }
        let qr = PivotedQr::new(jacobian);
        let triangle = Triangle::new(qr.upper(), qr.permutation().to_vec(), units, rank_tolerance);
        let mut projected = residuals.clone();
        qr.apply_transposed(&mut projected);
        let rhs = leading(&projected, n);
        Self::assemble(
            Some(qr),
            triangle,
            rhs,
            norms,
            factorization,
            rank_tolerance,
        )
    }

    fn assemble(
        qr: Option<PivotedQr>,
        triangle: Triangle,
        rhs: DVector<f64>,
        norms: DVector<f64>,
        factorization: Factorization,
        rank_tolerance: f64,
    ) -> Self {
        let gradient = triangle.transposed_product(&rhs);
        Self {
            qr,
            triangle,
            rhs,
            gradient,
            norms,
            factorization,
            rank_tolerance,
            svd: RefCell::new(None),
        }
    }

    /// The triangle and column scale, for covariances.
    pub fn triangle(&self) -> &Triangle {
        &self.triangle
    }

    /// The step by singular values: −D⁻¹ V diag(σ / (σ² + λ)) Uᵀ c.
    fn spectral_step(&self, c: &DVector<f64>, damping: f64, scale: &DVector<f64>) -> DampedStep {
        let mut cache = self.svd.borrow_mut();
        let scaled = match cache.take() {
            Some(known) if known.scale == *scale => known,
            _ => ScaledSvd {
                scale: scale.clone(),
                svd: self.triangle.transposed_svd(scale),
            },
        };
        let svd = &scaled.svd;
        let floor = self.rank_tolerance * svd.values.iter().copied().next().unwrap_or(0.0);
        let mut coefficients = svd.right.tr_mul(c);
        for (value, &sigma) in coefficients.iter_mut().zip(svd.values.iter()) {
            *value = if sigma > floor {
                -*value * sigma / (sigma * sigma + damping)
            } else {
                0.0
            };
        }
        let length = coefficients.norm();
        let slope = if length > 0.0 {
            coefficients
                .iter()
                .zip(svd.values.iter())
                .filter(|&(_, &sigma)| sigma > floor)
                .map(|(a, sigma)| (a / length).powi(2) / (sigma * sigma + damping))
                .sum()
        } else {
            0.0
        };
        let step = (&svd.left * coefficients).component_div(scale);
        *cache = Some(scaled);
        DampedStep { step, slope }
    }

    fn damped(&self, c: &DVector<f64>, damping: f64, scale: &DVector<f64>) -> DampedStep {
        match self.factorization {
            Factorization::Qr => self.triangle.damped_step(c, damping, scale),
            Factorization::Svd => self.spectral_step(c, damping, scale),
        }
    }
}

impl LinearModel for DenseModel {
    fn parameter_count(&self) -> usize {
        self.triangle.order()
    }

    fn gradient(&self) -> &DVector<f64> {
        &self.gradient
    }

    fn column_norms(&self) -> &DVector<f64> {
        &self.norms
    }

    fn rank(&self) -> usize {
        self.triangle.rank()
    }

    fn undamped_step(&self) -> DVector<f64> {
        match self.factorization {
            Factorization::Qr => self.triangle.basic_step(&self.rhs),
            Factorization::Svd => {
                self.spectral_step(&self.rhs, 0.0, self.triangle.units())
                    .step
            }
        }
    }

    fn damped_step(&self, damping: f64, scale: &DVector<f64>) -> DampedStep {
        self.damped(&self.rhs, damping, scale)
    }

    fn image_norm(&self, step: &DVector<f64>) -> f64 {
        self.triangle.product(step).norm()
    }

    fn null_space(&self) -> DMatrix<f64> {
        self.triangle.null_space()
    }

    fn image(&self, direction: &DVector<f64>) -> Option<DVector<f64>> {
        let qr = self.qr.as_ref()?;
        let mut image = self
            .triangle
            .product(direction)
            .resize_vertically(qr.rows(), 0.0);
        qr.apply(&mut image);
        Some(image)
    }

    fn step_for(
        &self,
        residuals: &DVector<f64>,
        damping: f64,
        scale: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let qr = self.qr.as_ref()?;
        let mut projected = residuals.clone();
        qr.apply_transposed(&mut projected);
        let c = leading(&projected, self.parameter_count());
        Some(if damping > 0.0 {
            self.damped(&c, damping, scale).step
        } else {
            self.triangle.basic_step(&c)
        })
    }

    fn restricted(&self, free: &[usize], shift: &DVector<f64>) -> Option<Self> {
        let n = self.parameter_count();
        let mut columns = DMatrix::zeros(n, free.len());
        for (k, &j) in free.iter().enumerate() {
            columns.set_column(k, &self.triangle.column(j));
        }
        let shifted = &self.rhs + self.triangle.product(shift);
        Some(Self::new(
            columns,
            &shifted,
            self.factorization,
            self.rank_tolerance,
        ))
    }
}

fn leading(vector: &DVector<f64>, n: usize) -> DVector<f64> {
    DVector::from_fn(n, |i, _| vector.get(i).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (DMatrix<f64>, DVector<f64>) {
        let a = DMatrix::from_fn(9, 3, |i, j| {
            ((i + 1) as f64 * 0.3).powi(j as i32) * 10f64.powi(3 * j as i32)
        });
        let r = DVector::from_fn(9, |i, _| (i as f64 * 1.7).cos());
        (a, r)
    }

    fn model(factorization: Factorization) -> DenseModel {
        let (a, r) = example();
        DenseModel::new(a, &r, factorization, 1e-13)
    }

    const BOTH: [Factorization; 2] = [Factorization::Qr, Factorization::Svd];

    #[test]
    fn undamped_step_leaves_no_gradient() {
        let (a, r) = example();
        for way in BOTH {
            let left = &a * model(way).undamped_step() + &r;
            for column in a.column_iter() {
                // epsilons on the cosine between the rest and each column
                assert!(
                    column.dot(&left).abs() <= 100.0 * f64::EPSILON * column.norm() * left.norm()
                );
            }
        }
    }

    #[test]
    fn damped_step_solves_the_stacked_system() {
        let (a, r) = example();
        let scale = DVector::from_vec(vec![2.0, 500.0, 3e5]);
        for way in BOTH {
            let damped = model(way).damped_step(0.37, &scale);
            let gram = a.tr_mul(&a) + DMatrix::from_diagonal(&scale.map(|d| 0.37 * d * d));
            let rest = &gram * &damped.step + a.tr_mul(&r);
            for j in 0..3 {
                // epsilons on each equation's own size
                assert!(rest[j].abs() <= 1e-13 * a.column(j).norm() * r.norm());
            }
            let step = &damped.step;
            let q = step.component_mul(&scale).component_mul(&scale)
                / step.component_mul(&scale).norm();
            let slope = q.dot(&gram.lu().solve(&q).expect("regular"));
            assert!((damped.slope / slope - 1.0).abs() < 1e-9, "{way:?}");
        }
    }

    #[test]
    fn gradient_and_images_are_those_of_the_jacobian() {
        let (a, r) = example();
        let m = model(Factorization::Qr);
        let v = DVector::from_vec(vec![1.0, -2e-3, 5e-6]);
        let image = &a * &v;
        assert!((m.image(&v).expect("dense") - &image).norm() <= 1e-14 * image.norm());
        assert!((m.image_norm(&v) / image.norm() - 1.0).abs() < 1e-14);
        let gradient = a.tr_mul(&r);
        for j in 0..3 {
            assert!((m.gradient()[j] - gradient[j]).abs() <= 1e-14 * a.column(j).norm() * r.norm());
        }
    }

    #[test]
    fn restricted_model_solves_for_the_free_parameters() {
        let (a, r) = example();
        let shift = DVector::from_vec(vec![0.0, 1e-3, 0.0]);
        let reduced = model(Factorization::Qr)
            .restricted(&[0, 2], &shift)
            .expect("dense");
        let step = reduced.undamped_step();
        let left = &a * DVector::from_vec(vec![step[0], 1e-3, step[1]]) + &r;
        for j in [0, 2] {
            assert!(a.column(j).dot(&left).abs() <= 1e-13 * a.column(j).norm() * left.norm());
        }
    }

    #[test]
    fn null_space_names_what_cannot_be_told_apart() {
        let (mut a, r) = example();
        let copy = a.column(0) * 4.0;
        a.set_column(1, &copy);
        let m = DenseModel::new(a.clone(), &r, Factorization::Qr, 1e-13);
        assert_eq!(m.rank(), 2);
        let null = m.null_space();
        assert!((&a * &null).norm() <= 1e-14 * a.norm() * null.norm());
        assert!((null[(0, 0)] / null[(1, 0)] + 4.0).abs() < 1e-12);
        assert!(null[(2, 0)].abs() * a.column(2).norm() < 1e-12);
    }
}
