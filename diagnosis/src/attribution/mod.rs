//! Which effects cause the gap: search, confidence set, sizes, and how far the answers move without
//! them.

pub(super) mod allowed;
pub(super) mod alternatives;
pub(super) mod attribute;
pub(super) mod bias;
mod by_traces;
pub(super) mod candidates;
pub(super) mod confidence;
pub(super) mod context;
mod correlated;
pub(super) mod doubt;
mod drifting;
pub(super) mod examined;
mod fewer;
pub(super) mod limits;
pub(super) mod mixing;
mod moments;
mod other_shapes;
pub(super) mod outweighed;
pub(super) mod refine;
pub(super) mod refit;
pub(super) mod remainder;
pub(super) mod reported;
pub(super) mod shrink;
pub(super) mod sizes;
pub(super) mod standing;
