//! The zero of one indicator jumps once.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::reversal::Channel;

/// See the head of the file. Variant: the channel in which the jump falls.
pub(super) struct ZeroJump;

/// Readings of one channel between neighbouring starts of the search.
const STRIDE: usize = 8;

impl Effect<FirstOrder> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero of one indicator jumps at one moment and stays there: a knock, a slip in its clamp",
            confirm: "check the clamp, and read a fixed point before and after every trace",
            source: "step function of time in one channel",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "jump",
            unit: "um",
            low: -1000.0,
            high: 1000.0,
        }]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "time",
            unit: "s",
            low: 0.0,
            high: 1e9,
        }]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for (variant, _) in model.present().iter().enumerate() {
            let times = times_of(model, variant);
            for pair in times.windows(2).step_by(STRIDE) {
                shapes.push(Shape {
                    variant,
                    values: vec![0.5 * (pair[0] + pair[1])],
                    steps: vec![0.5 * STRIDE as f64 * (pair[1] - pair[0])],
                });
            }
        }
        shapes
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let time = shape.values.first().copied().unwrap_or(f64::INFINITY);
        let mut column = Column::default();
        for trace in model.traces() {
            if model.places()[trace.start].channel == shape.variant {
                column
                    .rows
                    .extend(trace.clone().filter(|k| model.places()[*k].time > time));
            }
        }
        column.values = vec![1.0; column.rows.len()];
        vec![column]
    }

    /// The jump lies anywhere between two readings: a rectangle of that width.
    fn resolution(&self, model: &FirstOrder, shape: &Shape) -> Vec<f64> {
        let times = times_of(model, shape.variant);
        let right = shape
            .values
            .first()
            .map_or(0, |t| times.partition_point(|v| v <= t));
        let gap = match (
            right.checked_sub(1).and_then(|k| times.get(k)),
            times.get(right),
        ) {
            (Some(before), Some(after)) => after - before,
            _ => f64::NAN,
        };
        vec![gap / 12f64.sqrt()]
    }

    fn variant_name(&self, model: &FirstOrder, shape: &Shape) -> Option<String> {
        model
            .present()
            .get(shape.variant)
            .map(|c: &Channel| format!("channel {}", c.name()))
    }
}

/// The times of one channel's readings, in order.
fn times_of(model: &FirstOrder, channel: usize) -> Vec<f64> {
    let mut times: Vec<f64> = model
        .places()
        .iter()
        .filter(|p| p.channel == channel)
        .map(|p| p.time)
        .collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}
