//! Banded triangles by orthogonal transformations: tall rows are compressed by small Householder
//! factorisations ([`compress`]), folded into a banded triangle ([`BandTriangle::fold`]), and
//! solved with, at a cost linear in rows and in columns.

mod compress;
mod fold;
mod inverse;
mod lanes;
mod sandwich;
mod triangle;

pub use compress::{Tall, compress};
pub use fold::RowStack;
pub use inverse::{BandInverse, stencil_trace};
pub use sandwich::BandSandwich;
pub use triangle::BandTriangle;
