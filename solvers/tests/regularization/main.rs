//! Rules that choose the weight of a regularization.

mod banded;
mod likelihood;
#[cfg(feature = "periodogram")]
mod rules;
