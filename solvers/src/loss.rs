//! Robust losses: how much a large residual may cost.
//!
//! A fit minimises ½ Σ ρ(rᵢ²). With s = r² each loss is given by its value and first two
//! derivatives in s; all have ρ(0) = 0 and ρ′(0) = 1, so that small residuals cost what they do
//! in ordinary least squares. `scale` is the size of residual, in the residual's own unit, at
//! which a loss begins to differ.

use serde::{Deserialize, Serialize};

/// A robust loss and its scale.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Loss {
    /// ρ = s: ordinary least squares.
    #[default]
    Quadratic,
    /// ρ = s up to |r| = k, 2k|r| − k² beyond (Huber 1964). 95 % efficient at k = 1.345 σ.
    Huber {
        /// The size k of residual from which the cost grows linearly.
        scale: f64,
    },
    /// ρ = 2k² (√(1 + s/k²) − 1): a smooth Huber.
    SoftL1 {
        /// The size k of residual around which the cost turns linear.
        scale: f64,
    },
    /// ρ = k² ln(1 + s/k²). 95 % efficient at k = 2.385 σ.
    Cauchy {
        /// The size k of residual from which influence falls.
        scale: f64,
    },
    /// ρ = k²/3 (1 − (1 − s/k²)³) up to |r| = k, constant beyond (Beaton & Tukey 1974): residuals
    /// beyond k have no influence. 95 % efficient at k = 4.685 σ. Not convex: start near.
    Tukey {
        /// The size k of residual from which there is no influence at all.
        scale: f64,
    },
}

/// A loss at one residual: ρ(s), ρ′(s), ρ″(s) with s = r².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossValue {
    /// ρ(s).
    pub value: f64,
    /// dρ/ds.
    pub first: f64,
    /// d²ρ/ds².
    pub second: f64,
}

/// The share of ρ′ that the curvature ρ′ + 2sρ″ of a residual is never taken below.
const CURVATURE_FLOOR: f64 = 0.01;

impl Loss {
    /// The loss and its derivatives at the squared residual s ≥ 0.
    pub fn at(&self, s: f64) -> LossValue {
        match *self {
            Self::Quadratic => LossValue {
                value: s,
                first: 1.0,
                second: 0.0,
            },
            Self::Huber { scale } => huber(s, scale),
            Self::SoftL1 { scale } => soft_l1(s, scale),
            Self::Cauchy { scale } => cauchy(s, scale),
            Self::Tukey { scale } => tukey(s, scale),
        }
    }

    /// The scale k; `None` for ordinary least squares.
    pub fn scale(&self) -> Option<f64> {
        match *self {
            Self::Quadratic => None,
            Self::Huber { scale }
            | Self::SoftL1 { scale }
            | Self::Cauchy { scale }
            | Self::Tukey { scale } => Some(scale),
        }
    }

    /// The same loss for residuals counted in `unit`.
    pub(crate) fn in_unit(self, unit: f64) -> Self {
        match self {
            Self::Quadratic => Self::Quadratic,
            Self::Huber { scale } => Self::Huber {
                scale: scale / unit,
            },
            Self::SoftL1 { scale } => Self::SoftL1 {
                scale: scale / unit,
            },
            Self::Cauchy { scale } => Self::Cauchy {
                scale: scale / unit,
            },
            Self::Tukey { scale } => Self::Tukey {
                scale: scale / unit,
            },
        }
    }

    /// ½ Σ ρ(rᵢ²).
    pub fn cost(&self, residuals: &[f64]) -> f64 {
        0.5 * residuals.iter().map(|r| self.at(r * r).value).sum::<f64>()
    }

