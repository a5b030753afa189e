//! The part lay otherwise in one pass, or from some moment on.

use super::CirclePoints;
use crate::model::Moments;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// Moments at which the search begins.
const MOST: usize = 40;
/// Readings before and after a moment, at least: of fewer its two amplitudes make whatever they are, as a wrong reading
/// does.
const FEWEST: usize = 3;

/// See the head of the file.
pub(super) struct PartMoved;

impl Effect<CirclePoints> for PartMoved {
    fn name(&self) -> &str {
        "part-moved"
    }

    fn about(&self) -> About {
        About {
            physics: "the part, or the zero of the axes, moved: one pass has a centre of its own, or all points from some moment on",
            confirm: "clamp anew, measure a reference point before and after every pass",
            source: "a centre for each pass; another centre from a moment on",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("along-x", "um", 1e5),
            Parameter::symmetric("along-y", "um", 1e5),
        ]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "readings", 0.0, 1e9)]
    }

    /// One for each pass, without a moment, then those of all moments.
    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        // With two passes the place of the one is that of the other, turned round.
        let passes = model.traces().len();
        let different = match passes {
            0 | 1 => 0..0,
            2 => 1..2,
            _ => 0..passes,
        };
        let from_on = Moments::of(model.places().iter()).grid(passes, MOST);
        let seen = from_on
            .into_iter()
            .filter(|shape| self.allowed(model, shape));
        different.map(Shape::variant).chain(seen).collect()
    }

    fn allowed(&self, model: &CirclePoints, shape: &Shape) -> bool {
        shape.values.first().is_none_or(|moment| {
            let places = model.places().iter();
            let later = places.filter(|place| place.time > *moment).count();
            (FEWEST..=model.places().len().saturating_sub(FEWEST)).contains(&later)
        })
    }

    fn moments(&self, model: &CirclePoints, shape: &Shape) -> Vec<f64> {
        let of = |_: &f64| Moments::of(model.places().iter()).all();
        shape.values.first().map_or_else(Vec::new, of)
    }

    fn variant_name(&self, model: &CirclePoints, shape: &Shape) -> Option<String> {
        let Some(trace) = model.traces().get(shape.variant) else {
            return Some("from a moment on".to_owned());
        };
        let place = model.places().get(trace.start)?;
        Some(format!("repeat {}", place.repeat))
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        let rows: Vec<usize> = match (model.traces().get(shape.variant), shape.values.first()) {
            (Some(pass), _) => pass.clone().collect(),
            (None, Some(moment)) => {
                let later = |row: &usize| model.places()[*row].time > *moment;
                (0..model.places().len()).filter(later).collect()
            }
            (None, None) => return Vec::new(),
        };
        let angle = |k: usize| CirclePoints::angle(&model.places()[k]);
        [f64::cos, f64::sin]
            .map(|along| Column {
                values: rows.iter().map(|k| along(angle(*k))).collect(),
                rows: rows.clone(),
            })
            .into()
    }
}
