//! Propagation of distributions: Tables 6 to 8, the law of propagation, Student's distribution.

use crate::fixtures::table;
use crate::report_machine::{ARCSEC, machine, near, rows_of_holes};
use errsep_models::machine::features::{Circle, circularity_of};
use errsep_models::machine::{
    Axis, Chain, ComponentError, ErrorFunction, Independence, Machine, PolynomialBasis, Position,
    Prediction, Sampler, Sense, Spread, propagate, sample_features,
};
use errsep_models::uncertainty::{DegreesOfFreedom, Sample, coverage_factor};
use nalgebra::DMatrix;

fn sample_squareness(trials: usize, independence: Independence) -> Sample {
    let machine = machine();
    let rows = rows_of_holes();
    let sampler = Sampler::new(&machine, &rows.points(), independence, Prediction::Future)
        .unwrap()
        .with_known_spreads();
    sample_features(&sampler, trials, 1, 6868, |d, out| {
        out[0] = rows.angle(d) / ARCSEC
    })
    .unwrap()
    .output(0)
    .unwrap()
}

#[test]
fn table_6_squareness_by_monte_carlo() {
    // Another run of the simulation: 40 000 trials give the mean to 0.055, the deviation to 0.04.
    let sample = sample_squareness(40_000, Independence::Coordinates);
    near("mean", sample.mean(), -5.109, 4.0 * 0.055 + 0.02);
    near("deviation", sample.standard_deviation(), 11.106, 4.0 * 0.04);
    // k·u: the report's 1000 trials give the mean to 0.35 and the deviation to 0.25.
    near("mean", sample.mean(), -4.68, 3.0 * 0.35);
    near("deviation", sample.standard_deviation(), 11.02, 3.0 * 0.25);
}

#[test]
fn sampling_agrees_with_propagation_under_every_independence() {
    let machine = machine();
    let functional = rows_of_holes().functional(&machine).unwrap();
    for independence in [
        Independence::Scatter,
        Independence::Points,
        Independence::Coordinates,
    ] {
        let budget = propagate(&machine, &functional, independence, Prediction::Future).unwrap();
        let u = budget.result.standard_uncertainty / ARCSEC;
        // k·u: 20 000 trials give a standard deviation to 0.5 %.
        let found = sample_squareness(20_000, independence).standard_deviation();
        near("deviation", found, u, 4.0 * 0.005 * u);
    }
}

#[test]
fn tables_7_and_8_circularity() {
    let machine = machine();
    let centre = Position::new(75.0, 75.0, 0.0);
    // Mean and deviation of an independent run of 1e5 trials; printed to 0.1 um; without scatter.
    for (radius, mean, deviation, printed_mean, alone) in [
        (44.5, 17.87, 3.12, 17.9, 1.06),
        (55.5, 18.01, 3.16, 18.0, 1.33),
    ] {
        let circle = Circle::new([Axis::X, Axis::Y], centre, radius, 36).unwrap();
        let points = circle.points().to_vec();
        let future = Prediction::Future;
        let sampler = Sampler::new(&machine, &points, Independence::Coordinates, future).unwrap();
        let sample = sample_features(&sampler, 30_000, 1, 6868, |d, out| {
            out[0] = circularity_of(&circle, d);
        })
        .unwrap()
        .output(0)
        .unwrap();
        // k·u of both runs: 0.018 and 0.010 for the mean, 0.013 and 0.007 for the deviation; half
        // a digit of the reference.
        near("mean", sample.mean(), mean, 3.0 * 0.021 + 0.005);
        near(
            "deviation",
            sample.standard_deviation(),
            deviation,
            3.0 * 0.015 + 0.005,
        );
        // The report has 1000 trials, 0.1 um for the mean, and prints 0.1 um.
        near(
            "printed mean",
            sample.mean(),
            printed_mean,
            3.0 * 0.1 + 0.05,
        );
        near(
            "printed deviation",
            sample.standard_deviation(),
            3.1,
            3.0 * 0.07 + 0.05,
        );
        let certain: Vec<_> = points
            .iter()
            .map(|p| machine.deviation(p).unwrap())
            .collect();
        near(
            "alone",
            circularity_of(&circle, &certain),
            alone,
            0.005 + 0.01,
        );
    }
}

#[test]
fn rounded_coordinates_are_a_trap() {
    // The points as printed, to 0.01 mm, make 20.65 um where the exact ones make 17.87: their
    // rounding alone is 6.9 um, with the errors of the machine 7.6 um.
    let machine = machine();
    let centre = Position::new(75.0, 75.0, 0.0);
    let circle = Circle::new([Axis::X, Axis::Y], centre, 44.5, 36).unwrap();
    let printed: Vec<Position> = table("tableA2_inner.csv")
        .iter()
        .map(|row| Position::new(row.number("x_mm"), row.number("y_mm"), 0.0))
        .collect();
    let offsets: Vec<_> = printed
        .iter()
        .zip(circle.points())
        .map(|(p, exact)| (p - exact) * 1e3)
        .collect();
    let alone = circularity_of(&circle, &offsets);
    near("rounding alone", alone, 6.916, 0.0005);
    let certain: Vec<_> = printed
        .iter()
        .zip(&offsets)
        .map(|(p, o)| machine.deviation(p).unwrap() + o)
        .collect();
    near(
        "rounding and errors",
        circularity_of(&circle, &certain),
        7.57,
        0.005 + 0.01,
    );
    let sampler = Sampler::new(
        &machine,
        &printed,
        Independence::Coordinates,
        Prediction::Future,
    )
    .unwrap();
    let sample = sample_features(&sampler, 20_000, 1, 1, |d, out| {
        let moved: Vec<_> = d.iter().zip(&offsets).map(|(d, o)| d + o).collect();
        out[0] = circularity_of(&circle, &moved);
    });
    let sample = sample.unwrap().output(0).unwrap();
    near("mean", sample.mean(), 20.65, 3.0 * 0.026 + 0.005);
    near(
        "deviation",
        sample.standard_deviation(),
        3.39,
        3.0 * 0.02 + 0.005,
    );
}

