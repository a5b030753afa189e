//! Circle fits: the orthogonal fit beside the algebraic ones, on the same points in the same run.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use errsep_models::circle::{
    AlgebraicFit, CircleSimulation, Reference, algebraic, orthogonal_fit, reference_zone, simulate,
};
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
        for reference in [Reference::MinimumZone, Reference::MaximumInscribed] {
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

criterion_group!(benches, fits);
criterion_main!(benches);
