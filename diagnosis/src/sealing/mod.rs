//! What a further measurement is expected to show, written down before it is made, and how a measurement
//! that was made compares with it.
//!
//! The state of the model, the causes and the noise are those of the fit that the causes have joined. What a
//! new set-up changes ([`FittedModel::set_anew`](errsep_models::model::FittedModel::set_anew)) is fitted anew and
//! has no part in any number here; all else is carried over.

mod ahead;
mod carried;
mod forecast;
mod score;
mod scored;
mod sealed;

pub use forecast::NotSealed;
pub(super) use forecast::sealed;
pub use score::{Checked, CheckedEffect, CheckedGap, CheckedNumber, CheckedTrace, Standing};
pub(super) use scored::checked;
pub use sealed::{Interval, Sealed, SealedEffect, SealedGap, SealedNumber, SealedTrace};
