//! The noise of a run: white and correlated over a short time, from what a fit leaves.
//!
//! What is slower than the windows below is not counted as noise: level, slope and once-per-turn wave,
//! growing evenly, are unknowns of each window of two turns, so that the law is the same whichever model
//! left the residuals. The likelihood is that of what is left in each window without these unknowns
//! (restricted likelihood: r'V⁻¹r at their best values, and ln|V| + ln|X'V⁻¹X|). Residuals of a least squares
//! in the window would seem less correlated than the noise is, most where its length comes near the window's.

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::run::Run;
use crate::noise::{Law, Likelihood, NoiseValues, OfWhole, Posterior};

/// Turns of a window.
const WINDOW_TURNS: f64 = 2.0;
/// Unknowns of a window.
const WINDOW_UNKNOWNS: usize = 6;
/// The longest correlation is this part of a turn: beyond it noise, form and wave are one.
const LONGEST: f64 = 0.25;

/// The laws of the noise that the residuals (µm) of readings that see the angles ψ (rad) allow.
pub fn laws(run: &Run, psi: &[f64], residuals: &[f64]) -> Posterior {
    let windows = Windows::of(run, psi, residuals);
    let mean = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
    let white = mean.max(f64::MIN_POSITIVE);
    Posterior::of(&windows).unwrap_or_else(|| Posterior::of_white(white, residuals.len()))
}

/// A reading's row of a window: its residual after the rows of the unknowns.
const COLUMNS: usize = WINDOW_UNKNOWNS + 1;

/// The residuals of a run in windows.
struct Windows {
    windows: Vec<Window>,
    reach: (f64, f64),
}

struct Window {
    /// Time since the reading before.
    steps: Vec<f64>,
    rows: Vec<SVector<f64, COLUMNS>>,
    /// ln|X'X|.
    log_plain: f64,
}

impl Windows {
    fn of(run: &Run, psi: &[f64], residuals: &[f64]) -> Self {
        let whole = (psi[psi.len() - 1] - psi[0]).abs() / TAU;
        let span = run.times().1 - run.times().0;
        let turn = span / whole.max(1.0);
        let spacing = span / (run.len() - 1) as f64;
        let found = windows(psi, WINDOW_TURNS).into_iter().filter_map(|window| {
            if window.len() < 4 * WINDOW_UNKNOWNS {
                return None;
            }
            let (first, last) = (run.time[window.start], run.time[window.end - 1]);
            let (middle, half) = (f64::midpoint(first, last), 0.5 * (last - first));
            let row = |i: usize| {
                let tau = (run.time[i] - middle) / half;
                let (s, c) = psi[i].sin_cos();
                SVector::from([1.0, tau, c, s, tau * c, tau * s, residuals[i]])
            };
            let rows: Vec<_> = window.clone().map(row).collect();
            let normal = rows.iter().map(|r| r * r.transpose()).sum();
            Some(Window {
                steps: window
                    .map(|i| run.time[i] - run.time[i.max(1) - 1])
                    .collect(),
                log_plain: eliminated(&normal)?.0,
                rows,
            })
        });
        Self {
            windows: found.collect(),
            reach: (spacing, LONGEST * turn),
        }
    }
}

/// ln of the determinant of the part of X'V⁻¹X that belongs to the unknowns, and what the residuals' own part
/// is without them.
fn eliminated(normal: &SMatrix<f64, COLUMNS, COLUMNS>) -> Option<(f64, f64)> {
    let own = normal.fixed_view::<WINDOW_UNKNOWNS, WINDOW_UNKNOWNS>(0, 0);
    let right = normal.fixed_view::<WINDOW_UNKNOWNS, 1>(0, WINDOW_UNKNOWNS);
    let factor = own.into_owned().cholesky()?;
    let log = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
    let taken = right.dot(&factor.solve(&right));
    let left = normal[(WINDOW_UNKNOWNS, WINDOW_UNKNOWNS)] - taken;
    Some((log, left))
}

impl Window {
    /// Logarithm of the determinant and quadratic form of what holds noise alone, by a Kalman filter.
    fn filtered(&self, white: f64, correlated: f64, length: f64) -> (f64, f64) {
        let mut normal = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
        let mut state = SVector::<f64, COLUMNS>::zeros();
        let (mut log, mut doubt) = (0.0, correlated);
        let mut last = (f64::NAN, 0.0);
        for (i, (row, step)) in self.rows.iter().zip(&self.steps).enumerate() {
            if i > 0 {
                if *step != last.0 {
                    last = (*step, (-step / length).exp());
                }
                let decay = last.1;
                state *= decay;
                doubt = decay * decay * doubt + correlated * (1.0 - decay * decay);
            }
            let variance = (doubt + white).max(f64::MIN_POSITIVE);
            let innovation = row - state;
            log += variance.ln();
            normal.ger(1.0 / variance, &innovation, &innovation, 1.0);
            let gain = doubt / variance;
            state += innovation * gain;
            doubt *= 1.0 - gain;
        }
        match eliminated(&normal) {
            Some((own, squares)) => (log + own - self.log_plain, squares),
            None => (f64::INFINITY, f64::INFINITY),
        }
    }
}

impl NoiseValues for Windows {
    fn count(&self) -> usize {
        let of = |w: &Window| w.rows.len() - WINDOW_UNKNOWNS;
        self.windows.iter().map(of).sum()
    }

    fn reach(&self) -> Option<(f64, f64)> {
        Some(self.reach)
    }

    /// A level is an unknown of each window.
    fn has_shifts(&self) -> bool {
        false
    }

