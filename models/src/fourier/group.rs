//! The repeats of one probe spacing, averaged order by order.

use super::joint::Joint;
use super::scan::{Scan, Section};
use super::spectrum::coefficients;
use super::transfer::{LOST_BELOW, transfer};
use realfft::num_complex::Complex64;

/// The scans of one spacing on one grid. Their model is one for all of them up to zero and step of
/// each scan, so that their mean tells the workpiece and what is left of each tells the noise.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// Probe spacing d, mm.
    pub spacing: f64,
    /// Places of the scans.
    pub scans: Vec<usize>,
    /// Readings on the section, N.
    pub samples: usize,
    /// Differences that a scan lacked and that were taken from the others.
    pub filled: usize,
    /// First grid point that P3 supplies.
    pub third_from: Option<usize>,
    /// Mean difference signal, orders 0 to (N − 1)/2, µm.
    pub mean: Vec<Complex64>,
    /// A step of one at the joint, the same orders; all zero without a third probe.
    pub step: Vec<Complex64>,
    /// T of the same orders.
    pub transfer: Vec<Complex64>,
}

impl Group {
    /// Readings that the mean stands for, N times the number of repeats: each part of an order of the
    /// mean has the variance σ² over this.
    pub fn weight(&self) -> f64 {
        self.repeats() * self.samples as f64
    }

    /// Number of repeats.
    pub fn repeats(&self) -> f64 {
        self.scans.len() as f64
    }

    /// Whether P3 takes over inside the section.
    pub fn has_step(&self) -> bool {
        self.third_from
            .is_some_and(|from| from > 0 && from < self.samples)
    }

    /// Highest order below half the number of readings.
    pub fn highest(&self) -> usize {
        self.mean.len().saturating_sub(1)
    }

    /// det W of an order, zero beyond the highest.
    pub fn determinant(&self, order: usize) -> f64 {
        self.transfer.get(order).map_or(0.0, Complex64::norm_sqr)
    }

    /// The mean difference signal less a step, at an order that the grid has.
    pub fn without_step(&self, order: usize, step: f64) -> Option<Complex64> {
        Some(self.mean.get(order)? - step * self.step.get(order)?)
    }
}

/// Groups the scans in the order in which their spacings come first; also the spectrum of each scan.
pub(super) fn group(
    scans: &[Scan],
    joints: &[Joint],
    section: Section,
) -> (Vec<Group>, Vec<Vec<Complex64>>) {
    let spectra: Vec<Vec<Complex64>> = joints
        .iter()
        .map(|j| coefficients(&j.difference, highest(j.difference.len())))
        .collect();
    let mut groups: Vec<Group> = Vec::new();
    for (i, (scan, joint)) in scans.iter().zip(joints).enumerate() {
        let samples = joint.difference.len();
        let own = groups.iter_mut().find(|g| {
            g.spacing == scan.spacing && g.samples == samples && g.third_from == joint.third_from
        });
        if let Some(own) = own {
            own.scans.push(i);
            own.filled += scan.filled.len();
            continue;
        }
        let mut beyond = vec![0.0; samples];
        if let Some(rest) = joint.third_from.and_then(|from| beyond.get_mut(from..)) {
            rest.fill(1.0);
        }
        let orders = highest(samples);
        groups.push(Group {
            spacing: scan.spacing,
            scans: vec![i],
            samples,
            filled: scan.filled.len(),
            third_from: joint.third_from,
            mean: Vec::new(),
            step: coefficients(&beyond, orders),
            transfer: (0..=orders)
                .map(|order| transfer(scan.spacing, section.length, order))
                .collect(),
        });
    }
    for group in &mut groups {
        group.mean = vec![Complex64::default(); highest(group.samples) + 1];
        for spectrum in group.scans.iter().filter_map(|&i| spectra.get(i)) {
            for (sum, value) in group.mean.iter_mut().zip(spectrum) {
                *sum += value / group.scans.len() as f64;
            }
        }
    }
    (groups, spectra)
}

/// Σ N |T|² of an order over the groups that `used` admits; nothing where every one of them loses it.
pub(super) fn information(
    groups: &[Group],
    order: usize,
    used: impl Fn(&Group) -> bool,
) -> Option<f64> {
    let mut seen = false;
    let sum = groups
        .iter()
        .filter(|g| used(g))
        .map(|g| {
            let determinant = g.determinant(order);
            seen |= determinant >= LOST_BELOW;
            g.weight() * determinant
        })
        .sum();
    seen.then_some(sum)
}

/// The least-squares coefficient of an order once the steps are known: Σ N T* M / Σ N |T|².
pub(super) fn common(groups: &[Group], steps: &[f64], order: usize) -> Option<Complex64> {
    let information = information(groups, order, |_| true)?;
    let sum: Complex64 = groups
        .iter()
        .zip(steps)
        .filter_map(|(g, &step)| {
            let passed = g.transfer.get(order)?.conj();
            Some(g.weight() * passed * g.without_step(order, step)?)
        })
        .sum();
    Some(sum / information)
}

fn highest(samples: usize) -> usize {
    samples.saturating_sub(1) / 2
}
