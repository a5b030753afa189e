//! A chip or a film of dirt under the stylus at one place.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file. It only shows where it was not always there: in one channel (it came
/// or went when the spindle was turned) or in one repeat of one channel.
///
/// Variants: channel · (repeats + 1) + 0 for all repeats, or + the place of the repeat.
pub(super) struct LocalContamination;

impl Effect<FirstOrder> for LocalContamination {
    fn name(&self) -> &str {
        "local-contamination"
    }

    fn about(&self) -> About {
        About {
            physics: "dirt lifts the stylus at one place in one channel or one repeat",
            confirm: "wipe the artefact there and measure that trace again",
            source: "bump of Gaussian section, always towards the indicator",
        }
    }

    fn link(&self) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "height",
            unit: "um",
            low: 0.0,
            high: 500.0,
        }]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter {
                name: "position",
                unit: "mm",
                low: -1e6,
                high: 1e6,
            },
            Parameter {
                name: "log-width",
                unit: "ln mm",
                low: -20.0,
                high: 20.0,
            },
        ]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let repeats = model.repeats();
        let x = model.positions();
        let first = x.first().copied().unwrap_or(0.0);
        let spacing = model.travel() / (x.len() - 1) as f64;
        let mut shapes = Vec::new();
        for channel in 0..model.present().len() {
            // With one repeat that repeat is the channel.
            let scopes = if repeats.len() > 1 {
                repeats.len() + 1
            } else {
                1
            };
            for scope in 0..scopes {
                // A bump in one repeat stands out of the others: fewer starts are enough.
                let mut width = if scope == 0 { 0.7 } else { 1.4 } * spacing;
                while width < 0.07 * model.travel() {
                    let steps = (model.travel() / (2.0 * width)).ceil();
                    for k in 0..=steps as usize {
                        shapes.push(Shape {
                            variant: channel * (repeats.len() + 1) + scope,
                            values: vec![first + model.travel() * k as f64 / steps, width.ln()],
                            steps: vec![0.5 * width, 0.3],
                        });
                    }
                    width *= 2.5;
                }
            }
        }
        shapes
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let &[position, log_width] = shape.values.as_slice() else {
            return Vec::new();
        };
        let repeats = model.repeats();
        let channel = shape.variant / (repeats.len() + 1);
        let repeat = match shape.variant % (repeats.len() + 1) {
            0 => None,
            k => repeats.get(k - 1),
        };
        let width = log_width.exp();
        let mut column = Column::default();
        for trace in model.traces() {
            let first = &model.places()[trace.start];
            if first.channel != channel || repeat.is_some_and(|r| *r != first.repeat) {
                continue;
            }
            for k in trace.clone() {
                let away = (model.places()[k].x - position) / width;
                if away.abs() < 5.0 {
                    column.rows.push(k);
                    column.values.push((-0.5 * away * away).exp());
                }
            }
        }
        vec![column]
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let (Some(first), Some(last)) = (model.positions().first(), model.positions().last())
        else {
            return false;
        };
        let spacing = model.travel() / (model.positions().len() - 1) as f64;
        matches!(shape.values.as_slice(), &[position, log_width]
            if (*first..=*last).contains(&position)
                && log_width.exp() > 0.4 * spacing
                // Anything wider is no chip but a form.
                && log_width.exp() < 0.08 * model.travel())
    }

    fn variant_name(&self, model: &FirstOrder, shape: &Shape) -> Option<String> {
        let repeats = model.repeats();
        let channel = model.present().get(shape.variant / (repeats.len() + 1))?;
        Some(match shape.variant % (repeats.len() + 1) {
            0 => format!("channel {}", channel.name()),
            k => format!("channel {}, repeat {}", channel.name(), repeats.get(k - 1)?),
        })
    }
}
