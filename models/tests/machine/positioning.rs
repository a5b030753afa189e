//! Figures of positioning tests, their uncertainties, and what readings cannot tell.

use errsep_models::positioning::{
    Direction, Drift, Figure, Influences, NoUncertainty, PositioningError, PositioningSimulation,
    Reading, analyse, simulate,
};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn reading(target: f64, run: u32, direction: Direction, deviation: f64) -> Reading {
    Reading {
        target,
        run,
        direction,
        deviation,
        time: None,
    }
}

/// Three targets, two runs: means and standard deviations by hand.
fn small() -> Vec<Reading> {
    use Direction::{Backward, Forward};
    let root = std::f64::consts::FRAC_1_SQRT_2;
    // Half a difference d of two readings is a standard deviation of d/√2.
    [
        (0.0, Forward, 1.0, 0.5),
        (10.0, Forward, 4.0, 1.0),
        (20.0, Forward, -2.0, 0.25),
        (0.0, Backward, 2.0, 0.5),
        (10.0, Backward, 1.0, 0.5),
        (20.0, Backward, -1.0, 1.5),
    ]
    .into_iter()
    .flat_map(|(target, direction, mean, std)| {
        [(1, root * std), (2, -root * std)]
            .map(|(run, off)| reading(target, run, direction, mean + off))
    })
    .collect()
}

#[test]
fn figures_by_hand() {
    let found = analyse(&small(), &Influences::default(), 1).unwrap();
    // Tolerance: epsilons, on numbers below 20.
    for (figure, expected) in [
        (Figure::AForward, 6.0 - (-2.5)),
        (Figure::ABackward, 3.0 - (-4.0)),
        (Figure::A, 6.0 - (-4.0)),
        (Figure::EForward, 6.0),
        (Figure::EBackward, 3.0),
        (Figure::E, 6.0),
        (Figure::M, 4.0),
        (Figure::RForward, 4.0),
        (Figure::RBackward, 6.0),
        // The greatest of 2 + 1, 3 + 3 and 3.5 + 1, against 4 and 6 in one direction.
        (Figure::R, 6.0),
        (Figure::B, 3.0),
        (Figure::BMean, (-1.0 + 3.0 - 1.0) / 3.0),
        (Figure::U, 3.0),
        (Figure::UMean, 5.0 / 3.0),
        (Figure::Pa, 4.0),
        (Figure::Ps, 6.0 * 0.875),
        (Figure::PsMean, 6.0 * (0.5 + 0.75 + 0.875) / 3.0),
        // 2.5 + 1.5 + 2.25 less −1.5 − 0.5 − 2.625.
        (Figure::P, 6.25 + 4.625),
    ] {
        let value = found.value(figure).unwrap();
        assert!(
            (value - expected).abs() < 1e-13,
            "{figure:?}: {value} for {expected}"
        );
    }
}

