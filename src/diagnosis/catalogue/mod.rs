//! Effects of the user's own: by a table or by a formula.

pub(super) mod formula;
pub(super) mod tabulated;
