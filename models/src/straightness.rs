//! Straightness of a profile against the three reference lines of ISO 230-1: least squares,
//! end points, minimum zone.

use thiserror::Error;

/// The line from which deviations are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReferenceLine {
    /// Least sum of squared deviations.
    LeastSquares,
    /// Through the first and the last point (the mean of several readings there).
    EndPoint,
    /// Between the two parallel lines that hold the profile at the least distance along the reading.
    MinimumZone,
}

impl ReferenceLine {
    /// All three.
    pub const ALL: [Self; 3] = [Self::LeastSquares, Self::EndPoint, Self::MinimumZone];

    /// Its name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "least squares",
            Self::EndPoint => "end points",
            Self::MinimumZone => "minimum zone",
        }
    }

    /// Its name in files.
    pub const fn key(self) -> &'static str {
        match self {
            Self::LeastSquares => "least_squares",
            Self::EndPoint => "end_point",
            Self::MinimumZone => "minimum_zone",
        }
    }
}

/// A profile against a reference line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straightness {
    /// The reference line.
    pub reference: ReferenceLine,
    /// Its slope, µm/mm.
    pub slope: f64,
    /// Its height at x = 0, µm.
    pub intercept: f64,
    /// Greatest deviation above the line, µm.
    pub highest: f64,
    /// Greatest deviation below the line, µm, not positive.
    pub lowest: f64,
    frame: Frame,
    /// Slope and height of the line in the frame.
    line: (f64, f64),
}

impl Straightness {
    /// The straightness error, µm: the width of the strip along the line that holds the profile.
    pub fn error(&self) -> f64 {
        self.highest - self.lowest
    }

    /// Deviation of a point from the line, µm.
    pub fn deviation(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.frame.local(x, y);
        self.frame.height_unit * (v - self.line.1 - self.line.0 * u)
    }
}

/// Why there is no straightness.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NoStraightness {
    /// Positions and deviations differ in number.
    #[error("{positions} positions, but {deviations} deviations")]
    Lengths {
        /// Positions given.
        positions: usize,
        /// Deviations given.
        deviations: usize,
    },
    /// A line needs two places.
    #[error("a reference line needs two different positions")]
    OnePosition,
    /// Not a finite number.
    #[error("point {} is not finite", index + 1)]
    NotFinite {
        /// Which point, from 0.
        index: usize,
    },
    /// The straightness or the line is not a finite number.
    #[error(
        "the deviations, up to {deviation:e} µm over {length:e} mm, are too large to be calculated with"
    )]
    TooLarge {
        /// Greatest deviation given, µm.
        deviation: f64,
        /// Distance of the first from the last position, mm.
        length: f64,
    },
}

/// The straightness of a profile: positions `x` (mm, any order) and deviations `y` (µm).
///
/// The minimum zone is exact: the width of the strip of slope s is convex and piecewise linear in s
/// with its corners at the slopes of the edges of the convex hull, so the best of these edges is the
/// optimum. Cost n log n for the sort, then linear.
///
/// # Errors
/// Fewer than two different positions, different lengths, a value that is not finite, a result too
/// large to be a number.
///
/// ```
/// use errsep_models::straightness::{ReferenceLine, straightness};
/// let zone = straightness(&[0.0, 1.0, 2.0], &[0.0, 3.0, 0.0], ReferenceLine::MinimumZone)?;
/// assert_eq!(zone.error(), 3.0);
/// # Ok::<(), errsep_models::straightness::NoStraightness>(())
/// ```
pub fn straightness(
    x: &[f64],
    y: &[f64],
    reference: ReferenceLine,
) -> Result<Straightness, NoStraightness> {
    let (points, frame) = sorted_points(x, y)?;
    let slope = match reference {
        ReferenceLine::LeastSquares => least_squares_slope(&points),
        ReferenceLine::EndPoint => end_point_slope(&points),
        ReferenceLine::MinimumZone => minimum_zone_slope(&points),
    };
    let rests = || points.iter().map(|p| p.1 - slope * p.0);
    let (low, high) = rests().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), r| {
        (lo.min(r), hi.max(r))
    });
    let n = points.len() as f64;
    let height = match reference {
        ReferenceLine::LeastSquares => rests().sum::<f64>() / n,
        ReferenceLine::EndPoint => {
            let (first, height) = mean_at_end(points.iter());
            height - slope * first
        }
        ReferenceLine::MinimumZone => f64::midpoint(low, high),
    };
    let world_slope = slope * frame.height_unit / frame.length_unit * frame.part;
    let found = Straightness {
        reference,
        slope: world_slope,
        intercept: frame.height_unit * height - world_slope * frame.first,
        highest: frame.height_unit * (high - height),
        lowest: frame.height_unit * (low - height),
        frame,
        line: (slope, height),
    };
    let all = [
        found.slope,
        found.intercept,
        found.highest,
        found.lowest,
        found.error(),
    ];
    if all.iter().all(|value| value.is_finite()) {
        Ok(found)
    } else {
        Err(NoStraightness::TooLarge {
            deviation: y.iter().fold(0.0, |m, v| m.max(v.abs())),
            length: frame.length,
        })
    }
}

