//! The best member of an effect's family beside other causes, from a start.

use errsep_models::model::{AnyModel, Effect, Shape};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::attribution::by_traces::ByTraces;
use crate::attribution::context::{Cause, Context, as_matrix, column, span, unknowns};
use crate::detection::basis::orthonormal;
use crate::detection::dictionary::{inverse, is_positive, products, statistic};
use crate::levels::{ALIKE, UNSEARCHED};
use crate::search::{Reach, around, coordinate_search};

/// How often values that come back are tried around their cycles.
const ROUNDS: usize = 4;

/// What readings hold beside other causes at a state of the model: the same for every effect that is sought there.
pub(crate) struct Beside<'s> {
    context: &'s Context<'s>,
    state: &'s AnyModel,
    readings: &'s DVector<f64>,
    causes: &'s [Cause],
    /// What a column is multiplied with to get its score.
    adjoint: DVector<f64>,
    /// The same of the causes' directions.
    directions: Vec<DVector<f64>>,
}

impl<'s> Context<'s> {
    /// What readings hold beside causes.
    pub fn beside(
        &'s self,
        state: &'s AnyModel,
        readings: &'s DVector<f64>,
        causes: &'s [Cause],
    ) -> Beside<'s> {
        let whole = self.residual(readings);
        let basis = span(causes, self.space.readings());
        let residual = &whole - &basis * basis.tr_mul(&whole);
        let adjoint = column(self.space.adjoint(as_matrix(&residual)));
        let directions = self.space.adjoint(basis);
        Beside {
            context: self,
            state,
            readings,
            causes,
            adjoint,
            directions: directions.column_iter().map(|c| c.clone_owned()).collect(),
        }
    }
}

impl<'s> Beside<'s> {
    /// The best shape of an effect from a start, and the statistic there; its relatives are tried too, and the one
    /// of greatest evidence is taken.
    pub fn refine(&self, effect: usize, (start, reach): (&Shape, Reach)) -> (Cause, f64) {
        let seen = self.seen(effect);
        let (shape, t) = seen.of_greatest_evidence(seen.searched(start, reach), reach);
        (self.context.cause(self.state, effect, shape), t)
    }

    /// A refined cause once its values that come back were tried around their cycles, and its statistic; the
    /// cause as it is where none does.
    pub fn come_back(&self, (cause, t): (Cause, f64)) -> (Cause, f64) {
        let cycles = self.context.catalogue[cause.effect].cycles(self.state, &cause.shape);
        if cycles.is_empty() {
            return (cause, t);
        }
        let (shape, t) = self.seen(cause.effect).come_back(&cause.shape, &cycles);
        (self.context.cause(self.state, cause.effect, shape), t)
    }

    /// As [`Beside::refine`], without relatives.
    pub fn refine_alone(&self, effect: usize, (start, reach): (&Shape, Reach)) -> (Cause, f64) {
        let (shape, t) = self.seen(effect).searched(start, reach);
        (self.context.cause(self.state, effect, shape), t)
    }

    /// An effect as it is seen here.
    pub(super) fn seen(&'s self, effect: usize) -> Seen<'s> {
        Seen {
            context: self.context,
            effect: self.context.catalogue[effect].as_ref(),
            state: self.state,
            beside: self,
            adjoint: &self.adjoint,
            directions: &self.directions,
        }
    }
}

/// An effect as it is seen beside other causes at a state of the model.
pub(super) struct Seen<'s> {
    pub context: &'s Context<'s>,
    pub effect: &'s dyn Effect<AnyModel>,
    pub state: &'s AnyModel,
    beside: &'s Beside<'s>,
    /// What a column is multiplied with to get its score.
    pub adjoint: &'s DVector<f64>,
    /// The same of the other causes' directions.
    pub directions: &'s [DVector<f64>],
}

