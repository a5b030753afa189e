//! Dual numbers: a value and its derivatives by up to [`MOST`] parameters.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The most parameters a standard problem has.
pub const MOST: usize = 12;

/// What a model may do with a parameter.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// A number without derivatives.
    fn constant(value: f64) -> Self;
    /// The value alone.
    fn value(self) -> f64;
    /// A function of the number, given its value and its derivative there.
    fn chain(self, value: f64, derivative: f64) -> Self;

    /// eˣ.
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.chain(value, value)
    }
    /// ln x.
    fn ln(self) -> Self {
        self.chain(self.value().ln(), self.value().recip())
    }
    /// √x.
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root)
    }
    /// sin x.
    fn sin(self) -> Self {
        self.chain(self.value().sin(), self.value().cos())
    }
    /// cos x.
    fn cos(self) -> Self {
        self.chain(self.value().cos(), -self.value().sin())
    }
    /// arctan x.
    fn atan(self) -> Self {
        let x = self.value();
        self.chain(x.atan(), (1.0 + x * x).recip())
    }
    /// |x|, with the derivative 0 at 0.
    fn abs(self) -> Self {
        let x = self.value();
        self.chain(x.abs(), if x == 0.0 { 0.0 } else { x.signum() })
    }
    /// x to a whole power.
    fn powi(self, power: i32) -> Self {
        let x = self.value();
        self.chain(x.powi(power), f64::from(power) * x.powi(power - 1))
    }
    /// x², by one multiplication.
    fn square(self) -> Self {
        self * self
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn chain(self, value: f64, _derivative: f64) -> Self {
        value
    }
}

/// A value with its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its derivatives by the parameters.
    pub gradient: [f64; MOST],
}

impl Dual {
    /// Parameter `index` at `value`.
    pub fn parameter(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; MOST];
        if let Some(entry) = gradient.get_mut(index) {
            *entry = 1.0;
        }
        Self { value, gradient }
    }

    fn combined(self, other: Self, value: f64, own: f64, others: f64) -> Self {
        let mut gradient = [0.0; MOST];
        for (k, entry) in gradient.iter_mut().enumerate() {
            *entry = own * self.gradient[k] + others * other.gradient[k];
        }
        Self { value, gradient }
    }
}

impl Scalar for Dual {
    fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: [0.0; MOST],
        }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self {
            value,
            gradient: self.gradient.map(|g| derivative * g),
        }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.combined(other, self.value + other.value, 1.0, 1.0)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.combined(other, self.value - other.value, 1.0, -1.0)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.combined(other, self.value * other.value, other.value, self.value)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.combined(
            other,
            quotient,
            other.value.recip(),
            -quotient / other.value,
        )
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl Add<f64> for Dual {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        self.chain(self.value + other, 1.0)
    }
}

impl Sub<f64> for Dual {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        self.chain(self.value - other, 1.0)
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other)
    }
}

impl Div<f64> for Dual {
    type Output = Self;
    fn div(self, other: f64) -> Self {
        self.chain(self.value / other, other.recip())
    }
}
