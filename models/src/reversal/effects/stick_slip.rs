//! The slide sticks until its drive has wound up, then slips after it.
//!
//! It lags behind its command by a sawtooth of the way run, and what is seen comes with it; or it crabs: it
//! leans sideways by such a sawtooth, with the sign of the direction of travel. What all passes have in
//! common passes for form. A sawtooth that is the same in every trace of a direction shows by what the
//! directions differ; with a half or a whole slip at mid travel the rest is a constant lag,
//! `axis-backlash`. One that begins anew in each pass (a spindle position, a repeat and a direction, all
//! indicators read together) is found by its first wave, with a cosine and a sine in each pass, and
//! followed from there. Free: the greatest lag or lean, the way from slip to slip, told by the slips over
//! the travel, the state at mid travel or where each pass begins.

use std::ops::Range;

use nalgebra::DMatrix;

use super::{FirstOrder, part_of_travel, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Place, Shape};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: a lag, the same in every trace of a direction; then of sawteeth that
/// begin anew in each pass [`KINDS`] for the lag and for each direction across: their first waves, and
/// the sawtooth towards and away.
pub(super) struct StickSlip {
    /// Directions across the travel that channels see: horizontal (0), vertical (1).
    across: Vec<usize>,
}

/// Kinds of sawteeth that begin anew in each pass.
const KINDS: usize = 3;

/// The variants that begin anew in each pass in words.
pub(super) const ANEW: &str = "beginning anew in each pass";

/// Slips over the travel between neighbouring starts of the search, and starts of the state.
const STRIDE: f64 = 0.4;
const STATES: [f64; 2] = [0.25, 0.75];
/// The same for first waves: the peak of a wave is one slip wide.
const WAVE_STRIDE: f64 = 0.6;
/// With more passes the phases of all of them are no explanation.
const MOST_PASSES: usize = 32;

/// Nearer to a half or a whole slip at mid travel it is a constant lag.
const ASIDE: f64 = 0.1;

/// What a shape is.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// The same in every trace of a direction.
    Same,
    /// First waves of a sawtooth, then the sawtooth with its sign; along (none) or across.
    Waves(Option<usize>),
    Sawtooth(Option<usize>, f64),
}

impl StickSlip {
    pub fn new(channels: &Arrangement) -> Self {
        let sees = |axis: &usize| channels.seats().iter().any(|s| s.phi[*axis] != 0.0);
        Self {
            across: (0..2).filter(sees).collect(),
        }
    }

