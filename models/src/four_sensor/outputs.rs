//! The outputs of the four sensors.

use rand::Rng;

use super::separation::normal;
use super::{FourSensorError, Geometry};

/// Readings of the four sensors at each slide position.
#[derive(Debug, Clone, PartialEq)]
pub struct Outputs {
    geometry: Geometry,
    start: f64,
    readings: Vec<[f64; 4]>,
    /// Variance of each reading over that of most, where some are known less well.
    variances: Option<Vec<[f64; 4]>>,
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
            variances: None,
        })
    }

    /// The same with the variance of each reading, over that of most: n/n_i of an average of n_i readings where others
    /// are of n. Surface and zero-adjustments are fitted as if all were alike; S and γ at a position count what is
    /// known of its own readings.
    #[must_use]
    pub fn with_variances(mut self, variances: Vec<[f64; 4]>) -> Self {
        let usual = variances.iter().flatten().all(|v| *v == 1.0);
        self.variances = Some(variances).filter(|_| !usual);
        self
    }

    /// Variances of the readings at one slide position, over that of most.
    pub(super) fn variances(&self, position: usize) -> [f64; 4] {
        let own = self.variances.as_ref();
        own.and_then(|rows| rows.get(position))
            .copied()
            .unwrap_or([1.0; 4])
    }

    /// Noise of readings of standard deviation `noise`, µm, one row a slide position.
    pub(super) fn random(&self, random: &mut impl Rng, noise: f64) -> Vec<[f64; 4]> {
        (0..self.readings.len())
            .map(|n| self.variances(n).map(|v| noise * v.sqrt() * normal(random)))
            .collect()
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
