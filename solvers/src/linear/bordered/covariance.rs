//! Covariances of a bordered system, without a dense inverse.
//!
//! With unit noise, y has the covariance C_y = (MᵀM)⁻¹ of the small problem and
//!
//! ```text
//!     c = R_cc⁻¹ [ (I − QQᵀ)(−t_c) + (−R_cy + Q B) y ] + const,
//! ```
//!
//! where (I − QQᵀ)t_c is independent of y (which sees t_c through Qᵀt_c only). So
//! cov(c) = Z − PPᵀ + U C_y Uᵀ and cov(c, y) = U C_y with Z = (R_ccᵀR_cc)⁻¹, P = R_cc⁻¹Q and
//! U = R_cc⁻¹(−R_cy + Q B).

use std::sync::OnceLock;

use nalgebra::DMatrix;

use super::{
    assemble::{Bordered, Group},
    solve::Solved,
};
use crate::linear::banded::{BandInverse, BandTriangle};

/// Covariances for unit noise: multiply by the noise variance where rows are not in units of it.
///
/// What belongs to the band is worked out when it first is asked for: the border alone costs nothing.
#[derive(Debug, Clone)]
pub struct BorderedCovariance {
    /// R_cc with R_cy beside it.
    pub(super) triangle: BandTriangle,
    /// Q, p columns.
    q: Vec<Vec<f64>>,
    /// B, p × q.
    b: DMatrix<f64>,
    border: DMatrix<f64>,
    /// A root of C_y: q rows of q values, row-major.
    root: Vec<f64>,
    of_band: OnceLock<OfBand>,
}

/// What it takes for the unknowns of the band.
#[derive(Debug, Clone)]
pub(super) struct OfBand {
    inverse: BandInverse,
    /// P, n rows of p values.
    pub(super) p: DMatrix<f64>,
    /// U, n rows of q values.
    pub(super) u: DMatrix<f64>,
    /// Row by row the q values of U·root and the p of P.
    beside: Vec<f64>,
}

impl BorderedCovariance {
    /// The covariance at a solution.
    pub fn new(system: &Bordered, solved: &Solved) -> Self {
        Self {
            triangle: system.triangle.clone(),
            q: solved.q.clone(),
            b: solved.b.clone(),
            border: solved.border_covariance.clone(),
            root: solved.border_root.transpose().as_slice().to_vec(),
            of_band: OnceLock::new(),
        }
    }

    pub(super) fn of_band(&self) -> &OfBand {
        self.of_band.get_or_init(|| {
            let (n, q, p) = (self.triangle.len(), self.border.nrows(), self.q.len());
            let stride = q + p;
            // Row by row −R_cy + Q B and Q, which R_cc⁻¹ makes U and P of.
            let mut rows = vec![0.0; n * stride];
            for (i, row) in rows.chunks_exact_mut(stride.max(1)).enumerate() {
                let (u, p) = row.split_at_mut(q);
                for (value, r) in u.iter_mut().zip(self.triangle.tail_row(i)) {
                    *value = -r;
                }
                for (l, (own, column)) in p.iter_mut().zip(&self.q).enumerate() {
                    *own = column[i];
                    for (value, b) in u.iter_mut().zip(self.b.row(l).iter()) {
                        *value += column[i] * b;
                    }
                }
            }
            self.triangle.solve_rows(&mut rows, stride);
            let matrix = DMatrix::from_row_slice(n, stride, &rows);
            let u = matrix.columns(0, q).into_owned();
            let root = DMatrix::from_row_slice(q, q, &self.root);
            let rooted = &u * root;
            for (i, row) in rows.chunks_exact_mut(stride.max(1)).enumerate() {
                for (value, rooted) in row.iter_mut().zip(rooted.row(i).iter()) {
                    *value = *rooted;
                }
            }
            OfBand {
                inverse: BandInverse::of(&self.triangle),
                p: matrix.columns(q, p).into_owned(),
                u,
                beside: rows,
            }
        })
    }

    /// The covariance matrix of the border's unknowns, q × q; zero rows where held.
    pub fn border(&self) -> &DMatrix<f64> {
        &self.border
    }

