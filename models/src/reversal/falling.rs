//! How the detail of a form falls from one number of cells to the next, and what of it a number of cells cuts off.
//!
//! The mean square of what K cells cut off a form falls as a power of K,
//!
//! ```text
//!     B²(K) = A K⁻ᑫ,    q = 1, 3, 5, 7:
//! ```
//!
//! 1 where the form wanders like a random walk, 3 with bends, 5 with jumps of the curvature, 7 where it is nearly as smooth as
//! cubic splines can follow. A fit on C cells differs from one on c by the detail between them, B²(c) − B²(C) in the mean
//! square, and by noise, in proportion to the C − c coefficients that are more. With normal coefficients a step of n of them
//! and mean square D has the likelihood
//!
//! ```text
//!     −n/2 [ln v + D/v],    v = B²(c) − B²(C) + n ν,
//! ```
//!
//! ν the variance of one. A is unknown within many powers of ten: at the step from the taken cells to finer ones the share
//! of noise κ = n ν/v is taken as anywhere from 0 to 1 with equal probability (Strawderman 1971, Daniels 1999), each q as
//! probable as the others. Given A and q the detail of that step has the mean square s² D + s n ν, s = 1 − κ, and what those
//! C cells do not follow either B²(C) − B²(N) at the positions, which N cells follow exactly; the mean of the sum over A and q
//! is what is cut off. Of the steps among coarser cells the last one alone counts: waves that these do not carry yet fall less
//! than those after them, and would make the end of the law too flat. That detail was not seen does not say that there is none: the fewer coefficients the step has, the more
//! may hide in its noise.

/// By which powers of the number of cells the mean square of what they cut off may fall.
const POWERS: [f64; 4] = [1.0, 3.0, 5.0, 7.0];

/// Detail over noise, a coefficient of the step to finer cells: least and largest that are tried, and the ratio of neighbours.
const RATIOS: (f64, f64, f64) = (1e-3, 1e6, 1.1);

/// From a fit on some cells to one on more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    /// Cells before and after.
    pub cells: [usize; 2],
    /// Mean square of the difference of the forms, µm².
    pub mean_square: f64,
}

impl Step {
    fn coefficients(&self) -> f64 {
        self.cells[1] as f64 - self.cells[0] as f64
    }

    /// The mean square of the detail between them where B²(K) = K⁻ᑫ.
    fn detail(&self, power: f64) -> f64 {
        between(self.cells, power)
    }
}

/// The mean square of the detail between two numbers of cells where B²(K) = K⁻ᑫ.
fn between(cells: [usize; 2], power: f64) -> f64 {
    let [before, after] = cells.map(|c| (c as f64).powf(-power));
    before - after
}

/// What fits on several numbers of cells say of a form's detail.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detail {
    /// From the cells that were taken to finer ones.
    pub cut: Step,
    /// To the cells that were taken from half as many or fewer, if there are any.
    pub seen: Option<Step>,
    /// Cells that follow a form at every position, no fewer than the finer ones.
    pub carried: usize,
    /// Mean square of the noise a coefficient, µm².
    pub noise: f64,
}

impl Detail {
    /// The mean square of what the taken cells cut off, µm².
    pub fn cut_off(&self) -> f64 {
        if !(self.noise > 0.0) {
            return self.cut.mean_square;
        }
        let (least, largest, ratio) = RATIOS;
        let count = (f64::ln(largest / least) / f64::ln(ratio)) as i32;
        // Logarithm of the probability and mean square of what is cut off.
        let mut laws = Vec::new();
        for power in POWERS {
            for k in 0..=count {
                laws.push(self.under(power, least * ratio.powi(k)));
            }
        }
        let highest = laws.iter().fold(f64::NEG_INFINITY, |m, law| m.max(law.0));
        let weight = |law: &(f64, f64)| (law.0 - highest).exp();
        let whole: f64 = laws.iter().map(weight).sum();
        laws.iter().map(|law| weight(law) * law.1).sum::<f64>() / whole
    }

    /// The logarithm of the probability of a law and what is cut off under it, µm²: with this power, and with so much more
    /// detail than noise in the step to finer cells.
    fn under(&self, power: f64, ratio: f64) -> (f64, f64) {
        let noise = self.cut.coefficients() * self.noise;
        let amplitude = ratio * noise / self.cut.detail(power);
        // Equal probability of κ = 1/(1 + ratio) in logarithms of the ratio.
        let prior = ratio.ln() - 2.0 * ratio.ln_1p();
        let likelihood = self.seen.iter().chain([&self.cut]).map(|step| {
            let n = step.coefficients();
            let variance = amplitude * step.detail(power) + n * self.noise;
            -0.5 * n * (variance.ln() + step.mean_square / variance)
        });
        let share = ratio / (1.0 + ratio);
        let followed = share * share * self.cut.mean_square + share * noise;
        let finer = amplitude * between([self.cut.cells[1], self.carried], power);
        (prior + likelihood.sum::<f64>(), followed + finer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(cells: [usize; 2], mean_square: f64) -> Step {
        Step { cells, mean_square }
    }

    /// Detail far out of the noise gives away how it falls: what is cut off is A K⁻³ as far as the positions carry it.
    #[test]
    fn a_law_that_is_seen_is_found() {
        let of = |cells: usize| 7.0 * (cells as f64).powi(-3);
        let seen = |cells: [usize; 2]| step(cells, of(cells[0]) - of(cells[1]));
        let detail = Detail {
            cut: seen([24, 48]),
            seen: Some(seen([12, 24])),
            carried: 100,
            noise: 1e-9,
        };
        // Truncation: the amplitude is known to a part in √(45/2) and the mean over it lies above the truth by 1/20.
        assert!((detail.cut_off() / (of(24) - of(100)) - 1.0).abs() < 0.1);
    }

    /// A difference as the noise makes it leaves room for detail, less where there are more coefficients to show it, and never
    /// none; in units of the noise, whatever that is.
    #[test]
    fn what_noise_may_hide_shrinks_with_coefficients() {
        let hidden = |n: usize, noise: f64| {
            let detail = Detail {
                cut: step([n, 2 * n], n as f64 * noise),
                seen: None,
                carried: 1000,
                noise,
            };
            detail.cut_off() / (n as f64 * noise)
        };
        let shares = [2, 8, 32, 128].map(|n| hidden(n, 1.0));
        assert!(
            shares.windows(2).all(|s| s[1] < s[0] && s[1] > 0.0),
            "{shares:?}"
        );
        // Equal probability of all κ: with one coefficient a few parts of the noise, with many √(2/n) of it.
        assert!(shares[0] > 0.5 && shares[3] < 0.2, "{shares:?}");
        // Rounding.
        assert!((hidden(8, 1e-6) / shares[1] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn without_noise_all_that_differs_is_detail() {
        let detail = Detail {
            cut: step([4, 8], 0.25),
            seen: None,
            carried: 8,
            noise: 0.0,
        };
        assert!((detail.cut_off() - 0.25).abs() < f64::EPSILON);
    }
}
