//! What stands out of the residuals of a run, turn by turn: their level and their once-per-turn wave,
//! against what the law of the noise allows.

use std::ops::Range;

use nalgebra::{Complex, DVector, Matrix3, Vector3};
use statrs::distribution::{ContinuousCDF, Normal};

use super::fit::TurningFit;
use super::noise::windows;
use crate::noise::{Law, decays};

/// What stands out of one turn.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnResidual {
    /// Its readings.
    pub readings: Range<usize>,
    /// Mean, µm.
    pub level: f64,
    /// Amplitudes of cos ψ and sin ψ, µm.
    pub wave: Complex<f64>,
    /// Standard uncertainty of level and of either amplitude, µm, under the law.
    pub std: [f64; 3],
}

/// All turns of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnResiduals {
    /// The turns.
    pub turns: Vec<TurnResidual>,
    /// Probability of as much in any of them by noise alone.
    pub p_value: f64,
    /// Σ of the squared levels over their variances, over the turns: above 1 where the residuals have
    /// slow parts that the law does not know.
    pub slow: f64,
}

/// Level and wave of the residuals of each turn.
pub fn turn_residuals(fit: &TurningFit, law: &Law) -> TurnResiduals {
    let time = &fit.problem.run.time;
    let mut turns = Vec::new();
    for readings in windows(&fit.psi, 1.0) {
        let rows: Vec<Vector3<f64>> = readings
            .clone()
            .map(|i| Vector3::new(1.0, fit.psi[i].cos(), fit.psi[i].sin()))
            .collect();
        let normal: Matrix3<f64> = rows.iter().map(|r| r * r.transpose()).sum();
        let Some(inverse) = normal.try_inverse().filter(|_| rows.len() >= 6) else {
            continue;
        };
        let right: Vector3<f64> = rows
            .iter()
            .zip(&fit.residuals[readings.clone()])
            .map(|(r, v)| r * *v)
            .sum();
        let found = inverse * right;
        let along = decays(&time[readings.clone()], law.length);
        let std = [0, 1, 2].map(|k| {
            let weights: Vec<f64> = rows
                .iter()
                .map(|r| inverse.row(k).dot(&r.transpose()))
                .collect();
            law.form(&along, &weights, &weights).sqrt()
        });
        turns.push(TurnResidual {
            readings,
            level: found[0],
            wave: Complex::new(found[1], found[2]),
            std,
        });
    }
    let (mut largest, mut slow): (f64, f64) = (0.0, 0.0);
    for turn in &turns {
        let values = DVector::from_column_slice(&[turn.level, turn.wave.re, turn.wave.im]);
        for (value, std) in values.iter().zip(turn.std) {
            largest = largest.max(value.abs() / std.max(f64::MIN_POSITIVE));
        }
        slow += (turn.level / turn.std[0].max(f64::MIN_POSITIVE)).powi(2);
    }
    let each = 2.0 * Normal::standard().sf(largest);
    let looks = 3.0 * turns.len() as f64;
    // Of independent looks: 1 − (1 − p)ⁿ, without the cancellation.
    let p_value = -f64::exp_m1(looks * f64::ln_1p(-each.min(1.0 - f64::EPSILON)));
    TurnResiduals {
        slow: slow / turns.len().max(1) as f64,
        turns,
        p_value,
    }
}
