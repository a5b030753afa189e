//! What stands out of the noise: readings in units of it with what the fit absorbs projected off, the
//! dictionary of signatures and places, and the null distribution that says how seldom as much would
//! stand out with nothing there.

pub(super) mod basis;
pub(super) mod calm;
pub(super) mod dictionary;
pub(super) mod estimate;
pub(super) mod fitted;
pub(super) mod folding;
pub(super) mod gram;
pub(super) mod localise;
pub(super) mod loose;
pub(super) mod null;
pub(super) mod residuals;
pub(super) mod scatter;
pub(super) mod shared_scatter;
pub(super) mod smallest;
pub(super) mod space;
