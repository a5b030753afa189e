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
    let tangent = |i: usize| {
        let (first, weights) = tangent_weights(&x[..n], i, how);
        let terms = weights.iter().zip(&y[first..n]);
        terms.map(|(w, y)| w * y).sum::<f64>()
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

/// The tangent at point `i` as weights of the points from the first number on: of the parabola
/// through it and its neighbours, or of the chord.
fn tangent_weights(x: &[f64], i: usize, how: Interpolation) -> (usize, [f64; 3]) {
    let n = x.len();
    if n == 2 || how == Interpolation::Linear {
        let first = i.min(n - 2);
        let slope = 1.0 / (x[first + 1] - x[first]);
        return (first, [-slope, slope, 0.0]);
    }
    let middle = i.clamp(1, n - 2);
    let (left, right) = (x[middle] - x[middle - 1], x[middle + 1] - x[middle]);
    let share = (2.0 * x[i] - x[middle - 1] - x[middle]) / (left + right);
    let (of_left, of_right) = ((1.0 - share) / left, share / right);
    (middle - 1, [-of_left, of_left - of_right, of_right])
}

/// A value of a profile as a weighted sum of up to four of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    first: usize,
    count: usize,
    weights: [f64; 4],
}

impl Stencil {
    /// The value at a point itself.
    pub const fn point(at: usize) -> Self {
        Self {
            first: at,
            count: 1,
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// The value that [`resample`] gives at a position, from the profile's points at `x`; a point
    /// within `same` of it is taken as it is. `None` farther than `beyond` an end (half the spacing
    /// there, where none is given), or between points that are more than `longest` apart.
    pub fn at(
        x: &[f64],
        at: f64,
        same: f64,
        longest: f64,
        beyond: Option<f64>,
        how: Interpolation,
    ) -> Option<Self> {
        let n = x.len();
        let right = x.partition_point(|p| *p < at - same);
        if x.get(right).is_some_and(|p| *p <= at + same) {
            return Some(Self::point(right));
        }
        if n < 2 {
            return None;
        }
        let mut stencil = Self {
            first: 0,
            count: 0,
            weights: [0.0; 4],
        };
        if right == 0 || right == n {
            let (end, neighbour) = if right == 0 { (0, 1) } else { (n - 1, n - 2) };
            let step = at - x[end];
            let reach = beyond.unwrap_or(REACH * (x[end] - x[neighbour]).abs());
            if step.abs() > reach {
                return None;
            }
            stencil.first = tangent_weights(x, end, how).0;
            stencil.add(end, 1.0);
            stencil.add_tangent(x, end, step, how);
            return Some(stencil);
        }
        let left = right - 1;
        let width = x[right] - x[left];
        if width > longest {
            return None;
        }
        let t = (at - x[left]) / width;
        if how == Interpolation::Linear {
            stencil.first = left;
            stencil.add(left, 1.0 - t);
            stencil.add(right, t);
            return Some(stencil);
        }
        // Hermite's cubic.
        let u = 1.0 - t;
        stencil.first = tangent_weights(x, left, how).0;
        stencil.add(left, u * u * (1.0 + 2.0 * t));
        stencil.add(right, t * t * (1.0 + 2.0 * u));
        stencil.add_tangent(x, left, width * t * u * u, how);
        stencil.add_tangent(x, right, -width * t * t * u, how);
        Some(stencil)
    }

    fn add(&mut self, point: usize, weight: f64) {
        let place = point - self.first;
        self.weights[place] += weight;
        self.count = self.count.max(place + 1);
    }

    fn add_tangent(&mut self, x: &[f64], point: usize, factor: f64, how: Interpolation) {
        let (first, weights) = tangent_weights(x, point, how);
        for (k, weight) in weights.iter().enumerate().take(x.len() - first) {
            self.add(first + k, factor * weight);
        }
    }

    /// Its points and their weights.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let weights = self.weights[..self.count].iter().enumerate();
        weights.map(|(k, w)| (self.first + k, *w))
    }

    /// The value, from those of the points.
    pub fn of(&self, y: &[f64]) -> f64 {
        self.terms().map(|(i, w)| w * y[i]).sum()
    }
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
    fn a_stencil_is_the_spline_of_the_crate() {
        let y = [3.0, -1.0, 0.5, 2.0, 2.5, -4.0];
        for how in [Interpolation::Linear, Interpolation::Cubic] {
            for points in 2..=6 {
                let (x, y) = (&UNEVEN[..points], &y[..points]);
                for k in -20..=320 {
                    let at = f64::from(k) * 0.0251;
                    let spline = resample(x, y, &[at], how)[0];
                    let own = Stencil::at(x, at, 0.0, f64::INFINITY, None, how).map(|s| s.of(y));
                    // Epsilons: some tens of roundings of values up to 20.
                    match (spline, own) {
                        (Some(a), Some(b)) => assert!((a - b).abs() < 1e-13, "{at} {a} {b}"),
                        (a, b) => assert_eq!(a, b, "{how:?} {points} {at}"),
                    }
                }
            }
        }
        let across = |longest| Stencil::at(&UNEVEN, 2.0, 0.0, longest, None, Interpolation::Cubic);
        assert!(across(2.6).is_some() && across(2.4).is_none());
        let near = Stencil::at(&UNEVEN, 1.5 + 1e-9, 1e-8, 0.1, None, Interpolation::Cubic);
        assert_eq!(near, Some(Stencil::point(2)));
        let far = |beyond| Stencil::at(&UNEVEN, -0.8, 0.0, 1.0, beyond, Interpolation::Cubic);
        assert!(far(None).is_none() && far(Some(0.9)).is_some());
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
