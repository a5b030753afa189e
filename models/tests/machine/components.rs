//! Regression and tables of single component errors, and what a machine refuses.

use errsep_models::machine::features::{Circle, Squareness, length};
use errsep_models::machine::{
    Axis, COMPONENTS, Chain, Characterization, Component, ComponentError, ErrorFunction,
    Independence, Kind, LineSummary, Machine, MachineError, Observation, Position, Prediction,
    RegressionError, Sampler, Sense, Spread, fit_component, part_residuals, propagate,
    sample_features, simulate_characterization, simulate_parts,
};
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};
use nalgebra::{DMatrix, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn component(name: &str) -> Component {
    name.parse().unwrap()
}

fn readings(n: usize, f: impl Fn(f64) -> f64) -> Vec<Observation> {
    (0..n)
        .map(|i| {
            let position = 100.0 + 25.4 * i as f64;
            Observation {
                position,
                value: f(position),
                repeat: 0,
            }
        })
        .collect()
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found} is not {expected} within {tolerance}"
    );
}

#[test]
fn straight_line_equals_its_closed_form() {
    // Exact limit: the matrix form of equation (20) against 1/n + (x - x̄)²/S_xx.
    let data = readings(8, |x| 0.5 - 0.02 * x + (x * 7.0).sin());
    let fitted = fit_component(component("EXX"), &data, 1).unwrap();
    let n = data.len() as f64;
    let mean = data.iter().map(|o| o.position).sum::<f64>() / n;
    let sxx: f64 = data.iter().map(|o| (o.position - mean).powi(2)).sum();
    let sxy: f64 = data.iter().map(|o| (o.position - mean) * o.value).sum();
    let level = data.iter().map(|o| o.value).sum::<f64>() / n;
    let line = |x: f64| level + sxy / sxx * (x - mean);
    let squares: f64 = data
        .iter()
        .map(|o| (o.value - line(o.position)).powi(2))
        .sum();
    let summary = LineSummary {
        residual_std: (squares / (n - 2.0)).sqrt(),
        observations: 8,
        mean_position: mean,
        sum_of_squares: sxx,
    };
    let closed = summary.spread(component("EXX")).unwrap();
    for x in [0.0, 100.0, 188.9, 400.0] {
        let value = fitted.function.value(fitted.component, x).unwrap();
        near("line", value, line(x), 1e-12);
        near(
            "variance",
            fitted.spread.of_function(x),
            closed.of_function(x),
            1e-12,
        );
    }
    near("scatter", fitted.spread.scatter, closed.scatter, 1e-12);
    assert_eq!(fitted.spread.degrees, closed.degrees);
}

#[test]
fn prediction_intervals_cover_the_next_reading() {
    // k·u: 1000 machines, one future reading each far from the stations; 950 ± 7 fall inside.
    let truth = ErrorFunction::polynomial(vec![3.0, -0.05, 1e-4]);
    let straightness = component("EYX");
    let degrees = DegreesOfFreedom::Infinite;
    let error = |spread| ComponentError {
        component: straightness,
        function: truth.clone(),
        spread,
    };
    let machine = |error| Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, vec![error]);
    let true_machine = machine(error(Spread::scatter(0.7, degrees))).unwrap();
    let plan = Characterization {
        stations: vec![0.0, 50.0, 100.0, 150.0],
        repeats: 3,
    };
    let later = Characterization {
        stations: vec![260.0],
        repeats: 1,
    };
    let mut inside = 0;
    for seed in 0..1000 {
        let data = simulate_characterization(&true_machine, &plan, seed).unwrap();
        let data: Vec<Observation> = data.into_iter().map(|(_, o)| o).collect();
        let fitted = machine(fit_component(straightness, &data, 2).unwrap()).unwrap();
        let next = simulate_characterization(&true_machine, &later, 5000 + seed).unwrap()[0].1;
        let functional = errsep_models::machine::features::point(
            &fitted,
            &Position::new(next.position, 0.0, 0.0),
            Axis::Y,
        )
        .unwrap();
        let budget = propagate(
            &fitted,
            &functional,
            Independence::Points,
            Prediction::Future,
        )
        .unwrap();
        let interval = budget.result.expanded(0.95).unwrap();
        inside += u32::from(interval.lower <= next.value && next.value <= interval.upper);
    }
    near("inside", f64::from(inside), 950.0, 3.0 * 7.0);
}

#[test]
fn positions_far_from_zero_cost_no_digits() {
    // Epsilons: the powers are centred and scaled, so a stage at 1e6 mm fits as one at 0.
    let shifted = |offset: f64| {
        let data: Vec<Observation> = (0..20)
            .map(|i| {
                let t = f64::from(i) - 9.5;
                Observation {
                    position: offset + t,
                    value: t.powi(3) - 2.0 * t + (t * 3.0).cos(),
                    repeat: 0,
                }
            })
            .collect();
        let fitted = fit_component(component("EXX"), &data, 5).unwrap();
        fitted
            .function
            .value(component("EXX"), offset + 4.25)
            .unwrap()
    };
    near("value", shifted(1_048_576.0), shifted(0.0), 1e-11);
}

