//! Householder QR with column pivoting, in place.
//!
//! Businger & Golub, Numer. Math. 7 (1965) 269; the down-dating of column norms with the
//! safeguard of Drmač & Bujanović, ACM TOMS 35 (2008) 12.

use nalgebra::{DMatrix, DVector};

/// The factorisation A P = Q R of an m × n matrix with m ≥ n or m < n.
#[derive(Debug, Clone)]
pub struct PivotedQr {
    /// R above and on the diagonal, the reflectors (leading 1 implied) below it.
    factors: DMatrix<f64>,
    /// The factor τ of each reflector I − τ v vᵀ.
    tau: Vec<f64>,
    /// Column k of A P is column `permutation[k]` of A.
    permutation: Vec<usize>,
}

impl PivotedQr {
    /// Factors `matrix`, whose storage becomes that of the factors.
    pub fn new(mut matrix: DMatrix<f64>) -> Self {
        let (m, n) = matrix.shape();
        let steps = m.min(n);
        let mut permutation: Vec<usize> = (0..n).collect();
        let mut norms: Vec<f64> = (0..n)
            .map(|j| norm(&matrix.as_slice()[j * m..(j + 1) * m]))
            .collect();
        let mut reference = norms.clone();
        let mut tau = vec![0.0; steps];

        for k in 0..steps {
            let pivot = largest(&norms, k);
            if pivot != k {
                matrix.swap_columns(k, pivot);
                permutation.swap(k, pivot);
                norms.swap(k, pivot);
                reference.swap(k, pivot);
            }
            let (head, tail) = matrix.as_mut_slice().split_at_mut((k + 1) * m);
            let column = &mut head[k * m + k..];
            tau[k] = make_reflector(column);
            // The reflector's leading 1 is put in place while it is applied.
            let diagonal = std::mem::replace(&mut column[0], 1.0);
            for (other, j) in tail.chunks_exact_mut(m).zip(k + 1..) {
                let target = &mut other[k..];
                let scale = tau[k] * dot(column, target);
                subtract_scaled(target, scale, column);
                downdate(&mut norms[j], &mut reference[j], target);
            }
            column[0] = diagonal;
        }
        Self {
            factors: matrix,
            tau,
            permutation,
        }
    }

    /// Replaces v (length m) by Qᵀ v.
    pub fn apply_transposed(&self, vector: &mut DVector<f64>) {
        for k in 0..self.tau.len() {
            self.reflect(k, vector.as_mut_slice());
        }
    }

    /// Replaces v (length m) by Q v.
    pub fn apply(&self, vector: &mut DVector<f64>) {
        for k in (0..self.tau.len()).rev() {
            self.reflect(k, vector.as_mut_slice());
        }
    }

    /// R as a square upper triangle, n × n; rows beyond m are zero.
    pub fn upper(&self) -> DMatrix<f64> {
        let n = self.factors.ncols();
        let rows = self.factors.nrows();
        DMatrix::from_fn(n, n, |i, j| {
            if i <= j && i < rows {
                self.factors[(i, j)]
            } else {
                0.0
            }
        })
    }

    /// Number of rows, m.
    pub fn rows(&self) -> usize {
        self.factors.nrows()
    }

    /// The permutation: column k of A P is column `permutation()[k]` of A.
    pub fn permutation(&self) -> &[usize] {
        &self.permutation
    }

    fn reflect(&self, k: usize, vector: &mut [f64]) {
        let m = self.factors.nrows();
        let reflector = &self.factors.as_slice()[k * m + k + 1..(k + 1) * m];
        let (first, rest) = vector[k..].split_at_mut(1);
        let scale = self.tau[k] * (first[0] + dot(reflector, rest));
        first[0] -= scale;
        subtract_scaled(rest, scale, reflector);
    }
}

/// Turns x into the reflector that maps it to (β, 0, …): β is left in front, v behind it.
pub(crate) fn make_reflector(x: &mut [f64]) -> f64 {
    let Some((first, rest)) = x.split_first_mut() else {
        return 0.0;
    };
    let below = norm(rest);
    if below == 0.0 {
        return 0.0;
    }
    let alpha = *first;
    let beta = -alpha.hypot(below).copysign(alpha);
    let divisor = alpha - beta;
    for value in rest.iter_mut() {
        *value /= divisor;
    }
    *first = beta;
    (beta - alpha) / beta
}

