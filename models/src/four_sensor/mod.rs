//! Straightness and tilt of a slide from four displacement sensors on a common surface.
//!
//! Source: W. Zhao et al., "On-machine measurement of the straightness and tilt errors of a linear
//! slideway using a new four-sensor method", Chin. J. Mech. Eng. 32:24 (2019). Output i at slide
//! position x is
//!
//! ```text
//!     mᵢ(x) = f(x + pᵢ) + S(x) + pᵢ γ(x) + eᵢ,   e₁ = 0,
//! ```
//!
//! with the surface f, the straightness S, the tilt γ and the zero-adjustments e. [`Separator`]
//! fits all of them to the outputs at once; [`PublishedSeparator`] is the paper's own way. Neither
//! can find the parabola of f: see [`Parabola`].

mod along;
mod choice;
mod curves;
mod diagnosable;
pub mod direct;
mod effects;
mod ends;
mod error;
mod excess;
mod frame;
mod gauge;
mod geometry;
mod likeliest;
mod long;
mod outputs;
mod published;
mod quantities;

mod scatter;
mod separation;
pub mod simulate;
pub mod triples;
mod zone;

pub use along::Along;
pub use choice::{Choice, Chosen, Penalised};
pub use diagnosable::FourSensors;
pub use effects::amplitude;
pub use ends::Ends;
pub use error::FourSensorError;
pub use excess::{Excess, Found, ToldBy};
pub use gauge::{Line, Parabola};
pub use geometry::Geometry;
pub use likeliest::Likeliest;
pub use long::{LongSeparator, banded_system, separate_long};
pub use outputs::Outputs;
pub use published::{PublishedSeparation, PublishedSeparator};
pub use scatter::Scatter;
pub use separation::{Profile, Separation, Separator, Settings};
pub use zone::MinimumZone;