#[test]
fn what_cannot_be_regressed_is_named() {
    let exx = component("EXX");
    let cause = |data: &[Observation], degree| match fit_component(exx, data, degree) {
        Err(MachineError::Regression { source, .. }) => source,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        cause(&readings(2, |x| x), 1),
        RegressionError::TooFewReadings { terms: 2, found: 2 }
    );
    let same = [Observation {
        position: 5.0,
        value: 1.0,
        repeat: 0,
    }; 6];
    assert_eq!(
        cause(&same, 1),
        RegressionError::TooFewPositions { terms: 2, found: 1 }
    );
    let bad = [Observation {
        position: f64::NAN,
        value: 1.0,
        repeat: 0,
    }; 6];
    assert_eq!(cause(&bad, 1), RegressionError::NotFinite { number: 1 });
    let mut close = readings(40, |x| x);
    close.iter_mut().for_each(|o| o.position = o.position.ln());
    assert_eq!(
        cause(&close, 35),
        RegressionError::Indistinguishable { terms: 36 }
    );
    assert_eq!(
        fit_component(component("C0Y"), &readings(5, |x| x), 1),
        Err(MachineError::NotAFunction {
            component: component("C0Y")
        })
    );
}

#[test]
fn tables_run_in_straight_lines_and_end_where_they_end() {
    let table = ErrorFunction::Table {
        positions: vec![0.0, 10.0, 30.0],
        values: vec![1.0, 2.0, -2.0],
    };
    let at = |x| table.value(component("EXX"), x);
    assert_eq!(
        [0.0, 5.0, 10.0, 20.0, 30.0].map(|x| at(x).unwrap()),
        [1.0, 1.5, 2.0, 0.0, -2.0]
    );
    for x in [-0.001, 30.001] {
        assert!(matches!(at(x), Err(MachineError::OutsideTable { .. })));
    }
}

fn with(error: ComponentError) -> Result<Machine, MachineError> {
    Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, vec![error])
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    let sound = ComponentError {
        component: component("EXX"),
        function: ErrorFunction::constant(1.0),
        spread: Spread::none(),
    };
    let chain = || Chain::parse("FXYZ").unwrap();
    assert!(with(sound.clone()).is_ok());
    assert_eq!(
        Machine::new(chain(), Sense::Tool, vec![sound.clone(), sound.clone()]),
        Err(MachineError::RepeatedComponent {
            component: component("EXX")
        })
    );
    let function = |function| {
        with(ComponentError {
            function,
            ..sound.clone()
        })
    };
    assert!(function(ErrorFunction::constant(f64::NAN)).is_err());
    let table = |positions: &[f64], values: &[f64]| ErrorFunction::Table {
        positions: positions.to_vec(),
        values: values.to_vec(),
    };
    assert!(function(table(&[0.0, 0.0], &[1.0, 1.0])).is_err());
    assert!(function(table(&[0.0], &[1.0])).is_err());
    assert!(function(table(&[0.0, 1.0], &[1.0])).is_err());
    assert!(function(table(&[0.0, 1.0], &[1.0, f64::INFINITY])).is_err());
    let slope = ErrorFunction::polynomial(vec![0.0, 1.0]);
    let turned = ComponentError {
        component: component("B0Z"),
        function: slope,
        ..sound.clone()
    };
    assert_eq!(
        with(turned),
        Err(MachineError::NotAFunction {
            component: component("B0Z")
        })
    );
    let spread = |spread| {
        with(ComponentError {
            spread,
            ..sound.clone()
        })
    };
    assert!(spread(Spread::scatter(f64::NAN, DegreesOfFreedom::Infinite)).is_err());
    let mut wrong = Spread::none();
    wrong.covariance = DMatrix::identity(2, 2);
    assert!(spread(wrong).is_err());
    let machine = with(sound).unwrap();
    assert!(
        machine
            .deviation(&Position::new(0.0, f64::NAN, 0.0))
            .is_err()
    );
    assert!(
        chain()
            .with_tool_offset(Vector3::new(0.0, 0.0, f64::INFINITY))
            .is_err()
    );
}

