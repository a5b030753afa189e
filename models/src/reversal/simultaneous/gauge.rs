//! The gauge: the least-squares line of every form over the measured positions is zero.
//!
//! A form is its spline less a straight line z₁ + z₂ξ, ξ = (x − centre)/scale. The least-squares
//! line of the spline over the positions of all channels, each weighted by the width of its
//! [cell](crate::reversal::cells), is z = G⁻¹XᵀW B c, with X = (1, ξ), W the widths, G = XᵀW X and
//! B the basis at the positions: the linear constraint that ties z to the coefficients. Readings do
//! not count in it, so that a tilt means the same with and without one of them.

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

/// The two rows of G⁻¹XᵀW B for growing positions.
pub fn line_of_spline(basis: &CubicBSpline, places: &[f64], axis: Axis) -> [Vec<f64>; 2] {
    let starts = starts(places, basis.breaks());
    // Moments Σ w tᵖ, Σ w ξ tᵖ and Σ w ξ² of the positions of each cell of the spline.
    let moments: Vec<[f64; 9]> = (0..basis.cell_count())
        .into_par_iter()
        .map(|k| {
            let mut moment = [0.0; 9];
            let (left, width) = basis.cell(k);
            for i in starts[k]..starts[k + 1] {
                let (w, x) = (cell_width(places, i), places[i]);
                let (t, xi) = ((x - left) / width, axis.xi(x));
                let powers = [1.0, t, t * t, t * t * t];
                for (p, power) in powers.into_iter().enumerate() {
                    moment[p] += w * power;
                    moment[4 + p] += w * xi * power;
                }
                moment[8] += w * xi * xi;
            }
            moment
        })
        .collect();
    let mut rows = [
        vec![0.0; basis.coefficient_count()],
        vec![0.0; basis.coefficient_count()],
    ];
    for (k, moment) in moments.iter().enumerate() {
        for (l, polynomial) in basis.polynomials(k).iter().enumerate() {
            for p in 0..4 {
                rows[0][k + l] += polynomial[p] * moment[p];
                rows[1][k + l] += polynomial[p] * moment[4 + p];
            }
        }
    }
    let [n, s1, s2] = [0, 4, 8].map(|p| moments.iter().map(|moment| moment[p]).sum::<f64>());
    let determinant = n * s2 - s1 * s1;
    let inverse = Matrix2::new(s2, -s1, -s1, n) / determinant;
    for k in 0..basis.coefficient_count() {
        let z = inverse * Vector2::new(rows[0][k], rows[1][k]);
        (rows[0][k], rows[1][k]) = (z.x, z.y);
    }
    rows
}
