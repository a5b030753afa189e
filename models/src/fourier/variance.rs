//! Uncertainty of the profile from the noise of the readings.

use super::joint::Joint;
use super::scan::{Scan, Section};
use super::separation::{Combination, OrderResult};
use super::spectrum::{coefficients, profile};
use super::transfer::transfer;
use realfft::num_complex::Complex64;

/// Standard uncertainty at each position, µm.
///
/// The noise of the difference signals gives the same variance everywhere. The few readings of which
/// the shift of P3 is made act a second time, through the ramp that the shift puts into the profile:
/// with R(x) the response to a shift, w the weight of such a reading and D(x) its own direct response,
/// σ² [(wR + D)² − D²] is to be added.
pub(super) fn profile_std(
    scans: &[Scan],
    joints: &[Joint],
    orders: &[OrderResult],
    section: Section,
    combination: Combination,
    sigma: f64,
) -> Vec<f64> {
    let samples = joints.first().map_or(0, |j| j.difference.len());
    let common: f64 = orders.iter().map(|o| 4.0 * o.std * o.std).sum();
    let mut variance = vec![common; samples];
    for (scan, joint) in scans.iter().zip(joints) {
        if joint.shift_terms.is_empty() {
            continue;
        }
        let size = joint.difference.len();
        let used = |o: &OrderResult| {
            !o.lost
                && (combination == Combination::LeastSquares
                    || scan.spacing == scans[o.best_scan].spacing)
        };
        let respond = |signal: &[f64]| {
            let spectrum = coefficients(signal, section.orders);
            let mut series = vec![Complex64::default()];
            series.extend(orders.iter().map(|o| {
                let share = if used(o) { o.gain * o.gain } else { 0.0 };
                let weight = share * size as f64 / samples as f64;
                weight * transfer(scan.spacing, section.length, o.order).conj() * spectrum[o.order]
            }));
            profile(&series, samples)
        };
        let from_third = first_of_third(scan, section, size);
        let mut shifted = vec![0.0; size];
        shifted[from_third..].fill(-1.0);
        let ramp = respond(&shifted);
        for term in &joint.shift_terms {
            let direct = match (term.probe, term.index) {
                (1, k) if k < size => Some((k, 1.0)),
                (2, k) if k < from_third => Some((k, -1.0)),
                (3, k) if k >= from_third && k < size => Some((k, -1.0)),
                _ => None,
            };
            let own = direct.map_or_else(
                || vec![0.0; samples],
                |(k, sign)| {
                    let mut impulse = vec![0.0; size];
                    impulse[k] = sign;
                    respond(&impulse)
                },
            );
            for ((v, r), d) in variance.iter_mut().zip(&ramp).zip(&own) {
                *v += sigma * sigma * ((term.weight * r + d).powi(2) - d * d);
            }
        }
    }
    variance.into_iter().map(|v| v.max(0.0).sqrt()).collect()
}

/// The first grid point that P3 supplies.
fn first_of_third(scan: &Scan, section: Section, size: usize) -> usize {
    let joint = section.length - scan.spacing;
    let slack = 1e-6 * section.length / size as f64;
    scan.readings
        .partition_point(|r| r.x < joint - slack)
        .min(size)
}
