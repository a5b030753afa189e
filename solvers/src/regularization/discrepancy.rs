//! The discrepancy principle.

use super::error::checked_lambda;
use super::search::{root, sample};
use super::{Family, Point, RegularizationError};

/// What the discrepancy principle found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Discrepancy {
    /// The noise just explains the residuals here.
    Found(Point),
    /// Even the least regularized solution leaves more than the noise: the stated noise is too
    /// small, or the model does not hold. The point is that solution.
    NoiseTooSmall(Point),
    /// Even the most regularized solution leaves less than the noise: the data do not stand out of
    /// it. The point is that solution.
    NoiseTooLarge(Point),
}

impl Discrepancy {
    /// The largest λ whose residuals the noise explains.
    pub fn lambda(&self) -> Option<f64> {
        match self {
            Self::Found(point) => Some(point.lambda),
            Self::NoiseTooSmall(_) | Self::NoiseTooLarge(_) => None,
        }
    }
}

/// The largest λ whose residuals the noise can explain, `noise` being the standard deviation of one
/// row: ‖Ax − b‖² ≤ noise²·(ν + 1.645·√(2ν)) with ν = m − effective parameters.
///
/// Morozov's principle compares with noise²·m. The parameters that were fitted take their share of
/// the noise with them, hence ν; and one draw of the noise exceeds its expectation half of the time,
/// when no λ would do, hence the limit that one in twenty exceeds.
///
/// # Errors
/// `noise` or the range of λ not positive, or the family failed at some λ.
pub fn discrepancy<F: Family + ?Sized>(
    family: &F,
    noise: f64,
) -> Result<Discrepancy, RegularizationError> {
    checked_lambda(noise)?;
    let rows = family.row_count();
    let excess = |point: &Point| {
        let left = point.residual_degrees_of_freedom(rows).max(0.0);
        point.residual_norm.powi(2) - noise * noise * (left + ONE_SIDED_95 * (2.0 * left).sqrt())
    };
    let (smallest, largest) = family.range();
    // Beyond γ₁ the residual still grows towards ‖b‖.
    let points = sample(family, smallest, largest * 1e3, family.samples())?;
    // Downwards from the most regularized: the first solution that the noise can explain.
    let Some(accepted) = points.iter().rposition(|point| excess(point) <= 0.0) else {
        return Ok(Discrepancy::NoiseTooSmall(points[0]));
    };
    let Some(high) = points.get(accepted + 1) else {
        return Ok(Discrepancy::NoiseTooLarge(points[accepted]));
    };
    let ends = (points[accepted].lambda, high.lambda);
    Ok(Discrepancy::Found(root(family, ends, 1e-6, excess)?))
}

/// The 95 % quantile of the normal distribution, to which χ² tends.
const ONE_SIDED_95: f64 = 1.645;