    /// The covariance of two unknowns of the band no farther apart than its width; `None` beyond.
    pub fn band(&self, i: usize, j: usize) -> Option<f64> {
        (i.abs_diff(j) < self.triangle.width() && i.max(j) < self.triangle.len()).then(|| {
            let OfBand { inverse, p, u, .. } = self.of_band();
            inverse.get(i, j) - p.row(i).dot(&p.row(j))
                + (u.row(i) * &self.border * u.row(j).transpose())[0]
        })
    }

    /// The covariance of an unknown of the band with one of the border.
    pub fn mixed(&self, i: usize, j: usize) -> f64 {
        let u = &self.of_band().u;
        u.row(i).transpose().dot(&self.border.column(j))
    }

    /// The variance of a linear combination Σ w_i c_i + Σ v_j y_j, any distance apart.
    pub fn variance(&self, band: &[(usize, f64)], border: &[(usize, f64)]) -> f64 {
        let lowest = band.iter().map(|b| b.0).min().unwrap_or(0);
        let highest = band.iter().map(|b| b.0).max().unwrap_or(0);
        let own = if band.is_empty() {
            0.0
        } else if highest - lowest < self.triangle.width() {
            let inverse = &self.of_band().inverse;
            let mut sum = 0.0;
            for (k, (i, a)) in band.iter().enumerate() {
                sum += a * a * inverse.get(*i, *i);
                for (j, b) in &band[..k] {
                    sum += 2.0 * a * b * inverse.get(*i, *j);
                }
            }
            sum
        } else {
            let mut x = vec![0.0; self.triangle.len()];
            for (i, a) in band {
                x[*i] += a;
            }
            self.triangle.solve_transposed(&mut x);
            x.iter().map(|v| v * v).sum()
        };
        let (q, stride) = (self.border.nrows(), self.border.nrows() + self.q.len());
        // Along the root of C_y what is gained, along P what the constraints take away.
        let mut beside = vec![0.0; stride];
        for (i, a) in band {
            let rows = &self.of_band().beside;
            add(&mut beside, *a, &rows[i * stride..(i + 1) * stride]);
        }
        for (j, v) in border {
            add(&mut beside, *v, &self.root[j * q..(j + 1) * q]);
        }
        let (gained, lost) = beside.split_at(q);
        let squares = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        (own - squares(lost) + squares(gained)).max(0.0)
    }

    /// The covariance matrix of some unknowns, those of the band first; `None` where two of these are farther
    /// apart than the band is wide.
    pub fn among(&self, band: &[usize], border: &[usize]) -> Option<DMatrix<f64>> {
        let lowest = band.iter().min().copied().unwrap_or(0);
        let highest = band.iter().max().copied().unwrap_or(0);
        if highest - lowest >= self.triangle.width() {
            return None;
        }
        let (q, stride) = (self.border.nrows(), self.border.nrows() + self.q.len());
        let OfBand {
            inverse,
            beside: rows,
            ..
        } = self.of_band();
        let of_band = band.iter().map(|i| &rows[i * stride..][..stride]);
        let of_border = border.iter().map(|j| &self.root[j * q..][..q]);
        // Those of the border have no part that the constraints take away.
        let beside: Vec<(&[f64], &[f64])> = of_band
            .map(|row| row.split_at(q))
            .chain(of_border.map(|row| (row, [].as_slice())))
            .collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        Some(DMatrix::from_fn(beside.len(), beside.len(), |a, b| {
            let own = match (band.get(a), band.get(b)) {
                (Some(i), Some(j)) => inverse.get(*i, *j),
                _ => 0.0,
            };
            own - product(beside[a].1, beside[b].1) + product(beside[a].0, beside[b].0)
        }))
    }

