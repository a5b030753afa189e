//! Where a task puts its rows.

use crate::linear::banded::{Tall, compress};
use crate::linear::bordered::{Group, Share};

/// Below this, squares have lost digits: the least normal number over the rounding unit.
pub(super) const LEAST_COST: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// Takes batches of rows, compresses each at once and keeps one small triangle a group.
#[derive(Debug)]
pub struct Sink {
    batch: Tall,
    open: Vec<f64>,
    columns: usize,
    groups: Vec<Group>,
    cost: f64,
    vanished: bool,
}

impl Default for Sink {
    fn default() -> Self {
        Self {
            batch: Tall::new(16),
            open: Vec::new(),
            columns: 0,
            groups: Vec::new(),
            cost: 0.0,
            vanished: false,
        }
    }
}

impl Sink {
    /// Begins a group whose rows have so many local columns, the residual included.
    pub fn open(&mut self, columns: usize) {
        self.columns = columns;
        self.cost = 0.0;
        self.open.clear();
        self.open.resize(columns * columns, 0.0);
    }

    /// The batch to fill with `rows` rows (at most [`Tall::CAPACITY`]) of the open group.
    pub fn batch(&mut self, rows: usize) -> &mut Tall {
        self.batch.reset(rows, self.columns);
        &mut self.batch
    }

    /// Takes the filled batch; its part of the cost is half its sum of squares.
    pub fn push(&mut self) {
        let residual = self.batch.column(self.columns - 1);
        let cost = 0.5 * residual.iter().map(|r| r * r).sum::<f64>();
        if cost < LEAST_COST && residual.iter().any(|r| *r != 0.0) {
            self.vanished = true;
        }
        self.push_with_cost(cost);
    }

    /// Takes the filled batch and its part of the cost, where rows have been weighted by a robust
    /// loss and the cost is not half their sum of squares.
    pub fn push_with_cost(&mut self, cost: f64) {
        self.cost += cost;
        compress(&mut self.batch, &mut self.open);
    }

    /// Ends the group: the unknown of each local band column (`None` where fixed at zero), what
    /// local columns are to the border, and the part of the rows it belongs to.
    pub fn close(&mut self, band: Vec<Option<usize>>, border: Vec<Share>, part: usize) {
        self.groups.push(Group {
            band,
            border,
            columns: self.columns,
            part,
            triangle: self.open.clone(),
            cost: self.cost,
        });
    }

    /// The groups that have come in since the last call, and whether a batch had residuals whose
    /// squares are too small for a number.
    pub(super) fn take(&mut self) -> (Vec<Group>, bool) {
        (
            std::mem::take(&mut self.groups),
            std::mem::take(&mut self.vanished),
        )
    }
}
