//! What nobody listed: the gap that no effect of the catalogue explains, as an effect of its own, and how
//! such an effect fares on another campaign.

mod ground;
mod learn;
mod smooth;
mod tested;
mod weighed;

pub(super) use learn::learn;
pub use learn::{Learnt, NotLearnt};
pub use tested::Tested;
pub(super) use tested::tested;
pub use weighed::HeldOutAlong;
