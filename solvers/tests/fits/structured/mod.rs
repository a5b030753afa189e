//! The structured solver against dense linear algebra, on a problem written as an outsider would.

mod algebra;
mod problem;
mod runs;
