//! The dense kernels beside nalgebra's on the same matrices in the same run.
//!
//! `cargo bench -p errsep-campaigns --bench dense`

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use errsep_solvers::linear::jacobi_svd::JacobiSvd;
use errsep_solvers::linear::pivoted_qr::PivotedQr;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
}

fn triangles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dense QR");
    for (rows, columns) in [(20, 4), (200, 8), (1_000, 30), (2_000, 200)] {
        let from = matrix(rows, columns);
        let size = format!("{rows} x {columns}");
        group.bench_function(BenchmarkId::new("pivoted, ours", &size), |b| {
            b.iter_batched(
                || from.clone(),
                |m| black_box(PivotedQr::new(m)),
                BatchSize::LargeInput,
            );
        });
        group.bench_function(BenchmarkId::new("pivoted, nalgebra", &size), |b| {
            b.iter_batched(
                || from.clone(),
                |m| black_box(m.col_piv_qr()),
                BatchSize::LargeInput,
            );
        });
        group.bench_function(BenchmarkId::new("plain, nalgebra", &size), |b| {
            b.iter_batched(
                || from.clone(),
                |m| black_box(m.qr()),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

fn singular_values(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dense SVD");
    for columns in [4, 8, 30] {
        let from = matrix(columns, columns);
        group.bench_function(BenchmarkId::new("Jacobi, ours", columns), |b| {
            b.iter_batched(
                || from.clone(),
                |m| black_box(JacobiSvd::new(m)),
                BatchSize::LargeInput,
            );
        });
        group.bench_function(BenchmarkId::new("bidiagonal, nalgebra", columns), |b| {
            b.iter_batched(
                || from.clone(),
                |m| black_box(m.svd(true, true)),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, triangles, singular_values);
criterion_main!(benches);