    fn likelihoods(
        &self,
        white: f64,
        correlated: f64,
        length: f64,
        whole: &[OfWhole],
    ) -> Vec<Likelihood> {
        let of = |w: &Window| w.filtered(white, correlated, length);
        let parts: Vec<(f64, f64)> = self.windows.par_iter().map(of).collect();
        let (log, squares) = parts
            .iter()
            .fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
        let quadratic = squares.max(f64::MIN_POSITIVE);
        let count = self.count() as f64;
        let found = Likelihood {
            minus_log: 0.5 * (count * (quadratic / count).ln() + log),
            quadratic,
        };
        vec![found; whole.len()]
    }
}

/// −2 ln of the likelihood of residuals under a law, up to a constant.
pub fn misfit(run: &Run, residuals: &[f64], law: &Law) -> f64 {
    let steps: Vec<f64> = run.time.windows(2).map(|w| w[1] - w[0]).collect();
    let (log, squares) = filtered(&steps, residuals, law.white, law.correlated, law.length);
    log + squares
}

/// Σ ln F and Σ v²/F over the innovations v of variance F.
fn filtered(steps: &[f64], values: &[f64], white: f64, correlated: f64, length: f64) -> (f64, f64) {
    let (mut log, mut squares) = (0.0, 0.0);
    let (mut state, mut doubt) = (0.0, correlated);
    for (i, value) in values.iter().enumerate() {
        if i > 0 {
            let decay = (-steps[i - 1] / length).exp();
            state *= decay;
            doubt = decay * decay * doubt + correlated * (1.0 - decay * decay);
        }
        let variance = (doubt + white).max(f64::MIN_POSITIVE);
        let innovation = value - state;
        log += variance.ln();
        squares += innovation * innovation / variance;
        let gain = doubt / variance;
        state += gain * innovation;
        doubt *= 1.0 - gain;
    }
    (log, squares)
}

/// Stretches of so many turns, as many as are whole; the last holds what is left over.
pub fn windows(psi: &[f64], turns: f64) -> Vec<std::ops::Range<usize>> {
    let onward = (psi[psi.len() - 1] - psi[0]).signum();
    let turned = |i: usize| onward * (psi[i] - psi[0]) / TAU;
    let whole = (turned(psi.len() - 1) / turns).floor().max(1.0);
    let mut windows = Vec::new();
    let mut from = 0;
    for k in 1..=whole as usize {
        let to = if k == whole as usize {
            psi.len()
        } else {
            let limit = k as f64 * turns;
            from + (from..psi.len()).take_while(|i| turned(*i) < limit).count()
        };
        if to > from {
            windows.push(from..to);
        }
        from = to;
    }
    windows
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// A window of uneven readings, its values those of no law.
    fn window() -> (Window, Vec<f64>) {
        let times: Vec<f64> = (0..40)
            .map(|k| f64::from(k) + 0.3 * f64::from(k * k % 7) / 7.0)
            .collect();
        let rows = times.iter().enumerate().map(|(k, t)| {
            let (tau, k) = (t / 20.0 - 1.0, k as f64);
            let (s, c) = (0.37 * t).sin_cos();
            let value = (1.7 * k).sin() + 0.5 * (0.3 * k * k).cos();
            SVector::from([1.0, tau, c, s, tau * c, tau * s, value])
        });
        let rows: Vec<_> = rows.collect();
        let normal = rows.iter().map(|r| r * r.transpose()).sum();
        let steps = |k: usize| times[k] - times[k.max(1) - 1];
        let window = Window {
            steps: (0..times.len()).map(steps).collect(),
            log_plain: eliminated(&normal).unwrap().0,
            rows,
        };
        (window, times)
    }

    /// Beside the likelihood of what an orthonormal complement of the unknowns' columns leaves of the values, with
    /// the whole covariance written out.
    #[test]
    fn the_filter_is_the_likelihood_of_what_holds_noise_alone() {
        let (window, times) = window();
        let n = times.len();
        let columns = DMatrix::from_fn(n, WINDOW_UNKNOWNS, |i, j| window.rows[i][j]);
        let values = DVector::from_fn(n, |i, _| window.rows[i][WINDOW_UNKNOWNS]);
        let projector =
            DMatrix::identity(n, n) - &columns * columns.clone().pseudo_inverse(1e-12).unwrap();
        let eigen = projector.symmetric_eigen();
        let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > 0.5).collect();
        let complement = eigen.eigenvectors.select_columns(&kept);
        assert_eq!(complement.ncols(), n - WINDOW_UNKNOWNS);
        for (white, correlated, length) in [(1.0, 0.0, 1.0), (0.4, 0.9, 3.0), (0.05, 2.0, 11.0)] {
            let covariance = DMatrix::from_fn(n, n, |i, j| {
                let own = if i == j { white } else { 0.0 };
                own + correlated * (-(times[i] - times[j]).abs() / length).exp()
            });
            let left = complement
                .tr_mul(&(covariance * &complement))
                .cholesky()
                .unwrap();
            let seen = complement.tr_mul(&values);
            let log = 2.0 * left.l().diagonal().map(f64::ln).sum();
            let squares = seen.dot(&left.solve(&seen));
            let found = window.filtered(white, correlated, length);
            // Rounding of a covariance whose condition is below 1e3.
            assert!(
                (found.0 - log).abs() < 1e-9 * log.abs().max(1.0),
                "{} {log}",
                found.0
            );
            assert!(
                (found.1 - squares).abs() < 1e-9 * squares,
                "{} {squares}",
                found.1
            );
        }
    }
}
