//! Dirt or a scratch under the stylus at one place.
//!
//! A bump of either sign: Gaussian (a chip), flat-topped (a film), with steep sides (a scratch that a stylus
//! fits into) or triangular (a burr).
//! It only shows where it was not always there: in one channel (it came or went when the spindle was
//! turned), in one repeat of one channel or in all of its traces from one on; of designs that see a side
//! more often, in one repeat of all channels of the side, or on it from a position of the spindle on. It may come
//! while the stylus is upon its place. Free: height, place, width, section, channels, trace, where in it.

use std::ops::Range;

use super::Linearised;
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::{Arrangement, Seat};

/// See the head of the file. Variants: (section · groups + group) · scopes + scope, the scope as
/// [`Scope`] counts.
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

/// In which traces of its channels a bump lies: 0, the place of the repeat, or beyond the repeats the place
/// of the first trace in the order of time.
#[derive(Clone, Copy)]
enum Scope {
    All,
    Repeat(u32),
    From(usize),
}

/// Where in a trace a bump may come while the stylus is upon it, in widths from its middle.
const COMES: [f64; 4] = [-1.0, -0.3, 0.3, 1.0];

impl Scope {
    /// The first trace of a bump that stays.
    fn first(self) -> Option<usize> {
        match self {
            Self::All => Some(0),
            Self::Repeat(_) => None,
            Self::From(first) => Some(first),
        }
    }
}

/// The words that tell a bump that stays once it has come.
pub(super) const STAYS: &str = "from trace";

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

    /// Number of groups and scopes in which a bump may lie.
    fn places(&self, model: &Linearised) -> usize {
        self.groups.len() * self.scopes(model)
    }

    /// Number of scopes of the group with the most traces.
    fn scopes(&self, model: &Linearised) -> usize {
        let traces = self.groups.iter().map(|g| g.traces(model).len());
        model.repeats().len() + traces.max().unwrap_or(1).max(1)
    }

    /// Section, group and scope of a variant.
    fn told(&self, model: &Linearised, variant: usize) -> Option<(&Section, &Group, Scope)> {
        let scopes = self.scopes(model);
        let repeats = model.repeats();
        let scope = match variant % scopes {
            0 => Scope::All,
            k if k <= repeats.len() => Scope::Repeat(*repeats.get(k - 1)?),
            k => Scope::From(k - repeats.len()),
        };
        let group = self.groups.get(variant / scopes % self.groups.len())?;
        Some((SECTIONS.get(variant / self.places(model))?, group, scope))
    }
}

impl Group {
    /// The traces of its channels in the order of time.
    fn traces(&self, model: &Linearised) -> Vec<Range<usize>> {
        let place = |trace: &Range<usize>| &model.places()[trace.start];
        let own = model.traces().iter();
        let mut own: Vec<Range<usize>> = own
            .filter(|t| self.channels.contains(&place(t).channel))
            .cloned()
            .collect();
        own.sort_by(|a, b| place(a).time.total_cmp(&place(b).time));
        own
    }
}

