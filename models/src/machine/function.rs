//! A component error as a function of the coordinate of its axis.

use super::{Component, Kind, MachineError};

/// Powers `((x - centre) / scale)^k`, `k` from 0 to `terms - 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolynomialBasis {
    /// Where the powers vanish, mm.
    pub centre: f64,
    /// What makes them of order one, mm.
    pub scale: f64,
    /// Their number.
    pub terms: usize,
}

impl PolynomialBasis {
    /// Plain powers of the coordinate.
    #[must_use]
    pub const fn plain(terms: usize) -> Self {
        Self {
            centre: 0.0,
            scale: 1.0,
            terms,
        }
    }

    /// The powers at a coordinate.
    pub fn powers(&self, x: f64) -> impl Iterator<Item = f64> {
        let t = (x - self.centre) / self.scale;
        std::iter::successors(Some(1.0), move |power| Some(power * t)).take(self.terms)
    }
}

/// Value over the coordinate of the axis: um for a translation, rad for a rotation.
#[derive(Debug, Clone, PartialEq)]
pub enum ErrorFunction {
    /// A polynomial; a single term is a constant.
    Polynomial {
        /// Its powers.
        basis: PolynomialBasis,
        /// One coefficient a power.
        coefficients: Vec<f64>,
    },
    /// Straight lines between tabulated values.
    Table {
        /// Ascending coordinates, mm.
        positions: Vec<f64>,
        /// Value at each.
        values: Vec<f64>,
    },
}

impl ErrorFunction {
    /// The constant function.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self::Polynomial {
            basis: PolynomialBasis::plain(1),
            coefficients: vec![value],
        }
    }

    /// A polynomial by its coefficients of 1, x, x², … in um or rad a power of mm.
    #[must_use]
    pub fn polynomial(coefficients: Vec<f64>) -> Self {
        Self::Polynomial {
            basis: PolynomialBasis::plain(coefficients.len()),
            coefficients,
        }
    }

    /// Checks the numbers, and that an error of location is a constant.
    ///
    /// # Errors
    /// What is wrong, under the name of the component.
    pub fn check(&self, component: Component) -> Result<(), MachineError> {
        let bad = |why: &str| {
            Err(MachineError::BadComponent {
                component,
                why: why.to_owned(),
            })
        };
        let (parts, numbers) = match self {
            Self::Polynomial {
                basis,
                coefficients,
            } => {
                if basis.terms != coefficients.len() {
                    return bad("its polynomial has not one coefficient a power");
                }
                if !(basis.centre.is_finite() && basis.scale.is_finite() && basis.scale != 0.0) {
                    return bad("its polynomial has a centre or scale that is not usable");
                }
                (coefficients.len(), coefficients.iter().chain(&[]))
            }
            Self::Table { positions, values } => {
                if positions.len() != values.len() {
                    return bad("its table has not one value a position");
                }
                if positions.len() < 2 {
                    return bad("its table needs at least two positions");
                }
                if positions.windows(2).any(|pair| pair[1] <= pair[0]) {
                    return bad("the positions of its table must ascend");
                }
                (positions.len(), positions.iter().chain(values))
            }
        };
        if numbers.into_iter().any(|v| !v.is_finite()) {
            return bad("its numbers must be finite");
        }
        if component.kind == Kind::Squareness && parts > 1 {
            return Err(MachineError::NotAFunction { component });
        }
        Ok(())
    }

    /// The value at a coordinate (mm).
    ///
    /// # Errors
    /// A coordinate outside the table.
    pub fn value(&self, component: Component, x: f64) -> Result<f64, MachineError> {
        match self {
            Self::Polynomial {
                basis,
                coefficients,
            } => Ok(basis
                .powers(x)
                .zip(coefficients)
                .map(|(power, c)| power * c)
                .sum()),
            Self::Table { positions, values } => {
                let (Some(&from), Some(&to)) = (positions.first(), positions.last()) else {
                    return Ok(0.0);
                };
                if !(from..=to).contains(&x) {
                    return Err(MachineError::OutsideTable {
                        component,
                        at: x,
                        from,
                        to,
                    });
                }
                let right = positions
                    .partition_point(|p| *p < x)
                    .clamp(1, positions.len() - 1);
                let left = right - 1;
                let t = (x - positions[left]) / (positions[right] - positions[left]);
                Ok(values[left] + t * (values[right] - values[left]))
            }
        }
    }
}
