//! The rows of all traces, gathered on the cells of their groups: what a reading counts for hardly changes within one.

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::problem::NoValue;

use super::laws::Whole;
use super::supposed::Counted;
use super::survey::Survey;
use super::traces::Group;
use super::{rms, sum_of_squares};
use crate::noise::about_middle;

/// Readings of a cell whose derivatives stand for all of it.
const MOST_ROWS: usize = 4;
/// The derivatives of what one reading would be: by unknowns of the band (one may appear twice) and by
/// all of the border.
pub type Derivatives = (Vec<(usize, f64)>, Vec<f64>);

/// The derivatives of the sum of a cell's readings, over their standard deviation.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) band: Vec<(usize, f64)>,
    pub(super) border: Vec<f64>,
    pub(super) count: f64,
}

/// A trace on cells.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    pub(super) positions: Vec<f64>,
    /// The same from the middle of the trace.
    pub(super) about_middle: Vec<f64>,
    /// What a shift of one is in weighted units, against readings of the mean weight.
    pub(super) one: f64,
    pub(super) rows: Vec<Row>,
    /// The place of each cell among all channels', directions' and positions'; repeats share it.
    pub(super) places: Vec<usize>,
}

impl Cells {
    /// As laws see it.
    pub(super) fn whole(&self) -> Whole<'_> {
        Whole {
            about_middle: &self.about_middle,
            one: self.one,
        }
    }
}

/// The rows of all traces, gathered on cells.
#[derive(Debug, Clone)]
pub struct Gathered {
    pub(super) traces: Vec<Cells>,
    places: usize,
}

impl Gathered {
    /// Gathers the readings of groups around a solution.
    pub fn new(
        row: impl Fn(usize, usize) -> Result<Derivatives, NoValue>,
        survey: &Survey,
        groups: &[Group],
        weights: &[f64],
    ) -> Result<Self, NoValue> {
        let ones = ones(weights);
        let mut traces = Vec::new();
        let mut places = 0;
        for group in groups {
            for (trace, on_cells) in group.traces.iter().zip(&group.on_cells) {
                let rows_of = &survey.traces[group.channel][*trace];
                let mut cells = Cells {
                    positions: Vec::with_capacity(on_cells.cells.len()),
                    about_middle: Vec::new(),
                    one: ones[group.channel],
                    rows: Vec::with_capacity(on_cells.cells.len()),
                    places: Vec::with_capacity(on_cells.cells.len()),
                };
                for (cell, range) in &on_cells.cells {
                    let taken = range.len().min(MOST_ROWS);
                    let count = range.len() as f64;
                    let factor = weights[group.channel] * count / taken as f64;
                    let mut sum = Row {
                        band: Vec::new(),
                        border: Vec::new(),
                        count,
                    };
                    for k in 0..taken {
                        let at = range.start + (2 * k + 1) * range.len() / (2 * taken);
                        let (band, border) = row(group.channel, rows_of.row(at))?;
                        sum.band.extend(band.iter().map(|(j, v)| (*j, factor * v)));
                        sum.border.resize(border.len(), 0.0);
                        for (sum, v) in sum.border.iter_mut().zip(&border) {
                            *sum += factor * v;
                        }
                    }
                    cells.positions.push(group.positions[*cell]);
                    cells.rows.push(sum);
                    cells.places.push(places + cell);
                }
                cells.about_middle = about_middle(&cells.positions);
                traces.push(cells);
            }
            places += group.positions.len();
        }
        Ok(Self { traces, places })
    }

    /// What the readings of each cell count for, trace by trace, for a combination of unknowns whose
    /// covariances with all unknowns these are.
    pub(super) fn counting(&self, (band, border): &(Vec<f64>, Vec<f64>)) -> Vec<Vec<f64>> {
        let of = |row: &Row| {
            let near: f64 = row.band.iter().map(|(j, v)| v * band[*j]).sum();
            near + row
                .border
                .iter()
                .zip(border)
                .map(|(v, z)| v * z)
                .sum::<f64>()
        };
        self.traces
            .iter()
            .map(|trace| trace.rows.iter().map(of).collect())
            .collect()
    }

    /// Σ (Σ w)²/n over the cells, w what their n readings count for.
    pub(super) fn squares_of_cells(&self, counting: &[Vec<f64>]) -> f64 {
        let cells = self.traces.iter().zip(counting);
        let each = cells.flat_map(|(trace, own)| trace.rows.iter().zip(own));
        each.map(|(row, w)| w * w / row.count).sum()
    }

    /// Σ of squares of what repeats of one place count for together.
    pub(super) fn shared_squares(&self, counting: &[Vec<f64>]) -> f64 {
        let mut sums = vec![0.0; self.places];
        for (trace, own) in self.traces.iter().zip(counting) {
            for (place, w) in trace.places.iter().zip(own) {
                sums[*place] += w;
            }
        }
        sum_of_squares(&sums)
    }

    /// What the cells count for in a combination of unknowns of the border, trace by trace.
    pub fn counted(
        &self,
        covariance: &BorderedCovariance,
        border: &[(usize, f64)],
    ) -> Vec<Counted> {
        let counting = self.counting(&covariance.times(&[], border));
        let traces = self.traces.iter().zip(counting);
        traces
            .map(|(trace, counting)| Counted {
                positions: trace.positions.clone(),
                counting,
                readings: trace.rows.iter().map(|row| row.count).collect(),
            })
            .collect()
    }
}

/// What a shift of one is in the weighted units of each channel, against channels of the mean weight: an indicator that is
/// zeroed anew, or drifts, does so by as much whether it is noisy or not.
pub(super) fn ones(weights: &[f64]) -> Vec<f64> {
    let sigmas: Vec<f64> = weights.iter().map(|w| 1.0 / w).collect();
    let mean = rms(&sigmas);
    weights.iter().map(|w| w * mean).collect()
}
