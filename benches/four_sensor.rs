//! The L-curve of the direct four-sensor system: through the band up to 10⁵ points, and by the dense
//! decomposition where that still fits.
//!
//! `cargo bench -p errsep-campaigns --bench four_sensor`

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use errsep_models::four_sensor::simulate::{Disturbances, Example, simulate};
use errsep_models::four_sensor::{
    Geometry, Line, Outputs, Penalised, Separator, banded_system, direct,
};
use errsep_solvers::regularization::l_curve;

/// Outputs whose surface keeps the paper's wavelengths however long it is.
fn outputs(points: usize) -> Option<Outputs> {
    let geometry = Geometry::new(5.0, [1, 1, 5], points.checked_sub(7)?).ok()?;
    let mut truth = Example::of(&geometry);
    truth.surface_length = 340.0;
    simulate(&geometry, &truth, &Disturbances::noise(0.1), 1).ok()
}

fn whole_curve(c: &mut Criterion) {
    let mut group = c.benchmark_group("l_curve");
    group.sample_size(10);
    for points in [69, 200, 1_000, 10_000, 100_000] {
        let Some(outputs) = outputs(points) else {
            continue;
        };
        group.bench_with_input(BenchmarkId::new("band", points), &outputs, |b, outputs| {
            b.iter(|| {
                let system = banded_system(outputs, Penalised::Profile);
                black_box(system.map(|system| l_curve(&system)))
            });
        });
        if points <= 200 {
            group.bench_with_input(BenchmarkId::new("dense", points), &outputs, |b, outputs| {
                let data = direct::data(outputs);
                b.iter(|| {
                    let separator =
                        Separator::new(outputs.geometry(), Penalised::Profile, Line::EndPoints);
                    black_box(separator.map(|separator| {
                        separator
                            .decomposition()
                            .with_data(&data)
                            .and_then(|spectrum| l_curve(&spectrum))
                    }))
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, whole_curve);
criterion_main!(benches);
