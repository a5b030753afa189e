//! Deviations of points, lengths, angles and circularities of a machine whose components are fitted to
//! readings: the mean of many parts, the next part, its simulation.
//!
//! The truth is made by finite rotations of a machine whose components are drawn point by point; the
//! command propagates to first order.

use errsep_models::machine::features::{Circle, Squareness, circularity_of, length, point};
use errsep_models::machine::{
    Axis, Chain, Characterization, Component, ComponentError, ErrorFunction, Functional,
    Independence, Kind, Machine, Observation, Position, Prediction, Sampler, Sense, Spread,
    fit_component, propagate, sample_features, simulate_characterization,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

/// Name, function over the coordinate in mm, standard deviation about it: um and rad.
const TRUTH: [(&str, [f64; 3], f64); 5] = [
    ("EXX", [0.3, -0.02, 5e-5], 1.0),
    ("EYX", [0.0, 0.004, 0.0], 0.6),
    ("ECX", [2e-6, 5e-8, 0.0], 6e-6),
    ("EYY", [1.4, -0.018, 0.0], 1.5),
    ("C0Y", [-3.3e-5, 0.0, 0.0], 4e-6),
];

/// Degree of the functions that are fitted; an error of location is a constant.
const DEGREE: usize = 2;

/// Trials of a simulation.
const TRIALS: usize = 2000;

const POINTS: [[f64; 3]; 4] = [
    [20.0, 30.0, 0.0],
    [170.0, 30.0, 0.0],
    [170.0, 160.0, 0.0],
    [90.0, 190.0, 20.0],
];

fn component(name: &str) -> Option<Component> {
    name.parse().ok()
}

fn machine(errors: Vec<ComponentError>) -> Option<Machine> {
    Machine::new(Chain::parse("XYFZ").ok()?, Sense::Work, errors).ok()
}

/// The machine that is measured: its scatter is that of the readings.
fn truth() -> Option<Machine> {
    let of = |(name, function, std): (&str, [f64; 3], f64)| {
        let component = component(name)?;
        let terms = if component.kind == Kind::Squareness {
            1
        } else {
            3
        };
        Some(ComponentError {
            component,
            function: ErrorFunction::polynomial(function[..terms].to_vec()),
            spread: Spread::scatter(std, DegreesOfFreedom::Infinite),
        })
    };
    machine(TRUTH.into_iter().map(of).collect::<Option<_>>()?)
}

/// Where the points of a part really lie: each component has its value and, for the next part, its
/// scatter; an angle between two axes scatters once a part.
fn made(random: &mut ChaCha8Rng, points: &[Position], scatter: f64) -> Option<Vec<Vector3<f64>>> {
    let mut normal = || -> f64 { StandardNormal.sample(random) };
    let of_part: Vec<f64> = TRUTH.iter().map(|_| normal()).collect();
    let mut deviations = Vec::new();
    for p in points {
        let mut errors = Vec::new();
        for ((name, [a, b, c], std), once) in TRUTH.iter().zip(&of_part) {
            let component = component(name)?;
            let x = match component.kind {
                Kind::Squareness => 0.0,
                Kind::Translation | Kind::Rotation => p[component.axis.index()],
            };
            let anew = if component.kind == Kind::Squareness {
                *once
            } else {
                normal()
            };
            errors.push(ComponentError {
                component,
                function: ErrorFunction::constant(a + b * x + c * x * x + scatter * std * anew),
                spread: Spread::none(),
            });
        }
        deviations.push(machine(errors)?.exact_deviation(p).ok()?);
    }
    Some(deviations)
}

/// The machine as it is known from its readings.
fn known(truth: &Machine, repeats: usize, seed: u64) -> Option<Machine> {
    let plan = Characterization {
        stations: (0..6).map(|i| 40.0 * f64::from(i)).collect(),
        repeats,
    };
    let readings = simulate_characterization(truth, &plan, seed).ok()?;
    let fitted = |error: &ComponentError| {
        let of: Vec<Observation> = readings
            .iter()
            .filter(|(c, _)| *c == error.component)
            .map(|(_, o)| *o)
            .collect();
        let location = error.component.kind == Kind::Squareness;
        fit_component(error.component, &of, if location { 0 } else { DEGREE }).ok()
    };
    machine(truth.errors().iter().map(fitted).collect::<Option<_>>()?)
}

const NAMES: [&str; 6] = [
    "deviation along X",
    "deviation along Y",
    "length",
    "squareness",
    "length, simulated",
    "circularity, simulated",
];

fn one(truth: &Machine, repeats: usize, prediction: Prediction, seed: u64) -> Option<[Tally; 6]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_add(1 << 40));
    let scatter = match prediction {
        Prediction::Future => 1.0,
        Prediction::Mean => 0.0,
    };
    let machine = known(truth, repeats, seed)?;
    let points = POINTS.map(Position::from);
    let found = made(&mut random, &points, scatter)?;
    let mut tallies = [Tally::default(); 6];
    let mut add = |k: usize, functional: &Functional, true_value: f64| -> Option<()> {
        let budget = propagate(&machine, functional, Independence::Scatter, prediction).ok()?;
        let half = |share: f64| Some(budget.result.expanded(share).ok()?.expanded_uncertainty);
        let error = budget.result.value - true_value;
        let std = budget.result.standard_uncertainty;
        tallies[k].add_intervals(error, std, half(ONE_SIGMA)?, half(0.95)?);
        Some(())
    };
    for (p, d) in points.iter().zip(&found) {
        add(0, &point(&machine, p, Axis::X).ok()?, d.x)?;
        add(1, &point(&machine, p, Axis::Y).ok()?, d.y)?;
    }
    let nominal = points[1] - points[0];
    let moved = (found[1] - found[0]) * 1e-3;
    let longer = 1e3 * ((nominal + moved).norm() - nominal.norm());
    add(2, &length(&machine, &points[0], &points[1]).ok()?, longer)?;
    let (first, second) = (vec![points[0], points[1]], vec![points[1], points[2]]);
    let rows = Squareness::new([Axis::X, Axis::Y], first, second).ok()?;
    let sides = [
        nominal + moved,
        points[2] - points[1] + (found[2] - found[1]) * 1e-3,
    ];
    // Positive where the angle exceeds 90°; both rows run in the positive direction of their axis.
    let corner = (sides[0].y / sides[0].x).atan() + (sides[1].x / sides[1].y).atan();
    add(3, &rows.functional(&machine).ok()?, -corner)?;
    // By simulation.
    let mut simulated = |k: usize,
                         points: &[Position],
                         feature: &(dyn Fn(&[Vector3<f64>]) -> f64 + Sync),
                         true_value: f64|
     -> Option<()> {
        let sampler = Sampler::new(&machine, points, Independence::Scatter, prediction).ok()?;
        let trials = sample_features(&sampler, TRIALS, 1, seed, |d, out| out[0] = feature(d));
        let sample = trials.ok()?.output(0)?;
        let inside = |share: f64| {
            let i = sample.shortest_interval(share).ok()?;
            Some((i.lower..=i.upper).contains(&true_value))
        };
        let error = sample.mean() - true_value;
        let half = |inside: bool| if inside { f64::INFINITY } else { -1.0 };
        tallies[k].add_intervals(
            error,
            sample.standard_deviation(),
            half(inside(ONE_SIGMA)?),
            half(inside(0.95)?),
        );
        Some(())
    };
    simulated(
        4,
        &points[..2],
        &|d| 1e3 * ((nominal + (d[1] - d[0]) * 1e-3).norm() - nominal.norm()),
        longer,
    )?;
    let circle = Circle::new(
        [Axis::X, Axis::Y],
        Position::new(100.0, 100.0, 0.0),
        60.0,
        12,
    )
    .ok()?;
    let on_circle = made(&mut random, circle.points(), scatter)?;
    let out_of_round = circularity_of(&circle, &on_circle);
    simulated(
        5,
        circle.points(),
        &|d| circularity_of(&circle, d),
        out_of_round,
    )?;
    Some(tallies)
}

pub fn rows(seeds: u64) -> Vec<Row> {
    let Some(truth) = truth() else {
        return Vec::new();
    };
    let mut rows = Vec::new();
    for repeats in [10, 2] {
        for (name, prediction) in [
            ("the next part", Prediction::Future),
            ("the mean of many parts", Prediction::Mean),
        ] {
            let tallies: Vec<[Tally; 6]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| one(&truth, repeats, prediction, seed))
                .collect();
            for (k, quantity) in NAMES.into_iter().enumerate() {
                rows.push(Row {
                    case: format!("6 stations, {repeats} repeats: {name}"),
                    quantity: quantity.to_owned(),
                    seeds: tallies.len() as u64,
                    tally: tallies
                        .iter()
                        .fold(Tally::default(), |sum, t| sum.and(t[k])),
                });
            }
        }
    }
    rows
}
