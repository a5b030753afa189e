//! Solving the bordered system under its constraints.
//!
//! With e = R_cc c + R_cy y + t_c the residual of the band's rows and V = R_cc⁻ᵀW = Q Lᵀ, the
//! constraints Wᵀc = A y + k read
//!
//! ```text
//!     Vᵀe = (A + VᵀR_cy) y + (k + Vᵀt_c),
//! ```
//!
//! and the smallest e that satisfies them is e = Q (B y + b), B = L⁻¹A + QᵀR_cy, b = L⁻¹k + Qᵀt_c.
//! The constraints have become p rows B y + b in the small dense problem of the border, and no row
//! as long as the band is ever factorised.

use nalgebra::{DMatrix, DVector};

use super::{assemble::Bordered, constraints::Constraints};
use crate::linear::jacobi_svd::JacobiSvd;

/// A combination of border unknowns which the rows do not determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Undetermined {
    /// The weights of the border unknowns in the combination, of norm one in the scaled unknowns.
    pub weights: Vec<f64>,
}

/// The solution of a bordered system, with the factors the covariance needs.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Values of the band's unknowns.
    pub band: Vec<f64>,
    /// Values of the border's unknowns; zero where held.
    pub border: Vec<f64>,
    /// Combinations of the border not determined (given no step).
    pub undetermined: Vec<Undetermined>,
    /// Q, the p orthonormal columns of length n.
    pub(super) q: Vec<Vec<f64>>,
    /// B = L⁻¹A + QᵀR_cy, p × q.
    pub(super) b: DMatrix<f64>,
    /// (MᵀM)⁺ of the small problem, q × q, zero where held.
    pub(super) border_covariance: DMatrix<f64>,
    /// A root of it: its rows are the unknowns.
    pub(super) border_root: DMatrix<f64>,
}

/// Singular values of the scaled small problem below this share of the largest count as zero:
/// ten thousand roundings.
const RANK_TOLERANCE: f64 = 1e-12;

/// Below this ratio of norms there is no need to look at the singular values: a hundredth of what the
/// tolerance allows.
const CLEARLY_FULL_RANK: f64 = 0.01 / RANK_TOLERANCE;

impl Bordered {
    /// Minimises ‖R δ + t‖ under the constraints W ᵀδ_c = A δ_y + k, with held border unknowns
    /// at zero.
    ///
    /// # Errors
    /// The number of a constraint that depends on those before it.
    pub fn solve(
        &self,
        constraints: &Constraints,
        missing: &DVector<f64>,
        held: &[bool],
    ) -> Result<Solved, usize> {
        let (n, q, p) = (self.triangle.len(), self.border, constraints.len());
        let (t_c, t_y) = self.residual_parts();
        let mut columns: Vec<Vec<f64>> = constraints.band.clone();
        for column in &mut columns {
            self.triangle.solve_transposed(column);
        }
        let lower = orthonormalise(&mut columns)?.transpose();
        let mut right = DMatrix::zeros(p, q + 1);
        right.columns_mut(0, q).copy_from(&constraints.border);
        right.set_column(q, missing);
        // L is triangular with a nonzero diagonal after orthonormalise.
        lower.solve_lower_triangular_mut(&mut right);
        for (l, column) in columns.iter().enumerate() {
            for i in 0..n {
                for (j, r) in self.triangle.tail_row(i)[..q].iter().enumerate() {
                    right[(l, j)] += column[i] * r;
                }
                right[(l, q)] += column[i] * t_c[i];
            }
        }
        let (b, b_value) = (
            right.columns(0, q).into_owned(),
            right.column(q).into_owned(),
        );

        let free: Vec<usize> = (0..q).filter(|j| !held[*j]).collect();
        let small = DMatrix::from_fn(q + p, free.len(), |i, l| {
            if i < q {
                if free[l] >= i {
                    self.corner(i, free[l])
                } else {
                    0.0
                }
            } else {
                b[(i - q, free[l])]
            }
        });
        let value = DVector::from_fn(q + p, |i, _| if i < q { t_y[i] } else { b_value[i - q] });
        let norms = self.column_norms().1;
        let dense = solve_small(small, &value, free.iter().map(|j| norms[*j]).collect());
        let mut border = vec![0.0; q];
        let mut border_covariance = DMatrix::zeros(q, q);
        let mut border_root = DMatrix::zeros(q, q);
        for (l, &j) in free.iter().enumerate() {
            border[j] = dense.solution[l];
            for (m, &k) in free.iter().enumerate() {
                border_covariance[(j, k)] = dense.covariance[(l, m)];
                border_root[(j, m)] = dense.root[(l, m)];
            }
        }
        let undetermined = dense
            .null
            .iter()
            .map(|null| {
                let mut weights = vec![0.0; q];
                for (l, &j) in free.iter().enumerate() {
                    weights[j] = null[l];
                }
                Undetermined { weights }
            })
            .collect();

        let y = DVector::from_column_slice(&border);
        let pull = &b * &y + b_value;
        let mut band: Vec<f64> = (0..n)
            .map(|i| {
                let row = &self.triangle.tail_row(i)[..q];
                let coupled: f64 = row.iter().zip(&border).map(|(r, y)| r * y).sum();
                let pulled: f64 = columns.iter().zip(pull.iter()).map(|(c, e)| c[i] * e).sum();
                pulled - t_c[i] - coupled
            })
            .collect();
        self.triangle.solve(&mut band);
        Ok(Solved {
            band,
            border,
            undetermined,
            q: columns,
            b,
            border_covariance,
            border_root,
        })
    }

