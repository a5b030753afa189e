//! What nobody listed: the gap that no effect of the catalogue explains, as an effect of its own, and how
//! such an effect fares on another campaign.

mod ground;
mod learn;
mod smooth;
mod tested;
mod weighed;

pub use learn::{Learnt, NotLearnt, learn};
pub use tested::{Tested, tested};
pub use weighed::HeldOutAlong;