/// Height of a bump of one over the distance from its middle in widths, and what it is called.
type Section = (fn(f64) -> f64, &'static str);

/// Sections of unit height, by the distance from the middle in widths, and their names.
const SECTIONS: [Section; 4] = [
    (|away| (-0.5 * away * away).exp(), "Gaussian"),
    (|away| (-0.5 * away.powi(8)).exp(), "flat-topped"),
    (|away| (1.0 - 0.45 * away.abs()).max(0.0), "triangular"),
    (|away| (-0.5 * away.powi(20)).exp(), "steep-sided"),
];

impl Effect<Linearised> for LocalContamination {
    fn name(&self) -> &str {
        "local-contamination"
    }

    fn about(&self) -> About {
        About {
            physics: "dirt lifts the stylus, or a scratch lets it fall, at one place in one channel or one repeat",
            confirm: "wipe the artefact there and measure that trace again",
            source: "bump of Gaussian, flat-topped, steep-sided or triangular section",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
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

    /// The Gaussian bumps in all traces or in one repeat; the others are found from them.
    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let repeats = model.repeats();
        let x = model.positions();
        let first = x.first().copied().unwrap_or(0.0);
        let (spacing, every) = (spacing(model), self.scopes(model));
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
                            variant: group * every + scope,
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

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let (places, scopes) = (self.places(model), self.scopes(model));
        let Some((_, group, _)) = self.told(model, shape.variant) else {
            return Vec::new();
        };
        let sections = (0..SECTIONS.len()).map(|section| section * places + shape.variant % places);
        let repeats = model.repeats().len();
        let alone = if group.lasting { 0 } else { 1 };
        let stays = (repeats + 1)..(repeats + group.traces(model).len());
        let within = shape.variant - shape.variant % scopes;
        let others = (alone..repeats + 1).chain(stays).map(|k| within + k);
        let mut relatives: Vec<Shape> = sections
            .chain(others)
            .filter(|variant| *variant != shape.variant)
            .map(|variant| Shape {
                variant,
                ..shape.clone()
            })
            .collect();
        let first = self.told(model, shape.variant).map(|(_, _, s)| s.first());
        let (&[position, log_width], Some(Some(first))) = (shape.values.as_slice(), first) else {
            return relatives;
        };
        // In the trace before the first that holds it whole, or in the one that was taken for that.
        for order in first.saturating_sub(1)..=first {
            let from = if order == 0 { 0 } else { repeats + order };
            for comes in COMES {
                let mut other = shape.clone();
                other.variant = within + from;
                other.values.push(position + comes * log_width.exp());
                other.steps.push(0.3 * log_width.exp());
                relatives.push(other);
            }
        }
        relatives
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let &[position, log_width, ..] = shape.values.as_slice() else {
            return Vec::new();
        };
        let comes = shape.values.get(2);
        let Some(((section, _), group, scope)) = self.told(model, shape.variant) else {
            return Vec::new();
        };
        let width = log_width.exp();
        let mut column = Column::default();
        for (order, trace) in group.traces(model).into_iter().enumerate() {
            let met = match scope {
                Scope::All => true,
                Scope::Repeat(own) => model.places()[trace.start].repeat == own,
                Scope::From(first) => order >= first,
            };
            let partly = comes.filter(|_| scope.first() == Some(order));
            for k in trace.filter(|_| met) {
                let place = &model.places()[k];
                let x = match scope {
                    Scope::Repeat(_) => model.taken_at(k),
                    Scope::All | Scope::From(_) => place.x,
                };
                let away = (x - position) / width;
                let there = partly.is_none_or(|comes| place.direction * (x - comes) >= 0.0);
                if there && away.abs() < 5.0 {
                    column.rows.push(k);
                    column.values.push(section(away));
                }
            }
        }
        vec![column]
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let (Some(first), Some(last)) = (model.positions().first(), model.positions().last())
        else {
            return false;
        };
        matches!(shape.values.as_slice(), &[position, log_width, ..]
            if (*first..=*last).contains(&position)
                && log_width.exp() > 0.4 * spacing(model)
                // Anything wider is no chip but a form.
                && log_width.exp() < 0.08 * model.travel())
    }

    fn variant_name(&self, model: &Linearised, shape: &Shape) -> Option<String> {
        let ((_, section), group, scope) = self.told(model, shape.variant)?;
        let name = &group.name;
        let all = group.traces(model).len();
        let stays = |first: usize| format!("{section}, {name}, {STAYS} {} of {all}", first + 1);
        Some(match (scope, shape.values.get(2)) {
            (Scope::All, None) => format!("{section}, {name}"),
            (Scope::Repeat(repeat), _) => format!("{section}, {name}, repeat {repeat}"),
            (Scope::From(first), None) => stays(first) + " on",
            (scope, Some(comes)) => {
                format!("{} at {comes:.1} mm on", stays(scope.first().unwrap_or(0)))
            }
        })
    }
}

fn spacing(model: &Linearised) -> f64 {
    model.travel() / (model.positions().len() - 1) as f64
}
