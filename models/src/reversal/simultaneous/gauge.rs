//! The gauge: the least-squares line of every form over the measured positions is zero.
//!
//! A form is its spline less a straight line z₁ + z₂ξ, ξ = (x − centre)/scale. The least-squares
//! line of the spline over the positions of all channels, each weighted by the width of its
//! [cell](crate::reversal::cells), is z = G⁻¹XᵀW B c, with X = (1, ξ), W the widths, G = XᵀW X and
//! B the basis at the positions: the linear constraint that ties z to the coefficients. Readings do
//! not count in it, so that a tilt means the same with and without one of them.

use errsep_solvers::by_processor;
use errsep_solvers::linear::bordered::Constraints;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::readings::ChannelReadings;
use super::starts::starts;
use super::unknowns::Unknowns;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::cells::{Union, cell_width};

/// Centre and half width of the positions, mm: ξ = (x − centre)/scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Mean of all readings' positions, mm.
    pub center: f64,
    /// Half their range, mm.
    pub scale: f64,
}

impl Axis {
    /// The axis of readings sorted by position; `None` where all positions are equal.
    pub fn of(channels: &[ChannelReadings]) -> Option<Self> {
        let count: usize = channels.iter().map(ChannelReadings::len).sum();
        let sums: Vec<f64> = channels.par_iter().map(|c| c.x.iter().sum()).collect();
        let center = sums.into_iter().sum::<f64>() / count as f64;
        let (low, high) = range(channels);
        let scale = (high - low) / 2.0;
        (scale > 0.0 && scale.is_finite()).then_some(Self { center, scale })
    }

    /// ξ of a position.
    pub fn xi(&self, x: f64) -> f64 {
        (x - self.center) / self.scale
    }
}

/// First and last position of all channels, mm.
pub fn range(channels: &[ChannelReadings]) -> (f64, f64) {
    channels
        .iter()
        .filter_map(|c| Some((*c.x.first()?, *c.x.last()?)))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (a, b)| {
            (l.min(a), h.max(b))
        })
}

/// The constraints z = Wᵀc for the bases of the fitted forms, in their order.
pub fn constraints(
    unknowns: &Unknowns,
    bases: &[CubicBSpline],
    channels: &[ChannelReadings],
    axis: Axis,
) -> Constraints {
    constraints_at(unknowns, bases, &places(channels), axis)
}

/// The different positions of all channels, mm, growing.
pub fn places(channels: &[ChannelReadings]) -> Vec<f64> {
    Union::of(channels.iter().map(|c| &c.x[..])).collect()
}

/// The constraints where the different positions are known.
pub fn constraints_at(
    unknowns: &Unknowns,
    bases: &[CubicBSpline],
    places: &[f64],
    axis: Axis,
) -> Constraints {
    let forms = unknowns.forms.len();
    let mut band = Vec::with_capacity(2 * forms);
    let mut border = DMatrix::zeros(2 * forms, unknowns.border_count());
    let mut last: Option<(usize, [Vec<f64>; 2])> = None;
    for (form, basis) in bases.iter().enumerate() {
        let rows = match last.take() {
            Some((of, rows)) if bases[of] == *basis => rows,
            _ => line_of_spline(basis, places, axis),
        };
        for (l, row) in rows.iter().enumerate() {
            let mut column = vec![0.0; unknowns.band_count()];
            for (k, value) in row.iter().enumerate() {
                if let Some(j) = unknowns.coefficient(form, k) {
                    column[j] = *value;
                }
            }
            band.push(column);
            border[(2 * form + l, unknowns.line(form)[l])] = 1.0;
        }
        last = Some((form, rows));
    }
    Constraints {
        value: DVector::zeros(band.len()),
        band,
        border,
    }
}

/// Positions that are worth handing to another core.
const PLACES_A_CORE: usize = 4096;

