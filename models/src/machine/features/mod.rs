//! What the deviations do to features of a part: lengths, squareness, circularity.
//!
//! A feature is made of nominal points; a made part has each at its nominal place plus the
//! deviation there (NISTIR 6868, equation 39).

mod circularity;
mod length;
mod point;
mod squareness;

pub use circularity::{Circle, circularity_of};
pub use length::{length, length_of};
pub use point::point;
pub use squareness::Squareness;
