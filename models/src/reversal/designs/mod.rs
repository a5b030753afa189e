//! The reversal with any number of indicators, spindle positions and planes.
//!
//! A channel is two angles: φ of the indicator about the spindle axis (near 0°, top 90°, far 180°,
//! bottom 270°) and θ of the spindle, which turns side 0 of the artefact towards the top. The
//! indicator sees the side ψ = φ − θ. With n(a) = (cos a, sin a)
//!
//! ```text
//!     reading = M(x)·n(φ) + S_ψ(x) + [α·n(φ) + γ·n(ψ) + τ + κ_c cos 2ψ + κ_s sin 2ψ]·x + constant
//! ```
//!
//! [`Determined`] says what a list of channels determines, [`staged`] solves the linear model and
//! [`fit`] the exact geometry. See `docs/theory/reversal-designs.md`.

mod analysis;
pub(crate) mod channel;
mod closure;
mod determined;
mod disturbance;
mod error;
mod fit;
mod found;
mod ground;
mod knots;
mod layout;
mod options;
mod problem;
mod readings;
mod rig;
pub mod simulate;
mod solution;
pub mod staged;
mod wave_form;
mod words;

pub use analysis::Analysis;
pub(in crate::reversal) use channel::direction;
pub use channel::{Design, DesignChannel, DesignError, MOST_CHANNELS, SAME_ANGLE_DEG, angle_name};
pub use closure::{DesignClosure, PositionSlope};
pub use determined::{
    Determined, NotDetermined, Remedy, SLOPES, Zero, forms as form_analysis,
    slopes as slope_analysis,
};
pub use error::DesignFitError;
#[doc(hidden)]
pub use fit::central_differences;
pub use fit::fit;
pub use found::{ChannelResiduals, DesignConvergence, Found, FoundForm};
pub use options::{Crest, DesignOptions};
pub use readings::{DesignObservations, DesignReading};
pub use solution::DesignFit;
