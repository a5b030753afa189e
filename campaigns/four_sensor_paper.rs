//! The simulation of Zhao et al. (2019), section 3: 20 runs at each of three noise levels, and the
//! two positioning errors, by the published way and by the direct fit with each penalty and rule.
//!
//! Prints the table of docs/theory/four-sensor.md:
//! `cargo run --release -p errsep-campaigns --bin four_sensor_paper`.

use std::error::Error;

use errsep_models::four_sensor::simulate::{Disturbances, Example, Truth, simulate};
use errsep_models::four_sensor::{
    Choice, FourSensorError, Geometry, Line, Outputs, Penalised, PublishedSeparator, Separator,
    Settings, direct, triples,
};
use nalgebra::{DMatrix, DVector};

const RUNS: u64 = 20;

/// S in µm and γ in rad.
type Slide = (DVector<f64>, DVector<f64>);
type Method<'a> = Box<dyn Fn(&Outputs, f64) -> Result<Slide, FourSensorError> + 'a>;

fn main() -> Result<(), Box<dyn Error>> {
    println!("condition number (rank deficiency)");
    for points in [30, 200] {
        let geometry = Geometry::new(5.0, [1, 1, 5], points - 7)?;
        let silent = Outputs::new(geometry, 0.0, vec![[0.0; 4]; points - 7])?;
        let show = |name: &str, matrix: &DMatrix<f64>| -> Result<(), FourSensorError> {
            let (condition, deficiency) = triples::condition(matrix)?;
            println!("  N = {points:3} {name:22} {condition:10.3e} ({deficiency})");
            Ok(())
        };
        show("triples", &triples::unconstrained_matrix(&geometry))?;
        show(
            "triples, constrained",
            &triples::constrained_system(&silent).0,
        )?;
        show("direct", &direct::matrix(&geometry))?;
    }

    let geometry = Geometry::new(5.0, [1, 1, 5], 62)?;
    let truth = Example::of(&geometry);
    let methods = methods(&geometry)?;
    println!("\nlargest |error| of {RUNS} runs, of their average; S in um, gamma in 1e-3 degree");
    println!(
        "{:40} {:^13} | {:^13} | {:^13} | {:^13} | {:^13}",
        "", "S as stated", "to a line", "to a parabola", "gamma", "gamma, inside"
    );
    for noise in [0.1, 0.2, 0.3] {
        for (name, method) in &methods {
            let errors = (0..RUNS)
                .map(|seed| {
                    let outputs = simulate(&geometry, &truth, &Disturbances::noise(noise), seed)?;
                    method(&outputs, noise).map(|slide| errors(&geometry, &truth, slide))
                })
                .collect::<Result<Vec<_>, _>>()?;
            print_row(&format!("{noise} um, {name}"), &errors);
        }
    }
    let position = Disturbances {
        sensor_position: [0.0, 0.012, -0.003, 0.017],
        ..Disturbances::noise(0.0)
    };
    let slide = Disturbances {
        slide_position: 1.0,
        ..Disturbances::noise(0.0)
    };
    for (label, disturbances) in [("PE1", position), ("PE2", slide)] {
        for (name, method) in &methods {
            let outputs = simulate(&geometry, &truth, &disturbances, 0)?;
            let errors = errors(&geometry, &truth, method(&outputs, 0.01)?);
            print_row(&format!("{label}, {name}"), &[errors]);
        }
    }
    averaged_first(&geometry, &truth)?;
    spread_of_the_largest(&geometry, &truth)
}

