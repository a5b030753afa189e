//! The artefact moves along its axis when the spindle turns.
//!
//! Of two positions of the spindle the second is shifted against the first; of more each against the
//! first, or one of them against all others. Free: the shifts.
//!
//! A form that is bent within the shift is not its slope times the shift, and a state that was fitted to shifted
//! readings holds the mean of both forms. How far the artefact was shifted is found from the readings themselves
//! where that shows, and a state that still holds the shift is parted into the forms as they are. The values of such a
//! shape: the shifts; 1 where its state holds them still, else 0; their standard uncertainties; and by pairs the cells
//! that read beyond the ends of the forms, with the surface there. No search moves them.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::Linearised;
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape, each};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::{Arrangement, Laid};

/// See the head of the file. Variants: every position but the first, or the second of two; then one
/// alone, from the first on.
pub(super) struct ReversalShift {
    positions: Vec<f64>,
}

/// Variant of shifts of every position but the first.
const EVERY: usize = 0;

/// Greatest shift, mm.
const REACH: f64 = 20.0;

/// A shift is taken from the readings where it leaves less than this part of what differs between the positions,
const SHOWS: f64 = 0.5;
/// and where it is no less than this part of the distance of the readings.
const FAR: f64 = 0.5;

/// A state holds a shift still where taking it out leaves less of what differs between the positions, by this part of what
/// the readings themselves have less.
const HELD: f64 = 0.5;

impl ReversalShift {
    pub fn new(channels: &Arrangement) -> Self {
        Self {
            positions: channels.positions().to_vec(),
        }
    }

    /// The positions that are shifted.
    fn shifted(&self, variant: usize) -> std::ops::Range<usize> {
        match variant {
            EVERY => 1..self.positions.len().max(2),
            one => one - 1..one,
        }
    }

    /// What a position is laid over.
    fn laid<'m>(
        model: &'m Linearised,
        readings: &DVector<f64>,
        (variant, position): (usize, usize),
    ) -> Option<Laid<'m>> {
        let against = |other: usize| match variant {
            EVERY => other == 0,
            _ => other != position,
        };
        model.laid(readings, against, |p| p == position)
    }

    /// What differs between the positions without shifts and with them, µm².
    fn misfits(
        &self,
        model: &Linearised,
        readings: &DVector<f64>,
        variant: usize,
        told: &[(f64, f64)],
    ) -> Option<[f64; 2]> {
        let mut sums = [0.0; 2];
        for (position, (shift, _)) in self.shifted(variant).zip(told) {
            let laid = Self::laid(model, readings, (variant, position))?;
            sums[0] += laid.misfit(0.0);
            sums[1] += laid.misfit(*shift);
        }
        Some(sums)
    }

    /// The shifts that readings tell by themselves, with their standard uncertainties, where they do.
    fn told_by(
        &self,
        model: &Linearised,
        readings: &DVector<f64>,
        variant: usize,
    ) -> Option<Vec<(f64, f64)>> {
        let best = |position| {
            let laid = Self::laid(model, readings, (variant, position))?;
            let shift = laid.best(REACH);
            Some((shift, laid.std(shift)))
        };
        let told: Vec<(f64, f64)> = self.shifted(variant).map(best).collect::<Option<_>>()?;
        let gap = model.travel() / (model.positions().len() - 1) as f64;
        let is_far = told.iter().any(|(shift, _)| shift.abs() > FAR * gap);
        let [without, with] = self.misfits(model, readings, variant, &told)?;
        (is_far && with < SHOWS * without).then_some(told)
    }

    /// The shape of shifts that readings told with their standard uncertainties, at a state that holds them or does not.
    fn as_told(variant: usize, told: &[(f64, f64)], held: bool) -> Shape {
        let held = std::iter::once(f64::from(u8::from(held)));
        let shifts = told.iter().map(|(shift, _)| *shift);
        let values: Vec<f64> = shifts.chain(held).chain(told.iter().map(|t| t.1)).collect();
        Shape {
            variant,
            steps: vec![0.0; values.len()],
            values,
        }
    }

    /// The surface beyond the ends of the forms, by cell, behind a told shape's other values.
    fn beyond(&self, shape: &Shape) -> Vec<(usize, f64)> {
        let behind = 2 * self.shifted(shape.variant).len() + 1;
        let pairs = shape
            .values
            .get(behind..)
            .unwrap_or_default()
            .chunks_exact(2);
        pairs.map(|pair| (pair[0] as usize, pair[1])).collect()
    }

    /// The shifts of a shape, as far as it has any.
    fn shifts<'s>(&self, shape: &'s Shape) -> &'s [f64] {
        let count = self.shifted(shape.variant).len().min(shape.values.len());
        &shape.values[..count]
    }

    /// Shift of a position at a shape.
    fn shift_of(&self, shape: &Shape, position: usize) -> f64 {
        let mut own = self.shifted(shape.variant);
        let at = own.position(|p| p == position);
        at.and_then(|k| shape.values.get(k)).copied().unwrap_or(0.0)
    }

    /// Of shifts that the readings told, whether the state at which the shape stands holds them still: the value
    /// behind them.
    fn held(&self, shape: &Shape) -> Option<bool> {
        let held = shape.values.get(self.shifted(shape.variant).len());
        held.map(|held| *held > 0.0)
    }

    fn start(&self, variant: usize) -> Shape {
        Shape {
            variant,
            values: Vec::new(),
            steps: Vec::new(),
        }
    }
}

