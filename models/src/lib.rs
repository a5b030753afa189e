//! Models of the errors of machines, artefacts, sensors and set-ups.

pub mod anova;
pub mod basis;
pub mod calibration_line;
pub mod circle;
pub mod diagonal;
pub mod four_sensor;
pub mod fourier;
pub mod machine;
pub mod missing;
pub mod model;
pub mod noise;
pub mod number;
pub mod positioning;
pub mod reversal;
pub mod straightness;
pub mod uncertainty;
pub mod units;
pub mod zone;
