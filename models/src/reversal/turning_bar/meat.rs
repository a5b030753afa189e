//! JᵀVJ of a fit, J the derivatives of the model and V the covariance of the readings: what stands between the two
//! (JᵀJ)⁻¹ of the covariance of a least squares that weighs all readings alike.
//!
//! It takes one pass: with S_i = Σ_{j<i} e^{−(t_i − t_j)/ℓ} row_j the sum over all pairs is
//! Σ (row_i row_iᵀ + row_i S_iᵀ + S_i row_iᵀ). What levels and waves of single turns scatter beyond the law is a
//! further part of V: of each turn Σ row_i, Σ row_i cos ψ_i and Σ row_i sin ψ_i, squared.
//!
//! Noise a few correlation lengths apart has nothing in common, nor have different turns: between coefficients of
//! splines all of it lies in a band.

use errsep_solvers::linear::bordered::BorderedSymmetric;
use errsep_solvers::structured::StructuredProblem;

use super::fit::TurningFit;
use super::noise::windows;
use super::spread::Slow;
use crate::noise::Law;

/// Readings so many correlation lengths apart have less in common than one rounding: e⁻⁴⁰ = 4·10⁻¹⁸.
pub(super) const FARTHEST: f64 = 40.0;

/// JᵀVJ under a law of the noise and what is slower.
pub(super) fn meat(fit: &TurningFit, law: &Law, slow: Slow) -> BorderedSymmetric {
    let (n, q) = (fit.problem.band_count(), fit.problem.border_count());
    let mut sum = BorderedSymmetric::zeros(n, q);
    if law.white + law.correlated > 0.0 {
        add_noise(&mut sum, fit, law);
    }
    if slow != Slow::default() {
        add_slow(&mut sum, fit, slow);
    }
    sum
}

fn add_noise(sum: &mut BorderedSymmetric, fit: &TurningFit, law: &Law) {
    let (time, p) = (&fit.problem.run.time, fit.count());
    let variance = law.white + law.correlated;
    // S_i: its values, when each unknown was last seen, and those of which something is left.
    let (mut before, mut seen) = (vec![0.0; p], vec![f64::NEG_INFINITY; p]);
    let mut left: Vec<usize> = Vec::new();
    let mut last = None;
    fit.problem.rows(&fit.at, |i, row| {
        for (k, (j, a)) in row.iter().enumerate() {
            for (l, b) in &row[k..] {
                sum.add(*j, *l, variance * a * b);
            }
        }
        if law.correlated <= 0.0 {
            return;
        }
        let decay = last.map_or(0.0, |t: f64| (-(time[i] - t) / law.length).exp());
        last = Some(time[i]);
        left.retain(|k| {
            let near = time[i] - seen[*k] <= FARTHEST * law.length;
            before[*k] *= if near { decay } else { 0.0 };
            if !near {
                seen[*k] = f64::NEG_INFINITY;
            }
            near
        });
        for (j, a) in row {
            let own = law.correlated * a;
            for k in &left {
                // On the diagonal both orders are one element.
                let twice = if k == j { 2.0 } else { 1.0 };
                sum.add(*j, *k, twice * own * before[*k]);
            }
        }
        for (j, a) in row {
            if seen[*j] == f64::NEG_INFINITY {
                left.push(*j);
            }
            seen[*j] = time[i];
            before[*j] += a;
        }
    });
}

fn add_slow(sum: &mut BorderedSymmetric, fit: &TurningFit, slow: Slow) {
    let mut turn = vec![[0.0; 3]; fit.count()];
    let mut touched: Vec<usize> = Vec::new();
    let ends = windows(&fit.psi, 1.0).into_iter().map(|turn| turn.end - 1);
    let mut ends = ends.peekable();
    fit.problem.rows(&fit.at, |i, row| {
        let (sin, cos) = fit.psi[i].sin_cos();
        touched.extend(row.iter().map(|(j, _)| *j));
        for (j, a) in row {
            for (sum, wave) in turn[*j].iter_mut().zip([1.0, cos, sin]) {
                *sum += a * wave;
            }
        }
        if ends.next_if_eq(&i).is_none() {
            return;
        }
        touched.sort_unstable();
        touched.dedup();
        for (k, j) in touched.iter().enumerate() {
            for l in &touched[k..] {
                let ([level, cos, sin], other) = (turn[*j], turn[*l]);
                let waves = cos * other[1] + sin * other[2];
                sum.add(*j, *l, slow.level * level * other[0] + slow.wave * waves);
            }
        }
        for j in touched.drain(..) {
            turn[j] = [0.0; 3];
        }
    });
}