/// The fixture's figures come from another program; its readings are in mm.
#[test]
fn figures_of_another_program() {
    let rows = include_str!("../../../fixtures/positioning/readings.csv")
        .lines()
        .skip(1);
    let readings: Vec<Reading> = rows
        .map(|line| {
            let f: Vec<&str> = line.split(',').collect();
            let (target, position): (f64, f64) = (f[0].parse().unwrap(), f[3].parse().unwrap());
            let direction = Direction::from_name(f[2]).unwrap();
            reading(
                target,
                f[1].parse().unwrap(),
                direction,
                1e3 * (position - target),
            )
        })
        .collect();
    let found = analyse(&readings, &Influences::default(), 1).unwrap();
    let expected = include_str!("../../../fixtures/positioning/expected.csv")
        .lines()
        .skip(1);
    let mut count = 0;
    for line in expected {
        let (key, value) = line.split_once(',').unwrap();
        let figure = Figure::all().find(|f| f.key() == key).unwrap();
        let (value, found): (f64, f64) = (value.parse().unwrap(), found.value(figure).unwrap());
        // Tolerance: other tool, half a unit of the last digit written.
        assert!((found - value).abs() < 5.1e-7, "{key}: {found} for {value}");
        count += 1;
    }
    assert_eq!(count, Figure::COUNT);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    /// Adding a constant, turning the axis round and changing the unit change what they must.
    #[test]
    fn figures_follow_the_axis(seed in 0u64..1000, shift in -50.0..50.0f64, scale in 0.1..10.0f64) {
        let what = PositioningSimulation { targets: 4, runs: 3, ..PositioningSimulation::default() };
        let readings = simulate(&what, seed).unwrap();
        let values = |readings: &[Reading]| {
            analyse(readings, &Influences::default(), 1).unwrap().values
        };
        let own = values(&readings);
        let moved: Vec<Reading> = readings
            .iter()
            .map(|r| Reading { deviation: scale * (r.deviation + shift), ..*r })
            .collect();
        let turned: Vec<Reading> = readings
            .iter()
            .map(|r| Reading {
                target: -r.target,
                deviation: -r.deviation,
                direction: match r.direction {
                    Direction::Forward => Direction::Backward,
                    Direction::Backward => Direction::Forward,
                },
                ..*r
            })
            .collect();
        let (moved, turned) = (values(&moved), values(&turned));
        let partner = |figure| match figure {
            Figure::AForward => Figure::ABackward,
            Figure::ABackward => Figure::AForward,
            Figure::EForward => Figure::EBackward,
            Figure::EBackward => Figure::EForward,
            Figure::RForward => Figure::RBackward,
            Figure::RBackward => Figure::RForward,
            other => other,
        };
        for (figure, value) in own.iter() {
            // Tolerance: epsilons, sums of numbers up to 1000.
            let other = moved.get(figure).unwrap();
            prop_assert!((other - scale * value).abs() < 1e-11, "{:?}: {} {}", figure, other, value);
            let other = turned.get(partner(figure)).unwrap();
            prop_assert!((other - value).abs() < 1e-12, "{:?}: {} {}", figure, other, value);
        }
    }
}

fn expanded(readings: &[Reading], influences: &Influences, figure: Figure) -> f64 {
    let found = analyse(readings, influences, 7).unwrap();
    found.uncertainty(figure).unwrap().unwrap()
}

/// Steep enough that first and last target are the extremes whatever the noise.
fn steep(runs: u32, noise: f64) -> Vec<Reading> {
    let what = PositioningSimulation {
        targets: 6,
        runs,
        gain: 1000.0,
        periodic: 0.0,
        noise,
        ..PositioningSimulation::default()
    };
    simulate(&what, 5).unwrap()
}

/// Where the extremes are clear, a range is a difference of two means: Student's t.
#[test]
fn a_clear_range_has_students_uncertainty() {
    let readings = steep(5, 0.5);
    let found = analyse(&readings, &Influences::default(), 7).unwrap();
    let scatter = found.scatter.unwrap();
    assert_eq!(scatter.degrees_of_freedom, 48);
    // t(0.975, 48) = 2.01063.
    let of_difference = 2.01063 * scatter.std * (2.0_f64 / 5.0).sqrt();
    // Tolerance: truncation, four standard deviations of a 95 % point of 10 000 trials (1.1 % each).
    for figure in [Figure::EForward, Figure::EBackward] {
        let ratio = expanded(&readings, &Influences::default(), figure) / of_difference;
        assert!((ratio - 1.0).abs() < 0.044, "{figure:?}: {ratio}");
    }
    // The mean of both directions halves the variance; B̄ is a mean over six targets.
    let ratio = expanded(&readings, &Influences::default(), Figure::M) / of_difference;
    assert!((ratio - 0.5_f64.sqrt()).abs() < 0.032, "{ratio}");
    let ratio = expanded(&readings, &Influences::default(), Figure::BMean) / of_difference;
    assert!((ratio - (1.0_f64 / 6.0).sqrt()).abs() < 0.018, "{ratio}");
}

