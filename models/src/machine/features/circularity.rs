//! The roundness of a circle of points (NISTIR 6868, section 4.6).

use nalgebra::{Matrix3, Vector3};

use crate::machine::{Axis, MachineError, Position};
use crate::units::{mm_from_um, um_from_mm};

/// Equally spaced nominal points on a circle in a plane of two axes.
///
/// The report prints its points to 0.01 mm; that rounding alone is a circularity of 7 um, so the
/// points are made here and never read back from such a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    plane: [Axis; 2],
    centre: Position,
    points: Vec<Position>,
}

impl Circle {
    /// `count` points from the direction of the first axis towards the second, mm.
    ///
    /// # Errors
    /// Fewer than four points (three always lie on a circle), a radius that is not positive, a
    /// plane of one axis.
    pub fn new(
        plane: [Axis; 2],
        centre: Position,
        radius: f64,
        count: usize,
    ) -> Result<Self, MachineError> {
        let bad = |why: &str| MachineError::BadFeature {
            feature: "circularity",
            why: why.into(),
        };
        if plane[0] == plane[1] {
            return Err(bad("its plane needs two different axes"));
        }
        if count < 4 {
            return Err(bad(
                "it needs at least four points: any three lie on a circle",
            ));
        }
        if !(radius.is_finite() && radius > 0.0) {
            return Err(bad("its radius must be positive"));
        }
        let points = (0..count)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / count as f64;
                let mut point = centre;
                point[plane[0].index()] += radius * angle.cos();
                point[plane[1].index()] += radius * angle.sin();
                point
            })
            .collect();
        Ok(Self {
            plane,
            centre,
            points,
        })
    }

    /// The nominal points, mm.
    #[must_use]
    pub fn points(&self) -> &[Position] {
        &self.points
    }
}

/// Greatest less smallest distance (um) of the moved points from the centre of their circle of
/// least squares; NaN when they lie on a line.
///
/// The centre is that of the algebraic fit `u² + v² = 2 a u + 2 b v + c`, the minimum of the report's
/// residual (appendix F). On a whole circle it differs from the orthogonal one by 1e-6 mm.
#[must_use]
pub fn circularity_of(circle: &Circle, deviations: &[Vector3<f64>]) -> f64 {
    let [first, second] = circle.plane.map(Axis::index);
    let moved = || {
        circle.points.iter().zip(deviations).map(|(p, d)| {
            let from_centre = |i: usize| p[i] - circle.centre[i] + mm_from_um(d[i]);
            (from_centre(first), from_centre(second))
        })
    };
    // Sums of the rows (2u, 2v, 1) and of their right side u² + v².
    let [mut uu, mut uv, mut vv, mut u1, mut v1] = [0.0; 5];
    let mut right = Vector3::zeros();
    for (u, v) in moved() {
        let square = u * u + v * v;
        uu += u * u;
        uv += u * v;
        vv += v * v;
        u1 += u;
        v1 += v;
        right += Vector3::new(2.0 * u * square, 2.0 * v * square, square);
    }
    let count = circle.points.len() as f64;
    let normal = Matrix3::new(
        4.0 * uu,
        4.0 * uv,
        2.0 * u1,
        4.0 * uv,
        4.0 * vv,
        2.0 * v1,
        2.0 * u1,
        2.0 * v1,
        count,
    );
    let Some(solution) = normal.lu().solve(&right) else {
        return f64::NAN;
    };
    let (least, greatest) = moved().fold((f64::INFINITY, 0.0_f64), |(low, high), (u, v)| {
        let square = (u - solution[0]).powi(2) + (v - solution[1]).powi(2);
        (low.min(square), high.max(square))
    });
    let (least, greatest) = (least.sqrt(), greatest.sqrt());
    um_from_mm(greatest - least)
}
