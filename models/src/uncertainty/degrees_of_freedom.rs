//! Degrees of freedom of a standard uncertainty, finite or infinite, and the effective ones of a
//! combination.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::UncertaintyError;

/// How well a standard uncertainty is itself known (GUM G.4). In JSON a number, or `"infinite"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DegreesOfFreedom {
    /// A positive number, not necessarily whole.
    Finite(f64),
    /// The standard uncertainty is taken as exactly known.
    Infinite,
}

impl DegreesOfFreedom {
    /// A positive number; positive infinity is accepted as [`DegreesOfFreedom::Infinite`].
    ///
    /// # Errors
    /// Zero, negative numbers and NaN.
    pub fn new(number: f64) -> Result<Self, UncertaintyError> {
        if number == f64::INFINITY {
            Ok(Self::Infinite)
        } else if number.is_finite() && number > 0.0 {
            Ok(Self::Finite(number))
        } else {
            Err(UncertaintyError::BadDegreesOfFreedom { found: number })
        }
    }

    /// The number, infinity when infinite.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Finite(number) => number,
            Self::Infinite => f64::INFINITY,
        }
    }

    /// The next lower whole number, at least 1: the cautious reading of GUM G.6.4.
    #[must_use]
    pub fn truncated(self) -> Self {
        match self {
            Self::Finite(number) => Self::Finite(number.floor().max(1.0)),
            Self::Infinite => Self::Infinite,
        }
    }
}

impl std::fmt::Display for DegreesOfFreedom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Finite(number) if number.fract() == 0.0 => write!(f, "{number:.0}"),
            Self::Finite(number) => write!(f, "{number:.1}"),
            Self::Infinite => f.write_str("infinite"),
        }
    }
}

impl Serialize for DegreesOfFreedom {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Finite(number) => serializer.serialize_f64(*number),
            Self::Infinite => serializer.serialize_str("infinite"),
        }
    }
}

impl<'de> Deserialize<'de> for DegreesOfFreedom {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrWord;
        impl de::Visitor<'_> for NumberOrWord {
            type Value = DegreesOfFreedom;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a positive number or the word \"infinite\"")
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Self::Value, E> {
                DegreesOfFreedom::new(number).map_err(E::custom)
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Self::Value, E> {
                self.visit_f64(number as f64)
            }

            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Self::Value, E> {
                self.visit_f64(number as f64)
            }

            fn visit_str<E: de::Error>(self, word: &str) -> Result<Self::Value, E> {
                if word == "infinite" {
                    Ok(DegreesOfFreedom::Infinite)
                } else {
                    Err(E::invalid_value(de::Unexpected::Str(word), &self))
                }
            }
        }
        deserializer.deserialize_any(NumberOrWord)
    }
}

/// Effective degrees of freedom of independent contributions `|c_i| u_i` (Welch–Satterthwaite,
/// GUM G.4.1, equation G.2b): `u_c⁴ / Σ u_i⁴ / ν_i`.
///
/// Infinite when every contribution with finite degrees of freedom vanishes.
#[must_use]
pub fn welch_satterthwaite(contributions: &[(f64, DegreesOfFreedom)]) -> DegreesOfFreedom {
    // Scaled by the largest, so that fourth powers of lengths in metres do not underflow.
    let largest = contributions
        .iter()
        .fold(0.0_f64, |m, (u, _)| m.max(u.abs()));
    if largest == 0.0 {
        return DegreesOfFreedom::Infinite;
    }
    let mut variance = 0.0;
    let mut denominator = 0.0;
    for (u, degrees) in contributions {
        let square = (u / largest).powi(2);
        variance += square;
        denominator += square * square / degrees.as_f64();
    }
    if denominator == 0.0 {
        DegreesOfFreedom::Infinite
    } else {
        DegreesOfFreedom::Finite(variance * variance / denominator)
    }
}
