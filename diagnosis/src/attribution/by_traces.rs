//! The statistic of shapes that differ from one another in some traces alone.
//!
//! A search of where each of many passes begins changes one of them at a time: what the readings of the
//! others say stays as it is, and a step costs what the readings of one pass do.

use errsep_models::model::{Column, Shape};
use nalgebra::{DMatrix, DVector};

use crate::attribution::refine::Seen;
use crate::detection::dictionary::{is_positive, products, statistic};
use crate::detection::gram::Part;

/// An effect of one column at the shape that was tried last.
pub(super) struct ByTraces<'a, 's> {
    seen: &'a Seen<'s>,
    held: Held,
    /// The value that the shape tried last differs in from what is held.
    tried: Option<usize>,
}

/// What belongs to a shape.
#[derive(Clone)]
struct Held {
    shape: Shape,
    /// Its column over all readings.
    column: DVector<f64>,
    part: Part,
    /// Products of the column with the residual, and with the directions of the other causes.
    score: f64,
    along: DVector<f64>,
}

impl<'a, 's> ByTraces<'a, 's> {
    /// From a start; nothing where no value of it changes some traces alone.
    pub fn new(seen: &'a Seen<'s>, start: &Shape) -> Option<Self> {
        if seen.context.space.scatters() {
            return None;
        }
        let free = (0..start.values.len()).filter(|k| start.steps[*k] != 0.0);
        let changes_some = |k: usize| seen.effect.changed(seen.state, start, k).is_some();
        free.into_iter().find(|k| changes_some(*k))?;
        Some(Self {
            seen,
            held: Held::new(seen, start)?,
            tried: None,
        })
    }

    /// The statistic of other values.
    pub fn statistic(&mut self, values: &[f64]) -> f64 {
        let mut other = self.differing(values);
        // The value tried last that was kept goes first, so that one is left to try.
        other.sort_by_key(|k| Some(*k) != self.tried);
        let Some(last) = other.pop() else {
            return self.held.statistic(self.seen);
        };
        for k in other {
            self.held = self.moved(k, values[k]);
        }
        let tried = self.moved(last, values[last]);
        self.tried = Some(last);
        let statistic = tried.statistic(self.seen);
        if self
            .seen
            .effect
            .changed(self.seen.state, &tried.shape, last)
            .is_none()
        {
            // All readings are others: what comes next is nearer to this than to what was held.
            self.held = tried;
        }
        statistic
    }

    fn differing(&self, values: &[f64]) -> Vec<usize> {
        let held = &self.held.shape.values;
        (0..values.len())
            .filter(|k| values[*k] != held[*k])
            .collect()
    }

    /// What is held with another value.
    fn moved(&self, k: usize, value: f64) -> Held {
        let seen = self.seen;
        let mut shape = self.held.shape.clone();
        shape.values[k] = value;
        let Some((traces, column)) = seen.effect.changed(seen.state, &shape, k) else {
            return Held::new(seen, &shape).unwrap_or_else(|| self.held.clone());
        };
        let mut held = Held {
            shape,
            ..self.held.clone()
        };
        held.part = seen
            .context
            .space
            .replaced(&self.held.part, &column, &traces);
        for (&row, &value) in column.rows.iter().zip(&column.values) {
            let change = value - held.column[row];
            held.column[row] = value;
            held.score += change * seen.adjoint[row];
            for (along, direction) in held.along.iter_mut().zip(seen.directions) {
                *along += change * direction[row];
            }
        }
        held
    }
}

impl Held {
    /// Nothing where the effect has several columns at the shape.
    fn new(seen: &Seen<'_>, shape: &Shape) -> Option<Self> {
        let columns: Vec<Column> = seen.effect.columns(seen.state, shape);
        let [column] = columns.as_slice() else {
            return None;
        };
        let directions = seen.directions.iter();
        let along = directions.map(|d| products(&columns, d)[0]);
        Some(Self {
            shape: shape.clone(),
            column: column.dense(seen.context.space.readings()),
            part: seen.context.space.part(column),
            score: products(&columns, seen.adjoint)[0],
            along: DVector::from_iterator(seen.directions.len(), along),
        })
    }

    fn statistic(&self, seen: &Seen<'_>) -> f64 {
        let Some(square) = self.part.visible_square(&seen.context.space) else {
            return 0.0;
        };
        let gram = square - self.along.norm_squared();
        statistic(
            &DMatrix::from_element(1, 1, gram),
            &DVector::from_element(1, self.score),
            is_positive(seen.effect, &self.shape),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Limit*: some traces alone against all readings, to rounding of sums over a thousand of them, whichever
    /// values move, one or several at a time, beside another cause.
    #[test]
    fn a_step_of_some_traces_is_that_of_all_readings() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let noise = SceneNoise {
            white: 0.1,
            correlated: 0.05,
            length: 20.0,
            shift: 0.05,
        };
        let scene = Scene::random(40, 3, 1e-5, 2.0, noise, &mut random);
        let fitted = Linearised::new(&scene.measured(4), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let readings = model.linearised();
        let law = estimate(&model, &readings);
        let context = Context::new(&model, &catalogue, law, 40, 1);
        let place = |name: &str| catalogue.iter().position(|e| e.name() == name).unwrap();
        let effect = place("stick-slip");
        let drift = place("thermal-drift");
        let beside = [context.cause(&model, drift, catalogue[drift].grid(&model)[3].clone())];
        let beside = context.beside(&model, &readings, &beside);
        let seen = beside.seen(effect);
        // What waves settle to is a sawtooth that begins anew in each pass.
        let waves = catalogue[effect].grid(&model);
        let waves = waves.iter().find(|shape| shape.variant > 0).unwrap();
        let columns = catalogue[effect].columns(&model, waves).len();
        let start = catalogue[effect]
            .settled(waves, &vec![0.3; columns])
            .unwrap();
        let mut by_traces = ByTraces::new(&seen, &start).expect("passes of their own");
        let mut values = start.values.clone();
        for step in 0..60 {
            for _ in 0..1 + step % 3 {
                let k = random.random_range(0..values.len());
                values[k] += if start.steps[k] == 0.0 {
                    0.0
                } else {
                    random.random_range(-0.2..0.2)
                };
            }
            let whole = Shape {
                values: values.clone(),
                ..start.clone()
            };
            let (expected, ..) = seen.value(&whole);
            let found = by_traces.statistic(&values);
            assert!(
                (found - expected).abs() < 1e-9 * (1.0 + expected),
                "{step}: {found} for {expected}"
            );
        }
        let straight = Shape::only();
        let alone = context.beside(&model, &readings, &[]);
        let jump = alone.seen(place("gain-mismatch"));
        assert!(ByTraces::new(&jump, &straight).is_none());
    }
}
