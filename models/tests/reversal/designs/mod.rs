//! The reversal in any number of positions and planes.

mod bands;
mod crest;
mod effects;
mod fit;
mod knots;
mod noise;
mod table;
mod thickness;
