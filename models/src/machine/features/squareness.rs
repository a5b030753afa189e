//! The angle between two rows of points (NISTIR 6868, section 4.5).

use nalgebra::Vector3;

use crate::machine::{Axis, Functional, Machine, MachineError, Position, Weight};
use crate::units::mm_from_um;

/// Two rows of points and the directions along which they nominally run.
#[derive(Debug, Clone, PartialEq)]
pub struct Squareness {
    along: [Axis; 2],
    rows: [Vec<Position>; 2],
}

impl Squareness {
    /// Two rows, the first along `along[0]`, the second along `along[1]`.
    ///
    /// # Errors
    /// The same direction twice; a row of fewer than two points, or whose points all have the same
    /// coordinate along its direction.
    pub fn new(
        along: [Axis; 2],
        first: Vec<Position>,
        second: Vec<Position>,
    ) -> Result<Self, MachineError> {
        let bad = |why: String| MachineError::BadFeature {
            feature: "squareness",
            why,
        };
        if along[0] == along[1] {
            return Err(bad("its rows run in the same direction".into()));
        }
        for (row, axis) in [(&first, along[0]), (&second, along[1])] {
            let at = |p: &Position| p[axis.index()];
            let spread = row.iter().any(|p| at(p) != row.first().map_or(0.0, at));
            if !spread {
                let letter = axis.letter();
                return Err(bad(format!(
                    "the row along {letter} needs points at two or more coordinates {letter}"
                )));
            }
        }
        Ok(Self {
            along,
            rows: [first, second],
        })
    }

    /// The points of both rows, the first row first.
    #[must_use]
    pub fn points(&self) -> Vec<Position> {
        self.rows.concat()
    }

    /// The change (rad) of the angle from the first row to the second for these deviations (um) of
    /// [`Squareness::points`], by lines of least squares: `-slope(second) - slope(first)`
    /// (equations 36 and 42 to 44). Positive when the angle exceeds 90°.
    #[must_use]
    pub fn angle(&self, deviations: &[Vector3<f64>]) -> f64 {
        let split = self.rows[0].len().min(deviations.len());
        let (first, second) = deviations.split_at(split);
        let [a, b] = self.along;
        -slope(&self.rows[1], second, b, a) - slope(&self.rows[0], first, a, b)
    }

    /// The angle of this machine, rad, and its dependence on the deviations (equation 41).
    ///
    /// # Errors
    /// A position outside a table or not finite.
    pub fn functional(&self, machine: &Machine) -> Result<Functional, MachineError> {
        let points = self.points();
        let deviations = points
            .iter()
            .map(|p| machine.deviation(p))
            .collect::<Result<Vec<_>, _>>()?;
        let (first, second) = deviations.split_at(self.rows[0].len());
        let [a, b] = self.along;
        let gradients = slope_gradient(&self.rows[0], first, a, b).chain(slope_gradient(
            &self.rows[1],
            second,
            b,
            a,
        ));
        let weights = points
            .iter()
            .zip(gradients)
            .map(|(position, gradient)| Weight {
                position: *position,
                gradient: -gradient,
            })
            .collect();
        Ok(Functional {
            label: "squareness".into(),
            unit: "rad".into(),
            value: self.angle(&deviations),
            weights,
        })
    }
}

/// Sums of a row of moved points about its centre: `S_uu`, `S_uv`, mean of `u` and of `v`.
fn sums(row: &[Position], moved: &[Vector3<f64>], u: Axis, v: Axis) -> [f64; 4] {
    let n = row.len() as f64;
    let at = |axis: Axis| {
        let i = axis.index();
        row.iter()
            .zip(moved)
            .map(move |(p, d)| p[i] + mm_from_um(d[i]))
    };
    let (mean_u, mean_v) = (at(u).sum::<f64>() / n, at(v).sum::<f64>() / n);
    let pairs = at(u).zip(at(v));
    let (uu, uv) = pairs.fold((0.0, 0.0), |(uu, uv), (x, y)| {
        (uu + (x - mean_u).powi(2), uv + (x - mean_u) * (y - mean_v))
    });
    [uu, uv, mean_u, mean_v]
}

fn slope(row: &[Position], moved: &[Vector3<f64>], u: Axis, v: Axis) -> f64 {
    let [uu, uv, ..] = sums(row, moved, u, v);
    uv / uu
}

/// Derivative of the slope by each point, per um: with `b = S_uv / S_uu` it is `(v_k - v̄ - 2 b (u_k -
/// ū)) / S_uu` along `u` and `(u_k - ū) / S_uu` along `v`, equation (41) about the centre.
fn slope_gradient(
    row: &[Position],
    moved: &[Vector3<f64>],
    u: Axis,
    v: Axis,
) -> impl Iterator<Item = Vector3<f64>> {
    let [uu, uv, mean_u, mean_v] = sums(row, moved, u, v);
    let slope = uv / uu;
    row.iter().zip(moved).map(move |(p, d)| {
        let x = p[u.index()] + mm_from_um(d[u.index()]) - mean_u;
        let y = p[v.index()] + mm_from_um(d[v.index()]) - mean_v;
        let mut gradient = Vector3::zeros();
        gradient[u.index()] = mm_from_um((y - 2.0 * slope * x) / uu);
        gradient[v.index()] = mm_from_um(x / uu);
        gradient
    })
}
