//! A band with a border: many unknowns of which each row sees a few neighbours, and a few unknowns
//! which every row sees, with linear equality constraints between the two.
//!
//! The triangle of the whole system is
//!
//! ```text
//!     R_cc  R_cy | t_c      n rows, R_cc banded
//!           R_yy | t_y      q rows, dense
//! ```
//!
//! for min ‖Jδ + r‖². It is built by [`Bordered::absorb`] from small triangles, one a group of
//! rows, and nothing of the size rows × unknowns exists.

mod assemble;
mod constraints;
mod covariance;
mod model;
mod sandwich;
mod solve;
mod symmetric;

pub use assemble::{Bordered, Group, Share};
pub use constraints::Constraints;
pub use covariance::BorderedCovariance;
pub use model::BorderedModel;
pub use sandwich::{Combination, Sandwich};
pub use solve::{Solved, Undetermined};
pub use symmetric::BorderedSymmetric;
