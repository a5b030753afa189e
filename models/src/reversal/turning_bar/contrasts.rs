//! What stands out of the residuals of a run, turn by turn: their level and their once-per-turn wave,
//! against what the noise allows.
//!
//! A level or an amplitude is Σ w r over the residuals r of a turn. The fit has taken up a part of the noise
//! ε: r = (1 − J(JᵀJ)⁻¹Jᵀ)ε, so its variance is w'ᵀVw' with w' = w − J(JᵀJ)⁻¹Jᵀw. The law of the noise is
//! itself known from the residuals only: over its standard deviation the value follows Student's law, whose
//! degrees of freedom come from the laws that the residuals allow.

use std::ops::Range;

use nalgebra::{Complex, Matrix3, Vector3};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::fit::TurningFit;
use super::left::{Leaves, Left};
use super::noise::windows;
use crate::noise::{Posterior, decays};

/// Below this part of its variance before the fit a value is rounding: the fit has taken it up.
const TAKEN_UP: f64 = 1e-6;

/// What stands out of one turn.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnResidual {
    /// Its readings.
    pub readings: Range<usize>,
    /// Mean, µm.
    pub level: f64,
    /// Amplitudes of cos ψ and sin ψ, µm.
    pub wave: Complex<f64>,
    /// Standard uncertainty of level and of either amplitude, µm; zero where the fit takes all of it up.
    pub std: [f64; 3],
}

/// By how much levels, or waves, of single turns scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Σ of their squares over what noise lets expect of it: above 1 where the residuals have slow parts that
    /// the law does not know.
    pub ratio: f64,
    /// Probability of as much by noise alone.
    pub p_value: f64,
    /// Variance beyond the noise's, the same in each turn and independent from turn to turn, that would make
    /// as much, µm².
    pub excess: f64,
}

/// All turns of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnResiduals {
    /// The turns.
    pub turns: Vec<TurnResidual>,
    /// Probability of as much in any of them by noise alone.
    pub p_value: f64,
    /// Of the levels.
    pub levels: Scatter,
    /// Of both amplitudes of the wave.
    pub waves: Scatter,
    /// Degrees of freedom to which the variance of a wave's amplitude is known.
    pub freedom: f64,
}

/// Level and wave of a turn before what the noise says of them.
struct Look {
    readings: Range<usize>,
    found: Vector3<f64>,
    /// Of level and amplitudes: what each residual counts.
    weights: [Vec<f64>; 3],
    /// Variances under each law that is possible, as of the noise itself.
    of: [Vec<f64>; 3],
}

/// Level and wave of the residuals of each turn.
pub fn turn_residuals(fit: &TurningFit, noise: &Posterior) -> TurnResiduals {
    let turns = windows(&fit.psi, 1.0);
    let looks: Vec<Look> = turns
        .clone()
        .into_par_iter()
        .filter_map(|readings| look(fit, noise, readings))
        .collect();
    let leaves = Leaves::new(fit, noise.mean(), &turns);
    let left: Vec<[Left; 3]> = looks
        .par_iter()
        .map(|look| leaves.of(&look.readings, &look.weights))
        .collect();
    let (mut least, mut count) = (1.0_f64, 0.0);
    let mut turns = Vec::with_capacity(looks.len());
    for (look, left) in looks.iter().zip(&left) {
        let mut std = [0.0; 3];
        for k in 0..3 {
            let (variance, freedom) = noise.variance(&look.of[k]);
            if left[k].of_noise > TAKEN_UP
                && let Ok(law) = StudentsT::new(0.0, 1.0, freedom.max(1.0))
            {
                std[k] = (left[k].of_noise * variance.max(f64::MIN_POSITIVE)).sqrt();
                least = least.min(2.0 * law.sf(look.found[k].abs() / std[k]));
                count += 1.0;
            }
        }
        turns.push(TurnResidual {
            readings: look.readings.clone(),
            level: look.found[0],
            wave: Complex::new(look.found[1], look.found[2]),
            std,
        });
    }
    // Of independent looks: 1 − (1 − p)ⁿ, without the cancellation.
    let p_value = -f64::exp_m1(count * f64::ln_1p(-least.min(1.0 - f64::EPSILON)));
    TurnResiduals {
        turns,
        p_value,
        levels: scatter(noise, &looks, &left, 0..1),
        waves: scatter(noise, &looks, &left, 1..3),
        freedom: freedom(noise, &looks, 1),
    }
}

/// Degrees of freedom to which the variances of all turns together are known.
fn freedom(noise: &Posterior, looks: &[Look], k: usize) -> f64 {
    let laws = 0..noise.possible().len();
    let sums = laws.map(|l| looks.iter().map(|look| look.of[k][l]).sum::<f64>());
    noise.variance(&sums.collect::<Vec<_>>()).1
}

/// The scatter of levels (0) or amplitudes (1, 2).
fn scatter(noise: &Posterior, looks: &[Look], left: &[[Left; 3]], which: Range<usize>) -> Scatter {
    let (mut squares, mut expected, mut beyond, mut of_turns) = (0.0, 0.0, 0.0, 0.0);
    for (look, left) in looks.iter().zip(left) {
        for k in which.clone() {
            let variance = noise.variance(&look.of[k]).0.max(f64::MIN_POSITIVE);
            let square = look.found[k].powi(2);
            squares += square / variance;
            expected += left[k].of_noise;
            beyond += square - left[k].of_noise * variance;
            of_turns += left[k].of_turns;
        }
    }
    // A turn's worth at least: where the fit takes all up nothing is left to be seen.
    let expected = f64::max(expected, 1.0);
    let ratio = squares / expected;
    // What the fit leaves is a projection: as many degrees of freedom as its trace.
    let law = FisherSnedecor::new(expected, freedom(noise, looks, which.start).max(1.0));
    Scatter {
        ratio,
        p_value: law.map_or(1.0, |law| law.sf(ratio)),
        excess: (beyond / f64::max(of_turns, 1.0)).max(0.0),
    }
}

/// Level and wave of one turn; `None` where they are not told apart.
fn look(fit: &TurningFit, noise: &Posterior, readings: Range<usize>) -> Option<Look> {
    let time = &fit.problem.run.time[readings.clone()];
    let rows: Vec<Vector3<f64>> = readings
        .clone()
        .map(|i| Vector3::new(1.0, fit.psi[i].cos(), fit.psi[i].sin()))
        .collect();
    let normal: Matrix3<f64> = rows.iter().map(|r| r * r.transpose()).sum();
    let inverse = normal.try_inverse().filter(|_| rows.len() >= 6)?;
    let right: Vector3<f64> = rows
        .iter()
        .zip(&fit.residuals[readings.clone()])
        .map(|(r, v)| r * *v)
        .sum();
    let weights = [0, 1, 2].map(|k| -> Vec<f64> {
        let of = |r: &Vector3<f64>| inverse.row(k).dot(&r.transpose());
        rows.iter().map(of).collect()
    });
    let mut of = [Vec::new(), Vec::new(), Vec::new()];
    for possible in noise.possible() {
        let along = decays(time, possible.law.length);
        for (of, weights) in of.iter_mut().zip(&weights) {
            of.push(possible.law.form(&along, weights, weights));
        }
    }
    Some(Look {
        readings,
        found: inverse * right,
        weights,
        of,
    })
}
