//! Circles, Fourier tests and the four-sensor system.

mod circle_batch;
mod circle_exact;
mod circle_fit;
mod circle_zones;
mod four_sensor;
mod four_sensor_uncertainty;
mod fourier_table1;
mod fourier_uncertainty;