#[test]
fn features_that_are_none_are_refused() {
    let machine = Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, vec![]).unwrap();
    let p = |x, y| Position::new(x, y, 0.0);
    assert!(length(&machine, &p(1.0, 2.0), &p(1.0, 2.0)).is_err());
    let rows = |a, b, along| Squareness::new(along, a, b);
    let (flat, upright) = (
        vec![p(0.0, 0.0), p(9.0, 0.0)],
        vec![p(0.0, 0.0), p(0.0, 9.0)],
    );
    assert!(rows(flat.clone(), upright.clone(), [Axis::X, Axis::Y]).is_ok());
    assert!(rows(upright.clone(), flat.clone(), [Axis::X, Axis::Y]).is_err());
    assert!(rows(flat.clone(), flat.clone(), [Axis::X, Axis::X]).is_err());
    assert!(rows(vec![], upright, [Axis::X, Axis::Y]).is_err());
    let circle = |radius, count| Circle::new([Axis::X, Axis::Y], p(0.0, 0.0), radius, count);
    assert!(circle(1.0, 4).is_ok());
    assert!(circle(0.0, 4).is_err() && circle(f64::NAN, 4).is_err() && circle(1.0, 3).is_err());
}

/// A machine with all 21 errors, each a fitted line with scatter.
fn full_machine() -> Machine {
    let errors = COMPONENTS
        .iter()
        .enumerate()
        .map(|(i, c)| {
            let scale = if c.kind == Kind::Translation {
                1.0
            } else {
                2e-6
            };
            let degree = usize::from(c.kind != Kind::Squareness);
            let data = readings(9, |x| {
                scale * (0.01 * x * (i as f64 - 10.0) / 10.0 + (x + i as f64).sin())
            });
            fit_component(*c, &data, degree).unwrap()
        })
        .collect();
    Machine::new(Chain::parse("XFYZ").unwrap(), Sense::Tool, errors).unwrap()
}

#[test]
fn sampled_components_follow_the_law_of_propagation() {
    // k·u: lengths between a body's corners under what the points have in common; 20 000 trials
    // give a standard deviation to 0.5 %.
    let machine = full_machine();
    let (a, b) = (
        Position::new(0.0, 0.0, 0.0),
        Position::new(300.0, 200.0, 100.0),
    );
    let functional = length(&machine, &a, &b).unwrap();
    for independence in [
        Independence::Scatter,
        Independence::Points,
        Independence::Coordinates,
    ] {
        for prediction in [Prediction::Future, Prediction::Mean] {
            let u = propagate(&machine, &functional, independence, prediction)
                .unwrap()
                .result
                .standard_uncertainty;
            let sampler = Sampler::new(&machine, &[a, b], independence, prediction)
                .unwrap()
                .with_known_spreads();
            let sample = sample_features(&sampler, 20_000, 1, 3, |d, out| {
                out[0] = errsep_models::machine::features::length_of(&(b - a), &(d[1] - d[0]));
            });
            let found = sample.unwrap().output(0).unwrap();
            near("deviation", found.standard_deviation(), u, 4.0 * 0.005 * u);
            near(
                "mean",
                found.mean(),
                functional.value,
                4.0 * u / 20_000_f64.sqrt() + 1e-3,
            );
        }
    }
}

#[test]
fn parts_of_the_model_lie_where_it_predicts() {
    // k·u: residuals of simulated parts have the predicted spread; the six of a part
    // share the draw of its lines, so 400 parts count and not 2400 readings.
    let machine = full_machine();
    let features: Vec<(String, Position)> = [(100.0, 150.0), (300.0, 150.0), (200.0, 250.0)]
        .iter()
        .map(|(x, y)| (format!("{x}/{y}"), Position::new(*x, *y, 0.0)))
        .collect();
    let readings = simulate_parts(&machine, &features, 400, 1, 0.0, 9).unwrap();
    assert_eq!(readings.len(), 400 * 3 * 2);
    let residuals = part_residuals(&machine, &readings).unwrap();
    let squares: f64 = residuals
        .iter()
        .map(|r| r.normalized().unwrap().powi(2))
        .sum::<f64>()
        / 2400.0;
    near("mean square", squares, 1.0, 3.0 * (2.0 / 400.0_f64).sqrt());
    assert!(simulate_parts(&machine, &features, 1, 1, f64::NAN, 9).is_err());
}

/// Five repeats over nine positions, each zeroed anew by 2 µm beside a noise of 0.5 µm: u of the function in the
/// middle of the travel is that of five zeros. Kind: k·u; of 200 sets 95 % ± 4 standard deviations.
#[test]
fn repeats_that_were_zeroed_anew_are_in_the_uncertainty_of_the_function() {
    let exx = component("EXX");
    let mut held = 0;
    for seed in 0..200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut readings = Vec::new();
        for repeat in 1..=5 {
            let zero = 2.0 * normal();
            for i in 0..9 {
                let position = 50.0 * f64::from(i);
                readings.push(Observation {
                    position,
                    value: 0.01 * position + zero + 0.5 * normal(),
                    repeat,
                });
            }
        }
        let found = fit_component(exx, &readings, 1).unwrap();
        let error = found.function.value(exx, 200.0).unwrap() - 2.0;
        let k = coverage_factor(0.95, found.spread.degrees).unwrap();
        held += usize::from(error.abs() < k * found.spread.of_function(200.0).sqrt());
    }
    assert!((178..=200).contains(&held), "{held}");
}
