//! A profile brought to other positions, by the `splines` crate.
//!
//! The cubic is that of Catmull and Rom where the grid is even. The crate's own rule needs two
//! points on either side and loses parabolas on an uneven grid; so each key carries its tangents as
//! Bézier handles, taken from the parabola through it and its neighbours (at an end, through the
//! last three points): a parabola is then reproduced everywhere, on any grid.

use serde::{Deserialize, Serialize};
use splines::{Interpolation as Rule, Key, Spline};

/// How a profile is interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// Straight between neighbours.
    Linear,
    /// Cubic, parabolas reproduced.
    #[default]
    Cubic,
}

/// A profile beyond its last point by more than this share of a spacing has no value.
const REACH: f64 = 0.5;

/// Values of the profile (x growing strictly, at least two finite points) at positions `at`.
///
/// Within half a spacing beyond an end the end's tangent is followed; farther out there is no value.
pub fn resample(x: &[f64], y: &[f64], at: &[f64], how: Interpolation) -> Vec<Option<f64>> {
    let n = x.len().min(y.len());
    if n < 2 {
        return vec![None; at.len()];
    }
    let tangent = |i: usize| match how {
        Interpolation::Linear => secant(x, y, i.min(n - 2)),
        Interpolation::Cubic => parabola_tangent(x, y, i),
    };
    let keys = (0..n)
        .map(|i| {
            let rule = match how {
                Interpolation::Linear => Rule::Linear,
                Interpolation::Cubic => {
                    let before = if i > 0 { x[i] - x[i - 1] } else { 0.0 };
                    let after = if i + 1 < n { x[i + 1] - x[i] } else { 0.0 };
                    let t = tangent(i) / 3.0;
                    Rule::StrokeBezier(y[i] - t * before, y[i] + t * after)
                }
            };
            Key::new(x[i], y[i], rule)
        })
        .collect();
    let spline = Spline::from_vec(keys);
    let beyond = |end: usize, neighbour: usize, p: f64| {
        ((p - x[end]).abs() <= REACH * (x[end] - x[neighbour]).abs())
            .then(|| y[end] + tangent(end) * (p - x[end]))
    };
    at.iter()
        .map(|&p| {
            if p <= x[0] {
                beyond(0, 1, p)
            } else if p >= x[n - 1] {
                beyond(n - 1, n - 2, p)
            } else {
                spline.sample(p)
            }
        })
        .collect()
}

fn secant(x: &[f64], y: &[f64], i: usize) -> f64 {
    (y[i + 1] - y[i]) / (x[i + 1] - x[i])
}

/// The tangent at point `i` of the parabola through it and its neighbours.
fn parabola_tangent(x: &[f64], y: &[f64], i: usize) -> f64 {
    let n = x.len();
    if n == 2 {
        return secant(x, y, 0);
    }
    let middle = i.clamp(1, n - 2);
    let (left, right) = (secant(x, y, middle - 1), secant(x, y, middle));
    let curvature = (right - left) / (x[middle + 1] - x[middle - 1]);
    left + curvature * (2.0 * x[i] - x[middle - 1] - x[middle])
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNEVEN: [f64; 6] = [0.0, 1.0, 1.5, 4.0, 4.25, 7.0];

    fn worst(how: Interpolation, f: impl Fn(f64) -> f64) -> f64 {
        let y = UNEVEN.map(&f);
        let at = (0..=700).map(|i| f64::from(i) / 100.0).collect::<Vec<_>>();
        let found = resample(&UNEVEN, &y, &at, how);
        at.iter()
            .zip(found)
            .map(|(x, v)| (v.unwrap() - f(*x)).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn exact_for_what_each_rule_reproduces() {
        // Some tens of roundings of numbers up to 100.
        assert!(worst(Interpolation::Linear, |x| 3.0 - 2.0 * x) < 1e-13);
        assert!(worst(Interpolation::Cubic, |x| 3.0 - 2.0 * x + 1.5 * x * x) < 1e-12);
        assert!(worst(Interpolation::Linear, |x| x * x) > 1.0);
    }

    #[test]
    fn no_value_far_outside() {
        let found = resample(
            &[0.0, 1.0, 2.0],
            &[0.0, 1.0, 4.0],
            &[-0.6, -0.4, 2.5, 2.6],
            Interpolation::Cubic,
        );
        assert_eq!(found[0], None);
        assert_eq!(found[3], None);
        // The tangents of x² at 0 and 2 are 0 and 4: exact in binary but for one rounding.
        assert!((found[1].unwrap() - 0.0).abs() < 1e-15);
        assert!((found[2].unwrap() - 6.0).abs() < 1e-15);
    }
}
