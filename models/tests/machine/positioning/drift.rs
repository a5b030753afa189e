//! Drift of the deviations over time.

use errsep_models::positioning::{
    Drift, Figure, Influences, NoUncertainty, PositioningSimulation, analyse, simulate,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::small;

#[test]
fn drift_is_found_beside_any_profile() {
    let what = PositioningSimulation {
        noise: 0.0,
        drift: 3.6,
        ..PositioningSimulation::default()
    };
    let drift = Drift::of(&simulate(&what, 1).unwrap()).unwrap();
    // Tolerance: epsilons of deviations up to 12 over times up to 1090 s.
    assert!((drift.rate - 1e-3).abs() < 1e-13, "{}", drift.rate);
    assert_eq!(drift.degrees_of_freedom, 5 - 2);
    assert_eq!(drift.duration, 1090.0);
    // Kind: k·u. Over 400 seeds, the share within one standard uncertainty; ± 4 standard deviations of it.
    let what = PositioningSimulation { noise: 0.5, ..what };
    let inside = (0..400)
        .filter(|seed| {
            let d = Drift::of(&simulate(&what, *seed).unwrap()).unwrap();
            (d.rate - 1e-3).abs() < d.std
        })
        .count();
    // Student's law with three degrees of freedom has 60.9 % there.
    assert!((205..=283).contains(&inside), "{inside}");
    // One run, or no times, tell none.
    let one = simulate(
        &PositioningSimulation {
            runs: 1,
            ..what.clone()
        },
        1,
    )
    .unwrap();
    assert_eq!(Drift::of(&one), None);
    assert_eq!(Drift::of(&small()), None);
}

/// Runs that were each zeroed anew, by 3 µm beside a noise of 1 µm: no drift, and an interval of the rate that
/// holds none. Of 200 tests 95 % ± 4 standard deviations.
#[test]
fn runs_zeroed_anew_are_no_drift() {
    let (mut held, mut shown) = (0, 0);
    for seed in 0..200 {
        let what = PositioningSimulation {
            noise: 1.0,
            ..PositioningSimulation::default()
        };
        let mut readings = simulate(&what, seed).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let zeros: Vec<f64> = (0..5).map(|_| StandardNormal.sample(&mut random)).collect();
        for r in &mut readings {
            r.deviation += 3.0 * zeros[r.run as usize - 1];
        }
        let found = analyse(&readings, &Influences::default(), 1).unwrap();
        let drift = found.drift.unwrap();
        held += usize::from(drift.rate.abs() < 3.182 * drift.std);
        shown += usize::from(drift.shows());
        let why = found.uncertainty(Figure::RForward).unwrap().unwrap_err();
        assert!(matches!(
            why,
            NoUncertainty::RunsDiffer | NoUncertainty::Drifts
        ));
    }
    assert!((178..=200).contains(&held) && shown <= 8, "{held} {shown}");
}
