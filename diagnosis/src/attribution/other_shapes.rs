//! A cause beside which its own effect stands out has the wrong shape: it is sought in others.
//!
//! A search beside other causes may end beside the best shape, and of two shapes the simpler one is taken where the
//! other explains little more. Neither is kept where what is left is more than noise and of the same effect.

use std::sync::Arc;

use errsep_models::model::{FittedModel, Shape};
use nalgebra::DVector;
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::attribution::remainder::Remainder;
use crate::attribution::standing::without;
use crate::levels::{FAR, NO_BETTER};
use crate::search::Reach;

/// Rounds of seeking others, and shapes that are fitted with the state in each.
const ROUNDS: usize = 3;
/// See [`ROUNDS`].
const FITTED: usize = 2;

impl Context<'_> {
    /// Causes in other shapes than those in which they leave `left`, and what they leave then; the same where that is
    /// adequate, or no other shape explains more.
    pub fn in_other_shapes(
        &self,
        readings: &DVector<f64>,
        causes: Vec<Cause>,
        left: Arc<Remainder>,
    ) -> (Vec<Cause>, Arc<Remainder>) {
        let mut best = (causes, left);
        for _ in 0..ROUNDS {
            let (causes, left) = &best;
            let misfit = self.misfit(readings, causes);
            let freedom = self.space.degrees_of_freedom() as f64;
            let far = misfit > freedom + FAR * (2.0 * freedom).sqrt();
            if far || self.adequate(causes, left) {
                break;
            }
            let lacking = (0..causes.len()).into_par_iter();
            let lacking = lacking.filter(|k| self.stands_out(left, causes, causes[*k].effect));
            let other = lacking.flat_map(|k| self.otherwise(readings, causes, k));
            let other = other.map(|causes| (self.misfit(readings, &causes), causes));
            let next = other.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, causes)) = next.filter(|(other, _)| *other < misfit - NO_BETTER) else {
                break;
            };
            let left = Arc::new(self.judged(readings, &causes));
            best = (causes, left);
        }
        best
    }

    /// The causes fitted again with one of them begun in each of its other shapes.
    fn otherwise(&self, readings: &DVector<f64>, causes: &[Cause], k: usize) -> Vec<Vec<Cause>> {
        let own = &causes[k];
        let others = without(causes, k);
        let Some(changes) = self.changes(readings, causes) else {
            return Vec::new();
        };
        let clean = self.without(readings, causes, &changes);
        let state = self.model.refit_as_smooth(clean);
        let state = self.seen_by(k, &state, causes, &changes);
        let mut starts: Vec<Shape> = self.catalogue[own.effect].relatives(&state, &own.shape);
        let left = self.remainder(readings, &others);
        starts.extend(self.start(&left, own.effect).cloned());
        let misfit = |cause: &Cause| {
            let mut all = others.clone();
            all.insert(k, cause.clone());
            (self.misfit(readings, &all), all)
        };
        let beside = self.beside(&state, readings, &others);
        let found = starts
            .par_iter()
            .map(|start| misfit(&beside.refine_alone(own.effect, (start, Reach::WIDE)).0));
        let mut found: Vec<(f64, Vec<Cause>)> = found.collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(FITTED);
        let fitted = found.into_par_iter();
        fitted
            .map(|(_, causes)| self.relinearised(readings, &causes, f64::INFINITY))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::attribution::context::{Context, span};
    use crate::detection::estimate::estimate;

    /// *Simulated truth*: a drift with a short time constant, taken for a straight one, of which that leaves 90 in χ²: it
    /// stands out beside itself, and is found in another shape beside which nothing does.
    #[test]
    fn a_drift_that_bends_is_not_left_as_a_straight_one() {
        let noise = SceneNoise {
            white: 0.1,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let scene = Scene::random(40, 3, 1e-5, 2.0, noise, &mut random);
        let fitted = Linearised::new(&scene.measured(4), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let quiet = model.linearised();
        let context = Context::new(&model, &catalogue, estimate(&model, &quiet), 200, 1);
        let name = |e: &dyn errsep_models::model::Effect<AnyModel>| e.name() == "thermal-drift";
        let drift = catalogue.iter().position(|e| name(e.as_ref())).unwrap();
        let grid = catalogue[drift].grid(&model);
        let [straight, bent] =
            [grid.len() - 1, 1].map(|k| context.cause(&model, drift, grid[k].clone()));
        let basis = span(std::slice::from_ref(&straight), quiet.len());
        let left = &bent.projected - &basis * basis.tr_mul(&bent.projected);
        let size = (90.0 / left.column(0).norm_squared()).sqrt();
        let readings = quiet + size * bent.columns[0].dense(left.nrows());
        let causes = vec![straight];
        let left = Arc::new(context.judged(&readings, &causes));
        assert!(!context.adequate(&causes, &left));
        let (causes, left) = context.in_other_shapes(&readings, causes, left);
        assert!(context.adequate(&causes, &left), "{:?}", causes[0].shape);
        assert_ne!(causes[0].shape.values, grid[grid.len() - 1].values);
    }
}
