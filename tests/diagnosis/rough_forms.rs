//! Sizes on forms that turn as often as they are read: what a form is between its positions is then guessed, and a size
//! that hangs on it is known as badly as it is told.

use errsep::diagnosis::{Options, joined};
use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Form, Injection, Scene, SceneNoise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A thickness that the set-up does not state, mm.
const THICKNESS: f64 = 60.0;

/// The thickness that is told with its standard uncertainty, on forms of so many waves over the travel.
fn told(waves: u32, seed: u64) -> (f64, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = SceneNoise {
        white: 0.05,
        ..SceneNoise::default()
    };
    let mut scene = Scene::random(61, 3, 5e-3, 1.0, noise, &mut random);
    let travel = scene.travel();
    let positions = scene.positions.clone();
    for form in [&mut scene.m, &mut scene.s_a, &mut scene.s_b] {
        *form = Form::random(2.0, travel, waves, &mut random).level(&positions);
    }
    scene.effects.push(Injection::ThicknessShift(THICKNESS));
    let model = Linearised::new(&scene.measured(seed), Assumptions::default()).unwrap();
    let options = Options {
        draws: 100,
        ..Options::default()
    };
    let names = ["thickness-shift".to_owned()];
    let joined = joined(&model, model.effects(), &names, &options).unwrap();
    let size = &joined.effects[0].parameters[0];
    (size.value, size.std)
}

/// *k·u*, eight seeds each of two kinds: within two standard uncertainties in all but two, which the 95 % of a correct
/// one would exceed with 0.6 %; those that are outside are hardly seen at all. On smooth forms nothing is added: the
/// size is known to a seventh (seen: from an eighth to a twelfth).
#[test]
fn a_thickness_on_rough_forms_is_known_as_badly_as_it_is_told() {
    let is_off = |(size, std): &(f64, f64)| (size - THICKNESS).abs() > 2.0 * std;
    for waves in [50, 80] {
        let all: Vec<(f64, f64)> = (0..8).map(|seed| told(waves, seed)).collect();
        let outside = all.iter().filter(|size| is_off(size)).count();
        assert!(outside <= 2, "{waves} waves: {all:?}");
    }
    for seed in 1..4 {
        let size = told(9, seed);
        assert!(!is_off(&size) && size.1 < THICKNESS / 7.0, "{size:?}");
    }
}
