//! Traces that drift, each by a slope of its own.

use crate::scene::{diagnosed, scene};
use errsep::diagnosis::{Kind, Options, joined};
use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::Injection;
use errsep_models::reversal::{Channel, Direction, Observations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A trace drifts by up to so much from end to end, either way, µm.
const DRIFT: f64 = 0.8;
/// An indicator is set to zero within this before each pass, µm.
const ZERO: f64 = 3.0;

/// The readings with a line added to every trace, from its first reading on.
fn drifting(mut observations: Observations, travel: f64, seed: u64) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut lines = std::collections::HashMap::new();
    for reading in &mut observations.readings {
        let back = reading.direction == Direction::Backward;
        let key = (reading.channel, reading.repeat, back);
        let (zero, drift) = *lines.entry(key).or_insert_with(|| {
            (
                random.random_range(-ZERO..ZERO),
                random.random_range(-DRIFT..DRIFT),
            )
        });
        let gone = if back {
            1.0 - reading.x / travel
        } else {
            reading.x / travel
        };
        reading.value += zero + drift * gone;
    }
    observations
}

/// *Simulated truth*: where nothing else is in the readings nothing is named, and the drifts are told, but where they do not
/// stand out of other laws. k·u: a slope is uniform within ± 0.8 µm a travel, its standard deviation 0.46, which eight
/// contrasts know to a quarter; three of them.
#[test]
fn drifts_of_traces_are_no_cause() {
    let truth = scene(31, 3e-5);
    let travel = truth.travel();
    let mut drifts = Vec::new();
    for seed in 0..6 {
        let readings = drifting(truth.measured(seed), travel, seed);
        let verdict = diagnosed(&readings, &[]);
        assert_eq!(
            verdict.verdict.kind,
            Kind::None,
            "{seed}: {}",
            verdict.verdict.statement
        );
        if verdict
            .notes
            .iter()
            .any(|note| note.contains("drifts by a slope"))
        {
            drifts.push(verdict.noise.drift * travel);
        }
    }
    assert!(drifts.len() >= 4, "{drifts:?}");
    assert!(drifts.iter().all(|d| *d > 0.115 && *d < 0.81), "{drifts:?}");
}

/// *Simulated truth*: what does not go on in time is named beside them; what does is, where traces do not drift.
#[test]
fn causes_are_named_beside_drifts() {
    let mut truth = scene(32, 3e-5);
    let travel = truth.travel();
    let dirt = Injection::LocalContamination {
        height: 1.0,
        channel: Channel::C1B,
        repeat: Some(2),
        position: 0.4 * travel,
        width: 0.03 * travel,
    };
    for (name, injection) in [
        ("local-contamination", dirt),
        ("taper", Injection::Taper(2e-6)),
    ] {
        truth.effects = vec![injection];
        let verdict = diagnosed(&drifting(truth.measured(3), travel, 4), &[]);
        assert_eq!(
            verdict.verdict.effects,
            [name],
            "{}",
            verdict.verdict.statement
        );
    }
}

/// *Simulated truth*, k·u: an effect that is given is known as well as the drifts let it be. Twelve half-angles over their
/// uncertainties have a root mean square of 1, known to 1/√24; three of these.
#[test]
fn a_given_effect_is_as_sure_as_drifts_let_it_be() {
    let half_angle = 2e-6;
    let mut truth = scene(33, 3e-5);
    let travel = truth.travel();
    truth.effects = vec![Injection::Taper(half_angle)];
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    let mut squares = 0.0;
    for seed in 0..12 {
        let readings = drifting(truth.measured(seed), travel, seed);
        let model = Linearised::new(&readings, Assumptions::default()).unwrap();
        let names = ["taper".to_owned()];
        let fit = joined(&model, model.effects(), &names, &options).unwrap();
        let drifts = |note: &String| note.contains("drifts by a slope");
        assert!(fit.notes.iter().any(drifts), "{seed}: {:?}", fit.notes);
        let size = &fit.effects[0].parameters[0];
        squares += ((size.value - half_angle) / size.std).powi(2);
    }
    let rms = (squares / 12.0_f64).sqrt();
    assert!((rms - 1.0).abs() < 3.0 / 24.0_f64.sqrt(), "{rms}");
}
