//! One-way analysis of variance of replicates: what the parts differ by, against what the
//! measurement of one part scatters by.
//!
//! Source: D. E. Gilsinn, A. V. Ling, NISTIR 6868 (2002), section 5. The report reads the mean
//! square between parts as the variance of manufacturing; here the components of variance are
//! separated, and the report's own arithmetic is kept as a named choice in [`recipe`].

mod components;
mod groups;
mod one_way;
pub mod recipe;
mod repeats;
mod simulate;

pub use components::{Components, Interval};
pub use groups::{Group, Groups};
pub use one_way::{MeanSquare, OneWay, analyse};
pub use repeats::{Repeats, analyse_repeats};
pub use simulate::{Truth, simulate};

use crate::uncertainty::UncertaintyError;

/// Replicates that cannot be analysed, and why.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AnovaError {
    /// No group at all.
    #[error("there are no readings to analyse")]
    Empty,
    /// A group without readings.
    #[error("group `{group}` holds no reading: leave it out")]
    EmptyGroup {
        /// Name of the group.
        group: String,
    },
    /// Two groups of one name.
    #[error("group `{group}` is given twice: put its readings together")]
    RepeatedGroup {
        /// Name of the group.
        group: String,
    },
    /// A reading that is not finite.
    #[error("reading {number} of group `{group}` is {found}: it must be finite")]
    NotFinite {
        /// Name of the group.
        group: String,
        /// Number of the reading in its group, from 1.
        number: usize,
        /// What was found.
        found: f64,
    },
    /// One reading cannot show any scatter.
    #[error("there is one reading only: a scatter needs at least two")]
    OneReading,
    /// The readings are too large for their squares.
    #[error("the readings are so large that their squares overflow: choose a larger unit")]
    Overflow,
    /// A recipe that needs both scatters.
    #[error(
        "this recipe compares groups with repeats: it needs at least two groups, one of them \
         measured twice"
    )]
    NothingToCompare,
    /// A count or spread for the simulation that makes no sense.
    #[error("{what} is {found}: {remedy}")]
    BadTruth {
        /// What was given.
        what: &'static str,
        /// Its value.
        found: f64,
        /// What to give instead.
        remedy: &'static str,
    },
    /// A statistic that is not defined.
    #[error(transparent)]
    Uncertainty(#[from] UncertaintyError),
}
