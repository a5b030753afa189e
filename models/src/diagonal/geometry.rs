//! What the laser reads, by exact geometry: finite rotations, the beam cut with the mirror plane or
//! folded by the retro-reflector. Shares nothing with the linear prediction but the sign conventions.

use super::components::{Axis, Location};
use super::diagonals::{Diagonal, Target, Travel, WorkZone};
use super::errors::ErrorTables;
use nalgebra::{Rotation3, Vector3};

/// µm per mm.
const UM: f64 = 1e3;

/// Error of the displacement read at grid indices `at`, µm, relative to the start of the diagonal,
/// with the mirror of this set-up misaligned by `mirror` (rotation vector, rad). The start is left, and
/// on the way forward every stop reached, in the forward sense.
pub fn exact_reading(
    zone: &WorkZone,
    errors: &ErrorTables,
    diagonal: Diagonal,
    target: Target,
    mirror: Vector3<f64>,
    at: [usize; 3],
    travel: Travel,
) -> f64 {
    let n = diagonal.direction(zone);
    let laser = diagonal.start(zone);
    let (start, _) = zone.ends(diagonal);
    let displacement = |index: [usize; 3], travel: Travel| {
        let (tool, orientation) = pose(zone, errors, index, diagonal.approach(travel));
        match target {
            Target::Mirror => to_mirror(laser, n, tool, orientation, mirror),
            Target::RetroReflector => folded(laser, n, tool, mirror),
        }
    };
    let nominal = n.dot(&(zone.position(at) - zone.position(start)));
    UM * (displacement(at, travel) - displacement(start, Travel::Forward) - nominal)
}

/// Position of the tool, mm, and orientation: X carries Y carries Z carries the tool, each rotation
/// about the origin of its own slide.
fn pose(
    zone: &WorkZone,
    errors: &ErrorTables,
    index: [usize; 3],
    approach: [i8; 3],
) -> (Vector3<f64>, Rotation3<f64>) {
    let nominal = zone.position(index);
    let [xy, xz, yz] = Location::ALL.map(|l| errors.squareness_of(l));
    let along = [
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(-xy.sin(), xy.cos(), 0.0),
        Vector3::new(-xz, -yz, (1.0 - xz * xz - yz * yz).max(0.0).sqrt()),
    ];
    let mut tool = Vector3::zeros();
    let mut orientation = Rotation3::identity();
    for axis in Axis::ALL {
        let a = axis.index();
        let moved = along[a] * nominal[a] + errors.vector(axis, false, index[a], approach[a]) / UM;
        tool += orientation * moved;
        orientation *=
            Rotation3::from_scaled_axis(errors.vector(axis, true, index[a], approach[a]));
    }
    (tool, orientation)
}

/// Length of the beam from the laser to the mirror plane through the tool.
fn to_mirror(
    laser: Vector3<f64>,
    n: Vector3<f64>,
    tool: Vector3<f64>,
    orientation: Rotation3<f64>,
    mirror: Vector3<f64>,
) -> f64 {
    let normal = orientation * (Rotation3::from_scaled_axis(mirror) * n);
    (tool - laser).dot(&normal) / normal.dot(&n)
}

/// A quarter of the doubled path laser, retro-reflector, return mirror: the retro-reflector sends the
/// beam back parallel, displaced by twice its own offset from the beam, onto a mirror at the laser.
fn folded(laser: Vector3<f64>, n: Vector3<f64>, tool: Vector3<f64>, mirror: Vector3<f64>) -> f64 {
    let normal = Rotation3::from_scaled_axis(mirror) * n;
    let forward = (tool - laser).dot(&n);
    let offset = 2.0 * (tool - laser - forward * n);
    let mirror_ahead = -offset.dot(&normal) / normal.dot(&n);
    0.5 * (forward + (forward - mirror_ahead))
}
