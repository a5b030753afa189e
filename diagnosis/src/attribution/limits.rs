//! Causes that are freer than what they show: at the limit of their freedom they are another effect.

use errsep_models::model::{AnyModel, FittedModel, Shape};
use nalgebra::DVector;

use crate::attribution::context::{Cause, Context};

/// Rounds in which state and limit are fitted in turn.
const ROUNDS: usize = 3;

/// Whether the evidence for cause `k` of several is greater than that for its limit (Schwarz, Ann. Statist.
/// 6 (1978) 461).
pub(crate) fn is_beyond_limit(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    k: usize,
) -> bool {
    let Cause { effect, shape, .. } = &causes[k];
    let limit_at = |state: &AnyModel| {
        let columns = context.catalogue[*effect].limit(state, shape);
        Cause {
            effect: *effect,
            shape: Shape::only(),
            projected: context.space.forward_columns(&columns).0,
            columns,
            choices: 0,
        }
    };
    if limit_at(context.model).columns.is_empty() {
        return true;
    }
    let own = context.misfit(readings, causes);
    let mut plain = causes.to_vec();
    // What the limit changes bends the state at which it is taken, as any cause does.
    (0..ROUNDS).all(|_| {
        let Some(changes) = context.changes(readings, &plain) else {
            return true;
        };
        let clean = context.without(readings, &plain, &changes);
        let state = context.model.refit_as_smooth(clean);
        let limit = limit_at(&context.seen_by(k, &state, &plain, &changes));
        let more = causes[k].unknowns().saturating_sub(limit.unknowns());
        plain[k] = limit;
        let gained = context.misfit(readings, &plain) - own;
        gained > more as f64 * (context.space.readings() as f64).ln()
    })
}

#[cfg(test)]
mod tests {
    use errsep_models::model::AnyModel;
    use errsep_models::model::{FittedModel, Shape};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
    use nalgebra::DVector;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::is_beyond_limit;
    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;
    use crate::search::Reach;

    const ANEW: &str = "a lag that begins anew in each pass";

    fn model(lost: f64) -> AnyModel {
        let noise = SceneNoise {
            white: 0.05,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut scene = Scene::random(80, 3, 1e-5, 4.0, noise, &mut random);
        scene.effects.push(Injection::AxisBacklash(lost));
        let fitted = Linearised::new(&scene.measured(3), Assumptions::default());
        AnyModel::new(&fitted.unwrap())
    }

    /// Whether the lag anew that explains most of readings is more than its limit, and the part that it explains.
    fn lag_anew(model: &AnyModel, readings: &DVector<f64>) -> (bool, f64) {
        let catalogue = model.effects();
        let lags = |k: usize, shape: &Shape| {
            catalogue[k].variant_name(model, shape).as_deref() == Some(ANEW)
        };
        let name = |name: &str| catalogue.iter().position(|e| e.name() == name).unwrap();
        let effect = name("stick-slip");
        let context = Context::new(model, &catalogue, estimate(model, readings), 40, 1);
        let starts = catalogue[effect].grid(model);
        let starts = starts.iter().filter(|shape| lags(effect, shape)).step_by(3);
        let alone = context.beside(model, readings, &[]);
        let found = starts.map(|start| alone.refine(effect, (start, Reach::WIDE)));
        let (best, explained) = found.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let whole = context.residual(readings).norm_squared();
        let beyond = is_beyond_limit(&context, readings, &[best], 0);
        (beyond, explained / whole)
    }

    /// *Limit*: a lost motion is found as a lag that begins anew, which can be nearly even along the travel, and is no
    /// such lag; one that slips is. Both explain most of what is there.
    #[test]
    fn a_lost_motion_is_no_lag_that_slips() {
        let lost = model(1.5);
        let (beyond, part) = lag_anew(&lost, &lost.linearised());
        assert!(!beyond && part > 0.5, "{beyond} {part}");

        let still = model(0.0);
        let catalogue = still.effects();
        let slip = catalogue.iter().find(|e| e.name() == "stick-slip").unwrap();
        let waves = slip.grid(&still);
        let mut waves = waves.iter().filter(|shape| {
            slip.variant_name(&still, shape).as_deref() == Some(ANEW) && shape.values[0] > 5.0
        });
        let waves = waves.next().unwrap();
        let amplitudes = vec![0.5; slip.columns(&still, waves).len()];
        let mut saw = slip.settled(waves, &amplitudes).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let last = saw.values.len() - 1;
        let states = &mut saw.values[1..last];
        states.iter_mut().for_each(|state| *state = random.random());
        let mut readings = still.linearised();
        for column in slip.columns(&still, &saw) {
            readings += column.dense(readings.len());
        }
        let (beyond, part) = lag_anew(&still, &readings);
        assert!(beyond && part > 0.5, "{beyond} {part}");
    }
}
