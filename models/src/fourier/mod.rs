//! Straightness by the Fourier two-sensor and three-sensor methods and their combination over several
//! probe spacings.
//!
//! P. Huang et al., *On-machine workpiece straightness profile measurement using a hybrid Fourier
//! 3-sensor method*, Precision Engineering (2022), with its signs corrected: with φ = 2π d/L the second
//! probe sees f(θ + φ), so that the difference m = m₁ − m₂ has M = (1 − e^{+jφω}) F.
//!
//! Positions and spacings are in mm, readings and profiles in µm.

mod along;
mod beyond;
mod diagnosable;
mod effects;
mod estimate;
mod filled;
mod group;
mod joint;
mod noise;
mod quantities;
mod repeatability;
mod result;
mod scan;
mod separation;
mod simulate;
mod spectrum;
mod spread;
mod steps;
mod transfer;
mod width;

pub use beyond::BeyondOrders;
pub use diagnosable::FourierScans;
pub use effects::amplitude;
pub use filled::{Filled, fill};
pub use joint::{Compensation, Joint, ShiftTerm, join, step_terms};
pub use noise::NoiseSource;
pub use repeatability::{mean_deviation, mean_harmonic_deviation, repeatability};
pub use result::{Combination, JointStep, OrderResidual, OrderResult, Separation};
pub use scan::{FourierError, Scan, ScanReading, Section};
pub use separation::{separate, straightness};
pub use simulate::{Disturbance, FourierSimulation, FourierTruth, simulate, simulate_disturbed};
pub use transfer::{LOST_BELOW, determinant, noise_gain, sensitive_orders, transfer};
