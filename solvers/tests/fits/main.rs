//! The solvers against certified values, other tools and dense algebra.

mod derivatives;
mod every_solver;
mod front_door;
mod invariance;
mod more_garbow_hillstrom;
#[cfg(all(feature = "bootstrap", feature = "checkpoint"))]
mod outsider;
mod strd;
#[cfg(feature = "checkpoint")]
mod structured;
#[cfg(feature = "bootstrap")]
mod uncertainty;