/// The outputs of the runs averaged first, then separated: what repeats are for.
fn averaged_first(geometry: &Geometry, truth: &Example) -> Result<(), Box<dyn Error>> {
    println!("\n{RUNS} runs averaged, then separated: largest |error|, twice");
    let ways = [
        (Penalised::Profile, Choice::LCurve, "L-curve"),
        (Penalised::ProfileFromEnds, Choice::Likelihood, "likelihood"),
    ];
    for (noise, (penalised, choice, rule)) in [0.1, 0.2, 0.3]
        .into_iter()
        .flat_map(|noise| ways.map(|way| (noise, way)))
    {
        let separator = Separator::new(geometry, penalised, Line::EndPoints)?;
        let settings = Settings {
            choice,
            ..Settings::default()
        };
        let mut mean = vec![[0.0; 4]; geometry.output_count()];
        for seed in 0..RUNS {
            let outputs = simulate(geometry, truth, &Disturbances::noise(noise), seed)?;
            for (sum, row) in mean
                .iter_mut()
                .flatten()
                .zip(outputs.readings().as_flattened())
            {
                *sum += row / RUNS as f64;
            }
        }
        let found = separator.separate(&Outputs::new(*geometry, 0.0, mean)?, &settings)?;
        let slide = (found.straightness.values, found.tilt.values);
        let errors = errors(geometry, truth, slide);
        print_row(
            &format!("{noise} um, direct, {}, {rule}", penalised.name()),
            &[errors],
        );
    }
    Ok(())
}

fn add_share(mean: &mut [[f64; 4]], outputs: &Outputs) {
    let readings = outputs.readings().as_flattened();
    for (sum, reading) in mean.as_flattened_mut().iter_mut().zip(readings) {
        *sum += reading / RUNS as f64;
    }
}

/// The largest error of twenty runs is itself a draw: its 5 %, 50 % and 95 % points over many twenties.
fn spread_of_the_largest(geometry: &Geometry, truth: &Example) -> Result<(), Box<dyn Error>> {
    const SETS: u64 = 100;
    println!(
        "\nlargest |error| of {RUNS} runs, 5, 50 and 95 % of {SETS} sets: S to a parabola, gamma inside, \
         S of their average"
    );
    let rules = [
        ("L-curve", Choice::LCurve),
        ("GCV", Choice::Gcv),
        ("likelihood", Choice::Likelihood),
    ];
    let scale = 1e3_f64.to_degrees();
    for penalised in [Penalised::Profile, Penalised::ProfileFromEnds] {
        let separator = Separator::new(geometry, penalised, Line::EndPoints)?;
        for (noise, (rule, choice)) in [0.1, 0.2, 0.3]
            .into_iter()
            .flat_map(|noise| rules.map(|rule| (noise, rule)))
        {
            let settings = Settings {
                choice,
                ..Settings::default()
            };
            let (mut of_s, mut of_tilt) = (Vec::new(), Vec::new());
            let mut of_mean = Vec::new();
            for set in 0..SETS {
                let (mut s, mut tilt) = (0.0_f64, 0.0_f64);
                let mut mean = vec![[0.0; 4]; geometry.output_count()];
                for run in 0..RUNS {
                    let seed = 1000 * (set + 1) + run;
                    let outputs = simulate(geometry, truth, &Disturbances::noise(noise), seed)?;
                    add_share(&mut mean, &outputs);
                    let found = separator.separate(&outputs, &settings)?;
                    let slide = (found.straightness.values, found.tilt.values);
                    let errors = errors(geometry, truth, slide);
                    s = s.max(without_polynomial(&errors.0, 2).amax());
                    tilt = tilt.max(scale * well_seen(&errors.1).amax());
                }
                let outputs = Outputs::new(*geometry, 0.0, mean)?;
                let found = separator.separate(&outputs, &settings)?;
                let slide = (found.straightness.values, found.tilt.values);
                let errors = errors(geometry, truth, slide);
                of_mean.push(without_polynomial(&errors.0, 2).amax());
                of_s.push(s);
                of_tilt.push(tilt);
            }
            let points = |values: &mut Vec<f64>| {
                values.sort_by(f64::total_cmp);
                [4, 49, 94].map(|k| format!("{:6.2}", values[k])).join(" ")
            };
            println!(
                "{:40} {} | {} | {}",
                format!("{noise} um, direct, {}, {rule}", penalised.name()),
                points(&mut of_s),
                points(&mut of_tilt),
                points(&mut of_mean)
            );
        }
    }
    Ok(())
}

