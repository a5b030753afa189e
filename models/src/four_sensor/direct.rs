//! The direct way: f and e fitted to the four outputs themselves, S and γ eliminated exactly.
//!
//! At each slide position the four outputs are turned by an orthogonal matrix into two numbers that
//! hold S and γ and two that do not ([`Geometry::slide_free`]). Least squares of f and e on the
//! second pair is least squares of f, S, γ and e on the outputs, and white noise stays white. The
//! four triples of the published way are four combinations of the same two numbers: their noise is
//! correlated, and least squares weighs it wrongly.

use nalgebra::{DMatrix, DVector, Matrix4x2, Vector2, Vector4};

use super::{Geometry, Outputs, Penalised};

/// Unknowns beside the surface: the two slide-free combinations of e.
pub const ZERO_UNKNOWNS: usize = 2;

/// The matrix of the direct system, 2K × (N + 2), columns f(x₀) … f(x_{N−1}), then the two
/// slide-free combinations of e.
pub fn matrix(geometry: &Geometry) -> DMatrix<f64> {
    let points = geometry.point_count();
    let free = geometry.slide_free();
    let offsets = geometry.offsets();
    let mut matrix = DMatrix::zeros(2 * geometry.output_count(), points + ZERO_UNKNOWNS);
    for n in 0..geometry.output_count() {
        for combination in 0..2 {
            let row = 2 * n + combination;
            for (sensor, offset) in offsets.into_iter().enumerate() {
                matrix[(row, n + offset)] = free[(sensor, combination)];
            }
            matrix[(row, points + combination)] = 1.0;
        }
    }
    matrix
}

/// The right-hand side, µm, length 2K.
pub fn data(outputs: &Outputs) -> DVector<f64> {
    slide_free_part(outputs.geometry(), outputs.readings())
}

/// The two slide-free combinations of readings, one slide position after the other, length 2K.
pub(super) fn slide_free_part(geometry: &Geometry, readings: &[[f64; 4]]) -> DVector<f64> {
    let free = geometry.slide_free().transpose();
    let mut part = DVector::zeros(2 * readings.len());
    for (n, row) in readings.iter().enumerate() {
        part.rows_mut(2 * n, 2)
            .copy_from(&(free * Vector4::from(*row)));
    }
    part
}

/// The penalty as a matrix over all unknowns: the zero-adjustments are left free, as their size
/// says nothing about the surface.
pub fn penalty(geometry: &Geometry, penalised: Penalised) -> DMatrix<f64> {
    let points = geometry.point_count();
    penalised
        .penalty()
        .matrix(points)
        .resize_horizontally(points + ZERO_UNKNOWNS, 0.0)
}

/// e of the four sensors from its slide-free combinations, with e₁ = e₄ = 0: what is left out is a
/// constant of S and a constant of γ, which the outputs do not tell from e.
pub fn zero_adjustments(geometry: &Geometry, combinations: Vector2<f64>) -> Vector4<f64> {
    let e = geometry.slide_free() * combinations;
    let offsets = Vector4::from(geometry.offsets()).map(|offset| offset as f64);
    let slope = (e[3] - e[0]) / offsets[3];
    e - Vector4::repeat(e[0]) - offsets * slope
}

/// The pseudo-inverse of the slide's columns: S in µm and γ in rad of what is left of the four
/// outputs once f and e are taken away.
pub fn slide_of(geometry: &Geometry) -> nalgebra::Matrix2x4<f64> {
    let columns: Matrix4x2<f64> = geometry.slide_columns();
    // Well conditioned once scaled: the sensors' places are distinct by construction.
    let scale = columns[(3, 1)];
    let scaled = Matrix4x2::from_fn(|row, column| {
        columns[(row, column)] / if column == 1 { scale } else { 1.0 }
    });
    let normal = scaled.transpose() * scaled;
    let determinant = normal[(0, 0)] * normal[(1, 1)] - normal[(0, 1)] * normal[(1, 0)];
    let inverse = nalgebra::Matrix2::new(
        normal[(1, 1)],
        -normal[(0, 1)],
        -normal[(1, 0)],
        normal[(0, 0)],
    ) / determinant;
    let mut inverse = inverse * scaled.transpose();
    inverse.row_mut(1).unscale_mut(scale);
    inverse
}