type Point = (f64, f64);

/// Positions from the first one and deviations in powers of two near their greatest, so that no
/// product overflows or vanishes and nothing is rounded but the difference.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Frame {
    first: f64,
    /// Distance of the first from the last position; infinite where it overflows.
    length: f64,
    /// One, or a half where the length would overflow.
    part: f64,
    length_unit: f64,
    height_unit: f64,
}

impl Frame {
    fn local(&self, x: f64, y: f64) -> Point {
        (
            (self.part * x - self.part * self.first) / self.length_unit,
            y / self.height_unit,
        )
    }
}

/// The power of two at or below a value, at least the least normal number.
fn power_of_two(value: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits(value.to_bits() & EXPONENT).max(f64::MIN_POSITIVE)
}

fn sorted_points(x: &[f64], y: &[f64]) -> Result<(Vec<Point>, Frame), NoStraightness> {
    if x.len() != y.len() {
        return Err(NoStraightness::Lengths {
            positions: x.len(),
            deviations: y.len(),
        });
    }
    let given = || x.iter().copied().zip(y.iter().copied());
    if let Some(index) = given().position(|p| !(p.0.is_finite() && p.1.is_finite())) {
        return Err(NoStraightness::NotFinite { index });
    }
    let (first, last) = x
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if !(last > first) {
        return Err(NoStraightness::OnePosition);
    }
    let length = last - first;
    let part = if length.is_finite() { 1.0 } else { 0.5 };
    let frame = Frame {
        first,
        length,
        part,
        length_unit: power_of_two(part * last - part * first),
        height_unit: power_of_two(y.iter().fold(0.0, |m, v| m.max(v.abs()))),
    };
    let mut points: Vec<Point> = given().map(|(x, y)| frame.local(x, y)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    Ok((points, frame))
}

fn least_squares_slope(points: &[Point]) -> f64 {
    let n = points.len() as f64;
    let x_mean = points.iter().map(|p| p.0).sum::<f64>() / n;
    let y_mean = points.iter().map(|p| p.1).sum::<f64>() / n;
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        let d = p.0 - x_mean;
        (xy + d * (p.1 - y_mean), xx + d * d)
    });
    xy / xx
}

/// Position and mean height of the points that share the first position.
fn mean_at_end<'a>(points: impl Iterator<Item = &'a Point>) -> Point {
    let mut end = (0.0, 0.0);
    let mut n = 0.0;
    for p in points {
        if n > 0.0 && p.0 != end.0 {
            break;
        }
        n += 1.0;
        end = (p.0, end.1 + (p.1 - end.1) / n);
    }
    end
}

