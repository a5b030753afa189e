//! The standard deviation of one reading, found from the scans themselves.

use super::joint::Joint;
use super::scan::{Scan, Section};
use super::separation::{Combination, combine, spacings};
use super::transfer::transfer;
use crate::uncertainty::DegreesOfFreedom;
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Where the standard deviation of one reading came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// Given in the set-up.
    Given,
    /// Scatter of repeats of one spacing.
    Repeats,
    /// Disagreement of the spacings about the orders kept.
    Spacings,
    /// Difference signal beyond the orders kept: an upper bound, it holds the finer form too.
    BeyondOrders,
}

/// The best estimate that these scans allow, µm, where it came from and how well it is known.
pub(super) fn estimate_noise(
    scans: &[Scan],
    joints: &[Joint],
    spectra: &[Vec<Complex64>],
    sizes: &[usize],
    section: Section,
) -> (f64, NoiseSource, Option<DegreesOfFreedom>) {
    if let Some((sigma, freedom)) = noise_of_repeats(scans, joints) {
        return (
            sigma,
            NoiseSource::Repeats,
            DegreesOfFreedom::new(freedom).ok(),
        );
    }
    if scans.len() > 1 {
        // Each order leaves two degrees of freedom less than its scans have, whatever combination is
        // asked for: the disagreement is measured about the least-squares one.
        let (mut sum, mut freedom) = (0.0, 0);
        for order in 1..=section.orders {
            let best = combine(
                order,
                scans,
                spectra,
                sizes,
                section.length,
                Combination::LeastSquares,
            );
            if best.lost {
                continue;
            }
            for (i, scan) in scans.iter().enumerate() {
                let t = transfer(scan.spacing, section.length, order);
                sum += sizes[i] as f64 * (spectra[i][order] - t * best.coefficient).norm_sqr();
            }
            freedom += 2 * (scans.len() - 1);
        }
        if freedom > 0 {
            let sigma = (sum / freedom as f64).sqrt();
            return (
                sigma,
                NoiseSource::Spacings,
                DegreesOfFreedom::new(freedom as f64).ok(),
            );
        }
    }
    let (mut sum, mut freedom) = (0.0, 0.0);
    for (joint, spectrum) in joints.iter().zip(spectra) {
        let n = joint.difference.len() as f64;
        let total: f64 = joint.difference.iter().map(|v| v * v).sum();
        let kept: f64 = spectrum[0].norm_sqr()
            + 2.0 * spectrum[1..].iter().map(Complex64::norm_sqr).sum::<f64>();
        sum += (total - n * kept).max(0.0);
        freedom += n - 1.0 - 2.0 * section.orders as f64;
    }
    let sigma = (0.5 * sum / freedom).sqrt();
    (
        sigma,
        NoiseSource::BeyondOrders,
        DegreesOfFreedom::new(freedom).ok(),
    )
}

/// Scatter of the difference signal between repeats of one spacing, pooled; a difference has twice
/// the variance of a reading. Standard deviation, µm, and degrees of freedom.
fn noise_of_repeats(scans: &[Scan], joints: &[Joint]) -> Option<(f64, f64)> {
    let (mut sum, mut freedom) = (0.0, 0usize);
    for group in spacings(scans) {
        let members: Vec<&Joint> = (0..scans.len())
            .filter(|&i| scans[i].spacing == group)
            .map(|i| &joints[i])
            .collect();
        let size = members.first().map_or(0, |j| j.difference.len());
        if members.len() < 2 || members.iter().any(|j| j.difference.len() != size) {
            continue;
        }
        for k in 0..size {
            let average =
                members.iter().map(|j| j.difference[k]).sum::<f64>() / members.len() as f64;
            sum += members
                .iter()
                .map(|j| (j.difference[k] - average).powi(2))
                .sum::<f64>();
        }
        freedom += size * (members.len() - 1);
    }
    let freedom = freedom as f64;
    (freedom > 0.0).then(|| ((0.5 * sum / freedom).sqrt(), freedom))
}
