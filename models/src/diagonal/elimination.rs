//! The triangle of a design, eliminated level by level.
//!
//! A stop sees the functions of an axis at one position, and along a diagonal the positions of the axes
//! keep within one step of each other or of their mirror images. With the level of a position, its
//! distance in steps from the nearer end, a stop sees at most two levels, next to each other. The levels
//! are eliminated from the middle outwards by Householder reflections. What is left is a small dense
//! border: the ends of the axes, the squareness errors, the mirrors and the zeros of the runs.
//!
//! Three steps before keep it small, and change nothing:
//!
//! - runs over the same stops become one with their mean, weighted by the root of their number;
//! - the k readings of one stop become one by an orthogonal transformation, and k − 1 that see nothing
//!   but the zeros of their runs;
//! - what no stop sees of the functions at one position is split off ([`Group`]).

use super::design::{Design, RANK_TOLERANCE, decompose};
use super::diagonals::WorkZone;
use super::groups::{Arrangement, Slot, arrange};
use super::readings::DiagonalError;
use super::runs::{Gathered, Runs};
use super::undetermined::Undetermined;
use errsep_solvers::linear::banded::{BandTriangle, RowStack};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The triangle of a design.
#[derive(Debug)]
pub(super) struct Elimination {
    arrangement: Arrangement,
    triangle: BandTriangle,
    /// Columns of the band that depend on those before them.
    dependent: Vec<usize>,
    /// Number of zeros of runs, the last columns of the border.
    zeros: usize,
    /// Triangle of the border, q × q.
    pub(super) corner: DMatrix<f64>,
    /// Its right-hand side, length q.
    pub(super) right: DVector<f64>,
    /// What counts as zero in it.
    pub(super) floor: f64,
}

/// A stop in the columns of the triangle.
struct Row {
    band: Vec<(usize, f64)>,
    border: Vec<(usize, f64)>,
}

impl Elimination {
    /// Eliminates a design with its readings, µm.
    ///
    /// # Errors
    /// Singular values do not converge.
    pub(super) fn of(
        design: &Design,
        zone: &WorkZone,
        observed: &DVector<f64>,
    ) -> Result<Self, DiagonalError> {
        let arrangement = arrange(design, zone)?;
        let runs = Runs::of(design, observed);
        let (levels, unknowns) = (&arrangement.levels, arrangement.border);
        let (band, border) = (levels[levels.len() - 1], unknowns + runs.zeros.len());
        let width = levels.windows(3).map(|l| l[2] - l[0]).max();
        let mut found = Self {
            triangle: BandTriangle::new(band, width.unwrap_or(band), border + 1),
            arrangement,
            dependent: Vec::new(),
            zeros: runs.zeros.len(),
            corner: DMatrix::zeros(border, border),
            right: DVector::zeros(border),
            floor: 0.0,
        };
        let mut rest = Gathered::new(border + 1);
        let squares = found.fold(design, &runs, &mut rest);
        runs.differences(unknowns, &mut rest);
        let greatest = squares.iter().copied().fold(0.0, f64::max).sqrt();
        found.floor = RANK_TOLERANCE * greatest;
        let corner = rest.finish();
        for i in 0..border {
            for j in i..border {
                found.corner[(i, j)] = corner[i * (border + 1) + j];
            }
            found.right[i] = corner[i * (border + 1) + border];
        }
        Ok(found)
    }

