//! The slide sticks until its drive has wound up, then slips after it.
//!
//! It lags behind its command by a sawtooth of the way run, the same in every trace of a direction,
//! and what is seen comes with it. What both directions have in common passes for form; with a half
//! or a whole slip at mid travel the rest is a constant lag, `axis-backlash`. Free: the lag just before
//! it slips, the way from slip to slip, told by the slips over the travel, the state at mid travel.

use super::{FirstOrder, part_of_travel};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Place, Shape};

/// See the head of the file.
pub(super) struct StickSlip;

/// Slips over the travel between neighbouring starts of the search, and starts of the state.
const STRIDE: f64 = 0.4;
const STATES: [f64; 2] = [0.25, 0.75];

/// Nearer to a half or a whole slip at mid travel it is a constant lag.
const ASIDE: f64 = 0.1;

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
                2.0 + STRIDE * (k / STATES.len()) as f64,
                STATES[k % STATES.len()],
                0.0,
            ],
            steps: vec![0.25 * STRIDE, 0.1, 0.0],
        };
        (0..count * STATES.len()).map(at).collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let &[slips, state, lag] = shape.values.as_slice() else {
            return Vec::new();
        };
        let change = |k: usize, place: &Place| {
            let run = 0.5 * place.direction * part_of_travel(model, place.x);
            let behind = -place.direction * (slips * run + state).rem_euclid(1.0);
            behind * model.reading_chord(k, behind * lag)
        };
        vec![if model.lies_beneath() {
            Column::from_places(model.places(), change)
        } else {
            model.of_cell(change)
        }]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        let mut settled = shape.clone();
        if let (Some(lag), Some(size)) = (settled.values.get_mut(2), amplitudes.first()) {
            *lag = *size;
        }
        Some(settled)
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let reach = 1.5..highest(model) + STRIDE;
        let aside = |state: &f64| (ASIDE..=0.5 - ASIDE).contains(&state.rem_euclid(0.5));
        matches!(shape.values.as_slice(), [slips, state, ..]
            if reach.contains(slips) && aside(state))
    }
}

/// Most slips over the travel: six readings from slip to slip.
fn highest(model: &FirstOrder) -> f64 {
    0.16 * model.positions().len() as f64
}
