//! A machine: its chain, and what is known of each component error.

use nalgebra::{DMatrix, Vector3};

use super::{
    Chain, Component, ErrorFunction, Kind, MachineError, PolynomialBasis, Sense, exact_deviation,
    sensitivity,
};
use crate::uncertainty::DegreesOfFreedom;

/// Coordinates of the axes X, Y, Z, mm.
pub type Position = Vector3<f64>;

/// What is not known of a component error, in the unit of the component squared.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// The powers whose coefficients are uncertain.
    pub basis: PolynomialBasis,
    /// Covariance of those coefficients: common to all points.
    pub covariance: DMatrix<f64>,
    /// Variance about the function, drawn anew whenever the axis comes to a position.
    pub scatter: f64,
    /// Degrees of freedom of both.
    pub degrees: DegreesOfFreedom,
}

impl Spread {
    /// Nothing is uncertain.
    #[must_use]
    pub fn none() -> Self {
        Self::scatter(0.0, DegreesOfFreedom::Infinite)
    }

    /// The same standard uncertainty everywhere, drawn anew at every position.
    #[must_use]
    pub fn scatter(standard_uncertainty: f64, degrees: DegreesOfFreedom) -> Self {
        Self {
            basis: PolynomialBasis::plain(0),
            covariance: DMatrix::zeros(0, 0),
            scatter: standard_uncertainty * standard_uncertainty,
            degrees,
        }
    }

    /// Variance of the function itself at a coordinate: `φ' C φ`.
    #[must_use]
    pub fn of_function(&self, x: f64) -> f64 {
        self.quadratic(&self.basis.powers(x).collect::<Vec<_>>())
    }

    /// `a' C a` for any combination `a` of the coefficients.
    pub(super) fn quadratic(&self, a: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, u) in a.iter().enumerate() {
            for (j, v) in a.iter().enumerate() {
                sum += u * v * self.covariance[(i, j)];
            }
        }
        sum
    }

    fn check(&self, component: Component) -> Result<(), MachineError> {
        let bad = |why: &str| {
            Err(MachineError::BadComponent {
                component,
                why: why.to_owned(),
            })
        };
        if !(self.scatter.is_finite() && self.scatter >= 0.0) {
            return bad("its standard uncertainty must be finite and not negative");
        }
        if self.covariance.shape() != (self.basis.terms, self.basis.terms) {
            return bad("its covariance has not one row and column a coefficient");
        }
        if self.covariance.iter().any(|v| !v.is_finite()) {
            return bad("its covariance must be finite");
        }
        Ok(())
    }
}

/// One component error.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentError {
    /// Which of the 21.
    pub component: Component,
    /// Its best estimate.
    pub function: ErrorFunction,
    /// What is not known of it.
    pub spread: Spread,
}

/// A chain with its component errors; those not given are zero and certain.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    chain: Chain,
    sense: Sense,
    errors: Vec<ComponentError>,
}

impl Machine {
    /// Puts a machine together.
    ///
    /// # Errors
    /// A component given twice, or one whose numbers make no sense.
    pub fn new(
        chain: Chain,
        sense: Sense,
        mut errors: Vec<ComponentError>,
    ) -> Result<Self, MachineError> {
        errors.sort_by_key(|e| e.component.index());
        if let Some(pair) = errors.windows(2).find(|p| p[0].component == p[1].component) {
            return Err(MachineError::RepeatedComponent {
                component: pair[0].component,
            });
        }
        for error in &errors {
            error.function.check(error.component)?;
            error.spread.check(error.component)?;
        }
        Ok(Self {
            chain,
            sense,
            errors,
        })
    }

    /// The chain.
    #[must_use]
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Whose deviation the machine states.
    #[must_use]
    pub fn sense(&self) -> Sense {
        self.sense
    }

    /// The component errors given, in the order of [`super::COMPONENTS`].
    #[must_use]
    pub fn errors(&self) -> &[ComponentError] {
        &self.errors
    }

    /// The value of each component at a position, um and rad, in the order of
    /// [`super::COMPONENTS`].
    ///
    /// # Errors
    /// A position that is not finite or outside a table.
    pub fn values(&self, position: &Position) -> Result<[f64; 21], MachineError> {
        if let Some(found) = position.iter().copied().find(|v| !v.is_finite()) {
            return Err(MachineError::NotFinite {
                what: "a coordinate",
                found,
            });
        }
        let mut values = [0.0; 21];
        for error in &self.errors {
            let at = coordinate(error.component, position);
            values[error.component.index()] = error.function.value(error.component, at)?;
        }
        Ok(values)
    }

    /// Deviation of the functional point to first order, um: the general form of NISTIR 6868,
    /// equation (9), and of Soons, equation (1).
    ///
    /// # Errors
    /// As [`Machine::values`].
    pub fn deviation(&self, position: &Position) -> Result<Vector3<f64>, MachineError> {
        let values = self.values(position)?;
        Ok(self.errors.iter().fold(Vector3::zeros(), |sum, error| {
            sum + self.sensitivity(error.component, position) * values[error.component.index()]
        }))
    }

    /// The same by finite rotations, um.
    ///
    /// # Errors
    /// As [`Machine::values`].
    pub fn exact_deviation(&self, position: &Position) -> Result<Vector3<f64>, MachineError> {
        let values = self.values(position)?;
        Ok(exact_deviation(&self.chain, &values, position, self.sense))
    }

    /// Change of the deviation by a component, um per um or per rad.
    #[must_use]
    pub fn sensitivity(&self, component: Component, position: &Position) -> Vector3<f64> {
        sensitivity(&self.chain, component, position, self.sense)
    }
}

/// The coordinate that a component depends on; none for an error of location.
pub(super) fn coordinate(component: Component, position: &Position) -> f64 {
    match component.kind {
        Kind::Squareness => 0.0,
        Kind::Translation | Kind::Rotation => position[component.axis.index()],
    }
}
