//! Solving with the triangle of a pivoted QR: undamped, damped, and along its null space.
//!
//! Everything here is written in scaled unknowns z = N s, N the column norms of J, so that
//! J N⁻¹ P = Q R; right-hand sides are c = Qᵀ r.

use nalgebra::{DMatrix, DVector};

use super::DampedStep;
use super::jacobi_svd::JacobiSvd;
use super::pivoted_qr::make_reflector;

/// An upper triangle R with its column permutation and column scale.
#[derive(Debug, Clone)]
pub struct Triangle {
    upper: DMatrix<f64>,
    permutation: Vec<usize>,
    units: DVector<f64>,
    rank: usize,
}

impl Triangle {
    /// Takes R (n × n), the permutation and the column scale of J N⁻¹ P = Q R. Diagonal entries
    /// below `rank_tolerance` times the first count as zero.
    pub fn new(
        upper: DMatrix<f64>,
        permutation: Vec<usize>,
        units: DVector<f64>,
        rank_tolerance: f64,
    ) -> Self {
        let n = upper.ncols();
        let floor = rank_tolerance * upper.get((0, 0)).map_or(0.0, |first| first.abs());
        let rank = (0..n)
            .take_while(|&k| upper[(k, k)] != 0.0 && upper[(k, k)].abs() > floor)
            .count();
        Self {
            upper,
            permutation,
            units,
            rank,
        }
    }

    /// Number of unknowns, n.
    pub fn order(&self) -> usize {
        self.upper.ncols()
    }

    /// Numerical rank.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// The dependent parameters: those that the null space moves and the others compensate.
    pub fn dependent(&self) -> &[usize] {
        &self.permutation[self.rank..]
    }

    /// The column norms N that scale the unknowns.
    pub fn units(&self) -> &DVector<f64> {
        &self.units
    }

    /// Jᵀ r from c = Qᵀ r.
    pub fn transposed_product(&self, c: &DVector<f64>) -> DVector<f64> {
        let n = self.order();
        let mut product = DVector::zeros(n);
        for k in 0..n {
            let j = self.permutation[k];
            let sum: f64 = (0..=k).map(|i| self.upper[(i, k)] * c[i]).sum();
            product[j] = sum * self.units[j];
        }
        product
    }

    /// Qᵀ J s, whose norm is ‖J s‖.
    pub fn product(&self, step: &DVector<f64>) -> DVector<f64> {
        let n = self.order();
        let mut product = DVector::zeros(n);
        for k in 0..n {
            let j = self.permutation[k];
            let z = step[j] * self.units[j];
            for i in 0..=k {
                product[i] += self.upper[(i, k)] * z;
            }
        }
        product
    }

    /// The basic solution of min ‖J s + r‖: dependent parameters stay where they are.
    pub fn basic_step(&self, c: &DVector<f64>) -> DVector<f64> {
        let mut z = DVector::from_fn(self.rank, |i, _| -c[i]);
        back_substitute(&self.upper, &mut z);
        self.unscaled(&z)
    }

    /// The solution of min ‖J s + r‖² + λ ‖D s‖² by rotating √λ D N⁻¹ P into R.
    ///
    /// Column k of the lower block has its nonzeros in rows 0..=k, which makes the sweep cost
    /// ⅔ n³ (Nash's arrangement of MINPACK's `qrsolv`, with reflectors).
    pub fn damped_step(&self, c: &DVector<f64>, damping: f64, scale: &DVector<f64>) -> DampedStep {
        let n = self.order();
        let root = damping.sqrt();
        let mut triangle = self.upper.clone();
        let mut below = DMatrix::<f64>::zeros(n, n);
        let mut rhs = c.clone();
        let mut rhs_below = vec![0.0; n];
        let mut reflector = Vec::with_capacity(n + 1);
        for k in 0..n {
            let j = self.permutation[k];
            below[(k, k)] = root * scale[j] / self.units[j];
            reflector.clear();
            reflector.push(triangle[(k, k)]);
            reflector.extend_from_slice(&below.column(k).as_slice()[..=k]);
            let tau = make_reflector(&mut reflector);
            triangle[(k, k)] = reflector[0];
            let v = &reflector[1..];
            for l in k + 1..n {
                let mut column = below.column_mut(l);
                let lower = &mut column.as_mut_slice()[..=k];
                reflect_pair(&mut triangle[(k, l)], lower, v, tau);
            }
            reflect_pair(&mut rhs[k], &mut rhs_below[..=k], v, tau);
        }
        let mut z = -rhs;
        back_substitute(&triangle, &mut z);
        let step = self.unscaled(&z);
        let slope = self.slope(&triangle, &step, scale);
        DampedStep { step, slope }
    }

