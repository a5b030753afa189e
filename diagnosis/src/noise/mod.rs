//! The noise of the readings, before anything is said of a gap: its law from what differs between
//! repeats, with jumps and spikes told apart from it, and the whitening by that law.

pub(super) mod by_fit;
pub(super) mod contrasts;
mod course;
pub(super) mod dependence;
pub(super) mod jumps;
pub(super) mod law;
pub(super) mod piles;
pub(super) mod posterior;
pub(super) mod spikes;
pub(super) mod steps;
mod uneven;
pub(super) mod whitening;
