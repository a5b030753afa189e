//! One decomposition of (A, L) from which the solution follows at every λ.

use nalgebra::{DMatrix, DVector, SVD};

use super::{Penalty, RegularizationError, Spectrum};

/// The decomposed pair (A, L), good for any data and any λ.
///
/// The general form is brought to standard form (Eldén 1977; Hansen 1998, section 2.3): with W a
/// basis of the null space of L, L⁺ the pseudo-inverse and P = I − W(AW)⁺A, the matrix Ā = A P L⁺
/// has the singular values γ and the solution is x = P L⁺ x̄ + W(AW)⁺b. With L = I this is the
/// plain singular value decomposition.
#[derive(Debug, Clone)]
pub struct Decomposition {
    /// Left singular vectors of Ā, m × k.
    pub(super) left: DMatrix<f64>,
    /// γ, the singular values of Ā, descending, k.
    pub(super) singular_values: DVector<f64>,
    /// P L⁺ V: what one unit of each component adds to the solution, n × k.
    pub(super) directions: DMatrix<f64>,
    /// W(AW)⁺, the part the penalty does not see, n × m; absent when L has no null space.
    pub(super) free: Option<FreePart>,
    unknowns: usize,
    rows: usize,
}

#[derive(Debug, Clone)]
pub(super) struct FreePart {
    /// W(AW)⁺, n × m.
    pub(super) solve: DMatrix<f64>,
    /// Orthonormal basis of the range of AW, m × dim.
    pub(super) range: DMatrix<f64>,
}

impl Decomposition {
    /// Decomposes A with L = I.
    ///
    /// # Errors
    /// An entry is not finite, or the decomposition did not converge.
    pub fn standard(matrix: &DMatrix<f64>) -> Result<Self, RegularizationError> {
        check_finite(matrix, "the matrix")?;
        let (left, singular_values, right) = square_svd(matrix)?;
        Ok(Self {
            left,
            singular_values,
            directions: right,
            free: None,
            unknowns: matrix.ncols(),
            rows: matrix.nrows(),
        })
    }

    /// Decomposes A with any penalty.
    ///
    /// # Errors
    /// L has another number of columns than A, an entry is not finite, A and L share a null space,
    /// or a decomposition did not converge.
    pub fn general(matrix: &DMatrix<f64>, penalty: &Penalty) -> Result<Self, RegularizationError> {
        if *penalty == Penalty::Identity {
            return Self::standard(matrix);
        }
        check_finite(matrix, "the matrix")?;
        let unknowns = matrix.ncols();
        let l = penalty.matrix(unknowns);
        if l.ncols() != unknowns {
            return Err(RegularizationError::Shape {
                what: "a row of the penalty",
                expected: unknowns,
                found: l.ncols(),
            });
        }
        check_finite(&l, "the penalty")?;

        // Full right basis of L: its row space gives the pseudo-inverse, the rest is W.
        let (_, l_values, l_right) = square_svd(&l)?;
        let rank = numerical_rank(&l_values, l.nrows().max(unknowns));
        if rank == 0 {
            return Err(RegularizationError::NothingToChoose);
        }
        let mut pseudo_inverse = l_right.columns(0, rank).into_owned();
        for (mut column, value) in pseudo_inverse.column_iter_mut().zip(l_values.iter()) {
            column /= *value;
        }
        let null_space = l_right.columns(rank, unknowns - rank).into_owned();

        let free = free_part(matrix, &null_space)?;
        let mut reduced = matrix * &pseudo_inverse;
        let mut back = pseudo_inverse;
        if let Some(free) = &free {
            back -= &free.solve * &reduced;
            reduced -= &free.range * (free.range.transpose() * &reduced);
        }
        let (left, singular_values, right) = square_svd(&reduced)?;
        Ok(Self {
            left,
            singular_values,
            directions: back * right,
            free,
            unknowns,
            rows: matrix.nrows(),
        })
    }

    /// Number of rows of A, m.
    pub fn row_count(&self) -> usize {
        self.rows
    }

    /// The generalized singular values γ = σ/μ, descending.
    pub fn singular_values(&self) -> &DVector<f64> {
        &self.singular_values
    }

    /// How many γ stand above rounding error, max(m, n)·ε·γ₁.
    pub fn rank(&self) -> usize {
        numerical_rank(&self.singular_values, self.rows.max(self.unknowns))
    }

    /// γ₁/γₖ over the unknowns that are determined; infinite never appears, rank does.
    pub fn condition_number(&self) -> f64 {
        match self.rank() {
            0 => 1.0,
            rank => self.singular_values[0] / self.singular_values[rank - 1],
        }
    }

    /// The solutions for data b of length m.
    ///
    /// # Errors
    /// b has the wrong length or holds a value that is not finite.
    pub fn with_data<'a>(
        &'a self,
        data: &DVector<f64>,
    ) -> Result<Spectrum<'a>, RegularizationError> {
        Spectrum::new(self, data)
    }
}

fn free_part(
    matrix: &DMatrix<f64>,
    null_space: &DMatrix<f64>,
) -> Result<Option<FreePart>, RegularizationError> {
    let dimension = null_space.ncols();
    if dimension == 0 {
        return Ok(None);
    }
    let seen = matrix * null_space;
    let (left, values, right) = square_svd(&seen)?;
    // Relative to A itself: all of W may lie in A's null space.
    let threshold = matrix.norm() * f64::EPSILON * matrix.nrows().max(matrix.ncols()) as f64;
    let rank = values.iter().filter(|value| **value > threshold).count();
    if rank < dimension {
        return Err(RegularizationError::SharedNullSpace {
            dimension: dimension - rank,
        });
    }
    let mut scaled = right;
    for (mut column, value) in scaled.column_iter_mut().zip(values.iter()) {
        column /= *value;
    }
    Ok(Some(FreePart {
        solve: null_space * scaled * left.transpose(),
        range: left,
    }))
}

/// U, the singular values, V.
type Factors = (DMatrix<f64>, DVector<f64>, DMatrix<f64>);

/// U (m × n), descending singular values (n) and the complete V (n × n); a wide matrix is given
/// zero rows first, so that V has every direction, and its U zeros there.
fn square_svd(matrix: &DMatrix<f64>) -> Result<Factors, RegularizationError> {
    let (rows, columns) = matrix.shape();
    if rows == 0 || columns == 0 {
        return Err(RegularizationError::NothingToChoose);
    }
    let padded = matrix.clone().resize_vertically(rows.max(columns), 0.0);
    let svd = SVD::try_new(padded, true, true, f64::EPSILON, 0)
        .ok_or(RegularizationError::DidNotConverge)?;
    let (Some(left), Some(right)) = (svd.u, svd.v_t) else {
        return Err(RegularizationError::DidNotConverge);
    };
    Ok((
        left.rows(0, rows).into_owned(),
        svd.singular_values,
        right.transpose(),
    ))
}

fn numerical_rank(values: &DVector<f64>, size: usize) -> usize {
    let largest = values.iter().copied().fold(0.0, f64::max);
    let threshold = largest * f64::EPSILON * size as f64;
    values.iter().filter(|value| **value > threshold).count()
}

fn check_finite(matrix: &DMatrix<f64>, what: &'static str) -> Result<(), RegularizationError> {
    if matrix.iter().all(|value| value.is_finite()) {
        Ok(())
    } else {
        Err(RegularizationError::NotFinite { what })
    }
}
