//! The four-channel reversal: the parallelism of spindle and slide, the form of the slide and the
//! form of both sides of the artefact, from traces at two spindle positions.

mod cells;
mod channel_noise;
mod combinations;
mod convention;
pub mod designs;
pub mod diagnosable;
pub mod effects;
mod exact_form;
pub mod exact_readings;
mod falling;
mod finer_forms;
pub mod forward;
pub mod injected;
mod injection;
mod observations;
mod rounding;
pub mod simulate;
pub mod simultaneous;
mod smooth_profile;
pub mod staged;
mod straight_line;
pub mod turning;
pub mod turning_bar;

pub use combinations::Combination;
pub use convention::{Contrast, Convention, NOT_SHOWN};
pub use observations::{Channel, Direction, Observations, Reading};
pub use rounding::Rounding;