/// The two rows of G⁻¹XᵀW B for growing positions.
pub fn line_of_spline(basis: &CubicBSpline, places: &[f64], axis: Axis) -> [Vec<f64>; 2] {
    let starts = starts(places, basis.breaks());
    let cells = basis.cell_count();
    let cells_a_core = PLACES_A_CORE * cells / places.len().max(1);
    let moments: Vec<Moments> = (0..cells)
        .into_par_iter()
        .with_min_len(cells_a_core.max(1))
        .map(|k| {
            let mut sums = [0.0; 5];
            let (left, width) = basis.cell(k);
            gather(&mut sums, places, starts[k], starts[k + 1], left, width);
            Moments::new(&sums, [axis.xi(left), width / axis.scale])
        })
        .collect();
    let mut rows = [
        vec![0.0; basis.coefficient_count()],
        vec![0.0; basis.coefficient_count()],
    ];
    for (k, moment) in moments.iter().enumerate() {
        for (l, polynomial) in basis.polynomials(k).iter().enumerate() {
            for p in 0..4 {
                rows[0][k + l] += polynomial[p] * moment.ones[p];
                rows[1][k + l] += polynomial[p] * moment.xi[p];
            }
        }
    }
    let sum = |of: fn(&Moments) -> f64| moments.iter().map(of).sum::<f64>();
    let (n, s1, s2) = (sum(|m| m.ones[0]), sum(|m| m.xi[0]), sum(|m| m.xi_squares));
    let determinant = n * s2 - s1 * s1;
    let inverse = Matrix2::new(s2, -s1, -s1, n) / determinant;
    for k in 0..basis.coefficient_count() {
        let z = inverse * Vector2::new(rows[0][k], rows[1][k]);
        (rows[0][k], rows[1][k]) = (z.x, z.y);
    }
    rows
}

/// Moments of the positions of a cell: Σ w tᵖ, Σ w ξ tᵖ and Σ w ξ².
struct Moments {
    ones: [f64; 4],
    xi: [f64; 4],
    xi_squares: f64,
}

impl Moments {
    /// From Σ w tᵖ, p ≤ 4, where ξ = a + b t.
    fn new(sums: &[f64; 5], [a, b]: [f64; 2]) -> Self {
        let xi = |p: usize| a * sums[p] + b * sums[p + 1];
        Self {
            ones: [0, 1, 2, 3].map(|p| sums[p]),
            xi: [0, 1, 2, 3].map(xi),
            xi_squares: a * xi(0) + b * xi(1),
        }
    }
}

/// Positions taken together.
const LANES: usize = 4;

by_processor! {
    /// Adds w tᵖ, p ≤ 4, of the positions from..to, t = (x − left)/width.
    fn gather(
        sums: &mut [f64; 5],
        places: &[f64],
        from: usize,
        to: usize,
        left: f64,
        width: f64,
    ) from gather_generic
}

#[inline(always)]
fn gather_generic<const FMA: bool>(
    sums: &mut [f64; 5],
    places: &[f64],
    from: usize,
    to: usize,
    left: f64,
    width: f64,
) {
    let per_width = 1.0 / width;
    let mut lanes = [[0.0; LANES]; 5];
    let ends = [0, places.len().saturating_sub(1)];
    for k in ends.into_iter().take(places.len()) {
        if from <= k && k < to {
            let widths = [cell_width(places, k), 0.0, 0.0, 0.0];
            add_powers(&mut lanes, &[places[k]; LANES], &widths, left, per_width);
        }
    }
    let (from, to) = (from.max(1), to.min(ends[1]));
    if from < to {
        let (before, own, after) = (
            places[from - 1..to - 1].as_chunks::<LANES>(),
            places[from..to].as_chunks::<LANES>(),
            places[from + 1..to + 1].as_chunks::<LANES>(),
        );
        for ((before, x), after) in before.0.iter().zip(own.0).zip(after.0) {
            let mut widths = [0.0; LANES];
            for l in 0..LANES {
                widths[l] = 0.5 * (after[l] - before[l]);
            }
            add_powers(&mut lanes, x, &widths, left, per_width);
        }
        let (mut x, mut widths) = ([left; LANES], [0.0; LANES]);
        for (l, ((before, own), after)) in before.1.iter().zip(own.1).zip(after.1).enumerate() {
            (x[l], widths[l]) = (*own, 0.5 * (after - before));
        }
        add_powers(&mut lanes, &x, &widths, left, per_width);
    }
    for (sum, lanes) in sums.iter_mut().zip(lanes) {
        *sum += (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    }
}

#[inline(always)]
fn add_powers(
    sums: &mut [[f64; LANES]; 5],
    x: &[f64; LANES],
    widths: &[f64; LANES],
    left: f64,
    per_width: f64,
) {
    for l in 0..LANES {
        let t = (x[l] - left) * per_width;
        let mut power = widths[l];
        for sum in sums.iter_mut() {
            sum[l] += power;
            power *= t;
        }
    }
}