fn largest(norms: &[f64], from: usize) -> usize {
    let mut best = from;
    for j in from + 1..norms.len() {
        if norms[j] > norms[best] {
            best = j;
        }
    }
    best
}

/// Takes the leading entry off a remaining column norm; recomputes it once cancellation has
/// eaten half its digits.
fn downdate(norm_left: &mut f64, reference: &mut f64, column: &[f64]) {
    if *norm_left == 0.0 {
        return;
    }
    let ratio = column[0] / *norm_left;
    let left = ((1.0 + ratio) * (1.0 - ratio)).max(0.0);
    if left * (*norm_left / *reference).powi(2) <= f64::EPSILON.sqrt() {
        *norm_left = norm(&column[1..]);
        *reference = *norm_left;
    } else {
        *norm_left *= left.sqrt();
    }
}

/// The scalar product in eight running sums, which the compiler turns into vector code.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_blocks, b_blocks) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a_blocks
        .remainder()
        .iter()
        .zip(b_blocks.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a_blocks.zip(b_blocks) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + tail
}

/// The Euclidean norm, safe against overflow and underflow of the squares.
pub(crate) fn norm(x: &[f64]) -> f64 {
    let square = dot(x, x);
    if square.is_finite() && square > f64::MIN_POSITIVE / f64::EPSILON {
        return square.sqrt();
    }
    let largest = x.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * x.iter().map(|v| (v / largest).powi(2)).sum::<f64>().sqrt()
}

fn subtract_scaled(target: &mut [f64], scale: f64, x: &[f64]) {
    for (t, v) in target.iter_mut().zip(x) {
        *t -= scale * v;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(m: usize, n: usize, seed: u64) -> DMatrix<f64> {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        DMatrix::from_fn(m, n, |_, _| generator.random_range(-1.0..1.0))
    }

    fn rebuilt(a: &DMatrix<f64>) -> DMatrix<f64> {
        let qr = PivotedQr::new(a.clone());
        let upper = qr.upper();
        let mut product = DMatrix::zeros(a.nrows(), a.ncols());
        for (k, &j) in qr.permutation().iter().enumerate() {
            let mut column = DVector::zeros(a.nrows());
            for i in 0..=k.min(a.nrows() - 1) {
                column[i] = upper[(i, k)];
            }
            qr.apply(&mut column);
            product.set_column(j, &column);
        }
        product
    }

    #[test]
    fn factors_rebuild_the_matrix() {
        for (m, n) in [(1, 1), (5, 5), (40, 7), (3, 6)] {
            let a = random(m, n, 1);
            // epsilons: a few roundings per reflector
            assert!((rebuilt(&a) - &a).norm() <= 20.0 * n as f64 * f64::EPSILON * a.norm());
        }
    }

    #[test]
    fn diagonal_falls_and_shows_the_rank() {
        let mut a = random(30, 6, 2);
        let dependent = a.column(1) * 2.0 - a.column(4);
        a.set_column(2, &dependent);
        let upper = PivotedQr::new(a).upper();
        for k in 1..6 {
            assert!(upper[(k, k)].abs() <= upper[(k - 1, k - 1)].abs());
        }
        // epsilons: the dependent column leaves rounding only
        assert!(upper[(5, 5)].abs() <= 100.0 * f64::EPSILON * upper[(0, 0)].abs());
        assert!(upper[(4, 4)].abs() > 0.1);
    }

    #[test]
    fn transposed_undoes_apply() {
        let qr = PivotedQr::new(random(20, 4, 3));
        let v = DVector::from_fn(20, |i, _| (i as f64).sin());
        let mut w = v.clone();
        qr.apply(&mut w);
        qr.apply_transposed(&mut w);
        assert!((w - &v).norm() <= 50.0 * f64::EPSILON * v.norm());
    }

    #[test]
    fn norm_survives_tiny_and_huge_entries() {
        assert!((norm(&[3e-200, 4e-200]) / 5e-200 - 1.0).abs() < 4.0 * f64::EPSILON);
        assert!((norm(&[3e200, 4e200]) / 5e200 - 1.0).abs() < 4.0 * f64::EPSILON);
    }
}
