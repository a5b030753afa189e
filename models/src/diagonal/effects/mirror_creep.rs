//! The mirror turns while the runs of one diagonal are taken.

use super::DiagonalRuns;
use crate::diagonal::{Diagonal, Parameter as Parameter21};
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// The diagonals that were measured.
fn diagonals(model: &DiagonalRuns) -> Vec<Diagonal> {
    let mut diagonals: Vec<Diagonal> = model.channels().iter().map(|c| c.0).collect();
    diagonals.dedup();
    diagonals
}

/// See the head of the file.
pub(super) struct MirrorCreep;

impl Effect<DiagonalRuns> for MirrorCreep {
    fn name(&self) -> &str {
        "mirror-creep"
    }

    fn about(&self) -> About {
        About {
            physics: "the mount of the mirror creeps, so that its angle changes while the runs of one diagonal are taken",
            confirm: "clamp the mirror otherwise, wait, and repeat the first run of that diagonal at its end",
            source: "Soons, equation (4), the angle of the mirror growing evenly with time",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("first-angle", "rad", 1e-2),
            Parameter::symmetric("second-angle", "rad", 1e-2),
        ]
    }

    fn grid(&self, model: &DiagonalRuns) -> Vec<Shape> {
        (0..diagonals(model).len()).map(Shape::variant).collect()
    }

    fn variant_name(&self, model: &DiagonalRuns, shape: &Shape) -> Option<String> {
        let diagonals = diagonals(model);
        Some(diagonals.get(shape.variant)?.name().to_owned())
    }

    fn columns(&self, model: &DiagonalRuns, shape: &Shape) -> Vec<Column> {
        let diagonals = diagonals(model);
        let Some(own) = diagonals.get(shape.variant) else {
            return Vec::new();
        };
        let mine = |channel: usize| model.channels()[channel].0 == *own;
        let times = || {
            let places = model.places().iter().filter(|p| mine(p.channel));
            places.map(|p| p.time)
        };
        let first = times().fold(f64::INFINITY, f64::min);
        let last = times().fold(f64::NEG_INFINITY, f64::max);
        [0, 1]
            .map(|direction| {
                Column::from_places(model.places(), |row, place| {
                    if !mine(place.channel) {
                        return 0.0;
                    }
                    let grown = (place.time - first) / (last - first).max(1.0);
                    let turned = model.weighted(row, |parameter| {
                        f64::from(u8::from(matches!(
                            parameter,
                            Parameter21::Mirror(_, _, k) if *k == direction
                        )))
                    });
                    grown * turned
                })
            })
            .into()
    }
}