/// What is in proportion to length reaches E, M and A of a steep axis whole, reversal and repeatability
/// not at all; a drift that all runs share reaches E whole and M by 1/√2.
#[test]
fn influences_reach_the_figures_they_must() {
    let readings = steep(5, 1e-4);
    let of_length = Influences {
        device: 2.0,
        misalignment: 1.0,
        expansion: 2.0,
        drift: 0.0,
    };
    // 1.96 standard uncertainties of √(2² + 1² + 2²)/2; tolerance: truncation as above.
    for figure in [Figure::A, Figure::EForward, Figure::M, Figure::P] {
        let ratio = expanded(&readings, &of_length, figure) / (1.95996 * 1.5);
        assert!((ratio - 1.0).abs() < 0.044, "{figure:?}: {ratio}");
    }
    for figure in [
        Figure::B,
        Figure::BMean,
        Figure::R,
        Figure::RForward,
        Figure::Ps,
    ] {
        let u = expanded(&readings, &of_length, figure);
        assert!(u < 1e-3, "{figure:?}: {u}");
    }
    let drift = Influences {
        drift: 3.0,
        ..Influences::default()
    };
    for (figure, share) in [
        (Figure::EForward, 1.0),
        (Figure::M, 0.5_f64.sqrt()),
        (Figure::BMean, (1.0_f64 / 6.0).sqrt()),
    ] {
        let ratio = expanded(&readings, &drift, figure) / (1.95996 * 1.5 * share);
        assert!((ratio - 1.0).abs() < 0.044, "{figure:?}: {ratio}");
    }
    assert!(expanded(&readings, &drift, Figure::RForward) < 1e-3);
}

/// Kind: k·u. Of 80 tests 95 % hold the truth; fewer than 85 % happen about once in a thousand.
#[test]
fn intervals_hold_the_truth() {
    let what = PositioningSimulation {
        targets: 6,
        ..PositioningSimulation::default()
    };
    let truth = what.truth().values;
    let sets = 80;
    let mut inside = [0; Figure::COUNT];
    for seed in 0..sets {
        let found = analyse(
            &simulate(&what, seed).unwrap(),
            &Influences::default(),
            seed,
        )
        .unwrap();
        for (count, (figure, truth)) in inside.iter_mut().zip(truth.iter()) {
            let error = (found.value(figure).unwrap() - truth).abs();
            // A figure without an uncertainty claims nothing.
            *count += u64::from(
                found
                    .uncertainty(figure)
                    .unwrap()
                    .is_none_or_ok(|u| error <= u),
            );
        }
    }
    for (count, figure) in inside.iter().zip(Figure::all()) {
        let share = *count as f64 / sets as f64;
        assert!(share > 0.85, "{figure:?}: {share}");
    }
}

trait NoneOrOk {
    fn is_none_or_ok(&self, holds: impl Fn(f64) -> bool) -> bool;
}

impl NoneOrOk for Result<f64, NoUncertainty> {
    fn is_none_or_ok(&self, holds: impl Fn(f64) -> bool) -> bool {
        self.map_or(true, holds)
    }
}

fn reasons(readings: &[Reading]) -> Vec<(Figure, NoUncertainty)> {
    let found = analyse(readings, &Influences::default(), 1).unwrap();
    let withheld = found
        .uncertainties
        .iter()
        .filter_map(|(f, u)| Some((*f, u.err()?)));
    withheld.collect()
}

