//! Algebraic circle fits: A (x² + y²) + B x + C y + D = 0 with the least sum of squares of the left
//! side under one quadratic constraint, which is what tells the four apart.
//!
//! N. Chernov, *Circular and Linear Regression* (2010), chapters 5 and 7; hyper fit: A. Al-Sharadqah
//! and N. Chernov, *Error analysis for circle fitting algorithms*, Electron. J. Stat. 3 (2009).

use super::points::{Circle, CircleError, Frame, Point, check_points};
use errsep_solvers::linear::limited;
use nalgebra::{DMatrix, Matrix3, Matrix4, Vector4};
use serde::{Deserialize, Serialize};

/// Which algebraic fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlgebraicFit {
    /// A = 1: plain linear regression. Shrinks short arcs.
    Kasa,
    /// B² + C² − 4AD = 1.
    Pratt,
    /// Mean square gradient equal to one.
    Taubin,
    /// Twice Taubin's constraint less Pratt's: no essential bias in the radius.
    Hyper,
}

impl AlgebraicFit {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Kasa, Self::Pratt, Self::Taubin, Self::Hyper];

    /// Name in files and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kasa => "kasa",
            Self::Pratt => "pratt",
            Self::Taubin => "taubin",
            Self::Hyper => "hyper",
        }
    }
}

/// The algebraic fit of `points` (mm).
///
/// # Errors
/// Those of [`check_points`], and [`CircleError::StraighterThanAnyCircle`] when the quadratic
/// coefficient of the best curve is zero.
pub fn algebraic(points: &[Point], kind: AlgebraicFit) -> Result<Circle, CircleError> {
    check_points(points)?;
    let frame = Frame::of(points);
    let (factor, mean_square) = compressed(points, frame);
    let coefficients = match kind {
        AlgebraicFit::Kasa => kasa(&factor),
        AlgebraicFit::Taubin => taubin(&factor, mean_square),
        AlgebraicFit::Pratt => constrained(&factor, -2.0, 0.0),
        AlgebraicFit::Hyper => constrained(&factor, 2.0, 8.0 * mean_square),
    };
    coefficients
        .and_then(circle_of)
        .map(|c| frame.to_world(c))
        .ok_or(CircleError::StraighterThanAnyCircle)
}

/// The triangular factor of the rows (1, x, y, x² + y²) in centred, scaled coordinates, and the mean
/// of x² + y². Every algebraic fit needs only these sixteen numbers of the points.
fn compressed(points: &[Point], frame: Frame) -> (Matrix4<f64>, f64) {
    let rows = points.len().max(4);
    let mut design = DMatrix::zeros(rows, 4);
    let mut sum = 0.0;
    for (row, p) in points.iter().enumerate() {
        let q = frame.to_local(*p);
        let z = q.dot(q);
        design[(row, 0)] = 1.0;
        design[(row, 1)] = q.x;
        design[(row, 2)] = q.y;
        design[(row, 3)] = z;
        sum += z;
    }
    let r = design.qr().unpack_r();
    (
        Matrix4::from_fn(|i, j| r[(i, j)]),
        sum / points.len() as f64,
    )
}

/// Coefficients in the order (D, B, C, A): z regressed on (1, x, y).
fn kasa(factor: &Matrix4<f64>) -> Option<Vector4<f64>> {
    let triangle: Matrix3<f64> = factor.fixed_view::<3, 3>(0, 0).into();
    let right = factor.fixed_view::<3, 1>(0, 3).into_owned();
    let solution = triangle.solve_upper_triangular(&right)?;
    Some(Vector4::new(-solution[0], -solution[1], -solution[2], 1.0))
}

/// Least singular direction of the mean-free rows (x, y, z − mean z), z scaled by 2√(mean z): the
/// constraint 4 A² mean z + B² + C² = 1 of centred data becomes the unit sphere.
fn taubin(factor: &Matrix4<f64>, mean_square: f64) -> Option<Vector4<f64>> {
    let scale = 2.0 * mean_square.sqrt();
    let mut block: Matrix3<f64> = factor.fixed_view::<3, 3>(1, 1).into();
    for i in 0..3 {
        block[(i, 2)] /= scale;
    }
    let svd = limited::svd(block, false, true)?;
    let direction = svd
        .v_t?
        .row(least_index(svd.singular_values.as_slice()))
        .transpose();
    let a = direction[2] / scale;
    Some(Vector4::new(
        -mean_square * a,
        direction[0],
        direction[1],
        a,
    ))
}