    /// Folds the levels in, one after the other; the squares of the norms of all columns, band first.
    fn fold(&mut self, design: &Design, runs: &Runs, rest: &mut Gathered) -> Vec<f64> {
        let (band, tail) = (self.triangle.len(), self.triangle.tail());
        let unknowns = self.arrangement.border;
        let levels = self.arrangement.levels.clone();
        let mut by_level: Vec<Vec<(usize, Row)>> = Vec::new();
        by_level.resize_with(levels.len(), Vec::new);
        for (stop, terms) in design.stops.iter().enumerate() {
            let row = self.reduced(terms);
            let first = row.band.iter().map(|t| t.0).min().unwrap_or(band);
            let level = levels.partition_point(|&l| l <= first) - 1;
            by_level[level].push((stop, row));
        }
        let mut squares = vec![0.0; band + tail - 1];
        let mut stack = RowStack::default();
        for (level, rows) in by_level.iter().enumerate() {
            let first = levels[level];
            let end = *levels.get(level + 2).unwrap_or(&band);
            stack.reset(first, end - first, tail, rows.len());
            for (i, (stop, row)) in rows.iter().enumerate() {
                let out = stack.row_mut(i);
                let readings = &runs.readings[*stop];
                let weight = readings.iter().map(|r| r.count).sum::<f64>().sqrt();
                for &(j, a) in &row.band {
                    out[j - first] = weight * a;
                    squares[j] += (weight * a).powi(2);
                }
                let out = &mut out[end - first..];
                for &(j, a) in &row.border {
                    out[j] = weight * a;
                }
                for r in readings {
                    out[unknowns + r.zero] = r.count / weight;
                    out[tail - 1] += r.count / weight * r.value;
                }
                for (square, value) in squares[band..].iter_mut().zip(&*out) {
                    *square += value * value;
                }
            }
            if end > first {
                self.triangle.fold(&mut stack);
            }
            for row in stack.tails() {
                rest.push(row);
            }
            let last = *levels.get(level + 1).unwrap_or(&band);
            for i in first..last {
                if self.triangle.diagonal(i).abs() <= RANK_TOLERANCE * squares[i].sqrt() {
                    self.take_out(i, end, rest);
                }
            }
        }
        squares
    }

    /// Takes a dependent column out: the rest of its row belongs to the unknowns after it.
    fn take_out(&mut self, i: usize, end: usize, rest: &mut Gathered) {
        self.dependent.push(i);
        let row = self.triangle.take_row(i);
        let (band, tail) = row.split_at(row.len() - self.triangle.tail());
        let span = end - i - 1;
        let mut stack = RowStack::default();
        stack.reset(i + 1, span, tail.len(), 1);
        stack.row_mut(0)[..span].copy_from_slice(&band[..span]);
        stack.row_mut(0)[span..].copy_from_slice(tail);
        if span > 0 {
            self.triangle.fold(&mut stack);
        }
        for row in stack.tails() {
            rest.push(row);
        }
    }

    fn reduced(&self, terms: &[(usize, f64)]) -> Row {
        let mut row = Row {
            band: Vec::new(),
            border: Vec::new(),
        };
        for &(place, a) in terms {
            match self.arrangement.slots[place] {
                Slot::Border(column) => row.border.push((column, a)),
                Slot::Group(group, k) => {
                    let group = &self.arrangement.groups[group];
                    for (r, v) in group.seen.row(k).iter().enumerate() {
                        match row.band.iter_mut().find(|t| t.0 == group.first + r) {
                            Some(term) => term.1 += a * v,
                            None => row.band.push((group.first + r, a * v)),
                        }
                    }
                }
            }
        }
        row
    }

    /// Combinations that the readings determine, where the border alone has `border` of them.
    pub(super) fn rank_with(&self, border: usize) -> usize {
        self.triangle.len() - self.dependent.len() + border - self.zeros
    }

    /// Combinations that the readings determine.
    ///
    /// # Errors
    /// Singular values do not converge.
    pub(super) fn rank(&self) -> Result<usize, DiagonalError> {
        let border = decompose(&self.corner, self.floor)?;
        Ok(self.rank_with(border.determined.len()))
    }

    /// Where an unknown is, with the columns of the band that belong to its group.
    pub(super) fn slot(&self, place: usize) -> (Slot, Range<usize>) {
        let slot = self.arrangement.slots[place];
        let columns = match slot {
            Slot::Border(_) => 0..0,
            Slot::Group(group, _) => {
                let group = &self.arrangement.groups[group];
                group.first..group.first + group.seen.ncols()
            }
        };
        (slot, columns)
    }

    /// One unknown of a group in the columns that belong to it.
    pub(super) fn seen(&self, group: usize, row: usize) -> impl Iterator<Item = f64> {
        let seen = &self.arrangement.groups[group].seen;
        (0..seen.ncols()).map(move |r| seen[(row, r)])
    }

    /// Number of columns of the band.
    pub(super) fn band(&self) -> usize {
        self.triangle.len()
    }

    /// The columns of each level and of the next.
    pub(super) fn levels(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let levels = &self.arrangement.levels;
        (1..levels.len()).map(|l| {
            let end = *levels.get(l + 1).unwrap_or(&levels[l]);
            (levels[l - 1]..levels[l], levels[l]..end)
        })
    }

