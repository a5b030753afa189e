//! What a fit leaves of combinations of the readings of a turn.
//!
//! Of Σ w r over the residuals r the fit leaves w' = w − J(JᵀJ)⁻¹Jᵀw of the readings, which goes along the whole run.
//! Its form under a covariance V of the readings is
//!
//! ```text
//!     w'ᵀVw' = wᵀVw − 2 gᵀ(JᵀJ)⁻¹s + sᵀ(JᵀJ)⁻¹ JᵀVJ (JᵀJ)⁻¹s,   s = Jᵀw,   g = JᵀVw,
//! ```
//!
//! in which s has unknowns of the turn only, and g those as far as noise has something in common with it: parts of
//! both matrices that lie in a band, and the border.

use std::ops::Range;

use errsep_solvers::linear::bordered::{Combination, Sandwich};
use errsep_solvers::structured::StructuredProblem;

use super::fit::TurningFit;
use super::meat::{FARTHEST, meat};
use super::spread::Slow;
use crate::noise::{Law, decays};

/// What the fit leaves of a level or an amplitude.
#[derive(Clone, Copy)]
pub(super) struct Left {
    /// Part of the variance under the law.
    pub of_noise: f64,
    /// Part of a scatter from turn to turn.
    pub of_turns: f64,
}

/// The derivatives at a reading by the unknowns that it sees.
type Row = Vec<(usize, f64)>;

/// What a fit leaves under a law.
pub(super) struct Leaves<'f> {
    fit: &'f TurningFit<'f>,
    law: Law,
    of_noise: Sandwich,
    of_levels: Sandwich,
    of_waves: Sandwich,
}

impl<'f> Leaves<'f> {
    /// Of combinations of the readings of any of these turns.
    pub fn new(fit: &'f TurningFit<'f>, law: Law, turns: &[Range<usize>]) -> Self {
        let reaches = turns
            .iter()
            .map(|turn| fit.problem.span(&within(fit, &law, turn)));
        let width = reaches.max().unwrap_or(1);
        let of = |law: &Law, level: f64, wave: f64| {
            Sandwich::new(
                &fit.covariance,
                &meat(fit, law, Slow { level, wave }),
                width,
            )
        };
        let none = Law::of_white(0.0);
        Self {
            of_noise: of(&law, 0.0, 0.0),
            of_levels: of(&none, 1.0, 0.0),
            of_waves: of(&none, 0.0, 1.0),
            fit,
            law,
        }
    }

    /// Of level and amplitudes of a turn, which count its residuals so.
    pub fn of(&self, turn: &Range<usize>, weights: &[Vec<f64>; 3]) -> [Left; 3] {
        let window = within(self.fit, &self.law, turn);
        let mut rows: Vec<Row> = Vec::with_capacity(window.len());
        let take = |_, row: &[(usize, f64)]| rows.push(row.to_vec());
        self.fit.problem.rows_of(&window, &self.fit.at, take);
        let rows = rows;
        let along = decays(&self.fit.problem.run.time[window.clone()], self.law.length);
        let from = turn.start - window.start;
        let own = from..from + turn.len();
        let waves: Vec<[f64; 2]> = self.fit.psi[turn.clone()]
            .iter()
            .map(|psi| [psi.cos(), psi.sin()])
            .collect();
        [0, 1, 2].map(|k| {
            let weights = &weights[k];
            let seen = self.seen(&rows[own.clone()], weights);
            let mut padded = vec![0.0; window.len()];
            padded[own.clone()].copy_from_slice(weights);
            let common = coloured(&self.law, &along, &padded);
            let plain = self.law.form(&along, &padded, &padded);
            let of_noise = remainder(&self.of_noise, plain, &self.seen(&rows, &common), &seen);
            let (by, together): (&Sandwich, Vec<f64>) = if k == 0 {
                let sum: f64 = weights.iter().sum();
                (&self.of_levels, vec![sum; weights.len()])
            } else {
                let own = weights.iter().zip(&waves);
                let sums = own.fold([0.0; 2], |[c, s], (w, n)| [c + w * n[0], s + w * n[1]]);
                let wave = |n: &[f64; 2]| sums[0] * n[0] + sums[1] * n[1];
                (&self.of_waves, waves.iter().map(wave).collect())
            };
            let whole = weights.iter().zip(&together).map(|(w, t)| w * t).sum();
            let turned = self.seen(&rows[own.clone()], &together);
            Left {
                of_noise: of_noise / plain.max(f64::MIN_POSITIVE),
                of_turns: remainder(by, whole, &turned, &seen),
            }
        })
    }

    /// Jᵀw of some readings.
    fn seen(&self, rows: &[Row], weights: &[f64]) -> Combination {
        let n = self.fit.problem.band_count();
        let of_band = || rows.iter().flatten().map(|(j, _)| *j).filter(|j| *j < n);
        let low = of_band().min().unwrap_or(0);
        let mut band = vec![0.0; of_band().max().map_or(0, |high| high + 1 - low)];
        let mut border = vec![0.0; self.fit.problem.border_count()];
        for (row, w) in rows.iter().zip(weights) {
            for (j, a) in row {
                match j.checked_sub(n) {
                    None => band[j - low] += w * a,
                    Some(j) => border[j] += w * a,
                }
            }
        }
        Combination {
            band: band
                .into_iter()
                .enumerate()
                .map(|(k, v)| (low + k, v))
                .collect(),
            border: border.into_iter().enumerate().collect(),
        }
    }
}

/// wᵀVw − 2 gᵀ(JᵀJ)⁻¹s + sᵀ(JᵀJ)⁻¹ JᵀVJ (JᵀJ)⁻¹s.
fn remainder(by: &Sandwich, plain: f64, common: &Combination, seen: &Combination) -> f64 {
    (plain - 2.0 * by.covariance(common, seen) + by.form(seen)).max(0.0)
}

/// The readings of which the noise has something in common with that of a turn.
fn within(fit: &TurningFit, law: &Law, turn: &Range<usize>) -> Range<usize> {
    if law.correlated <= 0.0 {
        return turn.clone();
    }
    let (time, reach) = (&fit.problem.run.time, FARTHEST * law.length);
    let (first, last) = (time[turn.start] - reach, time[turn.end - 1] + reach);
    time.partition_point(|t| *t < first)..time.partition_point(|t| *t <= last)
}

/// Vw under a law.
fn coloured(law: &Law, decays: &[f64], w: &[f64]) -> Vec<f64> {
    let mut common: Vec<f64> = w.iter().map(|w| (law.white + law.correlated) * w).collect();
    let mut before = 0.0;
    for i in 0..w.len() {
        before *= decays[i];
        common[i] += law.correlated * before;
        before += w[i];
    }
    let mut after = 0.0;
    for i in (0..w.len()).rev() {
        common[i] += law.correlated * after;
        after = decays[i] * (after + w[i]);
    }
    common
}
