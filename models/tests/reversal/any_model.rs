//! A model of any kind answers as the model in it.

use errsep_models::model::{AnyModel, Estimate, FittedModel};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn reversal() -> Linearised {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let noise = SceneNoise {
        white: 0.1,
        ..SceneNoise::default()
    };
    let scene = Scene::random(30, 2, 1e-5, 2.0, noise, &mut random);
    Linearised::new(&scene.measured(7), Assumptions::default()).unwrap()
}

/// *Limit*, exact: a model of any kind answers as the model in it, for every method and the effects.
#[test]
fn all_is_passed_on() {
    let own = reversal();
    let any = AnyModel::new(&own);
    assert_eq!(any.name(), own.name());
    assert_eq!(any.reading_unit(), own.reading_unit());
    assert_eq!(any.position_unit(), own.position_unit());
    assert_eq!(any.time_unit(), own.time_unit());
    assert_eq!(any.record(), FittedModel::record(&own));
    assert_eq!(any.smooth(), own.smooth());
    assert_eq!(any.freedom().columns, own.freedom().columns);
    assert_eq!(any.linearised(), FittedModel::linearised(&own));
    assert_eq!(any.channel_names(), FittedModel::channel_names(&own));
    let place = own.places()[3];
    assert_eq!(
        any.trace_name(&place),
        FittedModel::trace_name(&own, &place)
    );
    assert_eq!(any.patterns().len(), FittedModel::patterns(&own).len());
    assert_eq!(any.quantities().len(), own.quantities().len());
    assert_eq!(any.profiles().len(), own.profiles().len());
    assert_eq!(any.correlated_noise(), own.correlated_noise());
    assert_eq!(any.jumps(), own.jumps());
    assert_eq!(any.names_single_readings(), own.names_single_readings());
    assert_eq!(any.expected_scatter(), own.expected_scatter());
    assert_eq!(any.rounding(), own.rounding());
    assert_eq!(any.stated_noise(), own.stated_noise());
    assert_eq!(any.set_anew(), own.set_anew());
    let other = own.observed() * 1.5;
    let same = |any: &AnyModel, own: &Linearised| {
        assert_eq!(any.observed(), own.observed());
        assert_eq!(any.smooth(), own.smooth());
    };
    same(&any.refit(other.clone()), &own.refit(other.clone()));
    same(
        &any.refit_as_smooth(other.clone()),
        &own.refit_as_smooth(other.clone()),
    );
    same(&any.as_read(), &own.as_read());
    let away = own.smoothed_away(&other);
    assert_eq!(any.smoothed_away(&other), away);
    if let Some(away) = away {
        same(&any.clone().roughened(&away), &own.clone().roughened(&away));
    }
    let further = FittedModel::further(&own);
    assert_eq!(any.further().len(), further.len());
    for ((words, any), (own_words, own)) in any.further().iter().zip(&further) {
        assert_eq!(words, own_words);
        same(any, own);
    }
    let effects = FittedModel::effects(&own);
    assert_eq!(any.effects().len(), effects.len());
    let beneath = (any.clone().beneath(&other), own.clone().beneath(&other));
    for (through, effect) in any.effects().iter().zip(&effects) {
        let grid = effect.grid(&own);
        assert_eq!(through.grid(&any), grid, "{}", effect.name());
        assert_eq!(through.name(), effect.name());
        assert_eq!(through.about(), effect.about());
        assert_eq!(through.amplitudes(), effect.amplitudes());
        assert_eq!(through.shape_parameters(), effect.shape_parameters());
        assert_eq!(through.is_linear_in_state(), effect.is_linear_in_state());
        assert_eq!(through.absorbed(), effect.absorbed());
        let Some(shape) = grid.last() else { continue };
        assert_eq!(through.link(shape), effect.link(shape));
        let count = effect.amplitudes_at(shape).len();
        let (sizes, known) = (vec![0.3; count], DMatrix::identity(count + 20, count + 20));
        assert_eq!(through.amplitudes_at(shape), effect.amplitudes_at(shape));
        assert_eq!(through.columns(&any, shape), effect.columns(&own, shape));
        assert_eq!(
            through.columns(&beneath.0, shape),
            effect.columns(&beneath.1, shape)
        );
        assert_eq!(
            through.relatives(&any, shape),
            effect.relatives(&own, shape)
        );
        assert_eq!(through.open(&any, shape), effect.open(&own, shape));
        assert_eq!(through.limit(&any, shape), effect.limit(&own, shape));
        assert_eq!(through.cycles(&any, shape), effect.cycles(&own, shape));
        assert_eq!(through.allowed(&any, shape), effect.allowed(&own, shape));
        assert_eq!(
            through.possible(&any, shape, &sizes),
            effect.possible(&own, shape, &sizes)
        );
        assert_eq!(
            through.settled(shape, &sizes),
            effect.settled(shape, &sizes)
        );
        assert_eq!(through.moments(&any, shape), effect.moments(&own, shape));
        assert_eq!(
            through.variant_name(&any, shape),
            effect.variant_name(&own, shape)
        );
        // By their words, as an uncertainty that is not known equals nothing.
        let told = |estimates: Vec<Estimate>| format!("{estimates:?}");
        assert_eq!(
            told(through.estimates(shape, &sizes, &known)),
            told(effect.estimates(shape, &sizes, &known))
        );
        let carried = effect.carried(&own, &own, shape, &sizes);
        assert_eq!(through.carried(&any, &any, shape, &sizes), carried);
        let own_changed = effect.changed(&own, shape, 1);
        assert_eq!(through.changed(&any, shape, 1), own_changed);
        let left = || Some(other.clone());
        let traced = effect.traced(&own, &left, shape);
        assert_eq!(through.traced(&any, &left, shape), traced);
        let followed = traced.as_ref().unwrap_or(shape);
        assert_eq!(through.choices(followed), effect.choices(followed));
        assert_eq!(through.open(&any, followed), effect.open(&own, followed));
        let restored = effect.restored(&own, followed, &other, own.observed());
        assert_eq!(
            through.restored(&any, followed, &other, own.observed()),
            restored
        );
    }
}
