//! The indicator lags behind its stylus: a play between stylus and pointer.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// See the head of the file. The lag saturates at half the width once the stylus has moved by the
/// width, so the signature depends on the size where the reading turns round within a trace.
pub(super) struct Hysteresis;

impl Effect<FirstOrder> for Hysteresis {
    fn name(&self) -> &str {
        "hysteresis"
    }

    fn about(&self) -> About {
        About {
            physics: "the indicator lags behind its stylus, so rising and falling readings differ by a constant width",
            confirm: "move the stylus up and down over gauge blocks and read the difference",
            source: "play operator (Brokate and Sprekels, Hysteresis and Phase Transitions, section 2.2); ISO 463 hysteresis of dial gauges",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "width",
            unit: "um",
            low: 0.0,
            high: 50.0,
        }]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        [1e-3, 1e-2, 3e-2, 1e-1]
            .iter()
            .enumerate()
            .map(|(variant, part)| Shape {
                variant,
                values: vec![part * model.reading_span()],
                steps: vec![0.0],
            })
            .collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let Some(&width) = shape.values.first() else {
            return Vec::new();
        };
        let width = width.max(1e-6 * model.reading_span());
        let places = model.places();
        let mut column = Column::default();
        for trace in model.traces() {
            let forward = places[trace.start].direction > 0.0;
            let order: Box<dyn Iterator<Item = usize>> = if forward {
                Box::new(trace.clone())
            } else {
                Box::new(trace.clone().rev())
            };
            let mut pointer: Option<f64> = None;
            for k in order {
                let stylus = model.smooth_reading(&places[k]);
                // The play is taken up in the direction in which the trace begins.
                let start = stylus
                    - 0.5
                        * width
                        * (places[k].direction * model.reading_slope(&places[k])).signum();
                let next = pointer
                    .unwrap_or(start)
                    .clamp(stylus - 0.5 * width, stylus + 0.5 * width);
                pointer = Some(next);
                column.rows.push(k);
                column.values.push((next - stylus) / width);
            }
        }
        vec![column]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        amplitudes.first().map(|&width| Shape {
            values: vec![width.max(0.0)],
            ..shape.clone()
        })
    }
}
