//! Effects of the user's own: by a table, by a formula, or by curves that were learnt.

pub(super) mod curve;
pub(super) mod formula;
pub(super) mod tabulated;
pub(super) mod written;