    /// The covariance matrix times a vector over the unknowns of band and border: what each unknown has
    /// in common with that linear combination of all.
    pub fn times(&self, band: &[(usize, f64)], border: &[(usize, f64)]) -> (Vec<f64>, Vec<f64>) {
        let OfBand { p, u, .. } = self.of_band();
        let combined =
            |m: &DMatrix<f64>, k: usize| -> f64 { band.iter().map(|(i, a)| a * m[(*i, k)]).sum() };
        let lost: Vec<f64> = (0..p.ncols()).map(|k| combined(p, k)).collect();
        let mut seen: Vec<f64> = (0..self.border.nrows()).map(|k| combined(u, k)).collect();
        for (j, v) in border {
            seen[*j] += v;
        }
        let through: Vec<f64> = self
            .border
            .row_iter()
            .map(|row| row.iter().zip(&seen).map(|(c, s)| c * s).sum())
            .collect();
        let mut own = vec![0.0; self.triangle.len()];
        for (i, a) in band {
            own[*i] += a;
        }
        if !band.is_empty() {
            self.triangle.solve_transposed(&mut own);
            self.triangle.solve(&mut own);
        }
        for (i, value) in own.iter_mut().enumerate() {
            *value -= lost
                .iter()
                .zip(p.row(i).iter())
                .map(|(l, p)| l * p)
                .sum::<f64>();
            *value += through
                .iter()
                .zip(u.row(i).iter())
                .map(|(t, u)| t * u)
                .sum::<f64>();
        }
        (own, through)
    }

    /// The trace of J cov Jᵀ over the rows of a group times `weight`: how many unknowns they use
    /// up.
    ///
    /// With G the group's triangle over its local columns it is the sum of G∘(G·K), K the
    /// covariance of the local columns' coefficients: K = Z − PPᵀ + E Eᵀ with E the rows of U and
    /// of the unit matrix that the columns bring, times a root of C_y.
    pub fn hat_trace(&self, group: &Group, weight: f64) -> f64 {
        let (columns, q, p) = (group.columns - 1, self.border.nrows(), self.q.len());
        let OfBand {
            inverse,
            beside: rows,
            ..
        } = self.of_band();
        let stride = q + p;
        // Row l: what column l brings through the border, and what the constraints take away.
        let mut through = vec![0.0; columns * stride];
        for share in &group.border {
            let row = &mut through[share.column as usize * stride..][..q];
            let root = &self.root[share.unknown as usize * q..][..q];
            for (sum, root) in row.iter_mut().zip(root) {
                *sum += share.weight * root;
            }
        }
        for (row, unknown) in through.chunks_exact_mut(stride).zip(&group.band) {
            if let Some(j) = unknown {
                let beside = &rows[j * stride..(j + 1) * stride];
                for (sum, value) in row.iter_mut().zip(beside) {
                    *sum += value;
                }
            }
        }
        let mut near = vec![0.0; group.band.len() * group.band.len()];
        for (l, i) in group.band.iter().enumerate() {
            for (m, j) in group.band.iter().enumerate() {
                if let (Some(i), Some(j)) = (i, j) {
                    near[l * group.band.len() + m] = inverse.get(*i, *j);
                }
            }
        }
        let mut sums = vec![0.0; stride];
        let mut trace = 0.0;
        for i in 0..columns {
            let row = &group.row(i)[..columns];
            sums.fill(0.0);
            for (value, through) in row.iter().zip(through.chunks_exact(stride)).skip(i) {
                for (sum, t) in sums.iter_mut().zip(through) {
                    *sum += value * t;
                }
            }
            let (gained, lost) = sums.split_at(q);
            trace += gained.iter().map(|s| s * s).sum::<f64>();
            trace -= lost.iter().map(|s| s * s).sum::<f64>();
            for (value, near) in row.iter().zip(near.chunks_exact(group.band.len().max(1))) {
                let own: f64 = row.iter().zip(near).map(|(v, z)| v * z).sum();
                trace += value * own;
            }
        }
        weight * weight * trace
    }
}

/// Adds a multiple of a row, as far as it goes.
#[inline]
fn add(sums: &mut [f64], factor: f64, row: &[f64]) {
    let n = sums.len().min(row.len());
    let (sums, row) = (&mut sums[..n], &row[..n]);
    for k in 0..n {
        sums[k] += factor * row[k];
    }
}
