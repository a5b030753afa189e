//! Restricted maximum likelihood: λ as the ratio of two scatters, both taken from the data.

use super::search::{root, sample};
use super::{Family, Point, RegularizationError};

/// What the likelihood found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// The norms at the λ found.
    pub point: Point,
    /// Standard deviation of one row's noise, σ.
    pub noise: f64,
    /// −2 ln of the restricted likelihood there, up to a constant that depends on the rows alone: what
    /// penalties that leave the same parameters free can be compared by.
    pub criterion: f64,
    /// The likelihood is greatest at an end of the range: at its large end the data show nothing but
    /// noise, at its small end no noise. `point` is that end.
    pub at_edge: bool,
}

/// λ looked at above the range, over three decades.
const BEYOND: usize = 30;

/// λ = σ/s of the likeliest σ and s, if the noise is white with standard deviation σ and the entries of
/// Lx are independent with standard deviation s (H. D. Patterson, R. Thompson, *Biometrika* 58 (1971)
/// 545; G. Wahba, *Annals of Statistics* 13 (1985) 1378, "generalized maximum likelihood"). What L does
/// not see is taken out first.
///
/// With γ the generalized singular values, n₀ the parameters that L leaves free, e = Σ γ²/(γ² + λ²) and
/// q = ‖Ax − b‖² + λ²‖Lx‖² the criterion is Σ ln(1 + γ²/λ²) + (m − n₀) ln q. Its slope in ln λ,
/// 2 [(m − n₀) λ²‖Lx‖²/q − e], needs only what every family tells; the criterion itself is the integral
/// of it, and Σ ln(1 + γ²/λ²) that of 2 e from λ on. Compared with generalized cross-validation its λ scatters less; an x that is smoother than L
/// says (smooth where L is the identity) is under-smoothed.
///
/// # Errors
/// No range of λ, or the family failed at some λ.
pub fn likelihood<F: Family + ?Sized>(family: &F) -> Result<Likelihood, RegularizationError> {
    let (smallest, largest) = family.range();
    likelihood_among(
        family,
        &sample(family, smallest, largest, family.samples())?,
    )
}

/// As [`likelihood`], beginning from norms that are known already, ascending in λ.
///
/// # Errors
/// No points, or the family failed at some λ.
pub fn likelihood_among<F: Family + ?Sized>(
    family: &F,
    points: &[Point],
) -> Result<Likelihood, RegularizationError> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Err(RegularizationError::NothingToChoose);
    };
    // Far above γ₁ only the free parameters count: what is left of the others is 1e-6 of a parameter.
    let free = family
        .point(1e3 * last.lambda)?
        .effective_parameters
        .round();
    let rows = family.row_count() as f64 - free;
    let penalised = |p: &Point| (p.lambda * p.seminorm).powi(2);
    let total = |p: &Point| p.residual_norm.powi(2) + penalised(p);
    let slope = |p: &Point| rows * penalised(p) / total(p) - (p.effective_parameters - free);
    // Half the criterion, up to a constant, by the trapezoidal rule in ln λ.
    let mut height = 0.0;
    let mut least = (0.0, 0);
    for (k, pair) in points.windows(2).enumerate() {
        let step = (pair[1].lambda / pair[0].lambda).ln();
        height += 0.5 * step * (slope(&pair[0]) + slope(&pair[1]));
        if height < least.0 {
            least = (height, k + 1);
        }
    }
    // e from the largest λ known to where nothing is let through.
    let beyond = sample(family, last.lambda, 1e3 * last.lambda, BEYOND)?;
    let parameters = |p: &Point| (p.effective_parameters - free).max(0.0);
    let ends = |p: &Point, at_edge| {
        let mut from = *p;
        let mut let_through = 0.0;
        for next in points.iter().chain(&beyond) {
            if next.lambda > from.lambda {
                let step = (next.lambda / from.lambda).ln();
                let_through += step * (parameters(&from) + parameters(next));
                from = *next;
            }
        }
        Likelihood {
            point: *p,
            noise: (total(p) / rows).max(0.0).sqrt(),
            criterion: let_through + rows * total(p).ln(),
            at_edge,
        }
    };
    let best = least.1;
    let (low, high) = (
        points[best.saturating_sub(1)],
        points[(best + 1).min(points.len() - 1)],
    );
    if slope(&low) > 0.0 {
        return Ok(ends(first, true));
    }
    if slope(&high) < 0.0 {
        return Ok(ends(last, true));
    }
    let found = root(family, (low.lambda, high.lambda), 1e-9, slope)?;
    Ok(ends(&found, false))
}
