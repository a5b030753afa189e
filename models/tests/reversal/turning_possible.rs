//! A turning bar whose inclination across its eccentricity is too small to be seen, in readings by the formula below: what goes
//! with it is as unsure as it is, and the form is as sure as its bands say.

use std::f64::consts::TAU;

use errsep_models::reversal::turning_bar::{
    Plan, Possible, Run, Setting, Survey, TurningReading, analyse,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const TRAVEL: f64 = 260.0;
const TURNS: f64 = 12.0;
const SPAN: f64 = 240.0;
const READINGS: usize = 600;
const NOISE: f64 = 0.5;
/// Along and across the eccentricity of 10 µm, µm over half the travel.
const GAMMA: [f64; 2] = [2.0, 1.5];

/// Slide and bar together; over the travel the line of the cosines is zero.
fn form(part: f64) -> f64 {
    (TAU * part).cos() + 0.25 * (3.0 * TAU * part).cos()
}

fn readings(seed: u64) -> Vec<TurningReading> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start: f64 = StandardNormal.sample(&mut rng);
    (0..READINGS)
        .map(|i| {
            let part = i as f64 / (READINGS - 1) as f64;
            let xi = 2.0 * part - 1.0;
            let (sin, cos) = (-(3.0 * start + TAU * TURNS * part)).sin_cos();
            let bar = (10.0 + GAMMA[0] * xi) * cos + GAMMA[1] * xi * sin;
            let noise: f64 = StandardNormal.sample(&mut rng);
            TurningReading {
                time: Some(SPAN * part),
                x: TRAVEL * part,
                value: form(part) + bar + NOISE * noise,
                spindle: None,
            }
        })
        .collect()
}

#[test]
fn what_goes_with_an_inclination_that_is_not_seen_is_as_unsure() {
    let plan = Plan {
        setting: Setting {
            harmonics: vec![2],
            ..Setting::default()
        },
        ..Plan::default()
    };
    let (mut held, mut of_speed, mut of_inclination, mut of_form) = (0, 0.0, 0.0, 0.0);
    let seeds = 24;
    let places = [0.06, 0.22, 0.37, 0.5, 0.68, 0.83, 0.97];
    for seed in 0..seeds {
        let run = Run::new(&readings(seed)).unwrap();
        let survey = Survey::new(&run, 0.0, 1.0, None).unwrap();
        let analysis = analyse(&run, &survey, &plan).unwrap();
        let possible = Possible::of(&run, &survey, &analysis, &analysis.steady, false);
        held += usize::from(analysis.steady.fit.across_held);
        let square = |told: errsep_models::reversal::turning_bar::Told, truth: f64| {
            ((told.value - truth) / told.std).powi(2)
        };
        of_speed += square(possible.speed(survey.base_hz).unwrap(), TURNS / SPAN);
        let bar = possible.bar().unwrap();
        let inclination = 2e-3 / TRAVEL * GAMMA[0].hypot(GAMMA[1]);
        of_inclination += square(bar.inclination_rad, inclination);
        let x = places.map(|part| TRAVEL * part);
        for (told, part) in possible.form(&x).into_iter().zip(places) {
            of_form += square(told, form(part)) / places.len() as f64;
        }
    }
    let rms = [of_speed, of_inclination, of_form].map(|s| (s / seeds as f64).sqrt());
    println!("{held} held, speed, inclination, form {rms:?}");
    assert!(held > seeds as usize / 2, "{held}");
    // k·u: a root mean square of 24 is known to 0.15; three of them. With γ across taken as zero that of the speed was 10, and
    // without what the cells cut off that of the form 1.7.
    assert!(rms.iter().all(|z| *z < 1.45), "{rms:?}");
}
