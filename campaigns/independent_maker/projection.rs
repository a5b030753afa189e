//! What a fit with free forms cannot take up: a plain dense least-squares fit of its own.
//!
//! Unknowns: M, S_A and S_B at every position, α, β, γ and an offset a channel; S_A and S_B have no
//! straight line, that of M belongs to α. Readings of one channel at one position, whatever repeat and
//! direction, share one expectation.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector};

use crate::design::Schedule;
use crate::rig::Moment;

/// Signs of M and α, of β, and the surface of each channel 1A, 1B, 2A, 2B.
const M: [f64; 4] = [1.0, -1.0, -1.0, 1.0];
const BETA: [f64; 4] = [1.0, 1.0, -1.0, -1.0];
const SIDE: [usize; 4] = [0, 1, 0, 1];

/// Diagonal of R below which a column adds nothing to those before it.
const DEPENDENT: f64 = 1e-9;

/// What one set of counts leaves.
struct Absorbed {
    /// An orthonormal basis of what the fit takes up, one row a cell in use.
    basis: DMatrix<f64>,
}

/// Cells: a channel at a nominal position.
struct Cells {
    count: Vec<f64>,
    sum: Vec<f64>,
    square: Vec<f64>,
}

/// The true gap of a change of the readings: √(RSS/ν) of its projection, µm.
pub fn true_gap(schedule: &Schedule, change: &[Vec<f64>]) -> f64 {
    let cells = Cells::of(schedule, change);
    let first = cells.count.first().copied().unwrap_or(0.0);
    if cells.count.iter().all(|n| *n == first && first > 0.0) {
        cells.gap(&Absorbed::of_even(cells.count.len()))
    } else {
        cells.gap(&Absorbed::of(&cells.count))
    }
}

/// The cell of a reading.
pub fn cell(schedule: &Schedule, moment: &Moment) -> usize {
    let nearest = (moment.x / schedule.spacing).round().max(0.0) as usize;
    moment.channel() * schedule.positions + nearest.min(schedule.positions - 1)
}

/// What the fit takes up of single readings: independent columns, one row a cell in use, and the row of each cell.
pub fn absorbed(schedule: &Schedule) -> (DMatrix<f64>, Vec<usize>) {
    let nothing: Vec<Vec<f64>> = schedule
        .traces
        .iter()
        .map(|trace| vec![0.0; trace.moments().count()])
        .collect();
    let count = Cells::of(schedule, &nothing).count;
    let mut basis = Absorbed::of(&count).basis;
    let mut row_of = vec![0; count.len()];
    let used = count.iter().enumerate().filter(|(_, n)| **n > 0.0);
    for (row, (cell, n)) in used.enumerate() {
        row_of[cell] = row;
        basis.row_mut(row).scale_mut(1.0 / n.sqrt());
    }
    (basis, row_of)
}

impl Cells {
    fn of(schedule: &Schedule, change: &[Vec<f64>]) -> Self {
        let zero = vec![0.0; 4 * schedule.positions];
        let mut cells = Self {
            count: zero.clone(),
            sum: zero.clone(),
            square: zero,
        };
        for (trace, values) in schedule.traces.iter().zip(change) {
            for (moment, value) in trace.moments().zip(values) {
                let cell = cell(schedule, &moment);
                cells.count[cell] += 1.0;
                cells.sum[cell] += value;
                cells.square[cell] += value * value;
            }
        }
        cells
    }

    fn gap(&self, absorbed: &Absorbed) -> f64 {
        let used: Vec<usize> = (0..self.count.len())
            .filter(|k| self.count[*k] > 0.0)
            .collect();
        let mut within = 0.0;
        let mut means = DVector::zeros(used.len());
        for (row, cell) in used.iter().enumerate() {
            let mean = self.sum[*cell] / self.count[*cell];
            within += (self.square[*cell] - mean * self.sum[*cell]).max(0.0);
            means[row] = self.count[*cell].sqrt() * mean;
        }
        let taken = absorbed.basis.tr_mul(&means);
        let left = &means - &absorbed.basis * taken;
        let freedom = self.count.iter().sum::<f64>() - absorbed.basis.ncols() as f64;
        ((within + left.norm_squared()) / freedom.max(1.0)).sqrt()
    }
}

impl Absorbed {
    /// Of cells that all have as many readings; worked out once for each number of them.
    fn of_even(cells: usize) -> Arc<Self> {
        static EVEN: Mutex<BTreeMap<usize, Arc<Absorbed>>> = Mutex::new(BTreeMap::new());
        let mut known = EVEN.lock().unwrap_or_else(PoisonError::into_inner);
        let absorbed = known
            .entry(cells)
            .or_insert_with(|| Arc::new(Self::of(&vec![1.0; cells])));
        Arc::clone(absorbed)
    }

    fn of(count: &[f64]) -> Self {
        let used: Vec<usize> = (0..count.len()).filter(|k| count[*k] > 0.0).collect();
        let n = count.len() / 4;
        let t = |k: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
        let level = without_line(n);
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut column = |value: &dyn Fn(usize, usize) -> f64| {
            columns.push(DVector::from_iterator(
                used.len(),
                used.iter()
                    .map(|cell| count[*cell].sqrt() * value(cell / n, cell % n)),
            ));
        };
        for channel in 0..4 {
            column(&|c, _| f64::from(u8::from(c == channel)));
        }
        column(&|c, k| M[c] * t(k));
        column(&|c, k| BETA[c] * t(k));
        column(&|c, k| M[c] * BETA[c] * t(k));
        for at in 0..n {
            column(&|c, k| M[c] * f64::from(u8::from(k == at)));
        }
        for j in 0..level.ncols() {
            for side in 0..2 {
                column(&|c, k| if SIDE[c] == side { level[(k, j)] } else { 0.0 });
            }
        }
        let decomposed = DMatrix::from_columns(&columns).col_piv_qr();
        let r = decomposed.r();
        let most = r[(0, 0)].abs();
        let rank = (0..r.nrows())
            .take_while(|k| r[(*k, *k)].abs() > DEPENDENT * most)
            .count();
        Self {
            basis: decomposed.q().columns(0, rank).into_owned(),
        }
    }
}

/// An orthonormal basis of the profiles without mean and straight line.
fn without_line(n: usize) -> DMatrix<f64> {
    let mut all = DMatrix::identity(n, n + 2);
    for k in 0..n {
        all[(k, 0)] = 1.0;
        all[(k, 1)] = 2.0 * k as f64 / (n - 1) as f64 - 1.0;
        for j in 0..n {
            all[(k, j + 2)] = f64::from(u8::from(j == k));
        }
    }
    all.columns(0, n)
        .into_owned()
        .qr()
        .q()
        .columns(2, n - 2)
        .into_owned()
}
