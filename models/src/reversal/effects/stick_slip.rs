//! The slide sticks until its drive has wound up, then slips after it.
//!
//! It lags behind its command by a sawtooth of the way run, the same in every trace of a direction, and
//! what is seen comes with it. What both directions have in common passes for form; with a half or a whole
//! slip at mid travel the rest is a constant lag, `axis-backlash`. Or the sawtooth begins anew in each pass (a
//! spindle position, a repeat and a direction, all indicators read together), of a lag, or of a lean where the
//! slide crabs: sideways, with the sign of the direction of travel. These are found by their mean and first wave,
//! with a cosine and a sine in each pass, and followed from there. Free: the greatest lag or
//! lean, the way from slip to slip, told by the slips over the travel, the state at mid travel or where each
//! pass begins.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;

use super::passes::{in_pass, passes};
use super::{Linearised, part_of_travel, spread};
use crate::model::{
    About, Column, Effect, Estimate, Fall, FittedModel, Link, Parameter, Place, Shape,
};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: a lag; then [`KINDS`] of a lean for each direction across: its first
/// waves, and the sawtooth towards and away; then first waves and sawtooth of a lag that begins anew.
pub(super) struct StickSlip {
    /// Directions across the travel that channels see: horizontal (0), vertical (1).
    across: Vec<usize>,
}

/// Variants of a lean in one direction.
const KINDS: usize = 3;

/// The variants of a lean in words.
pub(super) const LEAN: &str = "a lean sideways that begins anew in each pass";

/// That of a lag in words.
pub(super) const LAG: &str = "a lag that begins anew in each pass";

/// Slips over the travel between neighbouring starts of the search, and starts of the state.
const STRIDE: f64 = 0.4;
const STATES: [f64; 2] = [0.25, 0.75];
/// The same for first waves: the peak of a wave is one slip wide.
const WAVE_STRIDE: f64 = 0.6;
/// First step of the search of where a pass begins: the phase of a wave is known to less.
const STATE_STEP: f64 = 0.12;
/// With more passes the phases of all of them are no explanation.
const MOST_PASSES: usize = 32;

/// Nearer to a half or a whole slip at mid travel it is a constant lag.
const ASIDE: f64 = 0.1;

/// What a shape is.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Lag,
    /// First waves of what begins anew, then its sawtooth with its sign.
    Waves(Anew),
    Sawtooth(Anew, f64),
}

/// What begins anew in each pass.
#[derive(Clone, Copy, PartialEq)]
enum Anew {
    Lag,
    /// In a direction across.
    Lean(usize),
}

impl Anew {
    /// What a unit of lag or lean changes: a lag as far as it is, by what the slide comes upon there.
    fn change(self, model: &Linearised, k: usize, place: &Place, lag: f64) -> f64 {
        match self {
            Self::Lean(axis) => place.direction * model.seat(place).phi[axis],
            Self::Lag => -place.direction * model.reading_chord(k, -place.direction * lag),
        }
    }
}

impl StickSlip {
    pub fn new(channels: &Arrangement) -> Self {
        let sees = |axis: &usize| channels.seats().iter().any(|s| s.phi[*axis] != 0.0);
        Self {
            across: (0..2).filter(sees).collect(),
        }
    }

    fn kind(&self, variant: usize) -> Kind {
        let Some(own) = variant.checked_sub(1) else {
            return Kind::Lag;
        };
        let what = match self.across.get(own / KINDS) {
            Some(axis) => Anew::Lean(*axis),
            None => Anew::Lag,
        };
        match own % KINDS {
            0 => Kind::Waves(what),
            1 => Kind::Sawtooth(what, 1.0),
            _ => Kind::Sawtooth(what, -1.0),
        }
    }

    /// Where the variants begin of a lag that begins anew.
    fn lag_anew(&self) -> usize {
        1 + KINDS * self.across.len()
    }
}

impl Effect<Linearised> for StickSlip {
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

