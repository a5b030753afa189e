//! Uncertainties of the figures, and where there are none.

use errsep_models::positioning::{
    Figure, Influences, NoUncertainty, PositioningSimulation, Reading, analyse, simulate,
};

use super::{expanded, steep};

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