impl Seen<'_> {
    /// Statistic, EᵀPE and score of a shape; nothing stands out of one that the fit takes up whole.
    pub fn value(&self, shape: &Shape) -> (f64, DMatrix<f64>, DVector<f64>) {
        let columns = self.effect.columns(self.state, shape);
        let gram = self.context.space.gram(&columns);
        let visible = gram.is_visible();
        let mut gram = gram.matrix;
        for direction in self.directions {
            let along = products(&columns, direction);
            gram -= &along * along.transpose();
        }
        let score = products(&columns, self.adjoint);
        let positive = is_positive(self.effect, shape);
        let statistic = if visible {
            statistic(&gram, &score, positive)
        } else {
            0.0
        };
        (statistic, gram, score)
    }

    /// Of a shape found, with its statistic, and its relatives that of greatest evidence.
    fn of_greatest_evidence(&self, (mut shape, mut t): (Shape, f64), reach: Reach) -> (Shape, f64) {
        let readings = self.context.space.readings();
        let log_readings = (readings as f64).ln();
        let weighed = |shape: &Shape, t: f64| {
            let columns = self.effect.amplitudes_at(shape).len();
            let choices = self.effect.choices(shape);
            let unknowns = unknowns((readings, columns), shape, choices);
            (t - unknowns as f64 * log_readings, columns)
        };
        let relatives = self.effect.relatives(self.state, &shape);
        let mut relatives: Vec<(f64, usize, Shape)> = relatives
            .into_par_iter()
            .map(|other| {
                let (here, columns) = weighed(&other, self.value(&other).0);
                (here, columns, other)
            })
            .collect();
        // The best first: what it is searched to spares the search of many others.
        relatives.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut ahead: Vec<Option<(Shape, f64)>> = vec![None; relatives.len()];
        let mut searched: Vec<usize> = Vec::new();
        for k in 0..relatives.len() {
            let (least, columns) = weighed(&shape, t);
            let is_spared = |(here, own, other): &(f64, usize, Shape), searched: &[usize]| {
                let alike = searched.iter().filter(|v| **v == other.variant).count();
                // One that holds the other needs no search to be better; one of another kind does.
                let added = if *own == columns { UNSEARCHED * t } else { 0.0 };
                *here <= least - added || alike >= ALIKE
            };
            if is_spared(&relatives[k], &searched) {
                continue;
            }
            let other = relatives[k].2.variant;
            if ahead[k].is_none() {
                // Others that will be searched unless this one spares them, on processors that would stand idle.
                let mut next: Vec<usize> = Vec::new();
                let mut then = searched.clone();
                for j in k..relatives.len() {
                    if next.len() < rayon::current_num_threads() && !is_spared(&relatives[j], &then)
                    {
                        next.push(j);
                        then.push(relatives[j].2.variant);
                    }
                }
                let found: Vec<(Shape, f64)> = next
                    .par_iter()
                    .map(|j| self.searched(&relatives[*j].2, reach))
                    .collect();
                next.into_iter()
                    .zip(found)
                    .for_each(|(j, found)| ahead[j] = Some(found));
            }
            searched.push(other);
            if let Some((found, own_t)) = ahead[k].take()
                && weighed(&found, own_t).0 > least
            {
                (shape, t) = (found, own_t);
            }
        }
        (shape, t)
    }

    /// The best shape from a start, settled, and its statistic; one that settles to another variant is
    /// searched there.
    fn searched(&self, start: &Shape, reach: Reach) -> (Shape, f64) {
        let mut shape = start.clone();
        if shape.free() > 0 {
            let mut by_traces = ByTraces::new(self, start);
            let misfit = |values: &[f64]| self.misfit(start, values, by_traces.as_mut());
            shape.values = coordinate_search(&start.values, &start.steps, reach, misfit).0;
        }
        self.settled(shape, reach)
    }

    /// What small steps stop beside: the best around the cycles, searched on from there.
    fn come_back(&self, start: &Shape, cycles: &[(usize, f64)]) -> (Shape, f64) {
        let mut shape = start.clone();
        let mut by_traces = ByTraces::new(self, start);
        let mut misfit = |values: &[f64]| self.misfit(start, values, by_traces.as_mut());
        for _ in 0..ROUNDS {
            let (values, moved) = around(&shape.values, cycles, &mut misfit);
            if !moved {
                break;
            }
            shape.values = coordinate_search(&values, &start.steps, Reach::WIDE, &mut misfit).0;
        }
        self.settled(shape, Reach::WIDE)
    }

    /// The statistic of other values of a shape, the greatest the least; infinite where they are not allowed.
    fn misfit(&self, shape: &Shape, values: &[f64], near: Option<&mut ByTraces<'_, '_>>) -> f64 {
        let trial = Shape {
            values: values.to_vec(),
            ..shape.clone()
        };
        if !self.effect.allowed(self.state, &trial) {
            return f64::INFINITY;
        }
        match near {
            Some(near) => -near.statistic(values),
            None => -self.value(&trial).0,
        }
    }

    /// A shape as the readings tell it, less what the other causes change in them when all are fitted together.
    fn traced(&self, shape: &Shape) -> Option<Shape> {
        let left = || {
            let (readings, causes) = (self.beside.readings, self.beside.causes);
            if causes.is_empty() {
                return Some(readings.clone());
            }
            let columns = self.effect.columns(self.state, shape);
            let own = self.context.space.forward_columns(&columns).0;
            let sizes: Vec<f64> = own.column_iter().map(|c| c.norm()).collect();
            let basis = orthonormal(&own, &sizes);
            let others = self.context.amplitudes_beside(readings, causes, &basis)?;
            Some(readings - self.context.change(causes, &others))
        };
        self.effect.traced(self.state, &left, shape)
    }

    /// A shape with what readings and its size make of it.
    fn settled(&self, mut shape: Shape, reach: Reach) -> (Shape, f64) {
        if let Some(traced) = self.traced(&shape) {
            shape = traced;
        }
        let (mut t, mut gram, mut score) = self.value(&shape);
        for _ in 0..8 {
            // What the model absorbs of several columns together stays as small as may be.
            let amplitude = inverse(&gram) * &score;
            let Some(next) = self.effect.settled(&shape, amplitude.as_slice()) else {
                break;
            };
            if next.variant != shape.variant {
                return self.searched(&next, reach);
            }
            if next.values == shape.values {
                break;
            }
            shape = next;
            (t, gram, score) = self.value(&shape);
        }
        (shape, t)
    }
}

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::Channel;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Exact*: a bump in all repeats of one of three channels is a form, of which the fit leaves rounding; the same bump
    /// in one repeat is seen.
    #[test]
    fn nothing_stands_out_of_what_the_fit_takes_up() {
        let noise = SceneNoise {
            white: 0.1,
            correlated: 0.0,
            length: 20.0,
            shift: 0.0,
        };
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let scene = Scene::random(40, 3, 1e-5, 2.0, noise, &mut random);
        let mut observations = scene.measured(4);
        observations.readings.retain(|r| r.channel != Channel::C2A);
        let fitted = Linearised::new(&observations, Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let readings = model.linearised();
        let law = estimate(&model, &readings);
        let context = Context::new(&model, &catalogue, law, 40, 1);
        let name = "local-contamination";
        let effect = catalogue.iter().position(|e| e.name() == name).unwrap();
        let alone = context.beside(&model, &readings, &[]);
        let seen = alone.seen(effect);
        let in_words = |shape: &_| catalogue[effect].variant_name(&model, shape).unwrap();
        let bumps = catalogue[effect].grid(&model).into_iter();
        let statistics: Vec<(bool, f64)> = bumps
            .map(|shape| (in_words(&shape).contains("repeat"), seen.value(&shape).0))
            .collect();
        assert!(statistics.iter().any(|(repeat, t)| *repeat && *t > 0.0));
        assert!(statistics.iter().any(|(repeat, _)| !repeat));
        assert!(statistics.iter().all(|(repeat, t)| *repeat || *t == 0.0));
    }
}
