//! What is found along the band beside matrices written out.

use std::f64::consts::TAU;

use errsep_solvers::structured::StructuredProblem;
use nalgebra::{DMatrix, DVector};

use super::fit::{TurningFit, bent, steady, unsteady};
use super::left::Leaves;
use super::noise::windows;
use super::run::Run;
use super::setting::{Setting, Wave};
use super::simulate::{TurningPlan, simulate};
use super::spread::{Slow, Spread};
use super::start::Survey;
use crate::noise::Law;

/// Correlated over a quarter of a turn of twenty seconds.
const LAW: Law = Law {
    white: 0.02,
    correlated: 0.05,
    length: 5.0,
    shift: 0.0,
    drift: 0.0,
};

const SLOW: Slow = Slow {
    level: 0.03,
    wave: 0.04,
};

/// Derivatives, their (JᵀJ)⁻¹, and the covariance of the readings.
struct Dense {
    rows: DMatrix<f64>,
    inverse: DMatrix<f64>,
    /// Of each turn its level, cos ψ and sin ψ.
    turns: Vec<[DVector<f64>; 3]>,
    noise: DMatrix<f64>,
}

impl Dense {
    fn of(fit: &TurningFit, law: &Law) -> Self {
        let (n, p) = (fit.residuals.len(), fit.count());
        let mut rows = DMatrix::zeros(n, p);
        fit.problem.rows(&fit.at, |i, row| {
            for (j, a) in row {
                rows[(i, *j)] = *a;
            }
        });
        // Not from the rows: those of the last step, taken on its promise, are not in the fit's triangle.
        let band = fit.problem.band_count();
        let mut inverse = DMatrix::zeros(p, p);
        for j in 0..p {
            let (own, border) = match j.checked_sub(band) {
                None => fit.covariance.times(&[(j, 1.0)], &[]),
                Some(k) => fit.covariance.times(&[], &[(k, 1.0)]),
            };
            let column: Vec<f64> = own.into_iter().chain(border).collect();
            inverse.column_mut(j).copy_from_slice(&column);
        }
        let turns = windows(&fit.psi, 1.0).into_iter().map(|turn| {
            [0, 1, 2].map(|k| {
                DVector::from_fn(n, |i, _| {
                    let own = f64::from(u8::from(turn.contains(&i)));
                    own * [1.0, fit.psi[i].cos(), fit.psi[i].sin()][k]
                })
            })
        });
        let time = &fit.problem.run.time;
        let noise = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { law.white } else { 0.0 };
            own + law.correlated * (-(time[i] - time[j]).abs() / law.length).exp()
        });
        Self {
            turns: turns.collect(),
            rows,
            inverse,
            noise,
        }
    }

    /// Covariance of the unknowns.
    fn covariance(&self, slow: Slow) -> DMatrix<f64> {
        let mut readings = self.noise.clone();
        for turn in &self.turns {
            let variances = [slow.level, slow.wave, slow.wave];
            for (wave, variance) in turn.iter().zip(variances) {
                readings += wave * wave.transpose() * variance;
            }
        }
        let meat = self.rows.tr_mul(&(readings * &self.rows));
        &self.inverse * meat * &self.inverse
    }
}

/// A steady, an unsteady and a bent fit of a small run with so many cells.
fn with_fits(cells: usize, look: impl Fn(&TurningFit)) {
    let plan = TurningPlan {
        readings: 640,
        turns: 32.0,
        stray_rad: 2.0,
        bend_um: 1.0,
        ..TurningPlan::default()
    };
    let run = Run::new(&simulate(&plan).0).expect("a run");
    let setting = Setting {
        form_cells: cells + 2,
        wave: Wave::Unsteady { cells },
        ..Setting::default()
    };
    let survey = Survey::new(&run, 0.0, 1.0, None).expect("a bar that turns");
    let even = steady(&run, &survey, &setting).expect("a fit");
    let bend = bent(&run, &survey, &setting, &even).expect("a fit");
    let strays = unsteady(&run, &survey, &setting, &even, None).expect("a fit");
    for fit in [&even, &bend, &strays[0]] {
        look(fit);
    }
}

/// Whether two values are the same but for rounding of matrices whose condition is below 1e6.
fn same(found: f64, expected: f64, size: f64) {
    assert!(
        (found - expected).abs() <= 1e-9 * size,
        "{found} {expected}"
    );
}