    /// ‖R δ‖: by how much a step changes the rows' linear prediction.
    pub(super) fn image_norm(&self, band: &[f64], border: &[f64]) -> f64 {
        let q = self.border;
        let mut sum = 0.0;
        for i in 0..self.triangle.len() {
            sum += self.image(i, band, border).powi(2);
        }
        for i in 0..q {
            let image: f64 = (i..q).map(|j| self.corner(i, j) * border[j]).sum();
            sum += image * image;
        }
        sum.sqrt()
    }

    /// Row i of (R_cc R_cy) times a point.
    fn image(&self, i: usize, band: &[f64], border: &[f64]) -> f64 {
        let row = self.triangle.band(i);
        let beside = &self.triangle.tail_row(i)[..self.border];
        row.iter().zip(&band[i..]).map(|(r, c)| r * c).sum::<f64>()
            + beside.iter().zip(border).map(|(r, y)| r * y).sum::<f64>()
    }

    /// By how much ½‖Rδ + t‖² lies below ½‖t‖², without the cancellation of the two.
    pub fn predicted_reduction(&self, band: &[f64], border: &[f64]) -> f64 {
        let (t_c, t_y) = self.residual_parts();
        let q = self.border;
        let mut reduction = 0.0;
        for i in 0..self.triangle.len() {
            let change = self.image(i, band, border);
            reduction -= change * (t_c[i] + 0.5 * change);
        }
        for i in 0..q {
            let change: f64 = (i..q).map(|j| self.corner(i, j) * border[j]).sum();
            reduction -= change * (t_y[i] + 0.5 * change);
        }
        reduction
    }
}

struct Small {
    solution: DVector<f64>,
    covariance: DMatrix<f64>,
    root: DMatrix<f64>,
    null: Vec<DVector<f64>>,
}

impl Small {
    /// From the inverse of the triangle over scaled unknowns.
    fn of_full_rank(mut root: DMatrix<f64>, rhs: &DVector<f64>, scales: &[f64]) -> Self {
        for (i, scale) in scales.iter().enumerate() {
            root.row_mut(i).scale_mut(1.0 / scale);
        }
        Self {
            solution: -(&root * rhs),
            covariance: &root * root.transpose(),
            root,
            null: Vec::new(),
        }
    }
}

/// The inverse of a triangle whose least singular value is clearly not zero: ‖R‖‖R⁻¹‖ in the norm of
/// Frobenius is at least the ratio of the largest to the least.
fn inverse_root(triangle: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = triangle.nrows();
    if n != triangle.ncols() {
        return None;
    }
    let mut inverse = DMatrix::identity(n, n);
    let solved = triangle.solve_upper_triangular_mut(&mut inverse);
    (solved && triangle.norm() * inverse.norm() < CLEARLY_FULL_RANK).then_some(inverse)
}

/// Least squares min ‖M y + m‖ of a few unknowns by singular values. Columns are scaled by the
/// norms they had before the band was taken out of them: one of which only rounding is left shows.
fn solve_small(mut matrix: DMatrix<f64>, value: &DVector<f64>, mut scales: Vec<f64>) -> Small {
    let unknowns = matrix.ncols();
    for (j, scale) in scales.iter_mut().enumerate() {
        if !(*scale > 0.0 && scale.is_finite()) {
            *scale = 1.0;
        }
        matrix.column_mut(j).scale_mut(1.0 / *scale);
    }
    let qr = matrix.qr();
    let mut rhs = value.clone();
    qr.q_tr_mul(&mut rhs);
    let (rhs, triangle) = (rhs.rows(0, unknowns).into_owned(), qr.r());
    if let Some(root) = inverse_root(&triangle) {
        return Small::of_full_rank(root, &rhs, &scales);
    }
    let svd = JacobiSvd::new(triangle);
    let largest = svd.values.iter().fold(0.0_f64, |m, s| m.max(*s));
    let mut solution = DVector::zeros(unknowns);
    let mut root = DMatrix::zeros(unknowns, unknowns);
    let mut null = Vec::new();
    for (k, s) in svd.values.iter().enumerate() {
        let v = svd.right.column(k);
        if *s <= RANK_TOLERANCE * largest {
            null.push(v.component_div(&DVector::from_column_slice(&scales)));
        } else {
            solution.axpy(-svd.left.column(k).dot(&rhs) / s, &v, 1.0);
            root.set_column(k, &(v / *s));
        }
    }
    for i in 0..unknowns {
        solution[i] /= scales[i];
        root.row_mut(i).scale_mut(1.0 / scales[i]);
    }
    Small {
        solution,
        covariance: &root * root.transpose(),
        root,
        null,
    }
}

/// Orthonormalises the columns in place (Gram–Schmidt, twice) and returns the upper triangle.
fn orthonormalise(columns: &mut [Vec<f64>]) -> Result<DMatrix<f64>, usize> {
    let p = columns.len();
    let mut upper = DMatrix::zeros(p, p);
    for k in 0..p {
        let (done, rest) = columns.split_at_mut(k);
        let column = &mut rest[0];
        let before = norm(column);
        for _ in 0..2 {
            for (l, other) in done.iter().enumerate() {
                let share: f64 = other.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
                upper[(l, k)] += share;
                for (c, o) in column.iter_mut().zip(other) {
                    *c -= share * o;
                }
            }
        }
        let left = norm(column);
        if !(left > RANK_TOLERANCE * before) {
            return Err(k);
        }
        upper[(k, k)] = left;
        for c in column.iter_mut() {
            *c /= left;
        }
    }
    Ok(upper)
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