/// Pratt and hyper: M a = η N a for the least positive η, where N has the identity at (B, C) and the
/// symmetric block [[0, cross], [cross, corner]] at (D, A). Written for 1/η with M = V Σ² Vᵀ, it is the
/// greatest eigenvalue of Σ⁻¹ Vᵀ N V Σ⁻¹, which keeps its digits when the points are almost exact.
fn constrained(factor: &Matrix4<f64>, cross: f64, corner: f64) -> Option<Vector4<f64>> {
    let svd = limited::svd(*factor, false, true)?;
    let v_t = svd.v_t?;
    let least = least_index(svd.singular_values.as_slice());
    let greatest = svd.singular_values.max();
    if svd.singular_values[least] <= 4.0 * f64::EPSILON * greatest {
        return Some(v_t.row(least).transpose());
    }
    let mut constraint = Matrix4::identity();
    constraint[(0, 0)] = 0.0;
    constraint[(3, 3)] = corner;
    constraint[(0, 3)] = cross;
    constraint[(3, 0)] = cross;
    let inverse = Matrix4::from_diagonal(&svd.singular_values.map(|s| 1.0 / s));
    let eigen = limited::symmetric_eigen(inverse * v_t * constraint * v_t.transpose() * inverse)?;
    let chosen = eigen.eigenvalues.imax();
    (eigen.eigenvalues[chosen] > 0.0)
        .then(|| v_t.transpose() * inverse * eigen.eigenvectors.column(chosen))
}

fn least_index(values: &[f64]) -> usize {
    (0..values.len())
        .min_by(|&i, &j| values[i].total_cmp(&values[j]))
        .unwrap_or(0)
}

fn circle_of(c: Vector4<f64>) -> Option<Circle> {
    let (d, b, cc, a) = (c[0], c[1], c[2], c[3]);
    let centre = Point::new(-b / (2.0 * a), -cc / (2.0 * a));
    let radius = (centre.dot(centre) - d / a).sqrt();
    (centre.x.is_finite() && centre.y.is_finite() && radius.is_finite() && radius > 0.0)
        .then_some(Circle { centre, radius })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The six points of Gander, Golub and Strebel (1994).
    fn six() -> Vec<Point> {
        [(1., 7.), (2., 6.), (5., 8.), (7., 7.), (9., 5.), (3., 7.)]
            .map(|(x, y)| Point::new(x, y))
            .to_vec()
    }

    #[test]
    fn six_points_of_gander_golub_strebel() {
        // Tolerance: half a unit of the last printed digit.
        for (kind, x, y, r) in [
            (AlgebraicFit::Kasa, 4.742331, 3.835123, 4.108762),
            (AlgebraicFit::Pratt, 4.615482, 2.807354, 4.911302),
            (AlgebraicFit::Taubin, 4.613933, 2.795209, 4.879213),
            (AlgebraicFit::Hyper, 4.615482, 2.807354, 4.827575),
        ] {
            let c = algebraic(&six(), kind).unwrap();
            let off = [c.centre.x - x, c.centre.y - y, c.radius - r];
            assert!(off.iter().all(|d| d.abs() < 5.1e-7), "{kind:?} {c:?}");
        }
    }

    #[test]
    fn points_on_a_circle_give_that_circle_far_from_the_origin() {
        // Tolerance: rounding of the coordinates, 1e6 mm · ε = 2e-10 mm, grown by a 120° arc.
        let points: Vec<Point> = (0..50)
            .map(|i| {
                let t = f64::from(i) * 2.0 / 49.0;
                Point::new(1e6 + 40.0 * t.cos(), -3e5 + 40.0 * t.sin())
            })
            .collect();
        for kind in AlgebraicFit::ALL {
            let c = algebraic(&points, kind).unwrap();
            assert!((c.radius - 40.0).abs() < 5e-9, "{kind:?} {c:?}");
            assert!(
                c.centre.distance(Point::new(1e6, -3e5)) < 5e-9,
                "{kind:?} {c:?}"
            );
        }
    }

    #[test]
    fn three_points_are_met_exactly() {
        let points = [Point::new(0., 0.), Point::new(4., 0.), Point::new(0., 3.)];
        for kind in AlgebraicFit::ALL {
            let c = algebraic(&points, kind).unwrap();
            // Tolerance: 50 epsilons of a 4 mm figure.
            assert!((c.radius - 2.5).abs() < 5e-14, "{kind:?} {c:?}");
        }
    }
}