    fn link(&self, _shape: &Shape) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::between("lag", "mm", 0.0, 5.0)]
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        match self.kind(shape.variant) {
            Kind::Lag => self.amplitudes(),
            Kind::Sawtooth(Anew::Lag, _) => self.amplitudes(),
            Kind::Sawtooth(..) => vec![Parameter::between("lean", "um", 0.0, 100.0)],
            Kind::Waves(what) => {
                let count = 2 * shape.values.len().saturating_sub(1) + 1;
                let wave = match what {
                    Anew::Lag => Parameter::symmetric("wave", "mm", 5.0),
                    Anew::Lean(_) => Parameter::symmetric("wave", "um", 100.0),
                };
                vec![wave; count]
            }
        }
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        let state = Parameter::between("state", "1", -10.0, 10.0);
        vec![Parameter::between("slips", "1", 1.0, 1e6), state]
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let reach = (highest(model) - 2.0).max(0.0);
        let count = (reach / STRIDE) as usize;
        let lag = |k: usize| Shape {
            variant: 0,
            values: vec![
                2.0 + STRIDE * (k / STATES.len()) as f64,
                STATES[k % STATES.len()],
                0.0,
            ],
            steps: vec![0.25 * STRIDE, 0.1, 0.0],
        };
        let mut shapes: Vec<Shape> = (0..count * STATES.len()).map(lag).collect();
        let passes = passes(model).len();
        if passes > MOST_PASSES || model.repeats().len() < 2 {
            return shapes;
        }
        let starts = (0..self.across.len()).map(|axis| 1 + KINDS * axis);
        for variant in starts.chain([self.lag_anew()]) {
            shapes.extend((0..=(reach / WAVE_STRIDE) as usize).map(|k| {
                let mut values = vec![0.0; 1 + passes];
                let mut steps = values.clone();
                values[0] = 2.0 + WAVE_STRIDE * k as f64;
                steps[0] = 0.5 * WAVE_STRIDE;
                Shape {
                    variant,
                    values,
                    steps,
                }
            }));
        }
        shapes
    }

    /// Across the travel a sawtooth may lean to either side; its first wave tells nothing of it.
    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let Kind::Sawtooth(Anew::Lean(_), sign) = self.kind(shape.variant) else {
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

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(&slips) = shape.values.first() else {
            return Vec::new();
        };
        let run = |place: &Place| run(model, place);
        let change =
            |what: Anew, k: usize, place: &Place, lag: f64| what.change(model, k, place, lag);
        match self.kind(shape.variant) {
            Kind::Lag => {
                let &[_, state, lag] = shape.values.as_slice() else {
                    return Vec::new();
                };
                let change = |k: usize, place: &Place| {
                    let behind = -place.direction * part_of(slips * run(place) + state);
                    behind * model.reading_chord(k, behind * lag)
                };
                vec![if model.lies_beneath() {
                    Column::from_places(model.places(), change)
                } else {
                    model.of_cell(change)
                }]
            }
            Kind::Waves(what) => {
                let turn = std::f64::consts::TAU * slips;
                let of = |pass: &[Range<usize>], function: &dyn Fn(f64) -> f64| {
                    in_pass(model, pass, |k, place| {
                        change(what, k, place, 0.0) * function(turn * run(place))
                    })
                };
                let own = passes(model);
                let pairs = own.iter().map(|p| [of(p, &f64::cos), of(p, &f64::sin)]);
                let mut columns: Vec<Column> = pairs.flatten().collect();
                let all: Vec<Range<usize>> = own.concat();
                columns.push(of(&all, &|_| 1.0));
                columns
            }
            Kind::Sawtooth(what, sign) => {
                let own = passes(model);
                let lag = shape.values.get(1 + own.len()).copied().unwrap_or(0.0);
                let saw = Saw {
                    what,
                    sign,
                    slips,
                    lag,
                };
                let mut column = Column::default();
                for (pass, state) in own.iter().zip(shape.values.iter().skip(1)) {
                    let own = saw.in_pass(model, pass, *state);
                    column.rows.extend(own.rows);
                    column.values.extend(own.values);
                }
                vec![column]
            }
        }
    }

    /// Without slips that are seen it is a lag or a lean of either direction that changes evenly along the travel:
    /// `axis-backlash`, `lateral-backlash`.
    fn limit(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Kind::Sawtooth(what, _) = self.kind(shape.variant) else {
            return Vec::new();
        };
        let lag = shape.values.get(1 + passes(model).len()).copied();
        let half = 0.5 * lag.unwrap_or(0.0);
        let of = |direction: f64, along: fn(f64) -> f64| {
            Column::from_places(model.places(), |k, place| {
                if place.direction == direction {
                    along(part_of_travel(model, place.x)) * what.change(model, k, place, half)
                } else {
                    0.0
                }
            })
        };
        [1.0, -1.0]
            .into_iter()
            .flat_map(|direction| [of(direction, |_| 1.0), of(direction, |part| part)])
            .collect()
    }

    /// A sawtooth from 0 to 1 at θ/2π + φ has the first wave −sin(θ + 2πφ)/π: waves become the sawtooth
    /// with their phases.
    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        let mut settled = shape.clone();
        match self.kind(shape.variant) {
            Kind::Lag => *settled.values.get_mut(2)? = *amplitudes.first()?,
            Kind::Sawtooth(Anew::Lean(_), _) => return None,
            Kind::Sawtooth(Anew::Lag, _) => *settled.values.last_mut()? = *amplitudes.first()?,
            Kind::Waves(what) => {
                let pairs = amplitudes.chunks_exact(2);
                let phase = |pair: &[f64]| (-pair[0]).atan2(-pair[1]) / std::f64::consts::TAU;
                let states: Vec<f64> = pairs.map(phase).collect();
                settled.variant += 1;
                settled.values = vec![*shape.values.first()?];
                settled.steps = vec![0.1 * WAVE_STRIDE];
                settled.steps.extend(vec![STATE_STEP; states.len()]);
                settled.values.extend(states);
                if what == Anew::Lag {
                    settled.values.push(2.0 * *amplitudes.last()?);
                    settled.steps.push(0.0);
                }
            }
        }
        Some(settled)
    }

    /// Where a pass begins changes its own readings.
    fn changed(
        &self,
        model: &Linearised,
        shape: &Shape,
        value: usize,
    ) -> Option<(Vec<usize>, Column)> {
        let Kind::Sawtooth(what, sign) = self.kind(shape.variant) else {
            return None;
        };
        let own = passes(model);
        let pass = own.get(value.checked_sub(1)?)?;
        let saw = Saw {
            what,
            sign,
            slips: *shape.values.first()?,
            lag: shape.values.get(1 + own.len()).copied().unwrap_or(0.0),
        };
        let column = saw.in_pass(model, pass, *shape.values.get(value)?);
        let at = |range: &Range<usize>| model.traces().iter().position(|t| t == range);
        Some((pass.iter().filter_map(at).collect(), column))
    }

    /// Where it slips: the part of a slip that is slips × run + state passes a whole number.
    fn falls(&self, model: &Linearised, shape: &Shape) -> Vec<Fall> {
        let (kind, Some(&slips)) = (self.kind(shape.variant), shape.values.first()) else {
            return Vec::new();
        };
        let own = passes(model);
        let (what, lag) = match kind {
            Kind::Lag => (Anew::Lag, shape.values.get(2)),
            Kind::Sawtooth(what, _) => (what, shape.values.get(1 + own.len())),
            Kind::Waves(_) => return Vec::new(),
        };
        let lag = lag.copied().unwrap_or(0.0);
        let mut falls = Vec::new();
        for (which, pass) in own.iter().enumerate() {
            let at = if kind == Kind::Lag { 1 } else { 1 + which };
            let Some(&state) = shape.values.get(at) else {
                continue;
            };
            // All indicators of a pass are read together: the closest readings about a slip tell it.
            let mut of_pass: BTreeMap<i64, Fall> = BTreeMap::new();
            for rows in pass.iter().flat_map(|t| t.clone().zip(t.clone().skip(1))) {
                let runs = [rows.0, rows.1].map(|k| run(model, &model.places()[k]));
                let wholes = runs.map(|run| (slips * run + state).floor());
                if wholes[0] == wholes[1] {
                    continue;
                }
                let height = what.change(model, rows.1, &model.places()[rows.1], lag);
                let apart = (slips * (runs[1] - runs[0])).abs();
                let fall = of_pass.entry(wholes[1] as i64).or_insert_with(|| Fall {
                    by: vec![(0, 0.5 * (runs[0] + runs[1])), (at, 1.0)],
                    apart,
                    height: Column::default(),
                });
                fall.apart = fall.apart.min(apart);
                fall.height.rows.push(rows.1);
                fall.height.values.push(height);
            }
            falls.extend(of_pass.into_values());
        }
        falls
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let reach = 1.5..highest(model) + STRIDE;
        let aside = |state: &f64| (ASIDE..=0.5 - ASIDE).contains(&state.rem_euclid(0.5));
        let within = shape.values.first().is_some_and(|s| reach.contains(s));
        let anew = self.kind(shape.variant) != Kind::Lag;
        within && (anew || shape.values.get(1).is_some_and(aside))
    }

    /// Where it begins anew the places differ from pass to pass; they are open beyond the ends of the travel
    /// alone.
    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let kind = self.kind(shape.variant);
        let (&[slips, state, ..], Some(lag)) = (shape.values.as_slice(), shape.values.last())
        else {
            return Vec::new();
        };
        let states: Vec<f64> = match kind {
            Kind::Lag => vec![state; model.places().len()],
            Kind::Sawtooth(Anew::Lag, _) => {
                let mut states = vec![0.0; model.places().len()];
                for (pass, state) in passes(model).iter().zip(shape.values.iter().skip(1)) {
                    let own = pass.iter().flat_map(Clone::clone);
                    own.for_each(|k| states[k] = *state);
                }
                states
            }
            _ => return Vec::new(),
        };
        let (first, last) = ends(model);
        model.between_positions(|k, place| {
            let shift = -place.direction * lag * part_of(slips * run(model, place) + states[k]);
            let inside = (first..=last).contains(&(place.x + shift));
            [if inside && kind != Kind::Lag {
                0.0
            } else {
                shift
            }; 2]
        })
    }

    fn cycles(&self, _model: &Linearised, shape: &Shape) -> Vec<(usize, f64)> {
        match self.kind(shape.variant) {
            Kind::Sawtooth(..) => {
                let states = (1..shape.values.len()).filter(|k| shape.steps.get(*k) != Some(&0.0));
                states.map(|k| (k, 1.0)).collect()
            }
            _ => Vec::new(),
        }
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        let words = match self.kind(shape.variant) {
            Kind::Lag => return None,
            Kind::Waves(Anew::Lag) | Kind::Sawtooth(Anew::Lag, _) => LAG,
            _ => LEAN,
        };
        Some(words.to_owned())
    }

    /// Where each pass begins is not told.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let (names, told) = match self.kind(shape.variant) {
            // The waves of the passes are a step of the search.
            Kind::Waves(_) => (Vec::new(), 1),
            Kind::Lag => (self.amplitudes_at(shape), 2),
            Kind::Sawtooth(..) => (self.amplitudes_at(shape), 1),
        };
        let skipped = amplitudes.len().saturating_sub(names.len());
        let names = names.into_iter().zip(amplitudes);
        let shapes = self.shape_parameters().into_iter().zip(&shape.values);
        let all = names.chain(shapes.take(told)).enumerate();
        all.map(|(k, (parameter, value))| Estimate {
            name: parameter.name.into_owned(),
            value: *value,
            std: spread(covariance, &[(k + skipped, 1.0)]),
            unit: parameter.unit.to_owned(),
        })
        .collect()
    }
}

/// A sawtooth that begins anew in each pass.
struct Saw {
    what: Anew,
    sign: f64,
    slips: f64,
    lag: f64,
}

impl Saw {
    /// Its change of the readings of a pass that begins at a state.
    fn in_pass(&self, model: &Linearised, pass: &[Range<usize>], state: f64) -> Column {
        in_pass(model, pass, |k, place| {
            let part = part_of(self.slips * run(model, place) + state);
            self.sign * part * self.what.change(model, k, place, part * self.lag)
        })
    }
}

/// The way run at a place, from −½ to ½ of the travel forward and back again.
fn run(model: &Linearised, place: &Place) -> f64 {
    0.5 * place.direction * part_of_travel(model, place.x)
}

/// The part of a slip.
fn part_of(slips: f64) -> f64 {
    slips - slips.floor()
}

/// First and last position.
fn ends(model: &Linearised) -> (f64, f64) {
    let positions = model.positions();
    let at = |k: usize| positions.get(k).copied().unwrap_or(0.0);
    (at(0), at(positions.len().saturating_sub(1)))
}

/// Most slips over the travel: six readings from slip to slip.
fn highest(model: &Linearised) -> f64 {
    0.16 * model.positions().len() as f64
}
