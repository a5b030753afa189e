//! The rigid-body model of a machine of three linear axes: 21 component errors, the chain that
//! joins tool and workpiece, and what both say about points and features of a part.
//!
//! Sources: D. E. Gilsinn, A. V. Ling, NISTIR 6868 (2002), sections 4.1 to 4.6; J. A. Soons,
//! *Analysis of the step-diagonal test*, equation (1); ISO 230-1 for the names.
//!
//! Positions are in mm, translations in um, rotations in rad.

pub mod features;
pub mod names;

mod alignment;
mod chain;
mod component;
mod effects;
mod function;
mod joint_draws;
mod kinematics;
mod measured_parts;
mod model;
mod monte_carlo;
mod parts;
mod propagation;
mod regression;
mod repeats;
mod simulate;
mod turn;

pub use alignment::Alignment;
pub use chain::{Chain, Sense, Side, Slide};
pub use component::{Axis, COMPONENTS, Component, Kind};
pub use effects::amplitude;
pub use function::{ErrorFunction, PolynomialBasis};
pub use kinematics::{exact_deviation, sensitivity};
pub use measured_parts::MeasuredParts;
pub use model::{ComponentError, Machine, Position, Spread};
pub use monte_carlo::{Sampler, sample_features};
pub use parts::{PartReading, PartResidual, part_residuals};
pub use propagation::{Functional, Independence, Prediction, Weight, propagate};
pub use regression::{LineSummary, Observation, RegressionError, fit_component};
pub use simulate::{
    Characterization, PartDisturbance, simulate_characterization, simulate_parts,
    simulate_parts_disturbed,
};

use crate::uncertainty::UncertaintyError;

/// What the model cannot answer, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// A part that lies turned by too much.
    #[error(
        "part {part} lies turned by {angle:.4} rad against its nominal coordinates: beyond 0.02 rad it cannot be told along which axis of the machine an error acts"
    )]
    Turned {
        /// The part.
        part: String,
        /// Its turn, rad.
        angle: f64,
    },
    /// A chain that cannot be read.
    #[error(
        "the chain `{chain}` {why}: write X, Y, Z and F once each, from the workpiece to the tool, such as XYFZ"
    )]
    BadChain {
        /// The chain as written.
        chain: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A name that is none of the 21.
    #[error("`{name}` is none of the 21 component errors: write EXX … ECZ, or A0Z, B0Z, C0Y")]
    UnknownComponent {
        /// The name as written.
        name: String,
    },
    /// A component given twice.
    #[error("component {component} is given twice")]
    RepeatedComponent {
        /// The component.
        component: Component,
    },
    /// A location error that was made a function of position.
    #[error(
        "{component} is an error of location: it has one value and does not change along an axis"
    )]
    NotAFunction {
        /// The component.
        component: Component,
    },
    /// A coordinate outside the table of a component.
    #[error(
        "{component} is tabulated from {from} to {to} mm and was asked for at {at} mm: extend the table"
    )]
    OutsideTable {
        /// The component.
        component: Component,
        /// The coordinate, mm.
        at: f64,
        /// First tabulated position, mm.
        from: f64,
        /// Last tabulated position, mm.
        to: f64,
    },
    /// A function or a spread with numbers that make no sense.
    #[error("{component}: {why}")]
    BadComponent {
        /// The component.
        component: Component,
        /// What is wrong.
        why: String,
    },
    /// A position, weight or deviation that is not finite.
    #[error("{what} is {found}: it must be finite")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// What was found.
        found: f64,
    },
    /// Points that do not make the feature.
    #[error("{feature}: {why}")]
    BadFeature {
        /// The feature.
        feature: &'static str,
        /// What is wrong.
        why: String,
    },
    /// A regression that cannot be made.
    #[error("{component}: {source}")]
    Regression {
        /// The component.
        component: Component,
        /// Why.
        source: RegressionError,
    },
    /// A statistic that is not defined.
    #[error(transparent)]
    Uncertainty(#[from] UncertaintyError),
}
