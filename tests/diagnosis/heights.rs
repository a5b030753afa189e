//! Repeats whose indicator was set to zero anew before each of them.

use crate::scene::{diagnosed, scene};
use errsep::diagnosis::Kind;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::Injection;
use errsep_models::reversal::{Channel, Direction, Observations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Up to so far from zero, µm.
const ZEROED: f64 = 5.0;

/// The readings with each repeat at a height of its own; `by_pass`: both directions of it at two.
fn zeroed_anew(mut observations: Observations, seed: u64, by_pass: bool) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut heights = std::collections::HashMap::new();
    for reading in &mut observations.readings {
        let back = by_pass && reading.direction == Direction::Backward;
        let key = (reading.channel, reading.repeat, back);
        let height = heights
            .entry(key)
            .or_insert_with(|| random.random_range(-ZEROED..ZEROED));
        reading.value += *height;
    }
    observations
}

fn levelled(observations: &Observations) -> Option<f64> {
    let model = Linearised::new(observations, Assumptions::default());
    model.unwrap().levelled_um
}

/// What is there is named as if the zeros had been kept, and the gap is told in the noise of readings.
#[test]
fn causes_are_named_beside_zeros_set_anew() {
    let mut truth = scene(101, 3e-5);
    let dirt = Injection::LocalContamination {
        height: 1.0,
        channel: Channel::C1B,
        repeat: Some(2),
        position: 0.4 * truth.travel(),
        width: 0.03 * truth.travel(),
    };
    let drift = Injection::ThermalDrift {
        drift: 1.0,
        constant: 0.3 * truth.duration(),
        alike: true,
    };
    let cases = [
        ("taper", Injection::Taper(2e-6)),
        ("local-contamination", dirt),
        ("thermal-drift", drift),
    ];
    for (k, (name, injection)) in cases.into_iter().enumerate() {
        truth.effects = vec![injection];
        let readings = zeroed_anew(truth.measured(1 + k as u64), 1 + k as u64, k > 0);
        let verdict = diagnosed(&readings, &[]);
        assert_eq!(verdict.verdict.kind, Kind::Effect, "{name}");
        assert_eq!(verdict.verdict.effects, [name]);
        // k·u: 480 readings of each channel, less what is fitted, tell the noise to some 3 %; a drift counts as noise in part.
        let noise = verdict.gap.noise;
        assert!(noise > 0.0425 && noise < 0.1, "{name}: {noise}");
    }
    truth.effects.clear();
    let readings = zeroed_anew(truth.measured(9), 17, true);
    assert_eq!(diagnosed(&readings, &[]).verdict.kind, Kind::None);
    assert!(levelled(&readings).is_some_and(|h| h > 0.5 * ZEROED));
}

/// Heights that tell of something are left to it: a drift from repeat to repeat, a jump that stays, a lost motion.
#[test]
fn heights_with_a_cause_stay() {
    let mut truth = scene(22, 3e-5);
    let duration = truth.duration();
    let causes = [
        Injection::ThermalDrift {
            drift: 8.0,
            constant: duration,
            alike: false,
        },
        Injection::ZeroJump {
            jump: 3.0,
            channel: Channel::C2B,
            time: 0.7 * duration,
        },
        Injection::AxisBacklash(1.0),
    ];
    for (k, cause) in causes.into_iter().enumerate() {
        truth.effects = vec![cause];
        assert_eq!(levelled(&truth.measured(k as u64)), None, "{k}");
    }
    truth.effects.clear();
    let mut readings = truth.measured(5);
    assert_eq!(levelled(&readings), None);
    for reading in &mut readings.readings {
        if reading.direction == Direction::Backward {
            reading.value += 2.0;
        }
    }
    assert_eq!(levelled(&readings), None);
}

/// One pass each way, every zero set anew: the heights of the passes are unknowns.
#[test]
fn one_pass_each_way_that_is_zeroed_anew_is_no_gap() {
    let mut truth = scene(101, 3e-5);
    let once = |readings: Observations| Observations {
        readings: (readings.readings.into_iter())
            .filter(|r| r.repeat == 1)
            .collect(),
    };
    let readings = zeroed_anew(once(truth.measured(1)), 5, true);
    assert!(levelled(&readings).is_some());
    assert_eq!(diagnosed(&readings, &[]).verdict.kind, Kind::None);
    truth.effects = vec![Injection::Taper(2e-6)];
    let verdict = diagnosed(&zeroed_anew(once(truth.measured(2)), 6, true), &[]);
    assert_eq!(verdict.verdict.effects, ["taper"]);
    // A play of the indicators lifts both channels of each alike, and stays a cause.
    truth.effects = vec![Injection::Hysteresis(1.0)];
    assert_eq!(levelled(&once(truth.measured(3))), None);
}