/// A machine whose positioning of X is zero with a standard uncertainty of 2 um from ν degrees of
/// freedom, the same everywhere, and a scatter of 1 um about it.
fn one_component(degrees: DegreesOfFreedom) -> Machine {
    let basis = PolynomialBasis {
        centre: 0.0,
        scale: 1.0,
        terms: 1,
    };
    let error = ComponentError {
        component: "EXX".parse().unwrap(),
        function: ErrorFunction::constant(0.0),
        spread: Spread {
            basis,
            covariance: DMatrix::from_element(1, 1, 4.0),
            scatter: 1.0,
            degrees,
        },
    };
    Machine::new(Chain::parse("XYFZ").unwrap(), Sense::Work, vec![error]).unwrap()
}

fn sample_x(machine: &Machine, independence: Independence, trials: usize, known: bool) -> Sample {
    let points = [Position::new(10.0, 0.0, 0.0)];
    let mut sampler = Sampler::new(machine, &points, independence, Prediction::Future).unwrap();
    if known {
        sampler = sampler.with_known_spreads();
    }
    sample_features(&sampler, trials, 1, 101, |d, out| out[0] = d[0].x)
        .unwrap()
        .output(0)
        .unwrap()
}

#[test]
fn few_degrees_of_freedom_draw_from_students_distribution() {
    let trials = 40_000;
    // The component and its scatter rest on one sum of squares: together √5 um of t.
    let u = 5.0_f64.sqrt();
    for independence in [Independence::Scatter, Independence::Points] {
        for nu in [1.0, 3.0, 9.0, 50.0] {
            let degrees = DegreesOfFreedom::Finite(nu);
            let sample = sample_x(&one_component(degrees), independence, trials, false);
            for probability in [0.5, 0.9, 0.95, 0.99] {
                // Share of the trials inside ±k u, k of GUM table G.2: k·u of a binomial share, four.
                let k = coverage_factor(probability, degrees).unwrap();
                let inside = sample.sorted().iter().filter(|v| v.abs() < k * u).count();
                let found = inside as f64 / trials as f64;
                let spread = (probability * (1.0 - probability) / trials as f64).sqrt();
                near(
                    &format!("{independence:?} ν {nu}"),
                    found,
                    probability,
                    4.0 * spread,
                );
            }
        }
        // JCGM 101, 6.4.9.4: the variance is ν/(ν − 2) u². k·u: 40 000 trials, with the excess kurtosis
        // 6/(ν − 4) of t: u(s)/s = √((2 + 6/(ν − 4))/4/n).
        let nine = one_component(DegreesOfFreedom::Finite(9.0));
        let found = sample_x(&nine, independence, trials, false).standard_deviation();
        let wanted = u * (9.0_f64 / 7.0).sqrt();
        let relative = ((2.0 + 6.0 / 5.0) / 4.0 / trials as f64).sqrt();
        near("deviation", found, wanted, 4.0 * relative * wanted);
    }
}

#[test]
fn infinite_degrees_of_freedom_are_normal() {
    // Exact limits: the same draws as with known spreads; and t of a million degrees of freedom has the
    // normal shares.
    let normal = one_component(DegreesOfFreedom::Infinite);
    for independence in [Independence::Scatter, Independence::Points] {
        let one = sample_x(&normal, independence, 2000, false);
        let other = sample_x(&normal, independence, 2000, true);
        assert_eq!(one.sorted(), other.sorted());
        let many = one_component(DegreesOfFreedom::Finite(1e6));
        let sample = sample_x(&many, independence, 40_000, false);
        // k·u: 40 000 trials give a standard deviation to 0.35 %.
        let u = 5.0_f64.sqrt();
        near(
            "deviation",
            sample.standard_deviation(),
            u,
            4.0 * 0.0035 * u,
        );
    }
}

#[test]
fn a_shared_component_shares_its_degrees_of_freedom() {
    // Two points on one component without scatter between them: wherever a trial lies, both points
    // lie; a draw of χ² for each would part them.
    let machine = one_component(DegreesOfFreedom::Finite(2.0));
    let points = [Position::new(10.0, 0.0, 0.0), Position::new(90.0, 0.0, 0.0)];
    let sampler = Sampler::new(&machine, &points, Independence::Scatter, Prediction::Mean).unwrap();
    let trials = sample_features(&sampler, 1000, 1, 7, |d, out| out[0] = d[0].x - d[1].x).unwrap();
    assert!(trials.rows().all(|row| row[0] == 0.0));
}
