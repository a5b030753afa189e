//! The linear system of Zhao et al.: one equation a triple of sensors and slide position, and the
//! constraints that make up for its rank deficiency.
//!
//! The paper's numbered equations are rebuilt from its text; see the theory page.

use errsep_solvers::linear::jacobi_svd::JacobiSvd;
use errsep_solvers::regularization::Decomposition;
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::{FourSensorError, Geometry, Outputs};

/// A₀ of (4), 4K × (N + 4): X holds f(x₀) … f(x_{N−1}) and Δe₁ … Δe₄. Its rank is three less than
/// its columns: a constant, a straight line and a parabola of f are not seen.
pub fn unconstrained_matrix(geometry: &Geometry) -> DMatrix<f64> {
    let points = geometry.point_count();
    let weights = geometry.triple_weights();
    let offsets = geometry.offsets();
    let mut matrix = DMatrix::zeros(4 * geometry.output_count(), points + 4);
    for n in 0..geometry.output_count() {
        for triple in 0..4 {
            let row = 4 * n + triple;
            for (sensor, offset) in offsets.into_iter().enumerate() {
                matrix[(row, n + offset)] += weights[(triple, sensor)];
            }
            matrix[(row, points + triple)] = 1.0;
        }
    }
    matrix
}

/// A and b of (14): A₀ with f(x₀) = f(x_{N−1}) = 0 (11), Δe₁ = the mean of the first triple's
/// combination over the slide positions (12), and the two linear relations between the Δe (13),
/// each a unit row.
///
/// (12) says that the surface has no net change of slope from its beginning to its end: an
/// assumption, which stands in for the parabola that the outputs do not hold.
pub fn constrained_system(outputs: &Outputs) -> (DMatrix<f64>, DVector<f64>) {
    let geometry = outputs.geometry();
    let points = geometry.point_count();
    let free = unconstrained_matrix(geometry);
    let rows = free.nrows();
    let mut matrix = free.resize_vertically(rows + 5, 0.0);
    let mut data = DVector::zeros(rows + 5);

    let weights = geometry.triple_weights();
    for (n, readings) in outputs.readings().iter().enumerate() {
        let combined = weights * Vector4::from(*readings);
        data.rows_mut(4 * n, 4).copy_from(&combined);
    }
    matrix[(rows, 0)] = 1.0;
    matrix[(rows + 1, points - 1)] = 1.0;
    matrix[(rows + 2, points)] = 1.0;
    let count = geometry.output_count() as f64;
    data[rows + 2] = data.rows(0, rows).iter().step_by(4).sum::<f64>() / count;
    for (place, relation) in relations(&weights).into_iter().enumerate() {
        for (triple, coefficient) in relation.iter().enumerate() {
            matrix[(rows + 3 + place, points + triple)] = *coefficient;
        }
    }
    (matrix, data)
}

/// Largest over smallest singular value that is not rounding, and the rank deficiency.
///
/// # Errors
/// The decomposition did not converge.
pub fn condition(matrix: &DMatrix<f64>) -> Result<(f64, usize), FourSensorError> {
    let decomposition = Decomposition::standard(matrix)?;
    Ok((
        decomposition.condition_number(),
        matrix.ncols() - decomposition.rank(),
    ))
}

/// Two orthonormal relations cᵀΔe = 0: Δe = W·e with W of rank two, so they span its left null
/// space.
fn relations(weights: &Matrix4<f64>) -> [Vector4<f64>; 2] {
    let transposed = DMatrix::from_fn(4, 4, |i, j| weights[(j, i)]);
    let right = JacobiSvd::new(transposed).right;
    [2, 3].map(|k| Vector4::from_fn(|i, _| right[(i, k)]))
}
