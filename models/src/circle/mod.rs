//! Circles through measured points: algebraic fits as seeds, the orthogonal-distance fit as the
//! answer, and circularity from the least-squares, minimum-zone, inscribed and circumscribed
//! reference circles (ISO 12181: LSCI, MZCI, MICI, MCCI).
//!
//! Positions are in mm; form deviations are in µm and carry `_um` in their names.

mod algebraic;
mod batch;
mod bisector;
mod circumscribed;
mod contacts;
mod diagnosable;
mod effects;
mod inscribed;
mod minimum_zone;
mod neighbours;
mod nistir;
mod orthogonal;
mod passes;
mod points;
mod simulate;
mod zone;

pub use algebraic::{AlgebraicFit, algebraic};
pub use batch::{FittedCircle, orthogonal_fits};
pub use diagnosable::CirclePoints;
pub use effects::amplitude;
pub use nistir::{NistirEnding, NistirFit, nistir_fit};
pub use orthogonal::{CircleFit, OrthogonalCircle, orthogonal_fit};
pub use passes::PassScatter;
pub use points::{Circle, CircleError, LARGEST, Point, ReachedCircle, SMALLEST, check_points};
pub use simulate::{CircleSimulation, Disturbance, simulate, simulate_disturbed};
pub use zone::{Circularity, Reference, Zone, circularity, reference_zone};