    /// The factors (of the Jacobian's row, of the residual) that turn a robust problem into an
    /// ordinary one with the same gradient and nearly the same curvature.
    ///
    /// For one scalar residual the correction of Triggs et al. (2000, section 4.3) is exact: the
    /// curvature of ½ρ along the residual is ρ′ + 2sρ″, so the row takes its root and the residual
    /// ρ′ over that root, which keeps the gradient ρ′ r ∂r/∂p. Reweighting (rows by √ρ′) drops 2sρ″
    /// and then converges only linearly with every outlier. Where the curvature is small or
    /// negative it is floored at a hundredth of ρ′: the trust region, not the floor, bounds the
    /// step, and the rows stay within a factor ten of the reweighted ones.
    pub fn row_factors(&self, residual: f64) -> (f64, f64) {
        let s = residual * residual;
        let LossValue { first, second, .. } = self.at(s);
        if first <= 0.0 {
            return (0.0, 0.0);
        }
        let row = (first + 2.0 * s * second)
            .max(CURVATURE_FLOOR * first)
            .sqrt();
        (row, first / row)
    }
}

fn huber(s: f64, scale: f64) -> LossValue {
    if s <= scale * scale {
        return LossValue {
            value: s,
            first: 1.0,
            second: 0.0,
        };
    }
    let r = s.sqrt();
    LossValue {
        value: scale * (2.0 * r - scale),
        first: scale / r,
        second: -0.5 * scale / (r * s),
    }
}

fn soft_l1(s: f64, scale: f64) -> LossValue {
    let square = scale * scale;
    let root = (1.0 + s / square).sqrt();
    LossValue {
        // 2k²(root − 1) without its cancellation.
        value: 2.0 * s / (root + 1.0),
        first: 1.0 / root,
        second: -0.5 / (square * root.powi(3)),
    }
}

fn cauchy(s: f64, scale: f64) -> LossValue {
    let square = scale * scale;
    let share = 1.0 + s / square;
    LossValue {
        value: square * (s / square).ln_1p(),
        first: 1.0 / share,
        second: -1.0 / (square * share * share),
    }
}

fn tukey(s: f64, scale: f64) -> LossValue {
    let square = scale * scale;
    let share = s / square;
    if share >= 1.0 {
        return LossValue {
            value: square / 3.0,
            first: 0.0,
            second: 0.0,
        };
    }
    let left = 1.0 - share;
    LossValue {
        // (1 − (1 − t)³)/3 = t − t² + t³/3.
        value: s * (1.0 - share + share * share / 3.0),
        first: left * left,
        second: -2.0 * left / square,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(scale: f64) -> [Loss; 5] {
        [
            Loss::Quadratic,
            Loss::Huber { scale },
            Loss::SoftL1 { scale },
            Loss::Cauchy { scale },
            Loss::Tukey { scale },
        ]
    }

    #[test]
    fn derivatives_agree_with_differences_on_both_branches() {
        for scale in [0.7, 30.0] {
            for loss in all(scale) {
                for share in [1e-3, 0.4, 0.98, 1.03, 9.0] {
                    let s = share * scale * scale;
                    let h = 1e-5 * s;
                    let at = loss.at(s);
                    let (low, high) = (loss.at(s - h), loss.at(s + h));
                    let first = (high.value - low.value) / (2.0 * h);
                    let second = (high.first - low.first) / (2.0 * h);
                    // truncation of a central difference: h² relative, plus its rounding eps/1e-5
                    assert!((at.first - first).abs() <= 1e-8, "{loss:?} {share}");
                    assert!((at.second - second).abs() * s <= 1e-8, "{loss:?} {share}");
                }
            }
        }
    }

    #[test]
    fn every_loss_begins_as_least_squares() {
        for loss in all(2.0) {
            let zero = loss.at(0.0);
            assert_eq!((zero.value, zero.first), (0.0, 1.0), "{loss:?}");
        }
    }

    #[test]
    fn a_wide_scale_is_least_squares() {
        // exact limit: s/k² = 1e-18 leaves nothing of the correction
        for loss in all(1e9) {
            assert!(
                (loss.at(1.0).value - 1.0).abs() <= 2.0 * f64::EPSILON,
                "{loss:?}"
            );
        }
    }

    #[test]
    fn row_factors_keep_the_gradient() {
        for loss in all(1.5) {
            for residual in [-4.0, -0.3, 0.0, 1.2, 1.49, 20.0] {
                let (row, rest) = loss.row_factors(residual);
                let first = loss.at(residual * residual).first;
                // epsilons
                assert!((row * rest - first).abs() <= 4.0 * f64::EPSILON, "{loss:?}");
            }
        }
    }
}
