//! The profile from the difference signals: one spacing, the best spacing of each order, or all
//! spacings by least squares.

use super::joint::{Compensation, Joint, join};
use super::noise::{NoiseSource, estimate_noise};
use super::repeatability::repeatability;
use super::scan::{FourierError, Scan, Section};
use super::spectrum::{coefficients, profile};
use super::transfer::{LOST_BELOW, determinant, transfer};
use super::variance::profile_std;
use crate::uncertainty::DegreesOfFreedom;
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
    /// Noise gain: standard deviation of F in units of that of one M of the first scan's length.
    pub gain: f64,
    /// Fourier coefficient, µm; zero where the order is lost.
    pub coefficient: Complex64,
    /// Standard uncertainty of real and imaginary part, µm.
    pub std: f64,
    /// Whether no spacing passes the order.
    pub lost: bool,
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
    /// Positions, mm.
    pub x: Vec<f64>,
    /// Workpiece, µm, mean zero.
    pub workpiece: Vec<f64>,
    /// Standard uncertainty of the workpiece at each position, µm.
    pub workpiece_std: Vec<f64>,
    /// Slide, µm, mean zero: mean over the scans of P1 less the workpiece.
    pub slide: Vec<f64>,
    /// Orders 1, 2, ….
    pub orders: Vec<OrderResult>,
    /// Orders that no spacing passes; they are zero in the profile.
    pub lost: Vec<usize>,
    /// Standard deviation of one reading, µm, and where it came from.
    pub noise: (f64, NoiseSource),
    /// How well that is known: infinite where it was given, none where nothing is
    /// left over to tell it.
    pub degrees_of_freedom: Option<DegreesOfFreedom>,
    /// Mean height difference A2 − A3 of the scans that give one, µm.
    pub height_difference: Option<f64>,
    /// Mean rise of the workpiece over the section, µm, if the slide ends level.
    pub rise: Option<f64>,
    /// Residuals of the combination; empty for a single scan, which leaves none.
    pub residuals: Vec<OrderResidual>,
    /// U_sp over the repeats, µm, where there are at least two complete ones.
    pub repeatability: Option<f64>,
}

/// Separates the workpiece from the slide.
///
/// `noise` is the standard deviation of one reading in µm where it is known.
///
/// # Errors
/// Those of [`join`], and [`FourierError::NoScan`].
pub fn separate(
    scans: &[Scan],
    section: Section,
    compensation: Compensation,
    combination: Combination,
    noise: Option<f64>,
) -> Result<Separation, FourierError> {
    let joints: Vec<Joint> = scans
        .iter()
        .map(|scan| join(scan, section, compensation))
        .collect::<Result<_, _>>()?;
    let Some(first) = joints.first() else {
        return Err(FourierError::NoScan);
    };
    let samples = first.difference.len();
    let spectra: Vec<Vec<Complex64>> = joints
        .iter()
        .map(|j| coefficients(&j.difference, section.orders))
        .collect();
    let sizes: Vec<usize> = joints.iter().map(|j| j.difference.len()).collect();
    let mut orders: Vec<OrderResult> = (1..=section.orders)
        .map(|order| combine(order, scans, &spectra, &sizes, section.length, combination))
        .collect();
    let (sigma, source, degrees_of_freedom) = match noise {
        Some(sigma) => (sigma, NoiseSource::Given, Some(DegreesOfFreedom::Infinite)),
        None => estimate_noise(scans, &joints, &spectra, &sizes, section),
    };
    // M is a mean over N of differences of two readings: each of its two parts has σ/√N.
    for order in &mut orders {
        order.std = order.gain * sigma / (samples as f64).sqrt();
    }
    let mut series = vec![Complex64::default()];
    series.extend(orders.iter().map(|o| o.coefficient));
    let workpiece = profile(&series, samples);
    let slide = slide_of(&joints, &workpiece);
    let workpiece_std = profile_std(scans, &joints, &orders, section, combination, sigma);
    Ok(Separation {
        combination,
        x: (0..samples)
            .map(|i| section.length * i as f64 / samples as f64)
            .collect(),
        workpiece,
        workpiece_std,
        slide,
        lost: orders.iter().filter(|o| o.lost).map(|o| o.order).collect(),
        residuals: residuals_of(scans, &spectra, &sizes, &orders, section.length, sigma),
        height_difference: mean(joints.iter().filter_map(|j| j.height_difference)),
        rise: mean(joints.iter().filter_map(|j| j.rise)),
        repeatability: repeats(scans, section, compensation, combination)?,
        orders,
        noise: (sigma, source),
        degrees_of_freedom,
    })
}

