//! Readings and set-up of a reversal, as files hold them.

mod corrected;
mod crest;
mod data;
mod designs;
mod setup;

pub use corrected::{corrected, corrected_design};
pub use crest::StylusBeside;
pub use data::{Layout, ReversalData, read};
pub use designs::{DesignData, Readings, read_any};
pub use setup::{Angles, ReversalSetup, channels};
