//! Dirt or a scratch under the stylus at one place.
//!
//! A bump of either sign: Gaussian (a chip), flat-topped (a film) or triangular (a scratch, a burr).
//! It only shows where it was not always there: in one channel (it came or went when the spindle was
//! turned) or in one repeat of one channel; of designs that see a side more often, in one repeat of all
//! channels of the side, or on it from a position of the spindle on. Free: height, place, width, section,
//! channels or trace.

use super::FirstOrder;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::{Arrangement, Seat};

/// See the head of the file. Variants: section · groups · (repeats + 1) + group · (repeats + 1)
/// + 0 for all repeats, or + the place of the repeat.
pub(super) struct LocalContamination {
    /// The channels, then what channels of a side have in common.
    groups: Vec<Group>,
}

/// Channels in which a bump may lie together.
struct Group {
    name: String,
    channels: Vec<usize>,
    /// Whether in all repeats it is no form.
    lasting: bool,
}

impl LocalContamination {
    pub fn new(channels: &Arrangement) -> Self {
        let seats = channels.seats();
        let single = |(c, seat): (usize, &Seat)| Group {
            name: format!("channel {}", seat.name),
            channels: vec![c],
            lasting: true,
        };
        let mut groups: Vec<Group> = seats.iter().enumerate().map(single).collect();
        if channels.is_four() {
            return Self { groups };
        }
        for (side, angle) in channels.design().sides().iter().enumerate() {
            let mut own: Vec<usize> = (0..seats.len())
                .filter(|c| seats[*c].side == side)
                .collect();
            if own.len() < 2 {
                continue;
            }
            own.sort_by_key(|c| seats[*c].position);
            // All but one, or one, is a bump of a channel of its own.
            for from in 2..own.len() - 1 {
                let position = channels.positions()[seats[own[from]].position];
                groups.push(Group {
                    name: format!(
                        "side {}° from the spindle at {}° on",
                        angle_name(*angle),
                        angle_name(position)
                    ),
                    channels: own[from..].to_vec(),
                    lasting: true,
                });
            }
            groups.push(Group {
                name: format!("side {}°", angle_name(*angle)),
                channels: own,
                lasting: false,
            });
        }
        Self { groups }
    }

    /// Number of groups and traces in which a bump may lie.
    fn places(&self, model: &FirstOrder) -> usize {
        self.groups.len() * (model.repeats().len() + 1)
    }
}

/// Height of a bump of one over the distance from its middle in widths, and what it is called.
type Section = (fn(f64) -> f64, &'static str);

/// Sections of unit height, by the distance from the middle in widths, and their names.
const SECTIONS: [Section; 3] = [
    (|away| (-0.5 * away * away).exp(), "Gaussian"),
    (|away| (-0.5 * away.powi(8)).exp(), "flat-topped"),
    (|away| (1.0 - 0.45 * away.abs()).max(0.0), "triangular"),
];

impl Effect<FirstOrder> for LocalContamination {
    fn name(&self) -> &str {
        "local-contamination"
    }

    fn about(&self) -> About {
        About {
            physics: "dirt lifts the stylus, or a scratch lets it fall, at one place in one channel or one repeat",
            confirm: "wipe the artefact there and measure that trace again",
            source: "bump of Gaussian, flat-topped or triangular section",
        }
    }

    fn link(&self) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("height", "um", 500.0)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("position", "mm", 1e6),
            Parameter::symmetric("log-width", "ln mm", 20.0),
        ]
    }

    /// The Gaussian bumps; the other sections are found from them.
    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let repeats = model.repeats();
        let x = model.positions();
        let first = x.first().copied().unwrap_or(0.0);
        let spacing = spacing(model);
        let mut shapes = Vec::new();
        for (group, own) in self.groups.iter().enumerate() {
            // With one repeat that repeat is the channel; a side of which all is lifted is a form.
            let scopes = match (repeats.len(), own.lasting) {
                (1, true) => 0..1,
                (1, false) => 0..0,
                (count, true) => 0..count + 1,
                (count, false) => 1..count + 1,
            };
            for scope in scopes {
                // A bump in one repeat stands out of the others: fewer starts are enough.
                let mut width = if scope == 0 { 0.7 } else { 1.4 } * spacing;
                while width < 0.07 * model.travel() {
                    let steps = (model.travel() / (2.0 * width)).ceil();
                    for k in 0..=steps as usize {
                        shapes.push(Shape {
                            variant: group * (repeats.len() + 1) + scope,
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

    fn relatives(&self, model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let places = self.places(model);
        (0..SECTIONS.len())
            .map(|section| section * places + shape.variant % places)
            .filter(|variant| *variant != shape.variant)
            .map(|variant| Shape {
                variant,
                ..shape.clone()
            })
            .collect()
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let &[position, log_width] = shape.values.as_slice() else {
            return Vec::new();
        };
        let repeats = model.repeats();
        let place = shape.variant % self.places(model);
        let channels = &self.groups[place / (repeats.len() + 1)].channels;
        let repeat = match place % (repeats.len() + 1) {
            0 => None,
            k => repeats.get(k - 1),
        };
        let (section, _) = SECTIONS[(shape.variant / self.places(model)).min(SECTIONS.len() - 1)];
        let width = log_width.exp();
        let mut column = Column::default();
        for trace in model.traces() {
            let first = &model.places()[trace.start];
            if !channels.contains(&first.channel) || repeat.is_some_and(|r| *r != first.repeat) {
                continue;
            }
            for k in trace.clone() {
                let away = (model.places()[k].x - position) / width;
                if away.abs() < 5.0 {
                    column.rows.push(k);
                    column.values.push(section(away));
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
        matches!(shape.values.as_slice(), &[position, log_width]
            if (*first..=*last).contains(&position)
                && log_width.exp() > 0.4 * spacing(model)
                // Anything wider is no chip but a form.
                && log_width.exp() < 0.08 * model.travel())
    }

    fn variant_name(&self, model: &FirstOrder, shape: &Shape) -> Option<String> {
        let repeats = model.repeats();
        let place = shape.variant % self.places(model);
        let group = &self.groups.get(place / (repeats.len() + 1))?.name;
        let (_, section) = SECTIONS.get(shape.variant / self.places(model))?;
        Some(match place % (repeats.len() + 1) {
            0 => format!("{section}, {group}"),
            k => format!("{section}, {group}, repeat {}", repeats.get(k - 1)?),
        })
    }
}

fn spacing(model: &FirstOrder) -> f64 {
    model.travel() / (model.positions().len() - 1) as f64
}
