//! What a separation gives.

use super::beyond::BeyondOrders;
use super::joint::Compensation;
use super::noise::NoiseSource;
use super::width::Errors;
use crate::uncertainty::{DegreesOfFreedom, Disagreement};
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// How the candidates of the scans become one coefficient per order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combination {
    /// The spacing with the largest determinant, equation (27); the mean of its repeats.
    Hybrid,
    /// All scans: F = Σ N T* M / Σ N |T|², which has the least variance.
    #[default]
    LeastSquares,
}

/// One order of the profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderResult {
    /// Undulations per section.
    pub order: usize,
    /// det W of each scan, in the order of the scans.
    pub determinants: Vec<f64>,
    /// Scan whose determinant is largest.
    pub best_scan: usize,
    /// Noise gain with the steps known: standard deviation of F in units of that of one M of the first
    /// scan's length.
    pub gain: f64,
    /// Fourier coefficient, µm; zero where the order is lost.
    pub coefficient: Complex64,
    /// Standard uncertainty of the real part, µm.
    pub real_std: f64,
    /// Standard uncertainty of the imaginary part, µm.
    pub imaginary_std: f64,
    /// Covariance of the two parts, µm².
    pub covariance: f64,
    /// Whether no spacing passes the order.
    pub lost: bool,
}

impl Separation {
    /// White and correlated standard deviation of a reading, µm, and the length, mm, where repeats tell noise that is
    /// correlated along the scans.
    #[must_use]
    pub fn correlated_noise(&self) -> Option<(f64, f64, f64)> {
        let (white, correlated, length) = self.errors.along.as_ref()?.parts();
        Some((self.noise.0 * white, self.noise.0 * correlated, length))
    }
}

impl OrderResult {
    /// Root mean square of the standard uncertainties of both parts, µm.
    #[must_use]
    pub fn std(&self) -> f64 {
        (0.5 * (self.real_std.powi(2) + self.imaginary_std.powi(2))).sqrt()
    }

    /// Standard uncertainty of the peak amplitude 2 |F|, µm: of 2 F in the direction of F.
    #[must_use]
    pub fn amplitude_std(&self) -> f64 {
        let size = self.coefficient.norm();
        if size == 0.0 {
            return 2.0 * self.std();
        }
        let (c, s) = (self.coefficient.re / size, self.coefficient.im / size);
        let variance = (c * self.real_std).powi(2)
            + (s * self.imaginary_std).powi(2)
            + 2.0 * c * s * self.covariance;
        2.0 * variance.max(0.0).sqrt()
    }
}

/// The step at the joint of the scans of one spacing: A2 − A3 and the rise of the workpiece together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointStep {
    /// Probe spacing, mm.
    pub spacing: f64,
    /// Mean over the repeats, µm.
    pub value: f64,
    /// Its standard uncertainty, µm.
    pub std: f64,
}

/// One residual of the combination: M − T F of a scan and an order, scaled to unit variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OrderResidual {
    /// Index of the scan.
    pub scan: usize,
    /// Probe spacing, mm.
    pub spacing: f64,
    /// Repeat number.
    pub repeat: u32,
    /// Order.
    pub order: usize,
    /// Residual, in standard deviations of M.
    pub value: Complex64,
    /// ∂/∂F of the residual: −T over the standard deviation of M.
    pub sensitivity: Complex64,
}

/// The separated profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// How the scans were combined.
    pub combination: Combination,
    /// How the steps at the joints were taken: as asked for, or [`Compensation::Chord`] where they were
    /// to be fitted and form beyond the orders kept forbids it.
    pub compensation: Compensation,
    /// Positions, mm.
    pub x: Vec<f64>,
    /// Workpiece, µm, mean zero.
    pub workpiece: Vec<f64>,
    /// Standard uncertainty of the workpiece at each position, µm.
    pub workpiece_std: Vec<f64>,
    /// The workpiece less its least-squares line, µm.
    pub straightness: Vec<f64>,
    /// Standard uncertainty of that at each position, µm.
    pub straightness_std: Vec<f64>,
    /// Slide, µm, mean zero: mean over the scans of P1 less the workpiece.
    pub slide: Vec<f64>,
    /// Standard uncertainty of the slide less its least-squares line at each position, µm: its slope
    /// cannot be told from that of the workpiece.
    pub slide_std: Vec<f64>,
    /// Orders 1, 2, ….
    pub orders: Vec<OrderResult>,
    /// Orders that no spacing passes; they are zero in the profile.
    pub lost: Vec<usize>,
    /// Steps at the joint, one a spacing: fitted, or from the readings at the joint where these are
    /// taken out; empty without a third probe.
    pub steps: Vec<JointStep>,
    /// Standard deviation of one reading, µm, and where it came from.
    pub noise: (f64, NoiseSource),
    /// By how much a reading of P1 differs from scan to scan, µm; none with one scan.
    pub first_scatter: Option<f64>,
    /// How well that is known: infinite where it was given.
    pub degrees_of_freedom: DegreesOfFreedom,
    /// Form finer than the orders kept, where the readings show any.
    pub beyond_orders: Option<BeyondOrders>,
    /// Scatter between spacings that the noise does not explain, where there is any.
    pub disagreement: Option<Disagreement>,
    /// Mean height difference A2 − A3 of the scans that give one, µm.
    pub height_difference: Option<f64>,
    /// Mean rise of the workpiece over the section, µm, if the slide ends level.
    pub rise: Option<f64>,
    /// Residuals of the combination; empty for a single scan, which leaves none.
    pub residuals: Vec<OrderResidual>,
    /// U_sp over the repeats, µm, where there are at least two complete ones.
    pub repeatability: Option<f64>,
    pub(super) errors: Errors,
}
