//! The reversal in any number of positions and planes.

mod effects;
mod fit;
mod table;