impl Effect<Linearised> for ReversalShift {
    fn name(&self) -> &str {
        "reversal-shift"
    }

    fn about(&self) -> About {
        About {
            physics: "the artefact sits at another axial position after the spindle has turned, so its form returns shifted",
            confirm: "touch the end face of the artefact with an indicator in all spindle positions",
            source: "chord of S(x - shift) in a spindle position; Taylor expansion to first order where it is short",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Stylus
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let shift = Parameter::symmetric("shift", "mm", REACH);
        let own = self.shifted(shape.variant);
        if own.len() == 1 {
            return vec![shift];
        }
        let named = |p: usize| Parameter {
            name: Cow::Owned(format!("shift-at-{}deg", angle_name(self.positions[p]))),
            ..shift.clone()
        };
        own.map(named).collect()
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let variants = match self.positions.len() {
            0..=2 => EVERY..=EVERY,
            count => EVERY..=count,
        };
        let of = |variant| {
            let told = self.told_by(model, model.observed(), variant);
            let told = told.map(|told| Self::as_told(variant, &told, true));
            std::iter::once(self.start(variant)).chain(told)
        };
        variants.flat_map(of).collect()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let mut others = self.grid(model);
        others.retain(|other| other.variant != shape.variant);
        others
    }

    fn is_linear_in_state(&self) -> bool {
        true
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let parted = (self.held(shape) == Some(true))
            .then(|| model.parted(model.observed(), |p| self.shift_of(shape, p)));
        let forms = parted.as_ref().map(|parted| model.as_smooth(parted));
        let beyond = match &parted {
            Some(parted) => parted.beyond.clone(),
            None => self.beyond(shape),
        };
        let of = |position: usize| {
            let shift = self.shift_of(shape, position);
            model.of_cell(|_, place| {
                if model.seat(place).position != position {
                    return 0.0;
                }
                let side = model.side_form(place);
                let form = forms
                    .as_ref()
                    .map_or(model.form(side), |forms| &forms[side]);
                model.displaced(form, &beyond, place, shift)
            })
        };
        self.shifted(shape.variant).map(of).collect()
    }

    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        model.between_positions(|_, place| {
            let position = model.seat(place).position;
            [0.0, -self.shift_of(shape, position)]
        })
    }

    fn traced(
        &self,
        model: &Linearised,
        readings: &dyn Fn() -> Option<DVector<f64>>,
        shape: &Shape,
    ) -> Option<Shape> {
        let readings = readings()?;
        let told = self.told_by(model, &readings, shape.variant)?;
        let less = |of: &DVector<f64>| {
            let [without, with] = self.misfits(model, of, shape.variant, &told)?;
            Some(without - with)
        };
        let held = less(model.observed())? > HELD * less(&readings)?;
        let mut told = Self::as_told(shape.variant, &told, held);
        let parted = model.parted(&readings, |p| self.shift_of(&told, p));
        for (cell, there) in parted.beyond {
            told.values.extend([cell as f64, there]);
            told.steps.extend([0.0; 2]);
        }
        Some(told)
    }

    fn restored(
        &self,
        model: &Linearised,
        shape: &Shape,
        readings: &DVector<f64>,
        _clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        self.held(shape)?;
        Some(model.without_shifts(readings, |p| self.shift_of(shape, p)))
    }

    /// Another state has a surface of its own beyond the ends, and holds no shift.
    fn carried(
        &self,
        _from: &Linearised,
        _to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let count = self.shifted(shape.variant).len();
        let mut carried = shape.clone();
        if self.held(shape).is_some() {
            carried.values.truncate(2 * count + 1);
            carried.steps.truncate(2 * count + 1);
            carried.values[count] = 0.0;
        }
        (carried, amplitudes.to_vec())
    }

    /// A shift that the readings told is the length of a chord, and its size too: the one that is known better.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let parameters = self.amplitudes_at(shape).into_iter();
        let mut estimates = each(parameters, amplitudes.iter(), covariance);
        let shifts = self.shifts(shape);
        let stds = shape.values.get(shifts.len() + 1..).unwrap_or_default();
        for (estimate, (shift, std)) in estimates.iter_mut().zip(shifts.iter().zip(stds)) {
            if *std > 0.0 && *std < estimate.std {
                (estimate.value, estimate.std) = (*shift, *std);
            }
        }
        estimates
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        // The size that a long chord has leads away from a shift that the readings told.
        self.held(shape).is_none().then(|| Shape {
            values: amplitudes.to_vec(),
            steps: vec![0.0; amplitudes.len()],
            ..shape.clone()
        })
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        match (self.positions.len(), shape.variant) {
            (0..=2, _) => None,
            (_, EVERY) => Some("each position against the first".to_owned()),
            (_, one) => Some(format!(
                "spindle at {}°",
                angle_name(self.positions[one - 1])
            )),
        }
    }
}