    fn kind(&self, variant: usize) -> Kind {
        let Some(anew) = variant.checked_sub(1) else {
            return Kind::Same;
        };
        let along = match anew / KINDS {
            0 => None,
            one => self.across.get(one - 1).copied(),
        };
        match anew % KINDS {
            0 => Kind::Waves(along),
            1 => Kind::Sawtooth(along, 1.0),
            _ => Kind::Sawtooth(along, -1.0),
        }
    }
}

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

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        match self.kind(shape.variant) {
            Kind::Same | Kind::Sawtooth(None, _) => self.amplitudes(),
            Kind::Sawtooth(Some(_), _) => vec![Parameter::between("lean", "um", 0.0, 100.0)],
            Kind::Waves(along) => {
                let wave = match along {
                    None => Parameter::symmetric("wave", "mm", 5.0),
                    Some(_) => Parameter::symmetric("wave", "um", 100.0),
                };
                vec![wave; 2 * (shape.values.len() - 1)]
            }
        }
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        let state = Parameter::between("state", "1", -10.0, 10.0);
        vec![Parameter::between("slips", "1", 1.0, 1e6), state]
    }

    fn grid(&self, model: &FirstOrder) -> Vec<Shape> {
        let reach = (highest(model) - 2.0).max(0.0);
        let count = (reach / STRIDE) as usize;
        let same = |k: usize| Shape {
            variant: 0,
            values: vec![
                2.0 + STRIDE * (k / STATES.len()) as f64,
                STATES[k % STATES.len()],
                0.0,
            ],
            steps: vec![0.25 * STRIDE, 0.1, 0.0],
        };
        let mut shapes: Vec<Shape> = (0..count * STATES.len()).map(same).collect();
        let passes = passes(model).len();
        if passes > MOST_PASSES || model.repeats().len() < 2 {
            return shapes;
        }
        for along in 0..=self.across.len() {
            shapes.extend((0..(reach / WAVE_STRIDE) as usize).map(|k| {
                let mut values = vec![0.0; 1 + passes];
                let mut steps = values.clone();
                values[0] = 2.0 + WAVE_STRIDE * k as f64;
                steps[0] = 0.5 * WAVE_STRIDE;
                Shape {
                    variant: 1 + KINDS * along,
                    values,
                    steps,
                }
            }));
        }
        shapes
    }

    /// Across the travel a sawtooth may lean to either side; its first wave tells nothing of it.
    fn relatives(&self, _model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let Kind::Sawtooth(Some(_), sign) = self.kind(shape.variant) else {
            return Vec::new();
        };
        let mut other = shape.clone();
        other.variant = if sign > 0.0 {
            shape.variant + 1
        } else {
            shape.variant - 1
        };
        other
            .values
            .iter_mut()
            .skip(2)
            .for_each(|state| *state += 0.5);
        vec![other]
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let Some(&slips) = shape.values.first() else {
            return Vec::new();
        };
        let run = |place: &Place| 0.5 * place.direction * part_of_travel(model, place.x);
        let lean = |axis: usize, place: &Place| place.direction * model.seat(place).phi[axis];
        match self.kind(shape.variant) {
            Kind::Same => {
                let &[_, state, lag] = shape.values.as_slice() else {
                    return Vec::new();
                };
                let change = |k: usize, place: &Place| {
                    let behind = -place.direction * (slips * run(place) + state).rem_euclid(1.0);
                    behind * model.reading_chord(k, behind * lag)
                };
                vec![if model.lies_beneath() {
                    Column::from_places(model.places(), change)
                } else {
                    model.of_cell(change)
                }]
            }
            Kind::Waves(along) => {
                let turn = std::f64::consts::TAU * slips;
                let wave = |pass: &Vec<Range<usize>>, function: fn(f64) -> f64| {
                    in_pass(model, pass, |k, place| {
                        let unit = match along {
                            None => -place.direction * model.reading_chord(k, 0.0),
                            Some(axis) => lean(axis, place),
                        };
                        unit * function(turn * run(place))
                    })
                };
                let own = passes(model);
                let pairs = own.iter().map(|p| [wave(p, f64::cos), wave(p, f64::sin)]);
                pairs.flatten().collect()
            }
            Kind::Sawtooth(along, sign) => {
                let lag = shape.values.get(1).copied().unwrap_or(0.0);
                let mut column = Column::default();
                for (pass, state) in passes(model).iter().zip(shape.values.iter().skip(2)) {
                    let own = in_pass(model, pass, |k, place| {
                        let part = (slips * run(place) + state).rem_euclid(1.0);
                        let behind = -place.direction * part;
                        match along {
                            None => behind * model.reading_chord(k, behind * lag),
                            Some(axis) => sign * part * lean(axis, place),
                        }
                    });
                    column.rows.extend(own.rows);
                    column.values.extend(own.values);
                }
                vec![column]
            }
        }
    }

    /// A sawtooth ⌊·⌋ from 0 to 1 at θ/2π + φ has the first wave −sin(θ + 2πφ)/π: waves become the sawtooth
    /// with their phases.
    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        let mut settled = shape.clone();
        match self.kind(shape.variant) {
            Kind::Same => *settled.values.get_mut(2)? = *amplitudes.first()?,
            Kind::Sawtooth(..) => *settled.values.get_mut(1)? = *amplitudes.first()?,
            Kind::Waves(_) => {
                let pairs = amplitudes.chunks_exact(2);
                let phase = |pair: &[f64]| (-pair[0]).atan2(-pair[1]) / std::f64::consts::TAU;
                let states: Vec<f64> = pairs.map(phase).collect();
                settled.variant += 1;
                settled.values = vec![*shape.values.first()?, 0.0];
                settled.steps = vec![0.1 * WAVE_STRIDE, 0.0];
                settled.steps.extend(vec![0.05; states.len()]);
                settled.values.extend(states);
            }
        }
        Some(settled)
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let reach = 1.5..highest(model) + STRIDE;
        let aside = |state: &f64| (ASIDE..=0.5 - ASIDE).contains(&state.rem_euclid(0.5));
        let within = shape.values.first().is_some_and(|s| reach.contains(s));
        let same = self.kind(shape.variant) == Kind::Same;
        within && (!same || shape.values.get(1).is_some_and(aside))
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        match self.kind(shape.variant) {
            Kind::Same => None,
            Kind::Waves(None) | Kind::Sawtooth(None, _) => Some(format!("a lag, {ANEW}")),
            Kind::Waves(Some(_)) | Kind::Sawtooth(Some(_), _) => {
                Some(format!("a lean sideways, {ANEW}"))
            }
        }
    }

    /// Where each pass begins is not told.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let names = self.amplitudes_at(shape).into_iter().zip(amplitudes);
        let shapes = self.shape_parameters().into_iter().zip(&shape.values);
        let told = match self.kind(shape.variant) {
            Kind::Same => 2,
            _ => 1,
        };
        let all = names.chain(shapes.take(told)).enumerate();
        all.map(|(k, (parameter, value))| Estimate {
            name: parameter.name.into_owned(),
            value: *value,
            std: spread(covariance, &[(k, 1.0)]),
            unit: parameter.unit.to_owned(),
        })
        .collect()
    }
}

/// Traces of one spindle position, repeat and direction that are read at the same time: each pass of the
/// slide, in the order of its first trace.
fn passes(model: &FirstOrder) -> Vec<Vec<Range<usize>>> {
    let place = |trace: &Range<usize>| &model.places()[trace.start];
    let times = |trace: &Range<usize>| {
        let own = model.places()[trace.clone()].iter().map(|p| p.time);
        own.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
            (low.min(t), high.max(t))
        })
    };
    let together = |one: &Range<usize>, two: &Range<usize>| {
        let (a, b) = (place(one), place(two));
        let same = model.seat(a).position == model.seat(b).position
            && a.repeat == b.repeat
            && a.direction == b.direction;
        let (a, b) = (times(one), times(two));
        same && a.0 <= b.1 && b.0 <= a.1
    };
    let mut passes: Vec<Vec<Range<usize>>> = Vec::new();
    for trace in model.traces() {
        match passes.iter_mut().find(|pass| together(&pass[0], trace)) {
            Some(pass) => pass.push(trace.clone()),
            None => passes.push(vec![trace.clone()]),
        }
    }
    passes
}

/// A change of the readings of one pass.
fn in_pass(
    model: &FirstOrder,
    pass: &[Range<usize>],
    change: impl Fn(usize, &Place) -> f64,
) -> Column {
    let rows: Vec<usize> = pass.iter().flat_map(Clone::clone).collect();
    let values = rows
        .iter()
        .map(|k| change(*k, &model.places()[*k]))
        .collect();
    Column { rows, values }
}

/// Most slips over the travel: six readings from slip to slip.
fn highest(model: &FirstOrder) -> f64 {
    0.16 * model.positions().len() as f64
}
