//! A gap as a law: a formula of a stated grammar, corrected for all that was tried and accepted on repeats
//! that it was not chosen on.

mod bench;
mod evidence;
mod find;
mod function;
mod grammar;
mod injected;
mod lens;
mod pattern;
mod search;
mod smooth;
mod told;
mod view;

pub(super) use find::law;
pub use find::{Law, LawFound, LawRival, NoLaw, NoRepeats};
pub use injected::Power;
pub use told::{LawParameter, LawTerm};
