//! What an error of a slide does to the functional point: to first order, and exactly.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::{Axis, Chain, Component, Kind, Position, Sense, Side};
use crate::units::{UM_PER_MM, mm_from_um, um_from_mm};

/// Change of the deviation (um) of the functional point by one component, per um for a
/// translation and per rad for a rotation, at a position of the axes (mm).
///
/// A slide that rotates by `epsilon` moves the point at the arm `r` from its reference point by
/// `epsilon × r`; a path turned by `epsilon` moves its slide at displacement `s` by `epsilon × s`.
/// The deviation is that of the tool's side less that of the workpiece's, or the reverse.
#[must_use]
pub fn sensitivity(
    chain: &Chain,
    component: Component,
    position: &Position,
    sense: Sense,
) -> Vector3<f64> {
    let slide = chain.slide(component.axis);
    let direction = unit(component.direction);
    let motion = match component.kind {
        Kind::Translation => direction,
        Kind::Rotation => direction.cross(&arm(chain, component.axis, position)) * UM_PER_MM,
        Kind::Squareness => {
            let at = slide.displacement(position[component.axis.index()]);
            direction.cross(&(unit(component.axis) * at)) * UM_PER_MM
        }
    };
    match (slide.side, sense) {
        (Side::Tool, Sense::Tool) | (Side::Work, Sense::Work) => motion,
        _ => -motion,
    }
}

/// From the reference point of a slide to the functional point, nominally, mm.
fn arm(chain: &Chain, axis: Axis, position: &Position) -> Vector3<f64> {
    let reach = |side, last: Option<Axis>| {
        let mut sum = Vector3::zeros();
        for slide in chain.slides(side) {
            sum += unit(slide.axis) * slide.displacement(position[slide.axis.index()]);
            if Some(slide.axis) == last {
                break;
            }
        }
        sum
    };
    let functional = reach(Side::Tool, None) + chain.tool_offset();
    functional - reach(chain.slide(axis).side, Some(axis))
}

/// The deviation (um) of the functional point by homogeneous transforms of finite rotations.
///
/// `errors` holds the value of each component in the order of [`super::COMPONENTS`], um and rad.
#[must_use]
pub fn exact_deviation(
    chain: &Chain,
    errors: &[f64; 21],
    position: &Position,
    sense: Sense,
) -> Vector3<f64> {
    let side = |side| {
        chain
            .slides(side)
            .iter()
            .fold(Isometry3::identity(), |pose, slide| {
                pose * motion(
                    slide.displacement(position[slide.axis.index()]),
                    slide.axis,
                    errors,
                )
            })
    };
    let nominal = |side| {
        chain
            .slides(side)
            .iter()
            .fold(Vector3::zeros(), |sum, slide| {
                sum + unit(slide.axis) * slide.displacement(position[slide.axis.index()])
            })
    };
    let offset = chain.tool_offset();
    let work_point = nominal(Side::Tool) + offset - nominal(Side::Work);
    let tool = side(Side::Tool).transform_point(&Point3::from(offset));
    let work = side(Side::Work).transform_point(&Point3::from(work_point));
    let seen = match sense {
        Sense::Tool => side(Side::Work).inverse_transform_point(&tool).coords - work_point,
        Sense::Work => side(Side::Tool).inverse_transform_point(&work).coords - offset,
    };
    seen.map(um_from_mm)
}

/// The actual motion of one slide: ideal displacement along its turned path, then its errors.
fn motion(displacement: f64, axis: Axis, errors: &[f64; 21]) -> Isometry3<f64> {
    let of = |kind| {
        let mut vector = Vector3::zeros();
        for component in super::COMPONENTS {
            if component.kind == kind && component.axis == axis {
                vector[component.direction.index()] = errors[component.index()];
            }
        }
        vector
    };
    let path = UnitQuaternion::from_scaled_axis(of(Kind::Squareness)) * unit(axis);
    let shift = path * displacement + of(Kind::Translation).map(mm_from_um);
    let turn = UnitQuaternion::from_scaled_axis(of(Kind::Rotation));
    Isometry3::from_parts(Translation3::from(shift), turn)
}

fn unit(axis: Axis) -> Vector3<f64> {
    let mut vector = Vector3::zeros();
    vector[axis.index()] = 1.0;
    vector
}
