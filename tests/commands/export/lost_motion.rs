//! Lost motion: a firmware that moves its motor further on each change of direction leaves no mean reversal.

use errsep::export::{AxisErrors, Content, Grid, Request, Unit};
use proptest::prelude::*;

use super::export;

/// The motor of one axis under `M425`: the number behind the letter of the axis, added once the direction changes
/// to plus and taken away once it changes to minus.
fn motor(text: &str, letter: char, moves: &[f64]) -> Vec<f64> {
    let words = text.lines().filter(|line| line.starts_with("M425"));
    let distances: Vec<f64> = words
        .flat_map(|line| line.split_whitespace().skip(1))
        .filter_map(|word| word.strip_prefix(letter))
        .map(|number| number.parse().unwrap())
        .collect();
    let [distance] = distances[..] else {
        panic!("{text}")
    };
    assert!(distance >= 0.0, "{text}");
    let (mut offset, mut forward, mut at) = (0.0, true, f64::NEG_INFINITY);
    let mut stood = Vec::new();
    for target in moves {
        if (*target > at) != forward {
            forward = !forward;
            offset += if forward { distance } else { -distance };
        }
        at = *target;
        stood.push(target + offset);
    }
    stood
}

fn axis(cells: &[(f64, f64)], lost: f64) -> AxisErrors {
    AxisErrors {
        name: Some("Y".to_owned()),
        rotary: false,
        positions: (0..cells.len()).map(|k| 25.0 * k as f64).collect(),
        forward: cells.iter().map(|c| c.0 - lost).collect(),
        backward: cells.iter().map(|c| c.1).collect(),
        both: true,
        known: None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_mean_reversal_goes(
        cells in prop::collection::vec((-5e-3..5e-3f64, -5e-3..5e-3f64), 2..30),
        lost in 0.011..0.3f64,
        marlin in any::<bool>(),
    ) {
        let axis = axis(&cells, lost);
        let format = if marlin { "marlin-backlash" } else { "reprapfirmware-backlash" };
        let out = export(format, &Content::Positioning(axis.clone()), &Request::default()).unwrap();
        let n = axis.positions.len();
        let there: Vec<f64> = axis.positions.iter().copied().chain([f64::MAX]).collect();
        let back = axis.positions.iter().rev().copied();
        let stood = motor(&out.text, 'Y', &there.into_iter().chain(back).collect::<Vec<_>>());
        let reversal: f64 = (0..n)
            .map(|k| {
                let forward = stood[k] + axis.forward[k];
                let backward = stood[2 * n - k] + axis.backward[k];
                forward - backward
            })
            .sum::<f64>() / n as f64;
        // Half of the fifth decimal of mm, and rounding of positions of up to a metre.
        prop_assert!(reversal.abs() <= 0.5e-5 + 1e-12, "{} {}", reversal, out.text);
        prop_assert!(out.rounding.0 <= 0.5e-5 + 1e-15);
        prop_assert_eq!(out.axis.as_deref(), Some("Y"));
    }
}

#[test]
fn what_m425_cannot_correct_is_refused() {
    let good = axis(&[(0.0, 0.0), (1e-3, 0.0)], 0.02);
    let of = |errors: AxisErrors, request: Request| {
        let message =
            export("marlin-backlash", &Content::Positioning(errors), &request).unwrap_err();
        message.to_string()
    };
    let plain = Request::default;
    let one = AxisErrors {
        both: false,
        ..good.clone()
    };
    assert!(of(one, plain()).contains("one direction"));
    let turns = AxisErrors {
        rotary: true,
        ..good.clone()
    };
    assert!(of(turns, plain()).contains("this axis turns"));
    let ahead = AxisErrors {
        forward: good.backward.clone(),
        backward: good.forward.clone(),
        ..good.clone()
    };
    assert!(of(ahead, plain()).contains("further forward than backward"));
    let named = AxisErrors {
        name: Some("table".to_owned()),
        ..good.clone()
    };
    assert!(of(named, plain()).contains("letter of the axis"));
    let inch = Request {
        unit: Some(Unit::Inch),
        ..plain()
    };
    assert!(of(good.clone(), inch).contains("--unit"));
    let even = Request {
        grid: Some(Grid::Points(3)),
        ..plain()
    };
    assert!(of(good.clone(), even).contains("--points"));
    let other = Request {
        axis: Some("z".to_owned()),
        ..plain()
    };
    let out = export("marlin-backlash", &Content::Positioning(good), &other).unwrap();
    assert_eq!(out.text, "M425 Z0.01950\nM425 F1\nM500\n");
}
