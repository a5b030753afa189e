//! Causes refitted with the state of the model: what each changes, seen after the others, taken out
//! of the readings until nothing moves.

use std::borrow::Cow;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::attribution::context::{Cause, Context};
use crate::attribution::mixing::Mixing;
use crate::attribution::standing::has_possible_sizes;
use crate::search::Reach;

/// Relative change of the amplitudes at which refining stops.
const AT_REST: f64 = 1e-4;

/// Rounds in which relatives are tried, and a shape of more than [`MANY`] parameters is searched: with so many a search
/// always finds something, and by then the state moves them little.
const SEARCHED: usize = 2;
/// See [`SEARCHED`].
const MANY: usize = 12;

/// Most rounds of fitting the state without the causes.
const ROUNDS: usize = 16;
/// Rounds in which the best fit does not become better, by squares of standard deviations, after which there are no
/// more: what is followed anew in each round may never rest.
const IDLE: usize = 4;
/// See [`IDLE`].
const NO_GAIN: f64 = 0.02;

impl Context<'_> {
    /// Causes bend the state at which their signatures are taken: takes their change out of the
    /// readings, fits the model again and refines each there, until the change rests. The rounds
    /// are those of a fixed point, sped up by Anderson's mixing; the best fit seen is kept. They
    /// end early where the misfit will not come below `hopeless`.
    pub fn relinearised(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        hopeless: f64,
    ) -> Vec<Cause> {
        let mut best = (f64::INFINITY, causes.to_vec());
        let mut causes = causes.to_vec();
        let Some(mut changes) = self.changes(readings, &causes) else {
            return causes;
        };
        let mut mixing = Mixing::default();
        let mut idle = 0;
        for round in 0..ROUNDS {
            let state = self
                .model
                .refit_as_smooth(self.without(readings, &causes, &changes));
            for k in 0..causes.len() {
                let mut others = causes.clone();
                let own = others.remove(k);
                let state = self.seen_by(k, &state, &causes, &changes);
                causes[k] = self.again(&state, readings, &own, &others, round);
            }
            let misfit = self.misfit(readings, &causes);
            let gained = best.0 - misfit;
            if round > 0 && gained < 0.2 * (misfit - hopeless) {
                break;
            }
            // A size that nothing bounds grows with the state that it bends.
            if !has_possible_sizes(self, readings, &causes, 0..causes.len()) {
                break;
            }
            idle = if gained > NO_GAIN { 0 } else { idle + 1 };
            if misfit < best.0 {
                best = (misfit, causes.clone());
            }
            if idle == IDLE {
                break;
            }
            let Some(next) = self.changes(readings, &causes) else {
                break;
            };
            if (&next - &changes).norm() < AT_REST * next.norm() {
                break;
            }
            changes = mixing.mixed(&changes, next);
        }
        best.1
    }

    /// A cause searched again at another state, the less the later the round.
    fn again(
        &self,
        state: &AnyModel,
        readings: &DVector<f64>,
        cause: &Cause,
        others: &[Cause],
        round: usize,
    ) -> Cause {
        let (effect, shape) = (cause.effect, &cause.shape);
        if round < SEARCHED {
            let start = (shape, Reach::NEAR);
            self.beside(state, readings, others).refine(effect, start).0
        } else if shape.free() <= MANY {
            let start = (shape, Reach::CLOSE);
            let beside = self.beside(state, readings, others);
            beside.refine_alone(effect, start).0
        } else {
            self.at_rest(state, readings, cause, others)
        }
    }

    /// A cause at another state, its shape kept but for what its size makes of it.
    fn at_rest(
        &self,
        state: &AnyModel,
        readings: &DVector<f64>,
        cause: &Cause,
        others: &[Cause],
    ) -> Cause {
        let mut shape = cause.shape.clone();
        shape.steps.fill(0.0);
        let beside = self.beside(state, readings, others);
        let (mut kept, _) = beside.refine_alone(cause.effect, (&shape, Reach::CLOSE));
        kept.shape.steps.clone_from(&cause.shape.steps);
        kept
    }

    /// The state at which the signature of one of several causes is taken: with what the others
    /// change before it.
    pub fn seen_by<'s>(
        &self,
        which: usize,
        state: &'s AnyModel,
        causes: &[Cause],
        changes: &DMatrix<f64>,
    ) -> Cow<'s, AnyModel> {
        let link = |k: usize| self.catalogue[causes[k].effect].link(&causes[k].shape);
        let mut sum = DVector::zeros(self.space.readings());
        let mut any = false;
        for k in (0..causes.len()).filter(|k| *k != which && link(which).sees(link(*k))) {
            sum += changes.column(k);
            any = true;
        }
        if any {
            Cow::Owned(state.clone().beneath(&sum))
        } else {
            Cow::Borrowed(state)
        }
    }

    /// What each cause changes in the readings at its fitted amplitudes, readings × causes.
    pub fn changes(&self, readings: &DVector<f64>, causes: &[Cause]) -> Option<DMatrix<f64>> {
        let (amplitudes, _) = self.amplitudes(readings, causes)?;
        Some(self.changes_at(causes, &amplitudes))
    }

    /// The same at given amplitudes.
    pub fn changes_at(&self, causes: &[Cause], amplitudes: &DVector<f64>) -> DMatrix<f64> {
        let mut changes = DMatrix::zeros(self.space.readings(), causes.len());
        let mut at = 0;
        for (k, cause) in causes.iter().enumerate() {
            let own = amplitudes.rows(at, cause.columns.len()).clone_owned();
            at += cause.columns.len();
            changes.set_column(k, &self.change(std::slice::from_ref(cause), &own));
        }
        changes
    }

    /// Readings without what causes change in them, and what they hide of the state restored.
    pub fn without(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        changes: &DMatrix<f64>,
    ) -> DVector<f64> {
        let mut clean = readings - changes.column_sum();
        for (cause, change) in causes.iter().zip(changes.column_iter()) {
            let with = &clean + change;
            let effect = &self.catalogue[cause.effect];
            if let Some(restored) = effect.restored(self.model, &cause.shape, &with, &clean) {
                clean = restored;
            }
        }
        clean
    }
}

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Property*: however often a cause is fitted, the next search begins with the steps of the grid. Where each left
    /// shorter ones a search crept and stopped on the way.
    #[test]
    fn fitting_again_does_not_shorten_the_steps_of_a_search() {
        let noise = SceneNoise {
            white: 0.1,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let scene = Scene::random(40, 3, 1e-5, 2.0, noise, &mut random);
        let fitted = Linearised::new(&scene.measured(4), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let mut readings = model.linearised();
        let cycle = catalogue
            .iter()
            .position(|e| e.name() == "cyclic-error")
            .unwrap();
        let grid = catalogue[cycle].grid(&model);
        let start = grid[grid.len() / 3].clone();
        let column = catalogue[cycle].columns(&model, &start).remove(0);
        readings += 0.5 * column.dense(readings.len());
        let context = Context::new(&model, &catalogue, estimate(&model, &readings), 40, 1);
        let mut causes = vec![context.cause(&model, cycle, start.clone())];
        for _ in 0..3 {
            causes = context.relinearised(&readings, &causes, f64::INFINITY);
        }
        assert_eq!(causes[0].shape.steps, start.steps);
    }
}
