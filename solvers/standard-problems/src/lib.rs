//! Least-squares problems whose minima are certified or published.
//!
//! [`strd`] reads the certified regression problems of NIST from their own files; [`mgh`] holds
//! the collection of Moré, Garbow & Hillstrom. Models are written once, over any [`Scalar`]; their
//! derivatives come from the chain rule on [`Dual`] numbers and are exact to rounding. [`ill_posed`] has
//! linear problems to regularize.

pub mod banded;
pub mod dual;
pub mod ill_posed;
pub mod mgh;
pub mod separable;
pub mod strd;

pub use dual::{Dual, Scalar};
