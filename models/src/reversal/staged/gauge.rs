//! The straight-line part of a profile on the grid.

use super::grid::{Grid, LONGEST_GAP};
use super::resample::{Interpolation, Stencil};
use crate::reversal::cells::cell_width;

/// Height and slope of the line of a profile as weighted sums of its values.
#[derive(Debug, Clone)]
pub struct LinePart {
    /// Where the height is taken, mm.
    pub center: f64,
    /// Weights of the height.
    pub height: Vec<f64>,
    /// Weights of the slope, 1/mm.
    pub slope: Vec<f64>,
}

impl LinePart {
    /// The least-squares line of values at places with weights, each place's value made of the grid's.
    fn of(places: &[(f64, f64, Stencil)], count: usize) -> Self {
        let total: f64 = places.iter().map(|(_, w, _)| w).sum();
        let center = places.iter().map(|(x, w, _)| w * x).sum::<f64>() / total;
        let spread: f64 = places
            .iter()
            .map(|(x, w, _)| w * (x - center).powi(2))
            .sum();
        let mut part = Self {
            center,
            height: vec![0.0; count],
            slope: vec![0.0; count],
        };
        for (x, w, stencil) in places {
            for (k, a) in stencil.terms() {
                part.height[k] += w * a / total;
                part.slope[k] += w * (x - center) * a / spread;
            }
        }
        part
    }

    /// The line by which forms are gauged: over the measured positions that the grid reaches, each
    /// weighted by the width of its cell. Also the number of positions beyond reach.
    ///
    /// Traces of different grids end at different places about one spacing apart: so far the form is
    /// followed by its tangent, in the narrow cells that such ends have. Where the traces share their
    /// positions an end that does not tell the forms apart is not reached.
    pub fn gauge(
        grid: &Grid,
        positions: impl Iterator<Item = f64>,
        how: Interpolation,
    ) -> (Self, usize) {
        let reach = (!grid.one_grid).then_some(grid.spacing);
        let longest = LONGEST_GAP * grid.spacing;
        let mut beyond = 0;
        let mut reached = Vec::with_capacity(grid.x.len());
        for x in positions {
            match Stencil::at(&grid.x, x, grid.same, longest, reach, how) {
                Some(stencil) => reached.push((x, stencil)),
                None => beyond += 1,
            }
        }
        let x: Vec<f64> = reached.iter().map(|(x, _)| *x).collect();
        let places: Vec<(f64, f64, Stencil)> = reached
            .into_iter()
            .enumerate()
            .map(|(k, (at, stencil))| (at, cell_width(&x, k), stencil))
            .collect();
        (Self::of(&places, grid.x.len()), beyond)
    }

    /// The line over positions that have no other use, each weighted by the width of its cell.
    pub fn over(x: &[f64]) -> Self {
        let places: Vec<(f64, f64, Stencil)> = x
            .iter()
            .enumerate()
            .map(|(k, at)| (*at, cell_width(x, k), Stencil::point(k)))
            .collect();
        Self::of(&places, x.len())
    }

    /// The least-squares line over some of the positions, all alike.
    pub fn alike(x: &[f64], taken: impl Fn(usize) -> bool) -> Self {
        let places: Vec<(f64, f64, Stencil)> = x
            .iter()
            .enumerate()
            .filter(|(k, _)| taken(*k))
            .map(|(k, at)| (*at, 1.0, Stencil::point(k)))
            .collect();
        Self::of(&places, x.len())
    }

    /// Takes the line out of a profile at `x`.
    pub fn remove(&self, x: &[f64], y: &mut [f64]) {
        let sum = |weights: &[f64]| -> f64 { weights.iter().zip(&*y).map(|(w, y)| w * y).sum() };
        let (height, slope) = (sum(&self.height), sum(&self.slope));
        for (x, y) in x.iter().zip(y) {
            *y -= height + slope * (x - self.center);
        }
    }
}
