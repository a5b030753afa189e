//! Box bounds on parameters.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// Lower and upper limits of each parameter; infinite where there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Which limit of a box a parameter sits on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// The lower limit.
    Lower,
    /// The upper limit.
    Upper,
}

/// A parameter that ended on its bound, pressed against it by the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActiveBound {
    /// Index of the parameter.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The limit it sits on.
    pub side: Side,
    /// The value of that limit.
    pub value: f64,
}

impl Bounds {
    /// No limits for `parameters` parameters.
    pub fn none(parameters: usize) -> Self {
        Self {
            lower: DVector::from_element(parameters, f64::NEG_INFINITY),
            upper: DVector::from_element(parameters, f64::INFINITY),
        }
    }

    /// Limits for every parameter at once, both of length n.
    pub fn new(lower: DVector<f64>, upper: DVector<f64>) -> Self {
        Self { lower, upper }
    }

    /// The same box with parameter `index` kept between `lower` and `upper`; an index beyond the
    /// last parameter leaves the box as it is.
    #[must_use]
    pub fn with(mut self, index: usize, lower: f64, upper: f64) -> Self {
        if let (Some(low), Some(high)) = (self.lower.get_mut(index), self.upper.get_mut(index)) {
            *low = lower;
            *high = upper;
        }
        self
    }

    /// The same box with `more` parameters after the last one, without limits.
    #[must_use]
    pub fn extended(&self, more: usize) -> Self {
        let n = self.lower.len();
        Self {
            lower: self
                .lower
                .clone()
                .resize_vertically(n + more, f64::NEG_INFINITY),
            upper: self
                .upper
                .clone()
                .resize_vertically(n + more, f64::INFINITY),
        }
    }

    /// Lower limits, length n.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// Upper limits, length n.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// The limit a parameter sits on while the cost falls towards the outside; a parameter whose
    /// limits coincide always sits on its lower one.
    pub fn pressed(&self, index: usize, value: f64, gradient: f64) -> Option<Side> {
        if self.lower[index] == self.upper[index] || (value <= self.lower[index] && gradient > 0.0)
        {
            Some(Side::Lower)
        } else if value >= self.upper[index] && gradient < 0.0 {
            Some(Side::Upper)
        } else {
            None
        }
    }

    /// The limit that `value` lies beyond, if any.
    pub(crate) fn beyond(&self, index: usize, value: f64) -> Option<f64> {
        if value < self.lower[index] {
            Some(self.lower[index])
        } else if value > self.upper[index] {
            Some(self.upper[index])
        } else {
            None
        }
    }
}
