//! The gauge: the least-squares line of every form over the measured positions is zero.
//!
//! A form is its spline less a straight line z₁ + z₂ξ, ξ = (x − centre)/scale. The least-squares
//! line of the spline over all readings' positions is z = G⁻¹Xᵀ B c, with X = (1, ξ), G = XᵀX and B
//! the basis at the positions: the linear constraint that ties z to the coefficients.

use errsep_solvers::linear::bordered::Constraints;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::readings::ChannelReadings;
use super::unknowns::Unknowns;
use crate::basis::bspline::CubicBSpline;

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
    let forms = unknowns.forms.len();
    let mut band = Vec::with_capacity(2 * forms);
    let mut border = DMatrix::zeros(2 * forms, unknowns.border_count());
    let mut last: Option<(usize, [Vec<f64>; 2])> = None;
    for (form, basis) in bases.iter().enumerate() {
        let rows = match last.take() {
            Some((of, rows)) if bases[of] == *basis => rows,
            _ => line_of_spline(basis, channels, axis),
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

/// The two rows of G⁻¹XᵀB.
fn line_of_spline(basis: &CubicBSpline, channels: &[ChannelReadings], axis: Axis) -> [Vec<f64>; 2] {
    let cells = basis.cell_count();
    // Moments Σ tᵖ, Σ ξ tᵖ and Σ ξ² of the positions of each cell.
    let per_channel: Vec<Vec<[f64; 9]>> = channels
        .par_iter()
        .map(|channel| {
            let mut moments = vec![[0.0; 9]; cells];
            let mut from = 0;
            for (k, moment) in moments.iter_mut().enumerate() {
                let end = if k + 1 == cells {
                    channel.len()
                } else {
                    let right = basis.breaks()[k + 1];
                    from + channel.x[from..].partition_point(|x| *x < right)
                };
                let (left, width) = basis.cell(k);
                for x in &channel.x[from..end] {
                    let (t, xi) = ((x - left) / width, axis.xi(*x));
                    let powers = [1.0, t, t * t, t * t * t];
                    for (p, power) in powers.into_iter().enumerate() {
                        moment[p] += power;
                        moment[4 + p] += xi * power;
                    }
                    moment[8] += xi * xi;
                }
                from = end;
            }
            moments
        })
        .collect();
    let mut products = [
        vec![0.0; basis.coefficient_count()],
        vec![0.0; basis.coefficient_count()],
    ];
    for moments in &per_channel {
        for (k, moment) in moments.iter().enumerate() {
            for (l, polynomial) in basis.polynomials(k).iter().enumerate() {
                for p in 0..4 {
                    products[0][k + l] += polynomial[p] * moment[p];
                    products[1][k + l] += polynomial[p] * moment[4 + p];
                }
            }
        }
    }
    // Σ ξ is zero by the choice of the centre up to rounding; the exact sums are kept all the same.
    let [n, s1, s2] = [0, 4, 8].map(|p| -> f64 {
        let moments = per_channel.iter().flatten();
        moments.map(|moment| moment[p]).sum()
    });
    let determinant = n * s2 - s1 * s1;
    let inverse = Matrix2::new(s2, -s1, -s1, n) / determinant;
    let mut rows = products;
    for k in 0..basis.coefficient_count() {
        let z = inverse * Vector2::new(rows[0][k], rows[1][k]);
        (rows[0][k], rows[1][k]) = (z.x, z.y);
    }
    rows
}
