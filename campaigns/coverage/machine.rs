//! A machine whose 21 errors are straight lines with scatter, known from readings only: deviations of
//! points, lengths, squareness and circularity of the next part and of the mean of many.
//!
//! The part is made by setting every component anew at every point; only the kinematics are shared with
//! what is checked. Under `--independence points` and `coordinates` it is made as they assume, and as a
//! machine makes it whose functions all points have in common.

use errsep_models::machine::features::{self, Circle, Squareness};
use errsep_models::machine::{
    Axis, COMPONENTS, Chain, Component, ComponentError, ErrorFunction, Functional, Independence,
    Kind, Machine, Observation, Position, Prediction, Sampler, Sense, Spread, fit_component,
    propagate, sample_features,
};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

const STATIONS: [f64; 6] = [0.0, 50.0, 100.0, 150.0, 200.0, 250.0];
const REPEATS: usize = 2;
/// Readings of an angle between two axes.
const ANGLES: usize = 5;
const TRIALS: usize = 2000;

/// A component as it is: value at zero, slope, scatter.
struct True {
    component: Component,
    line: [f64; 2],
    scatter: f64,
}

type Normal<'a> = &'a mut dyn FnMut() -> f64;

fn truth(normal: Normal) -> Vec<True> {
    COMPONENTS
        .into_iter()
        .map(|component| {
            let size = if component.unit() == "um" { 1.0 } else { 3e-6 };
            let slope = match component.kind {
                Kind::Squareness => 0.0,
                Kind::Translation | Kind::Rotation => 0.01 * size * normal(),
            };
            True {
                component,
                line: [2.0 * size * normal(), slope],
                scatter: size,
            }
        })
        .collect()
}

fn measured(truth: &[True], normal: Normal) -> Option<Machine> {
    let errors = truth.iter().map(|t| {
        let (places, repeats, degree): (&[f64], _, _) = match t.component.kind {
            Kind::Squareness => (&[0.0], ANGLES, 0),
            Kind::Translation | Kind::Rotation => (&STATIONS, REPEATS, 1),
        };
        let mut readings = Vec::new();
        for position in places {
            for _ in 0..repeats {
                let value = t.line[0] + t.line[1] * position + t.scatter * normal();
                readings.push(Observation {
                    position: *position,
                    value,
                    repeat: 0,
                });
            }
        }
        fit_component(t.component, &readings, degree).ok()
    });
    machine(errors.collect::<Option<_>>()?)
}

fn machine(errors: Vec<ComponentError>) -> Option<Machine> {
    Machine::new(Chain::parse("XYFZ").ok()?, Sense::Tool, errors).ok()
}

/// What a part shows at these points: with scatter, or the mean of many parts.
fn part(
    truth: &[True],
    points: &[Position],
    future: bool,
    normal: Normal,
) -> Option<Vec<Vector3<f64>>> {
    let scatter = |t: &True, normal: Normal| if future { t.scatter * normal() } else { 0.0 };
    let angles: Vec<f64> = truth.iter().map(|t| scatter(t, normal)).collect();
    points
        .iter()
        .map(|point| {
            let errors = truth.iter().zip(&angles).map(|(t, angle)| {
                let own = match t.component.kind {
                    Kind::Squareness => *angle,
                    Kind::Translation | Kind::Rotation => scatter(t, normal),
                };
                let line = match t.component.kind {
                    Kind::Squareness => vec![t.line[0] + own],
                    Kind::Translation | Kind::Rotation => vec![t.line[0] + own, t.line[1]],
                };
                ComponentError {
                    component: t.component,
                    function: ErrorFunction::polynomial(line),
                    spread: Spread::none(),
                }
            });
            machine(errors.collect())?.deviation(point).ok()
        })
        .collect()
}

const QUANTITIES: [&str; 6] = [
    "deviation X",
    "deviation Y",
    "deviation Z",
    "length",
    "squareness",
    "circularity, by simulation",
];

/// What `--independence` is told, what the parts are made by, and the name of both.
const WAYS: [(Independence, Independence, &str); 5] = [
    (Independence::Scatter, Independence::Scatter, ""),
    (
        Independence::Points,
        Independence::Points,
        ", `points`, errors of their own at every point",
    ),
    (
        Independence::Coordinates,
        Independence::Coordinates,
        ", `coordinates`, errors of their own in every coordinate",
    ),
    (
        Independence::Points,
        Independence::Scatter,
        ", `points` though functions are in common",
    ),
    (
        Independence::Coordinates,
        Independence::Scatter,
        ", `coordinates` though functions are in common",
    ),
];

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    let predictions = [Prediction::Future, Prediction::Mean];
    for ((told, made, name), prediction) in WAYS
        .into_iter()
        .flat_map(|way| predictions.map(|prediction| (way, prediction)))
    {
        let tallies: Vec<[Tally; 6]> = (0..seeds)
            .into_par_iter()
            .filter_map(|seed| one(told, made, prediction, seed))
            .collect();
        let part = match prediction {
            Prediction::Future => "the next part",
            Prediction::Mean => "the mean of many parts",
        };
        for (k, quantity) in QUANTITIES.into_iter().enumerate() {
            rows.push(Row {
                case: format!("{part}{name}"),
                quantity: quantity.to_owned(),
                seeds: tallies.len() as u64,
                tally: tallies
                    .iter()
                    .fold(Tally::default(), |sum, t| sum.and(t[k])),
            });
        }
    }
    rows
}