#[test]
fn what_cannot_be_known_has_no_uncertainty() {
    let what = PositioningSimulation::default();
    assert!(reasons(&simulate(&what, 3).unwrap()).is_empty());

    let one = simulate(
        &PositioningSimulation {
            runs: 1,
            ..what.clone()
        },
        3,
    )
    .unwrap();
    let found = analyse(&one, &Influences::default(), 1).unwrap();
    assert!(found.value(Figure::A).is_none() && found.value(Figure::R).is_none());
    assert!(found.value(Figure::E).is_some() && found.value(Figure::B).is_some());
    assert!(
        reasons(&one)
            .iter()
            .all(|(_, why)| *why == NoUncertainty::OneRun)
    );
    assert_eq!(reasons(&one).len(), 9);

    let equal = simulate(
        &PositioningSimulation {
            noise: 0.0,
            ..what.clone()
        },
        3,
    )
    .unwrap();
    assert!(
        reasons(&equal)
            .iter()
            .all(|(_, why)| *why == NoUncertainty::NoScatter)
    );

    // Five times the scatter at one target in four.
    let mut uneven = simulate(&what, 3).unwrap();
    let truth = what.truth();
    for r in &mut uneven {
        let i = truth.targets.iter().position(|t| *t == r.target).unwrap();
        if i % 4 == 3 {
            let mean = truth.profile.means(r.direction).unwrap()[i];
            r.deviation = mean + 8.0 * (r.deviation - mean);
        }
    }
    let withheld = reasons(&uneven);
    assert!(
        withheld
            .iter()
            .all(|(f, why)| f.rests_on_scatter() && *why == NoUncertainty::ScatterDiffers)
    );
    assert_eq!(withheld.len(), 9);

    // A shift of each run.
    let mut shifted = simulate(&what, 3).unwrap();
    for r in &mut shifted {
        r.time = None;
        r.deviation += [0.0, 1.5, -0.7, 0.4, -1.2][r.run as usize - 1];
    }
    let withheld = reasons(&shifted);
    assert!(
        withheld
            .iter()
            .all(|(f, why)| f.rests_on_scatter() && *why == NoUncertainty::RunsDiffer)
    );
    assert_eq!(withheld.len(), 9);

    // A drift that the times show.
    let drifting = PositioningSimulation {
        drift: 20.0,
        ..what
    };
    let withheld = reasons(&simulate(&drifting, 3).unwrap());
    assert!(
        withheld
            .iter()
            .all(|(_, why)| *why == NoUncertainty::Drifts)
    );
    assert_eq!(withheld.len(), 11);
    let figures: Vec<Figure> = withheld.iter().map(|(f, _)| *f).collect();
    assert!(figures.contains(&Figure::BMean) && !figures.contains(&Figure::E));
}

/// A shift that a run has at all targets is no uncertainty of a range: exact limit.
#[test]
fn a_shift_of_each_run_leaves_ranges_alone() {
    let mut readings = steep(4, 0.5);
    let with = |readings: &[Reading]| expanded(readings, &Influences::default(), Figure::EForward);
    for r in &mut readings {
        r.deviation += [0.0, 30.0, -20.0, 10.0][r.run as usize - 1];
    }
    let once = with(&readings);
    for r in &mut readings {
        r.deviation += [0.0, 300.0, -200.0, 100.0][r.run as usize - 1];
    }
    // Tolerance: epsilons of shifts of 300 in sums of some hundred products.
    assert!((with(&readings) / once - 1.0).abs() < 1e-9);
}

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

#[test]
fn a_test_that_is_not_whole_is_refused() {
    let refused = |readings: &[Reading]| analyse(readings, &Influences::default(), 1).unwrap_err();
    assert_eq!(refused(&[]), PositioningError::Empty);
    let good = small();
    assert_eq!(
        refused(&good[..2]),
        PositioningError::OneTarget { target: 0.0 }
    );
    let mut twice = good.clone();
    twice.push(good[3]);
    assert!(matches!(
        refused(&twice),
        PositioningError::Duplicate {
            reading: 12,
            first: 3,
            run: 2,
            ..
        }
    ));
    assert!(matches!(
        refused(&good[..11]),
        PositioningError::UnequalRuns {
            reading: 10,
            run: 2,
            direction: Direction::Backward,
            ..
        }
    ));
    assert!(matches!(
        refused(&good[..10]),
        PositioningError::MissingDirection {
            reading: 4,
            direction: Direction::Backward,
            ..
        }
    ));
    let mut nan = good.clone();
    nan[5].deviation = f64::NAN;
    assert_eq!(refused(&nan), PositioningError::NotFinite { reading: 5 });
    nan[5].deviation = 1e300;
    assert_eq!(refused(&nan), PositioningError::TooLarge);
    // One direction everywhere is a test of its own.
    let found = analyse(&good[..6], &Influences::default(), 1).unwrap();
    assert!(found.value(Figure::AForward).is_some());
    assert!(found.value(Figure::A).is_none() && found.value(Figure::M).is_none());
}
