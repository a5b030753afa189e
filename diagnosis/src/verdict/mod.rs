//! What is said: the verdict with its sentence, places, how far the gap shrinks, what stays hidden.

pub(super) mod compose;
pub(super) mod conclusion;
pub(super) mod hidden;
pub(super) mod places;
pub(super) mod shape;
pub(super) mod statement;
pub(super) mod told;
pub(super) mod types;
