//! Whether causes stand: each needed beside the others, possible, and of a size that is known.

use std::ops::Range;

use nalgebra::DVector;

use crate::attribution::context::{Cause, Context, raw_signatures};
use crate::attribution::limits::is_beyond_limit;
use crate::attribution::shrink::held_out_square;
use crate::attribution::sizes::{Sizes, first_amplitude};
use crate::detection::basis::orthonormal;
use crate::detection::space::Space;
use crate::levels::{EARNED, FAR, LEAVES, STANDS, WEIGHTY};
use crate::noise::law::{NoiseLaw, NoiseSource};

/// Whether each of some causes is needed beside the others, is no other effect at its limit, and has a size
/// that is possible.
pub(crate) fn stand_together(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
) -> bool {
    let needed = causes.len() == 1
        || weighty(context, readings, causes)
            && (0..causes.len()).all(|k| {
                let beside = context.remainder(readings, &without(causes, k));
                context.p_value(&beside, causes[k].effect) < EARNED
            })
            && predicts(context, readings, causes);
    needed
        && explain_most(context, readings, causes)
        && has_possible_sizes(context, readings, causes, 0..causes.len())
        && (0..causes.len()).all(|k| is_beyond_limit(context, readings, causes, k))
        && sized(context, readings, causes)
}

/// Whether causes leave less of the misfit than they explain, or no more than noise may be. What the model does not know
/// of the state excuses a remainder, and of forms that are rough between the positions it excuses nearly all that an
/// effect may leave which sees them there.
fn explain_most(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let freedom = context.space.degrees_of_freedom() as f64;
    let beyond = |causes: &[Cause]| context.misfit(readings, causes) - freedom;
    let left = beyond(causes);
    left <= FAR * (2.0 * freedom).sqrt() || left <= LEAVES * beyond(&[])
}

/// Whether of every cause one size at least is beyond its standard uncertainty, of several causes
/// beyond twice that, the state's included: what may as well be nothing stands for something that it
/// only imitates.
fn sized(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let all = |sizes: Sizes| (0..causes.len()).all(|k| stands(context, causes, &sizes, k));
    // Without the state it is seen sooner.
    Sizes::fitted(context, readings, causes).is_some_and(all)
        && Sizes::fitted_with_state(context, readings, causes).is_some_and(all)
}

/// Whether one of the sizes that are told of a cause is known to better than itself.
pub(super) fn stands(context: &Context<'_>, causes: &[Cause], sizes: &Sizes, which: usize) -> bool {
    let shapes = context.catalogue[causes[which].effect].shape_parameters();
    let own = sizes.of(context, causes, which);
    let least = STANDS[usize::from(causes.len() > 1)];
    own.iter()
        .filter(|estimate| shapes.iter().all(|p| p.name != estimate.name))
        .any(|estimate| estimate.value.abs() > least * estimate.std)
}

/// Whether each of several causes, beside the others, changes the readings by more than may be left
/// of the strongest of them because its signature is not quite that of the true cause. Counted in
/// the readings' own unit, as signatures differ, and not by the noise, under which a slow change
/// shows less; of the strongest all that shows, as that is what a wrong signature errs by.
fn weighty(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let Some(changes) = context.changes(readings, causes) else {
        return false;
    };
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let shown = Space::new(context.model, &unit).forward(changes).0;
    let sizes: Vec<f64> = shown.column_iter().map(|c| c.norm()).collect();
    let own: Vec<f64> = (0..causes.len())
        .map(|k| {
            let mut others = sizes.clone();
            others.remove(k);
            let basis = orthonormal(&shown.clone().remove_column(k), &others);
            let change = shown.column(k);
            (change - &basis * basis.tr_mul(&change)).norm_squared()
        })
        .collect();
    let most = sizes.iter().map(|size| size * size).fold(0.0, f64::max);
    own.iter().all(|square| *square > WEIGHTY * most)
}

/// Whether each of several causes makes the prediction of held-out repeats better; a cause that
/// happened once cannot be judged so.
fn predicts(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> bool {
    let square = |causes: &[Cause]| {
        let signatures = raw_signatures(context, causes);
        held_out_square(context.model, readings, &signatures)
    };
    let Some(with) = square(causes) else {
        return true;
    };
    (0..causes.len()).all(|k| square(&without(causes, k)).is_none_or(|s| s > with))
}

/// Whether a cause beside others has a physically possible size.
pub(crate) fn possible(
    context: &Context<'_>,
    readings: &DVector<f64>,
    others: &[Cause],
    cause: &Cause,
) -> bool {
    let mut all = others.to_vec();
    all.push(cause.clone());
    has_possible_sizes(context, readings, &all, others.len()..all.len())
}

/// Whether some of several causes, all fitted together, have physically possible sizes.
pub(crate) fn has_possible_sizes(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    mut which: Range<usize>,
) -> bool {
    let Some((amplitudes, covariance)) = context.amplitudes(readings, causes) else {
        return false;
    };
    let stds = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    which.all(|k| {
        let cause = &causes[k];
        let from = first_amplitude(causes, k);
        let own = from..from + cause.projected.ncols();
        context.plausible(
            cause.effect,
            &cause.shape,
            &amplitudes.as_slice()[own.clone()],
            &stds.as_slice()[own],
        )
    })
}

/// The causes but one.
pub(crate) fn without(causes: &[Cause], k: usize) -> Vec<Cause> {
    let mut others = causes.to_vec();
    others.remove(k);
    others
}

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::Channel;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::explain_most;
    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Simulated truth*, of one seed: a jump of twenty times the noise beside a small shift. The shift explains some of
    /// what is missed and leaves most, the jump leaves little.
    #[test]
    fn a_small_cause_does_not_explain_a_large_misfit() {
        let noise = SceneNoise {
            white: 0.05,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let mut scene = Scene::random(60, 4, 1e-5, 2.0, noise, &mut random);
        scene.effects = vec![
            Injection::ZeroJump {
                jump: 1.0,
                channel: Channel::C1A,
                time: 20.0,
            },
            Injection::ReversalShift(1.0),
        ];
        let fitted = Linearised::new(&scene.measured(5), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let readings = model.linearised();
        let context = Context::new(&model, &catalogue, estimate(&model, &readings), 100, 1);
        let first = context.remainder(&readings, &[]);
        let explains = |name: &str| {
            let effect = catalogue.iter().position(|e| e.name() == name).unwrap();
            let start = context.start(&first, effect).unwrap().clone();
            let cause = context.cause(&model, effect, start);
            explain_most(&context, &readings, &[cause])
        };
        assert!(explains("zero-jump"));
        assert!(!explains("reversal-shift"));
    }
}
