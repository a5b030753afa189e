//! What the rows of a design matrix determine of its unknowns.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A column counts as a sum of those before it where less than this share of it is left: what half a
/// degree of an angle could bring about.
const LEAST_LEFT: f64 = 0.01;

/// Smaller coefficients are rounding: angles are right or far from it.
const ROUNDING: f64 = 1e-9;

/// Above this many channels closures of four channels are not searched.
const MOST_SEARCHED: usize = 24;

/// A design matrix (one row a channel), its columns in the order in which they are preferred: a column
/// that is a sum of those before it is *free*, and the readings do not determine its unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    unknowns: Vec<String>,
    matrix: DMatrix<f64>,
    pivots: Vec<usize>,
    free: Vec<usize>,
    /// Each free column as a sum of the pivots'.
    sums: DMatrix<f64>,
}

impl Analysis {
    /// The analysis of a matrix; unknowns whose column is zero are left out, no channel sees them.
    pub fn new(columns: Vec<(String, Vec<f64>)>) -> Self {
        let rows = columns.first().map_or(0, |c| c.1.len());
        let (unknowns, seen): (Vec<String>, Vec<Vec<f64>>) = columns
            .into_iter()
            .filter(|(_, column)| column.iter().any(|v| *v != 0.0))
            .unzip();
        let matrix = DMatrix::from_fn(rows, seen.len(), |r, c| seen[c][r]);
        let (pivots, free) = pivots(&matrix);
        let inverse = inverse(&matrix.select_columns(&pivots));
        let sums = (inverse * matrix.select_columns(&free)).map(clean);
        Self {
            unknowns,
            matrix,
            pivots,
            free,
            sums,
        }
    }

    /// Names of the unknowns that some channel sees.
    pub fn unknowns(&self) -> &[String] {
        &self.unknowns
    }

    /// One row a channel, one column an unknown.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// How many independent combinations of the unknowns are determined.
    pub fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// How many combinations of the channels are zero whatever the unknowns are.
    pub fn to_spare(&self) -> usize {
        self.matrix.nrows() - self.rank()
    }

    /// The unknowns that are fitted, the free ones being held at zero.
    pub fn pivots(&self) -> &[usize] {
        &self.pivots
    }

    /// The unknowns that are not determined beside those before them.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// By how much of each unknown no reading changes, for each free unknown: it by one, others as
    /// they make up for it.
    pub fn null_space(&self) -> Vec<Vec<f64>> {
        (0..self.free.len())
            .map(|f| {
                let mut vector = vec![0.0; self.unknowns.len()];
                vector[self.free[f]] = 1.0;
                for (p, j) in self.pivots.iter().enumerate() {
                    vector[*j] = 0.0 - self.sums[(p, f)];
                }
                vector
            })
            .collect()
    }

    /// What the fitted unknown of each pivot stands for: it and a sum of free ones.
    pub fn combinations(&self) -> Vec<Vec<f64>> {
        (0..self.pivots.len())
            .map(|p| {
                let mut vector = vec![0.0; self.unknowns.len()];
                vector[self.pivots[p]] = 1.0;
                for (f, j) in self.free.iter().enumerate() {
                    vector[*j] = self.sums[(p, f)];
                }
                vector
            })
            .collect()
    }

    /// The place among the pivots of an unknown that is determined by itself.
    pub fn alone(&self, name: &str) -> Option<usize> {
        let p = (0..self.pivots.len()).find(|p| self.unknowns[self.pivots[*p]] == name)?;
        self.sums.row(p).iter().all(|v| *v == 0.0).then_some(p)
    }

    /// Least-squares weights on the channels, one row a pivot.
    pub fn weights(&self) -> DMatrix<f64> {
        inverse(&self.matrix.select_columns(&self.pivots))
    }

    /// Independent combinations of the channels that are zero whatever the unknowns are: of four
    /// channels where there are such, the greatest weight 1.
    pub fn closures(&self) -> Vec<Vec<f64>> {
        let n = self.matrix.nrows();
        let mut found = Vec::new();
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut take = |weights: Vec<f64>, found: &mut Vec<Vec<f64>>| {
            let mut rest = DVector::from_column_slice(&weights);
            for b in &basis {
                rest -= b * rest.dot(b);
            }
            if rest.norm() > ROUNDING {
                basis.push(rest.normalize());
                found.push(weights);
            }
        };
        if n <= MOST_SEARCHED {
            for rows in fours(n) {
                if found.len() == self.to_spare() {
                    break;
                }
                if let Some(own) = left_null(&self.matrix.select_rows(&rows)).as_deref() {
                    let mut weights = vec![0.0; n];
                    for (r, w) in rows.iter().zip(own) {
                        weights[*r] = *w;
                    }
                    take(weights, &mut found);
                }
            }
        }
        // What is left: each channel against its value by all others' least squares.
        let pivots = self.matrix.select_columns(&self.pivots);
        let rest = DMatrix::identity(n, n) - &pivots * self.weights();
        for row in rest.row_iter() {
            if found.len() == self.to_spare() {
                break;
            }
            let largest = row.amax();
            if largest > ROUNDING {
                take(row.iter().map(|w| clean(w / largest)).collect(), &mut found);
            }
        }
        found
    }
}

fn clean(value: f64) -> f64 {
    let whole = (value * 12.0).round() / 12.0;
    // Right angles make small fractions: without their rounding.
    if (value - whole).abs() < ROUNDING {
        whole
    } else {
        value
    }
}

/// Which columns are no sums of those before them, and which are.
pub(super) fn pivots(matrix: &DMatrix<f64>) -> (Vec<usize>, Vec<usize>) {
    let (mut pivots, mut free) = (Vec::new(), Vec::new());
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for (j, column) in matrix.column_iter().enumerate() {
        let mut rest = column.into_owned();
        // Twice: the second time takes out what rounding has left.
        for _ in 0..2 {
            for b in &basis {
                rest -= b * rest.dot(b);
            }
        }
        let left = rest.norm();
        if left > LEAST_LEFT * column.norm() {
            basis.push(rest / left);
            pivots.push(j);
        } else {
            free.push(j);
        }
    }
    (pivots, free)
}

/// (AᵀA)⁻¹Aᵀ of a matrix of full column rank; its entries are cosines, and the normal matrix is as good
/// as it.
fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    match Cholesky::new(matrix.tr_mul(matrix)) {
        Some(normal) => normal.solve(&matrix.transpose()),
        None => DMatrix::zeros(matrix.ncols(), matrix.nrows()),
    }
}

/// All choices of four of n rows.
fn fours(n: usize) -> impl Iterator<Item = [usize; 4]> {
    (0..n).flat_map(move |a| {
        (a + 1..n)
            .flat_map(move |b| (b + 1..n).flat_map(move |c| (c + 1..n).map(move |d| [a, b, c, d])))
    })
}

/// The one combination of four rows that is zero, if all four weights are ±1.
fn left_null(rows: &DMatrix<f64>) -> Option<Vec<f64>> {
    // Signs: the first is +, and any of the others may be −.
    (1..8_u8)
        .map(|signs| {
            let sign = |k: u8| if signs & (1 << k) == 0 { 1.0 } else { -1.0 };
            vec![1.0, sign(0), sign(1), sign(2)]
        })
        .find(|weights| {
            rows.column_iter().all(|column| {
                let sum: f64 = column.iter().zip(weights).map(|(v, w)| v * w).sum();
                sum.abs() < ROUNDING
            })
        })
}
