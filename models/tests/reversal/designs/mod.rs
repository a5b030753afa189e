//! The reversal in any number of positions and planes.

mod fit;
mod table;
