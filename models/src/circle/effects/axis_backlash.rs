//! An axis loses motion where it reverses.

use super::CirclePoints;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// The variant of the x axis; the other is that of y.
const X: usize = 0;

/// At the reversal itself the axis has not moved back yet: a point stands as the place does that lies so far
/// before it, or a quarter of the way to its neighbour where that is less. Which side of the reversal noise has
/// put the point on does not count.
const JUST_BEFORE_DEG: f64 = 0.1;

/// See the head of the file.
pub(super) struct AxisBacklash;

impl Effect<CirclePoints> for AxisBacklash {
    fn name(&self) -> &str {
        "axis-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "an axis stands still for a while where it reverses, so that the circle has a step at both ends of that axis",
            confirm: "take the circle in the other direction: the step changes its sign",
            source: "half of the lost motion against the direction of the axis, along it; reversal error, ISO 230-4",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("lost-motion", "um", 1e3)]
    }

    fn grid(&self, _model: &CirclePoints) -> Vec<Shape> {
        (0..2).map(Shape::variant).collect()
    }

    fn variant_name(&self, _model: &CirclePoints, shape: &Shape) -> Option<String> {
        Some(
            if shape.variant == X {
                "x axis"
            } else {
                "y axis"
            }
            .to_owned(),
        )
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        vec![lost_motion(model, shape.variant)]
    }
}

/// Half of a lost motion of one against the travel of an axis, as the radius shows it.
pub(in crate::circle) fn lost_motion(model: &CirclePoints, axis: usize) -> Column {
    let earlier = model.spacing_of_a_pass() / 4.0;
    let earlier = earlier.min(JUST_BEFORE_DEG).to_radians();
    Column::from_places(model.places(), |_, place| {
        let angle = CirclePoints::angle(place);
        let (sin, cos) = (angle - place.direction * earlier).sin_cos();
        let (along, speed) = match axis {
            X => (angle.cos(), -sin),
            _ => (angle.sin(), cos),
        };
        -0.5 * along * (place.direction * speed).signum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circle::{CircleSimulation, simulate};

    /// Points at the reversals themselves, in noise that moves each to either side of them, both ways round.
    #[test]
    fn a_point_at_the_reversal_stands_as_before_it() {
        for arc in [std::f64::consts::TAU, -std::f64::consts::TAU] {
            let what = CircleSimulation {
                arc,
                ..CircleSimulation::default()
            };
            let passes = (1..=8_u32).flat_map(|pass| {
                let points = simulate(&what, u64::from(pass)).expect("points");
                points.into_iter().map(move |point| (point, pass))
            });
            let points: Vec<_> = passes.collect();
            let model = CirclePoints::new(&points, None).expect("a circle");
            let change = AxisBacklash.columns(&model, &Shape::variant(X))[0].dense(points.len());
            let at_rest = |at: f64| {
                let places = model.places().iter().enumerate();
                let near = places.filter(move |(_, p)| {
                    let off = (p.x - at + 180.0).rem_euclid(360.0) - 180.0;
                    off.abs() < 1.0
                });
                near.map(|(i, _)| change[i]).collect::<Vec<_>>()
            };
            // x rises before 0 degrees and falls before 180, whichever way round: half of the lost motion
            // behind, along the radius. The cosine of a point that noise moves by 1e-4 rad.
            for at in [0.0, 180.0] {
                let all = at_rest(at);
                assert_eq!(all.len(), 8);
                for value in all {
                    assert!((value + 0.5).abs() < 1e-6, "at {at}, arc {arc}: {value}");
                }
            }
        }
    }
}