    /// ‖S⁻ᵀ Pᵀ N⁻¹ q‖² with SᵀS = Pᵀ N⁻¹ (JᵀJ + λD²) N⁻¹ P and q = D² s / ‖D s‖.
    fn slope(&self, triangle: &DMatrix<f64>, step: &DVector<f64>, scale: &DVector<f64>) -> f64 {
        let n = self.order();
        let length = step.component_mul(scale).norm();
        if length == 0.0 {
            return 0.0;
        }
        let mut w: Vec<f64> = Vec::with_capacity(n);
        for k in 0..n {
            let j = self.permutation[k];
            let q = scale[j] * scale[j] * step[j] / (length * self.units[j]);
            let known: f64 = w
                .iter()
                .enumerate()
                .map(|(i, v)| triangle[(i, k)] * v)
                .sum();
            let pivot = triangle[(k, k)];
            w.push(if pivot == 0.0 {
                0.0
            } else {
                (q - known) / pivot
            });
        }
        w.iter().map(|v| v * v).sum()
    }

    /// The singular value decomposition of J D⁻¹ in the basis of Q, n × n, as that of the
    /// transposed triangle: its `right` vectors are the left ones of J D⁻¹ and the other way.
    pub fn transposed_svd(&self, scale: &DVector<f64>) -> JacobiSvd {
        let n = self.order();
        let mut transposed = DMatrix::zeros(n, n);
        for k in 0..n {
            let j = self.permutation[k];
            let factor = self.units[j] / scale[j];
            for i in 0..=k {
                transposed[(j, i)] = self.upper[(i, k)] * factor;
            }
        }
        JacobiSvd::new(transposed)
    }

    /// The null space, n × (n − rank), one column a dependent parameter; each column's largest
    /// entry in scaled unknowns is 1.
    pub fn null_space(&self) -> DMatrix<f64> {
        let n = self.order();
        let mut basis = DMatrix::zeros(n, n - self.rank);
        for dependent in self.rank..n {
            let mut z = DVector::from_fn(self.rank, |i, _| -self.upper[(i, dependent)]);
            back_substitute(&self.upper, &mut z);
            let largest = z.iter().fold(1.0_f64, |a, v| a.max(v.abs()));
            let mut column = self.unscaled(&(z / largest));
            let j = self.permutation[dependent];
            column[j] = 1.0 / (largest * self.units[j]);
            basis.set_column(dependent - self.rank, &column);
        }
        basis
    }

    /// (JᵀJ)⁻¹ over the independent parameters, zero rows and columns for the dependent ones.
    pub fn inverse_gram(&self) -> DMatrix<f64> {
        let n = self.order();
        let mut inverse = DMatrix::<f64>::zeros(n, n);
        let mut half = DMatrix::<f64>::zeros(n, self.rank);
        for k in 0..self.rank {
            // Column k of (leading R)⁻¹, in the order and units of the parameters.
            let mut z = DVector::zeros(self.rank);
            z[k] = 1.0;
            back_substitute(&self.upper, &mut z);
            half.set_column(k, &self.unscaled(&z));
        }
        inverse.gemm(1.0, &half, &half.transpose(), 0.0);
        inverse
    }

    /// The first `rank` entries of Qᵀ (J⁺)ᵀ w for w of length n: R⁻ᵀ Pᵀ N⁻¹ w.
    pub fn transposed_solve(&self, w: &DVector<f64>) -> DVector<f64> {
        let mut solution = DVector::zeros(self.rank);
        for k in 0..self.rank {
            let j = self.permutation[k];
            let known: f64 = (0..k).map(|i| self.upper[(i, k)] * solution[i]).sum();
            solution[k] = (w[j] / self.units[j] - known) / self.upper[(k, k)];
        }
        solution
    }

    /// Column j of J in the basis of Q, length n.
    pub fn column(&self, parameter: usize) -> DVector<f64> {
        let n = self.order();
        let mut column = DVector::zeros(n);
        if let Some(k) = self.permutation.iter().position(|&j| j == parameter) {
            for i in 0..=k {
                column[i] = self.upper[(i, k)] * self.units[parameter];
            }
        }
        column
    }

    /// Back to the order and the units of the parameters; the dependent ones get zero.
    fn unscaled(&self, z: &DVector<f64>) -> DVector<f64> {
        let mut step = DVector::zeros(self.order());
        for (k, value) in z.iter().enumerate() {
            let j = self.permutation[k];
            step[j] = value / self.units[j];
        }
        step
    }
}

/// Solves the leading triangle of the right-hand side's length in place.
fn back_substitute(upper: &DMatrix<f64>, rhs: &mut DVector<f64>) {
    for k in (0..rhs.len()).rev() {
        let pivot = upper[(k, k)];
        let value = if pivot == 0.0 { 0.0 } else { rhs[k] / pivot };
        rhs[k] = value;
        for i in 0..k {
            rhs[i] -= upper[(i, k)] * value;
        }
    }
}

/// Applies I − τ (1, v)(1, v)ᵀ to (head, lower).
fn reflect_pair(head: &mut f64, lower: &mut [f64], v: &[f64], tau: f64) {
    let inner: f64 = lower.iter().zip(v).map(|(a, b)| a * b).sum();
    let scale = tau * (*head + inner);
    *head -= scale;
    for (a, b) in lower.iter_mut().zip(v) {
        *a -= scale * b;
    }
}
