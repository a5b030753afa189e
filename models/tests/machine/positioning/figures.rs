//! Figures, by hand and of another program, and how they follow the axis.

use errsep_models::positioning::{
    Direction, Figure, Influences, PositioningSimulation, Reading, analyse, simulate,
};
use proptest::prelude::*;

use super::{reading, small};

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
    let rows = include_str!("../../../../fixtures/positioning/readings.csv")
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
    let expected = include_str!("../../../../fixtures/positioning/expected.csv")
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
