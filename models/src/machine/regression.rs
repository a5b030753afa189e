//! Regression of a component on the coordinate of its axis, with what prediction needs (NISTIR
//! 6868, equations 15 to 31).
//!
//! Equation (28) prints the distance from the mean without its square; equations (29) to (31)
//! count the scatter of the angle twice. Both follow equation (20) here.

use nalgebra::{DMatrix, DVector};

use super::repeats::Repeats;
use super::{
    Component, ComponentError, ErrorFunction, Kind, MachineError, PolynomialBasis, Spread,
};
use crate::uncertainty::DegreesOfFreedom;

/// One reading of a component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Coordinate of the axis, mm.
    pub position: f64,
    /// Reading, um or rad.
    pub value: f64,
    /// Number of the repeat that it belongs to; zero where that is not told.
    pub repeat: u32,
}

/// Why a regression cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// Not more readings than coefficients.
    #[error(
        "{found} of at least {} readings are given: {terms} for the coefficients, one for the scatter",
        terms + 1
    )]
    TooFewReadings {
        /// Coefficients asked for.
        terms: usize,
        /// Readings given.
        found: usize,
    },
    /// Not enough different positions.
    #[error(
        "its readings stand at {found} positions, {terms} coefficients need as many: lower the degree"
    )]
    TooFewPositions {
        /// Coefficients asked for.
        terms: usize,
        /// Different positions.
        found: usize,
    },
    /// The powers can no longer be told apart.
    #[error("{terms} coefficients cannot be told apart at these positions: lower the degree")]
    Indistinguishable {
        /// Coefficients asked for.
        terms: usize,
    },
    /// A position or reading that is not finite.
    #[error("reading {number} is not finite")]
    NotFinite {
        /// Number of the reading, from 1.
        number: usize,
    },
}

/// Fits a polynomial of the given degree; an error of location takes degree 0.
///
/// The scatter about it becomes the variance of a future reading, and the covariance of the
/// coefficients that of the function. Where the repeats differ as a whole (each zeroed anew, or drifting),
/// they are what is independent, not their readings (`repeats.rs`).
///
/// # Errors
/// Readings that do not determine the polynomial and its scatter.
pub fn fit_component(
    component: Component,
    observations: &[Observation],
    degree: usize,
) -> Result<ComponentError, MachineError> {
    if component.kind == Kind::Squareness && degree > 0 {
        return Err(MachineError::NotAFunction { component });
    }
    let wrong = |source| MachineError::Regression { component, source };
    let (n, terms) = (observations.len(), degree + 1);
    if let Some(at) = observations
        .iter()
        .position(|o| !(o.position + o.value).is_finite())
    {
        return Err(wrong(RegressionError::NotFinite { number: at + 1 }));
    }
    if n <= terms {
        return Err(wrong(RegressionError::TooFewReadings { terms, found: n }));
    }
    let mut positions: Vec<f64> = observations.iter().map(|o| o.position).collect();
    let centre = positions.iter().map(|x| x / n as f64).sum::<f64>();
    positions.sort_by(f64::total_cmp);
    let reach = positions
        .iter()
        .fold(0.0_f64, |m, x| m.max((x - centre).abs()));
    positions.dedup();
    if positions.len() < terms {
        return Err(wrong(RegressionError::TooFewPositions {
            terms,
            found: positions.len(),
        }));
    }
    let scale = if reach > 0.0 { reach } else { 1.0 };
    let basis = PolynomialBasis {
        centre,
        scale,
        terms,
    };

    let mut design = DMatrix::zeros(n, terms);
    for (i, observation) in observations.iter().enumerate() {
        for (k, power) in basis.powers(observation.position).enumerate() {
            design[(i, k)] = power;
        }
    }
    let values = DVector::from_iterator(n, observations.iter().map(|o| o.value));
    let qr = design.clone().qr();
    let r = qr.r();
    let diagonal = r.diagonal().map(f64::abs);
    if diagonal.min() <= 1e-12 * diagonal.max() {
        return Err(wrong(RegressionError::Indistinguishable { terms }));
    }
    let mut projected = values.clone();
    qr.q_tr_mul(&mut projected);
    let unsolvable = || wrong(RegressionError::Indistinguishable { terms });
    let coefficients = r
        .solve_upper_triangular(&projected.rows(0, terms))
        .ok_or_else(unsolvable)?;
    let inverse = r
        .solve_upper_triangular(&DMatrix::identity(terms, terms))
        .ok_or_else(unsolvable)?;
    let degrees = (n - terms) as f64;
    let left = &values - &design * &coefficients;
    let scatter = left.norm_squared() / degrees;
    let inverse = &inverse * inverse.transpose();
    let repeats = Repeats::of(observations, &design, &left);
    let (covariance, degrees) = match repeats.filter(Repeats::differ) {
        Some(repeats) => (repeats.covariance(&inverse), repeats.count() - 1.0),
        None => (inverse * scatter, degrees),
    };
    Ok(ComponentError {
        component,
        function: ErrorFunction::Polynomial {
            basis,
            coefficients: coefficients.as_slice().to_vec(),
        },
        spread: Spread {
            basis,
            covariance,
            scatter,
            degrees: DegreesOfFreedom::new(degrees)?,
        },
    })
}

/// What a report leaves of the regression of a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSummary {
    /// Standard deviation about the line, um or rad.
    pub residual_std: f64,
    /// Number of readings.
    pub observations: usize,
    /// Mean of their positions, mm.
    pub mean_position: f64,
    /// Sum of the squared distances of the positions from their mean, mm².
    pub sum_of_squares: f64,
}

impl LineSummary {
    /// The spread it stands for: `σ² (1/n + (x - x̄)² / S_xx)` of the line, `σ²` about it.
    ///
    /// # Errors
    /// Fewer than three readings, or numbers that are not positive.
    pub fn spread(&self, component: Component) -> Result<Spread, MachineError> {
        let bad = |why: &str| MachineError::BadComponent {
            component,
            why: why.to_owned(),
        };
        let finite = [self.residual_std, self.mean_position, self.sum_of_squares];
        if finite.iter().any(|v| !v.is_finite()) || self.residual_std < 0.0 {
            return Err(bad(
                "the numbers of its regression must be finite, its scatter not negative",
            ));
        }
        if self.observations < 3 {
            return Err(bad(
                "a line needs at least three readings to show a scatter",
            ));
        }
        if self.sum_of_squares <= 0.0 {
            return Err(bad("the sum of squares of its positions must be positive"));
        }
        let scatter = self.residual_std * self.residual_std;
        let variances = [
            scatter / self.observations as f64,
            scatter / self.sum_of_squares,
        ];
        Ok(Spread {
            basis: PolynomialBasis {
                centre: self.mean_position,
                scale: 1.0,
                terms: 2,
            },
            covariance: DMatrix::from_diagonal(&DVector::from_row_slice(&variances)),
            scatter,
            degrees: DegreesOfFreedom::new(self.observations as f64 - 2.0)?,
        })
    }
}
