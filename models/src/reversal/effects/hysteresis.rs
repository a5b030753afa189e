//! The indicator lags behind its stylus: a play between stylus and pointer.
//!
//! The lag saturates at half the width once the stylus has moved by the width, so the signature
//! depends on the size where the reading turns round within a trace. Where the pointer stands when a
//! trace begins depends on what came before: a place within the play, −1 to 1, for the forward and
//! the backward traces of every channel. Free: a width for each indicator, the beginnings.

use std::ops::Range;

use nalgebra::DVector;

use super::Linearised;
use super::indicators::{ALL, Indicators};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};

/// See the head of the file. Variants: the indicators.
pub(super) struct Hysteresis(pub Indicators);

/// A pointer moves where its slope is at least this part of the other direction's.
const MOVING: f64 = 0.5;

impl Effect<Linearised> for Hysteresis {
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

    fn link(&self, _shape: &Shape) -> Link {
        Link::Pointer
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(ALL))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let width = Parameter::between("width", "um", 0.0, 50.0);
        self.0.sizes(shape.variant, &width, "width")
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let span = model.reading_span();
        let of = |scope: usize| {
            let parts = [1e-3, 1e-2, 3e-2, 1e-1].into_iter();
            parts.map(move |part| self.started(model, scope, &|_| part * span))
        };
        self.0.scopes().flat_map(of).collect()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let count = self.0.of(shape.variant).len();
        let (widths, beginnings) = shape.values.split_at(count.min(shape.values.len()));
        let other = |variant: usize| {
            let width = |indicator: usize| match widths {
                [one] => *one,
                each => each.get(indicator).copied().unwrap_or(0.0),
            };
            let mut other = self.started(model, variant, &width);
            let from = self.0.of(variant).len();
            // Where its own pointers stand is known already.
            let own = |k: usize| shape.steps.get(count + k).is_some_and(|s| *s != 0.0);
            for (k, begins) in beginnings.iter().enumerate().filter(|(k, _)| own(*k)) {
                if let Some(value) = other.values.get_mut(from + k) {
                    *value = *begins;
                }
            }
            other
        };
        self.0.others(shape.variant).map(other).collect()
    }

    fn allowed(&self, _model: &Linearised, shape: &Shape) -> bool {
        let beginnings = shape.values.iter().skip(self.0.of(shape.variant).len());
        beginnings.into_iter().all(|v| (-1.0..=1.0).contains(v))
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let own = self.0.of(shape.variant);
        if shape.values.len() < own.len() {
            return Vec::new();
        }
        let first = own.len();
        let of = |(indicator, width): (usize, &f64)| lag(model, shape, first, indicator, *width);
        own.zip(&shape.values).map(of).collect()
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        Some(self.0.words(shape.variant))
    }

    /// Where the stylus turns round within the play the pointer stands still and tells nothing of
    /// it; the traces of the other direction, in which it moves, do.
    fn restored(
        &self,
        model: &Linearised,
        _shape: &Shape,
        readings: &DVector<f64>,
        clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let n = model.positions().len();
        let mut restored = clean.clone();
        for channel in 0..model.present().len() {
            let traces = |direction: f64| {
                model.traces().iter().filter(move |trace| {
                    let place = &model.places()[trace.start];
                    place.channel == channel && place.direction == direction
                })
            };
            let mean = |direction: f64, values: &DVector<f64>| {
                let count = traces(direction).count();
                let mut sum = DVector::zeros(n);
                traces(direction).for_each(|t| sum += values.rows(t.start, n));
                (count > 0).then(|| sum / count as f64)
            };
            let slopes = [1.0, -1.0].map(|direction| {
                let repeats: Vec<DVector<f64>> = traces(direction)
                    .map(|t| readings.rows(t.start, n).clone_owned())
                    .collect();
                model.smoothed(&repeats).slopes
            });
            let clean = [mean(1.0, clean)?, mean(-1.0, clean)?];
            for k in 0..n {
                let steepest = slopes[0][k].abs().max(slopes[1][k].abs());
                let moves = |d: usize| f64::from(u8::from(slopes[d][k].abs() >= MOVING * steepest));
                let weights = [moves(0), moves(1)];
                let stylus = (weights[0] * clean[0][k] + weights[1] * clean[1][k])
                    / (weights[0] + weights[1]);
                // What tells the repeats apart stays: the smoothing learns the noise from it.
                let moved = [stylus - clean[0][k], stylus - clean[1][k]];
                for (direction, moved) in [1.0, -1.0].into_iter().zip(moved) {
                    traces(direction).for_each(|t| restored[t.start + k] += moved);
                }
            }
        }
        Some(restored)
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        let mut settled = shape.clone();
        for (value, width) in settled.values.iter_mut().zip(amplitudes) {
            *value = width.max(0.0);
        }
        Some(settled)
    }
}

impl Hysteresis {
    /// The start of a search: widths of the indicators that the variant has, then the beginnings. The play
    /// is taken up in the direction in which a trace begins, as the slide comes from before its first
    /// position; where the form is level there, the search finds the side.
    fn started(&self, model: &Linearised, variant: usize, width: &dyn Fn(usize) -> f64) -> Shape {
        let own = self.0.of(variant);
        let mut values: Vec<f64> = own.clone().map(width).collect();
        let mut steps = vec![0.0; values.len()];
        let mut beginnings = vec![(0.0, 0.0); 2 * model.present().len()];
        for trace in model.traces() {
            let place = &model.places()[first_of(model, trace)];
            if own.contains(&model.seat(place).indicator) {
                let begins = -(place.direction * model.reading_slope(place)).signum();
                beginnings[beginning_of(model, trace)] = (begins, 1.0);
            }
        }
        values.extend(beginnings.iter().map(|b| b.0));
        steps.extend(beginnings.iter().map(|b| b.1));
        Shape {
            variant,
            values,
            steps,
        }
    }
}

/// How far the pointers of one indicator are behind, per unit of its play; `first`: where the
/// beginnings stand in the shape.
fn lag(model: &Linearised, shape: &Shape, first: usize, indicator: usize, width: f64) -> Column {
    let half = 0.5 * width.max(1e-6 * model.reading_span());
    let places = model.places();
    let mut column = Column::default();
    for trace in model.traces() {
        if model.seat(&places[trace.start]).indicator != indicator {
            continue;
        }
        let begins = shape
            .values
            .get(first + beginning_of(model, trace))
            .copied()
            .unwrap_or(0.0);
        let forward = places[trace.start].direction > 0.0;
        let mut pointer = model.smooth_reading(first_of(model, trace)) + begins * half;
        for step in 0..trace.len() {
            let k = if forward {
                trace.start + step
            } else {
                trace.end - 1 - step
            };
            let stylus = model.smooth_reading(k);
            // Not `clamp`, which ends the program where a state has no number.
            pointer = pointer.max(stylus - half).min(stylus + half);
            column.rows.push(k);
            column.values.push((pointer - stylus) / (2.0 * half));
        }
    }
    column
}

/// The reading with which a trace begins.
fn first_of(model: &Linearised, trace: &Range<usize>) -> usize {
    if model.places()[trace.start].direction > 0.0 {
        trace.start
    } else {
        trace.end - 1
    }
}

/// The place of a trace's beginning among the shape's: one for every channel and direction.
fn beginning_of(model: &Linearised, trace: &Range<usize>) -> usize {
    let place = &model.places()[trace.start];
    2 * place.channel + usize::from(place.direction < 0.0)
}