fn end_point_slope(points: &[Point]) -> f64 {
    let first = mean_at_end(points.iter());
    let last = mean_at_end(points.iter().rev());
    (last.1 - first.1) / (last.0 - first.0)
}

/// One chain of the convex hull from left to right: the upper for `side` +1, the lower for −1.
fn hull(points: &[Point], side: f64) -> Vec<Point> {
    let mut chain: Vec<Point> = Vec::new();
    for &p in points {
        while let [.., a, b] = chain[..] {
            let turn = (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
            if side * turn < 0.0 {
                break;
            }
            chain.pop();
        }
        chain.push(p);
    }
    chain
}

fn minimum_zone_slope(points: &[Point]) -> f64 {
    let upper = hull(points, 1.0);
    let lower = hull(points, -1.0);
    let rise = |a: &Point, b: &Point| (b.1 - a.1) / (b.0 - a.0);
    // Slopes fall along the upper chain and grow along the lower one: with the slopes in growing
    // order the touching point walks left above and right below.
    let mut slopes = upper
        .windows(2)
        .chain(lower.windows(2))
        .filter(|w| w[1].0 > w[0].0)
        .map(|w| rise(&w[0], &w[1]))
        .collect::<Vec<_>>();
    slopes.sort_by(f64::total_cmp);
    let (mut top, mut bottom) = (upper.len() - 1, 0);
    let mut best = (f64::INFINITY, 0.0);
    for s in slopes {
        let rest = |p: &Point| p.1 - s * p.0;
        while top > 0 && rest(&upper[top - 1]) >= rest(&upper[top]) {
            top -= 1;
        }
        while bottom + 1 < lower.len() && rest(&lower[bottom + 1]) <= rest(&lower[bottom]) {
            bottom += 1;
        }
        let width = rest(&upper[top]) - rest(&lower[bottom]);
        if width < best.0 {
            best = (width, s);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    // Printed to two decimals in the manual of a laser system (HP 5528A, section 21): the
    // tolerance is half a unit of the last digit.
    const AXIS_1: [f64; 10] = [-0.3, 0.9, 1.5, 2.5, 2.9, 3.6, 4.2, 5.1, 5.9, 7.2];
    const AXIS_2: [f64; 10] = [-0.5, -1.2, -2.5, -3.8, -4.0, -4.8, -5.9, -6.2, -7.4, -8.8];

    fn grid(step: f64) -> Vec<f64> {
        (0..10).map(|i| f64::from(i) * step).collect()
    }

    #[test]
    fn slopes_of_a_laser_systems_worked_example() {
        for (y, step, end_point, least_squares) in
            [(AXIS_1, 0.1, 8.33, 7.65), (AXIS_2, 0.05, -18.44, -17.42)]
        {
            let slope = |r| straightness(&grid(step), &y, r).unwrap().slope;
            assert!((slope(ReferenceLine::EndPoint) - end_point).abs() <= 0.005);
            assert!((slope(ReferenceLine::LeastSquares) - least_squares).abs() <= 0.005);
        }
        let line = straightness(&grid(0.05), &AXIS_2, ReferenceLine::LeastSquares).unwrap();
        assert!((line.intercept - -0.591).abs() <= 0.0005);
    }

    #[test]
    fn deviations_span_the_error() {
        for reference in ReferenceLine::ALL {
            let s = straightness(&grid(0.1), &AXIS_1, reference).unwrap();
            let deviations = grid(0.1)
                .iter()
                .zip(&AXIS_1)
                .map(|(&x, &y)| s.deviation(x, y))
                .collect::<Vec<_>>();
            let high = deviations.iter().copied().fold(f64::MIN, f64::max);
            let low = deviations.iter().copied().fold(f64::MAX, f64::min);
            // Rounding of one product and two sums of numbers below 10.
            assert!((high - s.highest).abs() < 1e-14 && (low - s.lowest).abs() < 1e-14);
        }
    }

    /// The strip's width is convex in its slope, so that a golden-section search is an independent
    /// way to the same minimum.
    #[test]
    fn minimum_zone_agrees_with_a_search() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        for n in [2, 3, 4, 10, 200] {
            let x = (0..n)
                .map(|_| random.random_range(0.0..100.0))
                .collect::<Vec<f64>>();
            let y = (0..n)
                .map(|_| random.random_range(-5.0..5.0))
                .collect::<Vec<f64>>();
            let width = |s: f64| {
                let rests = x.iter().zip(&y).map(|(x, y)| y - s * x);
                let (lo, hi) =
                    rests.fold((f64::MAX, f64::MIN), |(lo, hi), r| (lo.min(r), hi.max(r)));
                hi - lo
            };
            let (mut a, mut b) = (-1e4, 1e4);
            for _ in 0..200 {
                let (c, d) = (
                    b - (b - a) * 0.618_033_988_749_895,
                    a + (b - a) * 0.618_033_988_749_895,
                );
                if width(c) < width(d) { b = d } else { a = c }
            }
            let found = straightness(&x, &y, ReferenceLine::MinimumZone).unwrap();
            // The search ends within rounding of slope times position: 100 mm × 1e4 × epsilon.
            assert!((found.error() - width(a)).abs() < 1e-9, "n = {n}");
            for other in [ReferenceLine::LeastSquares, ReferenceLine::EndPoint] {
                assert!(found.error() <= straightness(&x, &y, other).unwrap().error() + 1e-12);
            }
        }
    }

    #[test]
    fn units_of_any_size_give_the_same_straightness() {
        let (x, y) = (grid(0.1), AXIS_1);
        let of = |x: &[f64], y: &[f64], r| straightness(x, y, r).unwrap();
        for reference in ReferenceLine::ALL {
            let plain = of(&x, &y, reference);
            for (of_x, of_y) in [
                (1e200, 1.0),
                (1e308, 1.0),
                (1e-290, 1e-8),
                (1.0, 1e-300),
                (1.0, 1e307),
            ] {
                let (a, b) = (x.iter().map(|v| v * of_x), y.iter().map(|v| v * of_y));
                let (a, b): (Vec<f64>, Vec<f64>) = (a.collect(), b.collect());
                let s = of(&a, &b, reference);
                // Epsilons: ten roundings of numbers of the size of the greatest deviation.
                let near = |v: f64, w: f64| (v / of_y - w).abs() < 10.0 * f64::EPSILON * 7.2;
                assert!(
                    near(s.error(), plain.error()),
                    "{reference:?} {of_x} {of_y} {s:?}"
                );
                for i in 0..x.len() {
                    assert!(near(s.deviation(a[i], b[i]), plain.deviation(x[i], y[i])));
                }
            }
        }
        // From −1.7e308 to 1.7e308 mm: the length itself overflows.
        let wide = [-1.7e308, 0.0, 1.7e308];
        let s = of(&wide, &[0.0, 3.0, 0.0], ReferenceLine::MinimumZone);
        assert_eq!(s.error(), 3.0);
        let error = straightness(
            &[0.0, 1.0, 2.0],
            &[1.7e308, -1.7e308, 1.7e308],
            ReferenceLine::EndPoint,
        );
        assert!(matches!(error, Err(NoStraightness::TooLarge { .. })));
    }

    #[test]
    fn refuses_what_has_no_line() {
        let of = |x: &[f64], y: &[f64]| straightness(x, y, ReferenceLine::MinimumZone);
        assert_eq!(of(&[], &[]), Err(NoStraightness::OnePosition));
        assert_eq!(
            of(&[1.0, 1.0], &[0.0, 2.0]),
            Err(NoStraightness::OnePosition)
        );
        assert_eq!(
            of(&[1.0, f64::NAN], &[0.0; 2]),
            Err(NoStraightness::NotFinite { index: 1 })
        );
        assert_eq!(
            of(&[1.0], &[]),
            Err(NoStraightness::Lengths {
                positions: 1,
                deviations: 0
            })
        );
    }
}
