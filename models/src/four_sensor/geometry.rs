//! Where the four sensors stand, and which combinations of their outputs are free of the slide.

use nalgebra::{Matrix4, Matrix4x2, Vector4};

use super::FourSensorError;
use crate::units::UM_PER_MM;

/// The sensors' places on the grid of the sampling points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    step: f64,
    multiples: [usize; 3],
    output_count: usize,
}

impl Geometry {
    /// Sampling interval Δx in mm, spacings D2, D3, D4 as multiples s2, s3, s4 of it, and the number
    /// K of slide positions at which all four sensors were read.
    ///
    /// # Errors
    /// A step that is not positive, a spacing of zero, or fewer outputs than can carry the unknowns.
    pub fn new(
        step: f64,
        multiples: [usize; 3],
        output_count: usize,
    ) -> Result<Self, FourSensorError> {
        if !(step.is_finite() && step > 0.0) {
            return Err(FourSensorError::Step { step });
        }
        if let Some(sensor) = multiples.iter().position(|multiple| *multiple == 0) {
            return Err(FourSensorError::SensorsCoincide { sensor: sensor + 2 });
        }
        let geometry = Self {
            step,
            multiples,
            output_count,
        };
        // 2K equations (two a slide position) against N + 2 unknowns less the three that no data
        // determine: K ≥ s2 + s3 + s4 − 1, and one more so that something is left to judge by.
        let needed = geometry.reach();
        if output_count <= needed {
            return Err(FourSensorError::TooFewOutputs {
                found: output_count,
                needed: needed + 1,
            });
        }
        Ok(geometry)
    }

    /// Sampling interval Δx, mm.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// s2, s3, s4.
    pub fn multiples(&self) -> [usize; 3] {
        self.multiples
    }

    /// Number K of slide positions.
    pub fn output_count(&self) -> usize {
        self.output_count
    }

    /// Number N = K + s2 + s3 + s4 of points of the surface that some sensor sees.
    pub fn point_count(&self) -> usize {
        self.output_count + self.reach()
    }

    /// Places of the sensors in steps from sensor 1.
    pub fn offsets(&self) -> [usize; 4] {
        let [s2, s3, s4] = self.multiples;
        [0, s2, s2 + s3, s2 + s3 + s4]
    }

    /// Places p_i of the sensors from sensor 1, mm.
    pub fn positions(&self) -> Vector4<f64> {
        Vector4::from(self.offsets()).map(|offset| offset as f64 * self.step)
    }

    /// Positions of the surface points relative to the first, mm, length N.
    pub fn surface_positions(&self) -> Vec<f64> {
        (0..self.point_count())
            .map(|n| n as f64 * self.step)
            .collect()
    }

    /// The four triples of sensors in the order of Δe₁ … Δe₄: (1,2,3), (1,2,4), (1,3,4), (2,3,4).
    pub const TRIPLES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];

    /// Periods of surface waves that the outputs do not show, mm, longest first; empty where the
    /// multiples have no common divisor.
    ///
    /// A wave zⁿ is invisible where the four values z^(pᵢ/Δx) are a linear function of pᵢ. Being on a
    /// circle and at four places of one line they are equal then, so that z^g = 1 for the greatest
    /// common divisor g of the multiples: periods gΔx/k. Waves shorter than two steps look like longer
    /// ones and are not listed. The size of such a wave may change linearly along the surface.
    pub fn invisible_periods(&self) -> Vec<f64> {
        let common = self.multiples.into_iter().fold(0, greatest_common_divisor);
        (1..=common / 2)
            .map(|k| common as f64 * self.step / k as f64)
            .collect()
    }

    /// Weights of the four outputs in each triple's combination, one row a triple: the weights of a
    /// triple sum to zero and so do their products with p, the middle one is −1.
    pub fn triple_weights(&self) -> Matrix4<f64> {
        let p = self.positions();
        let mut weights = Matrix4::zeros();
        for (row, [a, b, c]) in Self::TRIPLES.into_iter().enumerate() {
            weights[(row, a)] = (p[c] - p[b]) / (p[c] - p[a]);
            weights[(row, b)] = -1.0;
            weights[(row, c)] = (p[b] - p[a]) / (p[c] - p[a]);
        }
        weights
    }

    /// Two orthonormal combinations of the four outputs that see neither S nor γ: the second- and
    /// third-degree orthogonal polynomials over the sensors' places, one column each.
    ///
    /// A parabola of the surface reaches the first alone, whatever the slide position.
    pub fn slide_free(&self) -> Matrix4x2<f64> {
        let last = self.offsets()[3] as f64;
        let vandermonde = Matrix4::from_fn(|sensor, degree| {
            (self.offsets()[sensor] as f64 / last).powi(degree as i32)
        });
        vandermonde.qr().q().fixed_columns::<2>(2).into_owned()
    }

    /// The columns (1, 1000·p) with which an output sees S in µm and γ in rad.
    pub fn slide_columns(&self) -> Matrix4x2<f64> {
        let p = self.positions();
        Matrix4x2::from_fn(|sensor, column| {
            if column == 0 {
                1.0
            } else {
                UM_PER_MM * p[sensor]
            }
        })
    }

    fn reach(&self) -> usize {
        self.multiples.iter().sum()
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}
