//! How many simulated parts a second: the 21-error model at 36 points, on one thread and on two,
//! beside draws component by component, and the plain loop that evaluates function and kinematics anew
//! for every draw.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use errsep_models::machine::features::{Circle, circularity_of};
use errsep_models::machine::{
    Axis, COMPONENTS, Chain, Independence, Kind, Machine, Observation, Position, Prediction,
    Sampler, Sense, fit_component, sample_features,
};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const TRIALS: usize = 4096;

fn machine() -> Machine {
    let errors = COMPONENTS
        .iter()
        .enumerate()
        .map(|(i, c)| {
            let scale = if c.kind == Kind::Translation {
                1.0
            } else {
                1e-5
            };
            let readings: Vec<Observation> = (0..40)
                .map(|k| {
                    let position = 25.0 * f64::from(k % 8);
                    let value = scale * (f64::from(k) * 1.7 + i as f64).sin();
                    Observation {
                        position,
                        value,
                        repeat: 0,
                    }
                })
                .collect();
            let degree = usize::from(c.kind != Kind::Squareness);
            fit_component(*c, &readings, degree).expect("readings at eight stations carry a line")
        })
        .collect();
    let chain = Chain::parse("XYFZ").expect("a chain");
    Machine::new(chain, Sense::Tool, errors).expect("a machine")
}

/// Draws every component at every point and sums its effect, point by point.
fn plain_loop(machine: &Machine, circle: &Circle, trials: usize) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut sum = 0.0;
    let mut deviations = vec![Vector3::zeros(); circle.points().len()];
    for _ in 0..trials {
        for (deviation, p) in deviations.iter_mut().zip(circle.points()) {
            *deviation = Vector3::zeros();
            for error in machine.errors() {
                let at = match error.component.kind {
                    Kind::Squareness => 0.0,
                    Kind::Translation | Kind::Rotation => p[error.component.axis.index()],
                };
                let u = (error.spread.of_function(at) + error.spread.scatter).sqrt();
                let z: f64 = StandardNormal.sample(&mut rng);
                let value = error
                    .function
                    .value(error.component, at)
                    .unwrap_or(f64::NAN);
                *deviation += machine.sensitivity(error.component, p) * (value + u * z);
            }
        }
        sum += circularity_of(circle, &deviations);
    }
    sum
}

/// Draws component by component, as a single part is drawn: the earlier way.
fn one_by_one(sampler: &Sampler, circle: &Circle, trials: usize) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut deviations = vec![Vector3::zeros(); circle.points().len()];
    let mut sum = 0.0;
    for _ in 0..trials {
        sampler.draw(&mut rng, &mut deviations);
        sum += circularity_of(circle, &deviations);
    }
    sum
}

fn bench(c: &mut Criterion) {
    let machine = machine();
    let centre = Position::new(75.0, 75.0, 0.0);
    let circle = Circle::new([Axis::X, Axis::Y], centre, 44.5, 36).expect("a circle");
    let mut group = c.benchmark_group("machine_monte_carlo");
    group
        .throughput(Throughput::Elements(TRIALS as u64))
        .sample_size(10);
    group.bench_function("plain loop", |b| {
        b.iter(|| plain_loop(black_box(&machine), &circle, TRIALS));
    });
    for independence in [Independence::Points, Independence::Scatter] {
        let sampler = Sampler::new(&machine, circle.points(), independence, Prediction::Future)
            .expect("points");
        group.bench_function(format!("one by one, {independence:?}, threads 1"), |b| {
            b.iter(|| one_by_one(black_box(&sampler), &circle, TRIALS));
        });
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            group.bench_function(
                format!("sampler, {independence:?}, threads {threads}"),
                |b| {
                    b.iter(|| {
                        pool.install(|| {
                            sample_features(black_box(&sampler), TRIALS, 1, 1, |d, out| {
                                out[0] = circularity_of(&circle, d);
                            })
                        })
                    });
                },
            );
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
