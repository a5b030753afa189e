//! The outputs of the four sensors.

use super::{FourSensorError, Geometry};

/// Readings of the four sensors at each slide position.
#[derive(Debug, Clone, PartialEq)]
pub struct Outputs {
    geometry: Geometry,
    start: f64,
    readings: Vec<[f64; 4]>,
}

impl Outputs {
    /// Readings in µm, one row a slide position, equally spaced by Δx from `start` mm on.
    ///
    /// # Errors
    /// Another number of rows than the geometry says, or a reading that is not finite.
    pub fn new(
        geometry: Geometry,
        start: f64,
        readings: Vec<[f64; 4]>,
    ) -> Result<Self, FourSensorError> {
        if readings.len() != geometry.output_count() {
            return Err(FourSensorError::OutputCount {
                found: readings.len(),
                expected: geometry.output_count(),
            });
        }
        for (row, outputs) in readings.iter().enumerate() {
            if let Some(sensor) = outputs.iter().position(|value| !value.is_finite()) {
                return Err(FourSensorError::NotFinite {
                    sensor: sensor + 1,
                    position: start + row as f64 * geometry.step(),
                });
            }
        }
        Ok(Self {
            geometry,
            start,
            readings,
        })
    }

    /// The sensors' places.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Readings, µm, one row a slide position.
    pub fn readings(&self) -> &[[f64; 4]] {
        &self.readings
    }

    /// Slide positions, mm, length K.
    pub fn slide_positions(&self) -> Vec<f64> {
        self.positions(self.geometry.output_count())
    }

    /// Positions of the surface points, mm, length N.
    pub fn surface_positions(&self) -> Vec<f64> {
        self.positions(self.geometry.point_count())
    }

    fn positions(&self, count: usize) -> Vec<f64> {
        (0..count)
            .map(|n| self.start + n as f64 * self.geometry.step())
            .collect()
    }
}