fn methods(geometry: &Geometry) -> Result<Vec<(String, Method<'static>)>, FourSensorError> {
    let mut methods: Vec<(String, Method<'static>)> = Vec::new();
    let published = PublishedSeparator::new(geometry)?;
    let plain = published.clone();
    methods.push((
        "published, least squares".to_owned(),
        Box::new(move |outputs, _| {
            let found = plain.least_squares(outputs)?;
            Ok((found.straightness, found.tilt))
        }),
    ));
    type Rule = (&'static str, fn(f64) -> Choice);
    let rules: [Rule; 4] = [
        ("L-curve", |_| Choice::LCurve),
        ("GCV", |_| Choice::Gcv),
        ("likelihood", |_| Choice::Likelihood),
        ("discrepancy", |noise| Choice::Discrepancy { noise }),
    ];
    for (rule, choice) in rules {
        let published = published.clone();
        methods.push((
            format!("published, {rule}"),
            Box::new(move |outputs, noise| {
                let found = published.separate(outputs, choice(noise))?;
                Ok((found.straightness, found.tilt))
            }),
        ));
    }
    for penalised in Penalised::ALL {
        let separator = Separator::new(geometry, penalised, Line::EndPoints)?;
        for (rule, choice) in rules {
            let separator = separator.clone();
            methods.push((
                format!("direct, {}, {rule}", penalised.name()),
                Box::new(move |outputs, noise| {
                    let settings = Settings {
                        choice: choice(noise),
                        ..Settings::default()
                    };
                    let found = separator.separate(outputs, &settings)?;
                    Ok((found.straightness.values, found.tilt.values))
                }),
            ));
        }
    }
    Ok(methods)
}

/// Estimate less truth, the tilt less its mean.
fn errors(geometry: &Geometry, truth: &impl Truth, (straightness, tilt): Slide) -> Slide {
    let at = |n: usize| n as f64 * geometry.step();
    let of_s = DVector::from_fn(straightness.len(), |n, _| {
        straightness[n] - truth.straightness(at(n))
    });
    let of_tilt = DVector::from_fn(tilt.len(), |n, _| tilt[n] - truth.tilt(at(n)));
    (of_s, without_polynomial(&of_tilt, 0))
}

fn without_polynomial(values: &DVector<f64>, degree: usize) -> DVector<f64> {
    let count = values.len();
    let powers = DMatrix::from_fn(count, degree + 1, |n, power| {
        (2.0 * n as f64 / (count - 1) as f64 - 1.0).powi(power as i32)
    });
    let basis = powers.qr().q();
    values - &basis * (basis.transpose() * values)
}

/// The tilt where sensor 4 stands over surface that another sensor sees as well.
fn well_seen(tilt: &DVector<f64>) -> DVector<f64> {
    tilt.rows(0, tilt.len().saturating_sub(5)).into_owned()
}

fn print_row(name: &str, errors: &[Slide]) {
    let both = |of: &dyn Fn(&Slide) -> DVector<f64>, scale: f64| {
        let largest = errors.iter().map(|e| of(e).amax()).fold(0.0, f64::max);
        let sum: DVector<f64> = errors.iter().map(of).sum();
        let average = (sum / errors.len() as f64).amax();
        format!("{:6.2} {:6.2}", scale * largest, scale * average)
    };
    let tilt_scale = 1e3_f64.to_degrees();
    println!(
        "{name:40} {} | {} | {} | {} | {}",
        both(&|e| e.0.clone(), 1.0),
        both(&|e| without_polynomial(&e.0, 1), 1.0),
        both(&|e| without_polynomial(&e.0, 2), 1.0),
        both(&|e| e.1.clone(), tilt_scale),
        both(&|e| well_seen(&e.1), tilt_scale),
    );
}