pub(super) fn combine(
    order: usize,
    scans: &[Scan],
    spectra: &[Vec<Complex64>],
    sizes: &[usize],
    length: f64,
    combination: Combination,
) -> OrderResult {
    let determinants: Vec<f64> = scans
        .iter()
        .map(|s| determinant(s.spacing, length, order))
        .collect();
    let best_scan = (0..scans.len())
        .max_by(|&i, &j| determinants[i].total_cmp(&determinants[j]).then(j.cmp(&i)))
        .unwrap_or(0);
    let lost = determinants[best_scan] < LOST_BELOW;
    let mut numerator = Complex64::default();
    let mut information = 0.0;
    for (i, scan) in scans.iter().enumerate() {
        let used = match combination {
            Combination::LeastSquares => true,
            Combination::Hybrid => scan.spacing == scans[best_scan].spacing,
        };
        if used {
            let weight = sizes[i] as f64 / sizes[0] as f64;
            numerator += weight * transfer(scan.spacing, length, order).conj() * spectra[i][order];
            information += weight * determinants[i];
        }
    }
    OrderResult {
        order,
        determinants,
        best_scan,
        gain: if lost {
            0.0
        } else {
            information.sqrt().recip()
        },
        coefficient: if lost {
            Complex64::default()
        } else {
            numerator / information
        },
        std: 0.0,
        lost,
    }
}

fn slide_of(joints: &[Joint], workpiece: &[f64]) -> Vec<f64> {
    let same: Vec<&Joint> = joints
        .iter()
        .filter(|j| j.first.len() == workpiece.len())
        .collect();
    let mut slide: Vec<f64> = workpiece
        .iter()
        .enumerate()
        .map(|(k, w)| same.iter().map(|j| j.first[k]).sum::<f64>() / same.len() as f64 - w)
        .collect();
    let level = slide.iter().sum::<f64>() / slide.len().max(1) as f64;
    for s in &mut slide {
        *s -= level;
    }
    slide
}

fn residuals_of(
    scans: &[Scan],
    spectra: &[Vec<Complex64>],
    sizes: &[usize],
    orders: &[OrderResult],
    length: f64,
    sigma: f64,
) -> Vec<OrderResidual> {
    if scans.len() < 2 || sigma <= 0.0 {
        return Vec::new();
    }
    let mut residuals = Vec::new();
    for (i, scan) in scans.iter().enumerate() {
        let std = sigma / (sizes[i] as f64).sqrt();
        for o in orders.iter().filter(|o| !o.lost) {
            let t = transfer(scan.spacing, length, o.order);
            residuals.push(OrderResidual {
                scan: i,
                spacing: scan.spacing,
                repeat: scan.repeat,
                order: o.order,
                value: (spectra[i][o.order] - t * o.coefficient) / std,
                sensitivity: -t / std,
            });
        }
    }
    residuals
}

pub(super) fn spacings(scans: &[Scan]) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    for scan in scans {
        if !found.contains(&scan.spacing) {
            found.push(scan.spacing);
        }
    }
    found
}

/// U_sp over repeats that each have every spacing.
fn repeats(
    scans: &[Scan],
    section: Section,
    compensation: Compensation,
    combination: Combination,
) -> Result<Option<f64>, FourierError> {
    let mut numbers: Vec<u32> = scans.iter().map(|s| s.repeat).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.len() < 2 {
        return Ok(None);
    }
    let all = spacings(scans).len();
    let mut profiles = Vec::new();
    for number in numbers {
        let own: Vec<Scan> = scans
            .iter()
            .filter(|s| s.repeat == number)
            .cloned()
            .collect();
        if spacings(&own).len() == all {
            let one = separate(&own, section, compensation, combination, Some(0.0))?;
            profiles.push(one.workpiece);
        }
    }
    Ok(repeatability(&profiles))
}

/// The profile without its least-squares line: what is called straightness.
pub fn straightness(x: &[f64], profile: &[f64]) -> Vec<f64> {
    let n = x.len().min(profile.len()).max(1) as f64;
    let centre = x.iter().sum::<f64>() / n;
    let level = profile.iter().sum::<f64>() / n;
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for (a, b) in x.iter().zip(profile) {
        sxx += (a - centre).powi(2);
        sxy += (a - centre) * (b - level);
    }
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    x.iter()
        .zip(profile)
        .map(|(a, b)| b - level - slope * (a - centre))
        .collect()
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(s, n), v| (s + v, n + 1));
    (count > 0).then(|| sum / f64::from(count))
}
