//! How surely the turn of a fit is not steady.
//!
//! The coefficients of the turn's spline without their line, v = Pu, have the covariance C = PΣPᵀ, of which line and
//! constant are gone: χ² = vᵀC⁺v has two degrees of freedom less than there are coefficients. Conjugate gradients
//! find it from products with C, each of two solves along the band, and the JᵀVJ of the coefficients, which would
//! be their Σ⁻¹ up to a factor in white noise and nothing else unknown, makes the steps few whatever their number.

use super::fit::TurningFit;
use super::spread::Spread;

/// Steps, of which each adds to χ², end where two in a row add no more than this share of it.
const SETTLED: f64 = 1e-9;

/// What is left to be solved is rounding where its square is this share of what it was: it says nothing of χ², and steps
/// from there would grow without bounds.
const ROUNDING: f64 = 1e-20;

impl TurningFit<'_> {
    /// χ² of what the turn's spline holds beside a line, and its degrees of freedom: how surely the turn
    /// is not steady.
    pub fn strays(&self, spread: &Spread) -> Option<(f64, f64)> {
        let (height, slope) = self.turn_line()?;
        let basis = self.turn_basis()?;
        let unknowns = &self.problem.wave_unknowns[0];
        let frame = self.problem.frame;
        let xi: Vec<f64> = basis.line(0.0, 1.0).iter().map(|t| frame.tau(*t)).collect();
        let of = |row: &[f64]| -> Vec<f64> { unknowns.iter().map(|j| row[*j]).collect() };
        let (height, slope) = (of(height.as_slice()), of(slope.as_slice()));
        let without_line = |values: &[f64]| -> Vec<f64> {
            let (level, rise) = (dot(&height, values), dot(&slope, values));
            let places = values.iter().zip(&xi);
            places.map(|(v, xi)| v - level - rise * xi).collect()
        };
        let whole = |values: &[f64]| {
            let mut all = vec![0.0; self.count()];
            for (j, value) in unknowns.iter().zip(values) {
                all[*j] = *value;
            }
            all
        };
        let common = |weights: &[f64]| {
            let (sum, first) = (weights.iter().sum::<f64>(), dot(weights, &xi));
            let lines = height.iter().zip(&slope).map(|(h, s)| h * sum + s * first);
            let back: Vec<f64> = weights.iter().zip(lines).map(|(w, l)| w - l).collect();
            without_line(&of(&spread.times(&whole(&back))))
        };
        let nearly_solved = |values: &[f64]| of(&spread.meat_times(&whole(values)));
        let values = without_line(&of(&self.at.band));
        let freedom = values.len().saturating_sub(2);
        let square = generalised_square(values, freedom, common, nearly_solved, without_line);
        Some((square, freedom as f64))
    }
}

/// vᵀC⁺v of a v in the range of C, of a rank, by conjugate gradients: `near` is about C⁺, `within` projects on the range,
/// out of which rounding leads.
fn generalised_square(
    v: Vec<f64>,
    rank: usize,
    times: impl Fn(&[f64]) -> Vec<f64>,
    near: impl Fn(&[f64]) -> Vec<f64>,
    within: impl Fn(&[f64]) -> Vec<f64>,
) -> f64 {
    let mut rest = v;
    let mut direction = near(&rest);
    let mut size = dot(&rest, &direction);
    let least = ROUNDING * size;
    let mut square = 0.0;
    let mut settled = 0;
    // Without rounding there are no more steps than the rank.
    for _ in 0..3 * rank {
        let image = times(&direction);
        let curved = dot(&direction, &image);
        if !(size > 0.0 && curved > 0.0) {
            break;
        }
        let step = size / curved;
        square += step * size;
        settled = if step * size <= SETTLED * square {
            settled + 1
        } else {
            0
        };
        if settled == 2 {
            break;
        }
        for (rest, image) in rest.iter_mut().zip(&image) {
            *rest -= step * image;
        }
        rest = within(&rest);
        let next = near(&rest);
        let before = std::mem::replace(&mut size, dot(&rest, &next));
        if size <= least {
            break;
        }
        for (direction, next) in direction.iter_mut().zip(&next) {
            *direction = next + size / before * *direction;
        }
    }
    square
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
