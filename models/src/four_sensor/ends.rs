//! Where the ends of the surface lie against its mean line.
//!
//! [`Penalised::ProfileFromEnds`] presumes that both lie on it. Where that is true, S errs less: on the
//! surface of the paper the largest error of twenty runs is less by 37 to 59 % (docs/theory/four-sensor.md). In the terms of the penalties both models are alike but for the
//! scatter of the two end points, which is s in the one and zero in the other. Outputs speak for the
//! second by the factor with which an end is known to lie closer to the mean line than it scatters, and
//! that line is known no better than s√h, with h ≈ 9/N the leverage of an end in the parabola of N values:
//! a factor of √(N/9) an end at most, 2.8 for 69 points, however quiet the sensors are. That the ends lie
//! on the mean line is therefore known from how the surface was made or from another measurement, and
//! never from these outputs; what they can do is contradict it.

use super::{FourSensorError, Line, Outputs, Parabola, Penalised, Separator, Settings};

/// The first and the last point of the surface less its least-squares parabola.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// Height above the mean line, µm.
    pub offset: [f64; 2],
    /// Standard uncertainties, µm: of the noise and the penalty's pull, and of the mean line as the
    /// surface's N scattering points tell it.
    pub std: [f64; 2],
}

impl Ends {
    /// The ends that outputs show to a penalty on the profile itself, which presumes nothing of them;
    /// rule for λ and noise as in `settings`.
    ///
    /// # Errors
    /// As [`Separator::new`] and [`Separator::separate`].
    pub fn of(outputs: &Outputs, settings: &Settings) -> Result<Self, FourSensorError> {
        let settings = Settings {
            parabola: Parabola::LeastNorm,
            ..*settings
        };
        let separator = Separator::new(outputs.geometry(), Penalised::Profile, Line::LeastSquares)?;
        let found = separator.separate(outputs, &settings)?;
        let last = found.surface.values.len() - 1;
        let of_line = found.scatter.even.powi(2) * leverage_of_an_end(last + 1);
        let ends = [0, last];
        Ok(Self {
            offset: ends.map(|n| found.surface.values[n]),
            std: ends.map(|n| (found.surface.std[n].powi(2) + of_line).sqrt()),
        })
    }

    /// Whether the outputs contradict that both lie on the mean line: one is more than `factor` standard
    /// uncertainties away.
    pub fn contradict(&self, factor: f64) -> bool {
        let off = |(offset, std): (&f64, &f64)| offset.abs() > factor * std;
        self.offset.iter().zip(&self.std).any(off)
    }
}

/// Leverage of the first of `count` values in equal steps in their least-squares parabola: the sum of the
/// squares there of the orthonormal polynomials of degree 0, 1 and 2.
fn leverage_of_an_end(count: usize) -> f64 {
    let n = count as f64;
    let line = 3.0 * (n - 1.0) / (n * (n + 1.0));
    let bow = 5.0 * (n - 1.0) * (n - 2.0) / (n * (n + 1.0) * (n + 2.0));
    1.0 / n + line + bow
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// Epsilons: the diagonal of the projector by a QR decomposition.
    #[test]
    fn the_leverage_is_that_of_the_projector() {
        for count in [5, 69, 400] {
            let q = DMatrix::from_fn(count, 3, |n, power| {
                (2.0 * n as f64 / (count - 1) as f64 - 1.0).powi(power as i32)
            })
            .qr()
            .q();
            let expected = q.row(0).norm_squared();
            assert!((leverage_of_an_end(count) - expected).abs() < 1e-13);
        }
    }
}
