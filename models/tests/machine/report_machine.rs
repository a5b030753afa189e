//! The machine of NISTIR 6868 from its coefficients and variances.
#![allow(dead_code, reason = "each test file uses a part")]

use super::fixtures::table;
use errsep_models::machine::features::{Circle, Squareness};
use errsep_models::machine::{
    Axis, Chain, ComponentError, ErrorFunction, LineSummary, Machine, Observation, Position, Sense,
    fit_component,
};

pub const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Readings a component: ten at each of eight stations.
pub const READINGS: usize = 80;

/// Table 1, from seconds of arc.
pub fn angle() -> ComponentError {
    let readings: Vec<Observation> = table("table1_xy_angular_error.csv")
        .iter()
        .map(|row| Observation {
            position: 0.0,
            value: row.number("error_arcsec") * ARCSEC,
            repeat: 0,
        })
        .collect();
    fit_component("C0Y".parse().unwrap(), &readings, 0).unwrap()
}

/// Table 2 with the variances recovered from Tables A1 to A3, and the angle of Table 2.
pub fn machine() -> Machine {
    let recovered = table("variance_components_recovered.csv");
    let constant = |name: &str, column: &str| {
        let row = recovered
            .iter()
            .find(|row| row.text("component").starts_with(name))
            .unwrap();
        row.text(column)
            .split(' ')
            .next()
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    let coefficients = table("table2_coefficients.csv");
    let mut errors = Vec::new();
    for (iso, symbol, station) in [
        ("EXX", "delta_x(x)", "station mean x"),
        ("EYX", "delta_y(x)", "station mean x"),
        ("EYY", "delta_y(y)", "station mean y"),
        ("EXY", "delta_x(y)", "station mean y"),
        ("ECX", "eps_z(x)", "station mean x"),
        ("ECY", "eps_z(y)", "station mean y"),
    ] {
        let row = coefficients
            .iter()
            .find(|row| row.text("component") == symbol)
            .unwrap();
        let (unit, residual_std) = if symbol.starts_with("delta") {
            (1e3, constant(symbol, "sigma2").sqrt())
        } else if symbol == "eps_z(y)" {
            // The consistent factor of the angle is 6/5, which goes with the second figure.
            (1.0, 2.578e-4_f64.sqrt() * 1e-3)
        } else {
            (1.0, constant(symbol, "sigma2").sqrt() * 1e-3)
        };
        let line = LineSummary {
            residual_std,
            observations: READINGS,
            mean_position: constant(station, "sigma"),
            sum_of_squares: constant("Sxx", "sigma"),
        };
        let component = iso.parse().unwrap();
        errors.push(ComponentError {
            component,
            function: ErrorFunction::polynomial(vec![
                row.number("intercept") * unit,
                row.number("slope") * unit,
            ]),
            spread: line.spread(component).unwrap(),
        });
    }
    let printed = coefficients
        .iter()
        .find(|row| row.text("component") == "alpha_xy")
        .unwrap();
    let function = ErrorFunction::constant(printed.number("intercept"));
    errors.push(ComponentError {
        function,
        ..angle()
    });
    Machine::new(Chain::parse("XYFZ").unwrap(), Sense::Work, errors).unwrap()
}

/// The points of Tables A1, A2 and A3, exact where the print is rounded.
pub fn nominal_points() -> Vec<(&'static str, &'static str, Vec<Position>)> {
    let circle = |radius| {
        let centre = Position::new(75.0, 75.0, 0.0);
        let circle = Circle::new([Axis::X, Axis::Y], centre, radius, 36).unwrap();
        circle.points().to_vec()
    };
    let holes = table("tableA1_holes.csv")
        .iter()
        .map(|row| Position::new(row.number("x_mm"), row.number("y_mm"), 0.0))
        .collect();
    vec![
        ("tableA1_holes.csv", "tableA4_holes_intervals.csv", holes),
        (
            "tableA2_inner.csv",
            "tableA5_inner_intervals.csv",
            circle(44.5),
        ),
        (
            "tableA3_outer.csv",
            "tableA6_outer_intervals.csv",
            circle(55.5),
        ),
    ]
}
pub fn hole(number: &str) -> Position {
    let row = table("tableA1_holes.csv")
        .into_iter()
        .find(|r| r.text("hole") == number)
        .unwrap();
    Position::new(row.number("x_mm"), row.number("y_mm"), 0.0)
}

pub fn rows_of_holes() -> Squareness {
    let row = |numbers: [&str; 7]| numbers.map(hole).to_vec();
    Squareness::new(
        [Axis::X, Axis::Y],
        row(["3", "26", "25", "24", "23", "22", "21"]),
        row(["3", "4", "5", "6", "7", "8", "9"]),
    )
    .unwrap()
}

pub fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found} is not {expected} within {tolerance}"
    );
}