#[test]
fn variances_are_those_of_the_covariance_written_out() {
    for cells in [3, 26] {
        with_fits(cells, |fit| {
            for (law, slow) in [(LAW, SLOW), (Law::of_white(0.3), Slow::default())] {
                let covariance = Dense::of(fit, &law).covariance(slow);
                let spread = Spread::new(fit, &law, slow);
                let p = fit.count();
                let far = DVector::from_fn(p, |j, _| (1.3 * j as f64).sin());
                same(
                    spread.variance(&far),
                    far.dot(&(&covariance * &far)),
                    covariance.trace(),
                );
                for j in 0..p {
                    let mut one = DVector::zeros(p);
                    one[j] = 1.0;
                    let own = covariance[(j, j)];
                    same(spread.variance(&one), own, own);
                }
            }
        });
    }
}

#[test]
fn a_stray_is_as_sure_as_by_its_covariance_written_out() {
    for cells in [3, 26] {
        with_fits(cells, |fit| {
            let spread = Spread::new(fit, &LAW, SLOW);
            let Some((square, freedom)) = fit.strays(&spread) else {
                assert!(!matches!(fit.setting().wave, Wave::Unsteady { .. }));
                return;
            };
            let covariance = Dense::of(fit, &LAW).covariance(SLOW);
            let (height, slope) = fit.turn_line().expect("a turn");
            let places = fit.turn_basis().expect("a spline").line(0.0, 1.0);
            let mut weights = DMatrix::zeros(fit.count(), places.len());
            for (k, place) in places.iter().enumerate() {
                let mut row = -&height - &slope * fit.problem.frame.tau(*place);
                row[fit.problem.wave_unknowns[0][k]] += 1.0;
                weights.set_column(k, &row);
            }
            let values = weights.tr_mul(&fit.at.joined());
            let parts = weights.tr_mul(&(covariance * &weights)).symmetric_eigen();
            let along = parts.eigenvectors.tr_mul(&values);
            let largest = parts.eigenvalues.max();
            // Line and constant are gone: two combinations have neither value nor variance.
            let seen = parts.eigenvalues.iter().zip(along.iter());
            let seen = seen.filter(|(v, _)| **v > 1e-9 * largest);
            let seen: Vec<f64> = seen.map(|(v, a)| a * a / v).collect();
            let expected = seen.iter().sum::<f64>();
            same(square, expected, expected);
            assert_eq!(freedom, seen.len() as f64);
        });
    }
}

#[test]
fn what_is_left_of_a_turn_is_what_the_projection_written_out_leaves() {
    for (cells, length) in [(3, 5.0), (26, 5.0), (26, 0.01)] {
        with_fits(cells, |fit| {
            let law = Law { length, ..LAW };
            let dense = Dense::of(fit, &law);
            let turns = windows(&fit.psi, 1.0);
            let leaves = Leaves::new(fit, law, &turns);
            for turn in [0, 7, turns.len() - 1] {
                let readings = turns[turn].clone();
                let counts = readings.len() as f64;
                let weights = [0, 1, 2].map(|k: i32| -> Vec<f64> {
                    let own = |i: usize| (f64::from(k) * TAU * i as f64 / counts).cos() / counts;
                    (0..readings.len()).map(own).collect()
                });
                let found = leaves.of(&readings, &weights);
                for k in 0..3 {
                    let mut w = DVector::zeros(fit.residuals.len());
                    w.rows_mut(readings.start, readings.len())
                        .copy_from_slice(&weights[k]);
                    let own = w.dot(&(&dense.noise * &w));
                    let left = &w - &dense.rows * (&dense.inverse * dense.rows.tr_mul(&w));
                    let of_noise = left.dot(&(&dense.noise * &left)) / own;
                    let of_turn = |turn: &[DVector<f64>; 3]| -> f64 {
                        let waves = if k == 0 { &turn[..1] } else { &turn[1..] };
                        waves.iter().map(|wave| wave.dot(&left).powi(2)).sum()
                    };
                    let of_turns = dense.turns.iter().map(of_turn).sum();
                    same(found[k].of_noise, of_noise, 1.0);
                    same(found[k].of_turns, of_turns, 1.0);
                }
            }
        });
    }
}