    /// Element of the triangle over the band.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        match j.checked_sub(i) {
            Some(offset) => *self.triangle.band(i).get(offset).unwrap_or(&0.0),
            None => 0.0,
        }
    }

    /// Element of the border beside it.
    pub(super) fn border_entry(&self, i: usize, column: usize) -> f64 {
        self.triangle.tail_row(i)[column]
    }

    /// What the readings leave open: what no stop sees, what depends on others in the band, and the
    /// orthonormal columns of `border`, q × k, continued into the band.
    ///
    /// # Errors
    /// Singular values do not converge.
    pub(super) fn undetermined(
        &self,
        border: &DMatrix<f64>,
    ) -> Result<Undetermined, DiagonalError> {
        let none = vec![0.0; self.right.len()];
        let dependent = self.dependent.iter().map(|&j| {
            let mut band = vec![0.0; self.triangle.len()];
            for i in j.saturating_sub(self.triangle.width() - 1)..j {
                band[i] = -self.triangle.band(i)[j - i];
            }
            self.triangle.solve(&mut band);
            band[j] = 1.0;
            self.unknowns(&band, &none)
        });
        let continued = border.column_iter().map(|column| {
            let border: Vec<f64> = column.iter().copied().collect();
            let mut band = self.less_border(vec![0.0; self.triangle.len()], &border);
            self.triangle.solve(&mut band);
            self.unknowns(&band, &border)
        });
        let shared: Vec<DVector<f64>> = dependent.chain(continued).collect();
        let unseen = self
            .arrangement
            .groups
            .iter()
            .filter(|g| g.unseen.ncols() > 0);
        Undetermined::of(
            self.arrangement.slots.len(),
            unseen.map(|g| (&g.places[..], &g.unseen)),
            &shared,
        )
    }

    /// Unknowns by the columns of the triangle.
    fn unknowns(&self, band: &[f64], border: &[f64]) -> DVector<f64> {
        let values = self.arrangement.slots.iter().map(|slot| match *slot {
            Slot::Border(column) => border[column],
            Slot::Group(group, k) => {
                let group = &self.arrangement.groups[group];
                let seen = &band[group.first..];
                group.seen.row(k).iter().zip(seen).map(|(v, y)| v * y).sum()
            }
        });
        DVector::from_iterator(self.arrangement.slots.len(), values)
    }

    /// Columns of the triangle by unknowns: the transpose of [`Self::unknowns`].
    fn columns(&self, unknowns: &DVector<f64>) -> (Vec<f64>, DVector<f64>) {
        let mut band = vec![0.0; self.triangle.len()];
        let mut border = DVector::zeros(self.right.len());
        for (slot, &value) in self.arrangement.slots.iter().zip(unknowns) {
            match *slot {
                Slot::Border(column) => border[column] = value,
                Slot::Group(group, k) => {
                    let group = &self.arrangement.groups[group];
                    for (y, v) in band[group.first..].iter_mut().zip(&group.seen.row(k)) {
                        *y += v * value;
                    }
                }
            }
        }
        (band, border)
    }

    fn less_border(&self, mut band: Vec<f64>, border: &[f64]) -> Vec<f64> {
        for (i, value) in band.iter_mut().enumerate() {
            let tail = self.triangle.tail_row(i);
            *value -= tail.iter().zip(border).map(|(r, b)| r * b).sum::<f64>();
        }
        band
    }

    /// The scaled unknowns that belong to a solution of the border.
    pub(super) fn solution(&self, border: &DVector<f64>) -> DVector<f64> {
        let last = self.triangle.tail() - 1;
        let right = (0..self.triangle.len()).map(|i| self.triangle.tail_row(i)[last]);
        let mut band = self.less_border(right.collect(), border.as_slice());
        self.triangle.solve(&mut band);
        self.unknowns(&band, border.as_slice())
    }

    /// What a gradient Mᵀr of residuals r still adds to the scaled unknowns, by the triangle alone;
    /// `root` is W of the border, whose covariance is W Wᵀ.
    pub(super) fn correction(&self, gradient: &DVector<f64>, root: &DMatrix<f64>) -> DVector<f64> {
        let (mut band, mut border) = self.columns(gradient);
        self.triangle.solve_transposed(&mut band);
        for (i, z) in band.iter().enumerate() {
            for (b, r) in border.iter_mut().zip(self.triangle.tail_row(i)) {
                *b -= r * z;
            }
        }
        let border = root * root.tr_mul(&border);
        let mut band = self.less_border(band, border.as_slice());
        self.triangle.solve(&mut band);
        self.unknowns(&band, border.as_slice())
    }
}
