//! By how much a measured part lay turned, exactly.
//!
//! With the nominal points p and the measured ones q, each from its mean, the turn is the rotation R of least Σ |q − Rp|²
//! (Kabsch, Acta Cryst. A32, 1976). To first order it would be ω × p: of a plate of 400 mm that lies turned by 2 mrad that
//! misses 0.8 µm, which looks like a scale.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{Axis, PartReading};
use crate::units::mm_from_um;

/// Singular values below this share of the greatest are of points on a line, about which no turn is seen.
const ON_A_LINE: f64 = 1e-9;

/// A rotation as a vector, rad, and its angle, exact for the least ones too.
pub(super) fn as_vector(turn: &Rotation3<f64>) -> (Vector3<f64>, f64) {
    let m = turn.matrix();
    let sines = Vector3::new(
        m[(2, 1)] - m[(1, 2)],
        m[(0, 2)] - m[(2, 0)],
        m[(1, 0)] - m[(0, 1)],
    ) / 2.0;
    let sine = sines.norm();
    let angle = sine.atan2((m.trace() - 1.0) / 2.0);
    let vector = if sine > 0.0 {
        sines * (angle / sine)
    } else {
        Vector3::zeros()
    };
    (vector, angle)
}

/// Nominal and measured place of a point, mm.
type Pair = (Vector3<f64>, Vector3<f64>);

/// The rotation of a part and the mean of its nominal points; `None` where not every point was read along the same
/// two or three axes, or the points do not tell it.
pub(super) fn turn_of<'r>(
    readings: impl Iterator<Item = &'r PartReading>,
) -> Option<(Rotation3<f64>, Vector3<f64>)> {
    let mut points: BTreeMap<(u32, &str), (Pair, [bool; 3])> = BTreeMap::new();
    for r in readings {
        let ((_, measured), read) = points
            .entry((r.replicate, &r.feature))
            .or_insert(((r.position, r.position), [false; 3]));
        measured[r.axis.index()] += mm_from_um(r.value);
        read[r.axis.index()] = true;
    }
    let (_, read) = *points.values().next()?;
    if points.values().any(|(_, other)| *other != read) {
        return None;
    }
    let count = points.len() as f64;
    let (p, q) = points.values().fold(
        (Vector3::zeros(), Vector3::zeros()),
        |(p, q): Pair, ((nominal, measured), _)| (p + nominal, q + measured),
    );
    let (p, q) = (p / count, q / count);
    let from_mean = points
        .values()
        .map(|((nominal, measured), _)| (nominal - p, measured - q));
    let turn = match Axis::ALL.map(|axis| read[axis.index()]) {
        [true, true, true] => in_space(from_mean),
        [true, true, false] => about(Axis::Z, from_mean),
        [true, false, true] => about(Axis::Y, from_mean),
        [false, true, true] => about(Axis::X, from_mean),
        _ => None,
    };
    Some((turn?, p))
}

/// The rotation in space.
fn in_space(pairs: impl Iterator<Item = Pair>) -> Option<Rotation3<f64>> {
    let sum: Matrix3<f64> = pairs.map(|(p, q)| p * q.transpose()).sum();
    let svd = sum.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    if !(svd.singular_values[1] > ON_A_LINE * svd.singular_values[0]) {
        return None;
    }
    let mut signs = Matrix3::identity();
    // A reflection would fit flat parts as well.
    signs[(2, 2)] = (v * u.transpose()).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(v * signs * u.transpose()))
}

/// The rotation about an axis.
fn about(axis: Axis, pairs: impl Iterator<Item = Pair>) -> Option<Rotation3<f64>> {
    let mut along = Vector3::zeros();
    along[axis.index()] = 1.0;
    let (sine, cosine) = pairs.fold((0.0, 0.0), |(sine, cosine), (p, q)| {
        let flat = p - along * along.dot(&p);
        (sine + along.dot(&flat.cross(&q)), cosine + flat.dot(&q))
    });
    let axis = nalgebra::Unit::new_unchecked(along);
    (sine != 0.0 || cosine != 0.0).then(|| Rotation3::from_axis_angle(&axis, sine.atan2(cosine)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(turn: &Rotation3<f64>, axes: &[Axis], flat: bool) -> Vec<PartReading> {
        let mut all = Vec::new();
        for k in 0..12 {
            let (i, j) = (f64::from(k % 4), f64::from(k / 4));
            let z = if flat { 0.0 } else { 7.0 * (i * j).sin() };
            let nominal = Vector3::new(90.0 * i, 110.0 * j, z);
            let measured = turn * nominal + Vector3::new(0.3, -2.0, 0.1);
            for axis in axes {
                all.push(PartReading {
                    part: "1".to_owned(),
                    feature: k.to_string(),
                    axis: *axis,
                    replicate: 1,
                    position: nominal,
                    value: 1e3 * (measured - nominal)[axis.index()],
                });
            }
        }
        all
    }

    fn apart(a: &Rotation3<f64>, b: &Rotation3<f64>) -> f64 {
        (a.matrix() - b.matrix()).norm()
    }

    /// *Exact*: rotations as vectors, a tiny one and a half turn.
    #[test]
    fn rotations_are_vectors() {
        for size in [1e-9, 0.01, 1.5] {
            let about = Vector3::new(1.0, -2.0, 2.0) / 3.0 * size;
            let (vector, angle) = as_vector(&Rotation3::new(about));
            // Rounding.
            assert!(
                (vector - about).norm() < 1e-15 && (angle - size).abs() < 1e-15,
                "{size}"
            );
        }
        let (_, angle) = as_vector(&Rotation3::from_euler_angles(
            0.0,
            0.0,
            std::f64::consts::PI,
        ));
        assert!((angle - std::f64::consts::PI).abs() < 1e-12);
    }

    /// *Exact*: any rotation comes back from points in space and from flat ones, that about an axis from the two others.
    #[test]
    fn turns_come_back() {
        for turn in [
            Rotation3::from_euler_angles(2e-3, -0.01, 0.008),
            Rotation3::from_euler_angles(0.4, -1.0, 2.5),
        ] {
            for flat in [false, true] {
                let (found, _) = turn_of(readings(&turn, &Axis::ALL, flat).iter()).unwrap();
                // Rounding.
                assert!(apart(&found, &turn) < 1e-12, "{flat}");
            }
        }
        for (axes, angles) in [
            ([Axis::X, Axis::Y], [0.0, 0.0, 1.3]),
            ([Axis::X, Axis::Z], [0.0, -0.7, 0.0]),
            ([Axis::Y, Axis::Z], [0.02, 0.0, 0.0]),
        ] {
            let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
            let (found, _) = turn_of(readings(&turn, &axes, false).iter()).unwrap();
            assert!(apart(&found, &turn) < 1e-12, "{axes:?}");
        }
        let turn = Rotation3::identity();
        assert!(turn_of(readings(&turn, &[Axis::X], false).iter()).is_none());
    }
}
