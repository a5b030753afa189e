//! Bumps on a line under a common stretch and shift: a band with a border.

use errsep_solvers::Options;
use errsep_solvers::linear::bordered::{Constraints, Share};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{
    Parameters, Sink, StructuredFit, StructuredProblem, fit_structured,
};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Piecewise quadratic bumps c_k on a line, seen through a stretch and a shift that all rows share:
/// r = Σ_k N_k(x) c_k · exp(y₀ sin 9x) + y₁ + y₂ cos 7.3x − data. The mean of c is tied to y₁ by a
/// constraint.
pub(super) struct Bumps {
    pub(super) x: Vec<f64>,
    pub(super) data: Vec<f64>,
    pub(super) coefficients: usize,
    pub(super) constraints: Constraints,
    pub(super) held: Vec<bool>,
    /// Of the rows of even and of odd cells: the two parts.
    pub(super) weights: [f64; 2],
}

pub(super) const BORDER: usize = 3;

impl Bumps {
    pub(super) fn new(cells: usize, per_cell: usize, noise: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let coefficients = cells + 2;
        let x: Vec<f64> = (0..cells * per_cell)
            .map(|i| (i as f64 + 0.5) / per_cell as f64)
            .collect();
        let c: Vec<f64> = (0..coefficients)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let data = x
            .iter()
            .map(|x| {
                let (k, n) = bumps(*x, cells);
                let form: f64 = (0..3).map(|l| n[l] * c[k + l]).sum();
                let scaled = x / cells as f64;
                form * (0.3 * scaled).exp() + 0.2 - 0.1 * scaled
                    + noise * rng.random_range(-1.0..1.0)
            })
            .collect();
        let mut border = DMatrix::zeros(1, BORDER);
        border[(0, 1)] = 1.0;
        Self {
            x,
            data,
            coefficients,
            constraints: Constraints {
                band: vec![vec![1.0 / coefficients as f64; coefficients]],
                border,
                value: DVector::zeros(1),
            },
            held: vec![false; BORDER],
            weights: [1.0; 2],
        }
    }

    pub(super) fn cells(&self) -> usize {
        self.coefficients - 2
    }

    /// Residual and dense row at a point.
    pub(super) fn dense_row(&self, i: usize, at: &Parameters) -> (f64, Vec<f64>) {
        let x = self.x[i];
        let (k, n) = bumps(x, self.cells());
        let (swell, ripple) = ((9.0 * x).sin(), (7.3 * x).cos());
        let stretch = (at.border[0] * swell).exp();
        let mut row = vec![0.0; self.coefficients + BORDER];
        let mut form = 0.0;
        for l in 0..3 {
            row[k + l] = n[l] * stretch;
            form += n[l] * at.band[k + l];
        }
        row[self.coefficients] = form * swell * stretch;
        row[self.coefficients + 1] = 1.0;
        row[self.coefficients + 2] = ripple;
        let model = form * stretch + at.border[1] + at.border[2] * ripple;
        let weight = self.weights[k % 2];
        for value in &mut row {
            *value *= weight;
        }
        (weight * (model - self.data[i]), row)
    }

    pub(super) fn dense(&self, at: &Parameters) -> (DMatrix<f64>, DVector<f64>) {
        let mut jacobian = DMatrix::zeros(self.x.len(), self.coefficients + BORDER);
        let mut residual = DVector::zeros(self.x.len());
        for i in 0..self.x.len() {
            let (r, row) = self.dense_row(i, at);
            residual[i] = r;
            jacobian.row_mut(i).copy_from_slice(&row);
        }
        (jacobian, residual)
    }

    /// A basis of the steps that keep the constraint: columns of length n + q.
    pub(super) fn allowed(&self) -> DMatrix<f64> {
        let n = self.coefficients;
        // y₁ follows from c: leave it out and put the mean of c in its row.
        DMatrix::from_fn(n + BORDER, n + BORDER - 1, |i, j| {
            let own = if j <= n { j } else { j + 1 };
            match i {
                i if i == n + 1 => {
                    if j < n {
                        1.0 / n as f64
                    } else {
                        0.0
                    }
                }
                i => f64::from(u8::from(i == own)),
            }
        })
    }
}

/// Quadratic B-spline pieces on unit cells.
pub(super) fn bumps(x: f64, cells: usize) -> (usize, [f64; 3]) {
    let k = (x.floor() as usize).min(cells - 1);
    let t = x - k as f64;
    (
        k,
        [0.5 * (1.0 - t).powi(2), 0.5 + t * (1.0 - t), 0.5 * t * t],
    )
}

pub(super) fn solve(problem: &Bumps, start: Parameters) -> StructuredFit {
    fit_structured(problem, start, &Options::structured()).unwrap()
}

/// Every unknown of the border has a local column of its own, after those of the band.
pub(super) fn own_columns(band: u32) -> Vec<Share> {
    (0..BORDER as u32)
        .map(|unknown| Share {
            column: band + unknown,
            unknown,
            weight: 1.0,
        })
        .collect()
}

impl StructuredProblem for Bumps {
    type Prepared = Parameters;

    fn band_count(&self) -> usize {
        self.coefficients
    }
    fn border_count(&self) -> usize {
        BORDER
    }
    fn part_count(&self) -> usize {
        2
    }
    fn constraints(&self) -> &Constraints {
        &self.constraints
    }
    fn held(&self) -> &[bool] {
        &self.held
    }
    fn prepare(&self, at: &Parameters) -> Result<Parameters, NoValue> {
        if at.border[0].abs() > 50.0 {
            return Err(NoValue::new("the stretch is beyond e^50"));
        }
        Ok(at.clone())
    }
    fn band_width(&self, _: &Parameters) -> usize {
        3
    }
    fn task_count(&self, _: &Parameters) -> usize {
        self.cells()
    }
    fn task(&self, at: &Parameters, cell: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let rows: Vec<usize> = (0..self.x.len())
            .filter(|i| bumps(self.x[*i], self.cells()).0 == cell)
            .collect();
        sink.open(3 + BORDER + 1);
        for some in rows.chunks(100) {
            let batch = sink.batch(some.len());
            for (b, i) in some.iter().enumerate() {
                let (residual, row) = self.dense_row(*i, at);
                for l in 0..3 {
                    batch.column_mut(l)[b] = row[cell + l];
                }
                for l in 0..BORDER {
                    batch.column_mut(3 + l)[b] = row[self.coefficients + l];
                }
                batch.column_mut(3 + BORDER)[b] = residual;
            }
            sink.push();
        }
        sink.close(
            (cell..cell + 3).map(Some).collect(),
            own_columns(3),
            cell % 2,
        );
        Ok(())
    }
}

pub(super) fn somewhere(problem: &Bumps) -> Parameters {
    let mut at = Parameters::zeros(problem.coefficients, BORDER);
    for (k, c) in at.band.iter_mut().enumerate() {
        *c = (k as f64).sin();
    }
    at.border[0] = 0.1;
    at.border[1] = at.band.iter().sum::<f64>() / problem.coefficients as f64;
    at
}