/// What a part shows of which every point or coordinate has errors of its own: those of functions known
/// from readings of their own, and scatter.
fn apart(
    truth: &[True],
    machine: &Machine,
    point: &Position,
    future: bool,
    normal: Normal,
) -> Option<Vector3<f64>> {
    let known = measured(truth, normal)?.deviation(point).ok()?;
    let shown = part(truth, std::slice::from_ref(point), future, normal)?[0];
    Some(machine.deviation(point).ok()? + shown - known)
}

/// The part as the errors at its points have things in common.
fn made(
    what: Independence,
    truth: &[True],
    machine: &Machine,
    points: &[Position],
    future: bool,
    normal: Normal,
) -> Option<Vec<Vector3<f64>>> {
    match what {
        Independence::Scatter => part(truth, points, future, normal),
        Independence::Points => points
            .iter()
            .map(|point| apart(truth, machine, point, future, normal))
            .collect(),
        Independence::Coordinates => points
            .iter()
            .map(|point| {
                let mut shown = Vector3::zeros();
                for k in 0..3 {
                    shown[k] = apart(truth, machine, point, future, normal)?[k];
                }
                Some(shown)
            })
            .collect(),
    }
}

fn one(
    told: Independence,
    in_common: Independence,
    prediction: Prediction,
    seed: u64,
) -> Option<[Tally; 6]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal: Normal = &mut || StandardNormal.sample(&mut random);
    let truth = truth(normal);
    let machine = measured(&truth, normal)?;
    let future = prediction == Prediction::Future;
    let mut tallies = [Tally::default(); 6];
    let mut count = |k: usize, functional: &Functional, value: f64| {
        let budget = propagate(&machine, functional, told, prediction).ok()?;
        tallies[k].add(
            functional.value - value,
            budget.result.standard_uncertainty,
            budget.result.degrees_of_freedom.as_f64(),
        );
        Some(())
    };
    let ends = [
        Position::new(40.0, 60.0, 30.0),
        Position::new(220.0, 180.0, 90.0),
    ];
    let shown = made(in_common, &truth, &machine, &ends, future, normal)?;
    for (k, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
        let functional = features::point(&machine, &ends[1], axis).ok()?;
        count(k, &functional, shown[1][axis.index()])?;
    }
    let functional = features::length(&machine, &ends[0], &ends[1]).ok()?;
    let direction = (ends[1] - ends[0]).normalize();
    count(3, &functional, direction.dot(&(shown[1] - shown[0])))?;
    let row = |axis: usize| -> Vec<Position> {
        let at = |s: f64| {
            let mut p = Position::new(30.0, 30.0, 0.0);
            p[axis] = s;
            p
        };
        [30.0, 80.0, 130.0, 180.0, 230.0].map(at).to_vec()
    };
    let squareness = Squareness::new([Axis::X, Axis::Y], row(0), row(1)).ok()?;
    let functional = squareness.functional(&machine).ok()?;
    let shown = made(
        in_common,
        &truth,
        &machine,
        &squareness.points(),
        future,
        normal,
    )?;
    count(4, &functional, squareness.angle(&shown))?;
    let centre = Position::new(125.0, 125.0, 0.0);
    let circle = Circle::new([Axis::X, Axis::Y], centre, 60.0, 24).ok()?;
    let shown = made(in_common, &truth, &machine, circle.points(), future, normal)?;
    let shown = features::circularity_of(&circle, &shown);
    let sampler = Sampler::new(&machine, circle.points(), told, prediction).ok()?;
    let sample = sample_features(&sampler, TRIALS, 1, seed, |d, out| {
        out[0] = features::circularity_of(&circle, d);
    })
    .ok()?
    .output(0)?;
    let inside = |p: f64| {
        let interval = sample.symmetric_interval(p).ok()?;
        Some(interval.lower <= shown && shown <= interval.upper)
    };
    tallies[5].add_inside(inside(ONE_SIGMA)?, inside(0.95)?);
    Some(tallies)
}
