//! The noise of a run: white and correlated over a short time, from what a fit leaves.
//!
//! What is slower than the windows below is not counted as noise: level, slope and once-per-turn wave,
//! growing evenly, are taken out of each window of two turns before the law is sought, so that it is
//! the same whichever model left them. The likelihood of white noise beside an Ornstein–Uhlenbeck
//! process at uneven times comes from a Kalman filter of one state.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

use super::run::Run;
use crate::noise::Law;
use errsep_solvers::scalar::least_between;

/// Turns of a window.
const WINDOW_TURNS: f64 = 2.0;
/// Unknowns taken out of each window.
const WINDOW_UNKNOWNS: usize = 6;
/// The longest correlation is this part of a turn: beyond it noise and form are one.
const LONGEST: f64 = 0.1;
/// Rounds of the search over length and share.
const ROUNDS: usize = 3;

/// The law of the noise in residuals (µm) of readings that see the angles ψ (rad).
pub fn law(run: &Run, psi: &[f64], residuals: &[f64]) -> Law {
    let (inside, part) = inside_windows(run, psi, residuals);
    let n = inside.len() as f64;
    let steps: Vec<f64> = run.time.windows(2).map(|w| w[1] - w[0]).collect();
    let whole = (psi[psi.len() - 1] - psi[0]).abs() / TAU;
    let turn = (run.times().1 - run.times().0) / whole.max(1.0);
    let mean_step = steps.iter().sum::<f64>() / steps.len() as f64;
    let (low, high) = (
        (0.1 * mean_step).ln(),
        f64::max(LONGEST * turn, mean_step).ln(),
    );
    let cost = |share: f64, length: f64| {
        let (log, squares) = filtered(&steps, &inside, 1.0 - share, share, length);
        0.5 * log + 0.5 * n * (squares / n).max(f64::MIN_POSITIVE).ln()
    };
    // The best of a coarse grid, then in turn along either.
    let grid = (0..8).flat_map(|i| (1..8).map(move |j| (f64::from(i) / 7.0, f64::from(j) / 8.0)));
    let (mut length, mut share) = grid
        .map(|(i, share)| (low + i * (high - low), share))
        .min_by(|a, b| cost(a.1, a.0.exp()).total_cmp(&cost(b.1, b.0.exp())))
        .unwrap_or((low, 0.0));
    for _ in 0..ROUNDS {
        let (from, to) = ((share - 0.13).max(0.0), (share + 0.13).min(0.999));
        let by_share = |s: f64| Ok::<f64, Infallible>(cost(s, length.exp()));
        share = least_between(from, to, 1e-4, by_share).unwrap_or(share);
        let reach = (high - low) / 7.0;
        let (from, to) = ((length - reach).max(low), (length + reach).min(high));
        let by_length = |l: f64| Ok::<f64, Infallible>(cost(share, l.exp()));
        length = least_between(from, to, 1e-3, by_length).unwrap_or(length);
    }
    let (_, squares) = filtered(&steps, &inside, 1.0 - share, share, length.exp());
    let variance = squares / n / part;
    Law {
        white: variance * (1.0 - share),
        correlated: variance * share,
        length: length.exp(),
        shift: 0.0,
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

/// What is left in the windows, and the part of the variance that it still has.
fn inside_windows(run: &Run, psi: &[f64], residuals: &[f64]) -> (Vec<f64>, f64) {
    let mut inside = residuals.to_vec();
    let mut taken = 0;
    for window in windows(psi, WINDOW_TURNS) {
        let n = window.len();
        if n < 4 * WINDOW_UNKNOWNS {
            continue;
        }
        let (first, last) = (run.time[window.start], run.time[window.end - 1]);
        let (middle, half) = (f64::midpoint(first, last), 0.5 * (last - first));
        let design = DMatrix::from_fn(n, WINDOW_UNKNOWNS, |r, c| {
            let i = window.start + r;
            let tau = (run.time[i] - middle) / half;
            let (sin, cos) = psi[i].sin_cos();
            [1.0, tau, cos, sin, tau * cos, tau * sin][c]
        });
        let values = DVector::from_column_slice(&residuals[window.clone()]);
        if let Some(factor) = design.tr_mul(&design).cholesky() {
            let left = &values - &design * factor.solve(&design.tr_mul(&values));
            inside[window.clone()].copy_from_slice(left.as_slice());
            taken += WINDOW_UNKNOWNS;
        }
    }
    let n = residuals.len() as f64;
    (inside, 1.0 - taken as f64 / n)
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
