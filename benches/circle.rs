//! Circle fits: the orthogonal fit beside the algebraic ones, on the same points in the same run; the
//! reference circles beside a linear program, which finds the two concentric circles of least area
//! between them, the usual stand-in for those of least separation.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use errsep_models::circle::{
    AlgebraicFit, CircleSimulation, Point, Reference, algebraic, circularity, orthogonal_fit,
    orthogonal_fits, reference_zone, simulate,
};
use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem, SolveOutcome};
use std::hint::black_box;

fn fits(c: &mut Criterion) {
    let mut group = c.benchmark_group("circle");
    for count in [36, 1000] {
        let what = CircleSimulation {
            count,
            noise_um: 20.0,
            ..CircleSimulation::default()
        };
        let Ok(points) = simulate(&what, 1) else {
            continue;
        };
        group.throughput(Throughput::Elements(1));
        for kind in AlgebraicFit::ALL {
            group.bench_with_input(BenchmarkId::new(kind.name(), count), &points, |b, p| {
                b.iter(|| algebraic(black_box(p), kind));
            });
        }
        group.bench_with_input(BenchmarkId::new("orthogonal", count), &points, |b, p| {
            b.iter(|| orthogonal_fit(black_box(p), None));
        });
        for reference in Reference::ALL {
            group.bench_with_input(
                BenchmarkId::new(reference.name(), count),
                &points,
                |b, p| {
                    b.iter(|| reference_zone(black_box(p), reference));
                },
            );
        }
    }
    group.finish();
}

/// Fits of many parts by one call, on one thread and on two, beside one call a part.
fn batches(c: &mut Criterion) {
    let of = |seed| {
        let what = CircleSimulation {
            count: 36,
            noise_um: 20.0,
            ..CircleSimulation::default()
        };
        simulate(&what, seed).unwrap_or_default()
    };
    let sets: Vec<Vec<Point>> = (0..4096).map(of).collect();
    let mut group = c.benchmark_group("circles of 36 points");
    group.throughput(Throughput::Elements(sets.len() as u64));
    group.sample_size(10);
    group.bench_function("one by one", |b| {
        b.iter(|| {
            black_box(&sets)
                .iter()
                .filter(|s| orthogonal_fit(s, None).is_ok())
                .count()
        });
    });
    for threads in [1, 2] {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else {
            continue;
        };
        group.bench_function(format!("batch, threads {threads}"), |b| {
            b.iter(|| pool.install(|| orthogonal_fits(black_box(&sets), None)));
        });
    }
    group.bench_function("all four references", |b| {
        b.iter(|| {
            let found = black_box(&sets).iter().map(|set| {
                let fit = algebraic(set, AlgebraicFit::Hyper)?;
                circularity(set, fit)
            });
            found.filter(Result::is_ok).count()
        });
    });
    group.finish();
}

/// An oval without noise, on which every point is a corner of the convex hull, and a trace of three
/// lobes with noise.
fn traces(count: usize) -> [(&'static str, CircleSimulation); 2] {
    let of = |undulations: u32, noise_um: f64| CircleSimulation {
        count,
        noise_um,
        lobes: vec![(undulations, 5.0, 0.0)],
        ..CircleSimulation::default()
    };
    [("oval", of(2, 0.0)), ("noisy", of(3, 0.5))]
}

fn reference_circles(c: &mut Criterion) {
    let mut group = c.benchmark_group("all reference circles");
    group.sample_size(10);
    for count in [36, 1000, 3600, 14_400, 36_000, 100_000, 1_000_000] {
        for (name, what) in traces(count) {
            let Ok(points) = simulate(&what, 1) else {
                continue;
            };
            let Ok(fit) = algebraic(&points, AlgebraicFit::Hyper) else {
                continue;
            };
            group.throughput(Throughput::Elements(count as u64));
            group.bench_with_input(BenchmarkId::new(name, count), &points, |b, p| {
                b.iter(|| circularity(black_box(p), fit));
            });
            if count <= 14_400 {
                let id =
                    BenchmarkId::new(format!("{name}, linear program of the zone alone"), count);
                group.bench_with_input(id, &points, |b, p| b.iter(|| least_area(black_box(p))));
            }
        }
    }
    group.finish();
}

/// π times this is the least area between two concentric circles that hold all points between them, mm²,
/// by the dual program: of the points' weights λ (outer) and μ (inner), each of sum one and with a common
/// centre of gravity, those with the greatest Σ (λ − μ)(x² + y²).
fn least_area(points: &[Point]) -> Option<f64> {
    let mut program = Problem::new(OptimizationDirection::Maximize);
    let mut sums = [(); 4].map(|()| LinearExpr::empty());
    for p in points {
        let square = p.x * p.x + p.y * p.y;
        let outer = program.add_var(square, (0.0, f64::INFINITY));
        let inner = program.add_var(-square, (0.0, f64::INFINITY));
        sums[0].add(outer, 1.0);
        sums[1].add(inner, 1.0);
        for (sum, coordinate) in sums[2..].iter_mut().zip([p.x, p.y]) {
            sum.add(outer, coordinate);
            sum.add(inner, -coordinate);
        }
    }
    for (sum, right) in sums.into_iter().zip([1.0, 1.0, 0.0, 0.0]) {
        program.add_constraint(sum, ComparisonOp::Eq, right);
    }
    match program.solve().ok()? {
        SolveOutcome::Solution(solution) => Some(solution.objective()),
        SolveOutcome::Interrupted(_) => None,
    }
}

criterion_group!(benches, fits, batches, reference_circles);
criterion_main!(benches);
