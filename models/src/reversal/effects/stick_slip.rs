//! The slide sticks until its drive has wound up, then slips after it.
//!
//! It lags behind its command by a sawtooth of the way run, the same in every trace of a direction,
//! and what is seen comes with it. Free: the lag just before it slips, the way from slip to slip,
//! told by the slips over the travel, and the state at mid travel.

use super::{FirstOrder, part_of_travel};
use crate::model::{About, Column, Effect, Link, Parameter, Shape};

/// See the head of the file.
pub(super) struct StickSlip;

/// Slips over the travel between neighbouring starts of the search, and starts of the state.
const STRIDE: f64 = 0.4;
const STATES: usize = 4;

impl Effect<FirstOrder> for StickSlip {
    fn name(&self) -> &str {
        "stick-slip"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide sticks until its drive has wound up and then slips after it, over and over",
            confirm: "feed slowly under a laser or scale and look for steps; lubricate and repeat",
            source: "sawtooth of the lag; Armstrong-Helouvry, Control of Machines with Friction (1991)",
        }
    }

    fn link(&self) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("lag", "mm", 0.0, 5.0)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        let state = Parameter::between("state", "1", -10.0, 10.0);
        vec![Parameter::between("slips", "1", 1.0, 1e6), state]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let count = ((highest(model) - 2.0) / STRIDE).max(0.0) as usize;
        let at = |k: usize| Shape {
            variant: 0,
            values: vec![
                2.0 + STRIDE * (k / STATES) as f64,
                (k % STATES) as f64 / STATES as f64,
            ],
            steps: vec![0.25 * STRIDE, 0.5 / STATES as f64],
        };
        (0..count * STATES).map(at).collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let &[slips, state] = shape.values.as_slice() else {
            return Vec::new();
        };
        vec![model.of_cell(|_, place| {
            let run = 0.5 * place.direction * part_of_travel(model, place.x);
            let wound = (slips * run + state).rem_euclid(1.0);
            -place.direction * wound * model.reading_slope(place)
        })]
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let reach = 1.5..highest(model) + STRIDE;
        shape
            .values
            .first()
            .is_some_and(|slips| reach.contains(slips))
    }
}

/// Most slips over the travel: four readings from slip to slip.
fn highest(model: &FirstOrder) -> f64 {
    0.25 * model.positions().len() as f64
}
