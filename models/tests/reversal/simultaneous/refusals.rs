//! What is chosen by itself, and what cannot be fitted.

use errsep_models::reversal::simulate::{even_grid, simulate};
use errsep_models::reversal::simultaneous::{Knots, Options, ReversalError, Thickness, fit};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};

use super::plan::*;

#[test]
fn the_number_of_knots_follows_the_forms() {
    let (plan, _) = spline_plan(16, 400, 0.02, 12);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let chosen = Options {
        thickness: Thickness::Known(42.0),
        ..Options::default()
    };
    let solution = fit(&observations, &chosen).unwrap();
    assert!(
        (16..=32).contains(&solution.knots.cells()),
        "{:?}",
        solution.knots.table
    );
    assert!(solution.knots.neighbour_z < 4.0);
    let few = fit(
        &observations,
        &Options {
            knots: Knots::Cells(4),
            ..chosen
        },
    )
    .unwrap();
    assert_eq!(
        few.knots.verdict,
        errsep_models::reversal::simultaneous::KnotVerdict::TooFew
    );
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let reading = |channel, x, value| Reading {
        channel,
        repeat: 1,
        direction: Direction::Forward,
        time: None,
        x,
        value,
    };
    let of = |readings| Observations { readings };
    let plain = Options::default();
    assert_eq!(
        fit(&of(vec![]), &plain).unwrap_err(),
        ReversalError::NoReadings
    );
    let one_place = of((0..30)
        .map(|i| reading(Channel::C1A, 5.0, i as f64))
        .collect());
    assert!(matches!(
        fit(&one_place, &plain),
        Err(ReversalError::OnePosition { channel: "1A", .. })
    ));
    let two = of(vec![
        reading(Channel::C1A, 0.0, 0.0),
        reading(Channel::C1A, 1.0, 0.0),
    ]);
    assert!(matches!(
        fit(&two, &plain),
        Err(ReversalError::TooFewReadings { .. })
    ));
    let nan = of(vec![reading(Channel::C1A, f64::NAN, 0.0)]);
    assert!(matches!(
        fit(&nan, &plain),
        Err(ReversalError::NotUsable { .. })
    ));
    // 60°: 1732 µm on 1 mm.
    let steep = of((0..50)
        .map(|i| reading(Channel::C1A, i as f64, 1_732.0 * i as f64))
        .collect());
    assert!(matches!(
        fit(&steep, &plain),
        Err(ReversalError::TooSteep { channel: "1A", .. })
    ));
    let flat = of((0..50)
        .map(|i| reading(Channel::C1A, i as f64, 0.0))
        .collect());
    let negative = Options {
        thickness: Thickness::Known(-3.0),
        ..Options::default()
    };
    let message = fit(&flat, &negative).unwrap_err().to_string();
    assert!(message.contains("thickness is -3"), "{message}");
    // All zero: nothing to find, but an answer all the same.
    let zero = fit(&flat, &plain).unwrap();
    assert_eq!(zero.tilts()[0].angle.value, 0.0);
    let turned = Options {
        start_tilts_rad: Some(vec![1.0]),
        ..Options::default()
    };
    assert!(matches!(
        fit(&flat, &turned),
        Err(ReversalError::NoStart(_))
    ));
    // Hardly any tilt: the thickness leaves no trace.
    let rough = of((0..50)
        .map(|i| reading(Channel::C1A, i as f64, (i * i % 7) as f64))
        .collect());
    let free = Options {
        thickness: Thickness::Fitted(40.0),
        ..Options::default()
    };
    assert!(matches!(
        fit(&rough, &free),
        Err(ReversalError::ThicknessNotDetermined { std_mm }) if std_mm > 1e3
    ));
    // Too many knots for the readings of one trace.
    let dense = Options {
        knots: Knots::At(even_grid(0.0, 49.0, 200)),
        ..Options::default()
    };
    assert!(matches!(
        fit(&flat, &dense),
        Err(ReversalError::TooFewReadings { .. })
    ));
}
