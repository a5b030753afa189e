//! What the noise of the fitted state does to the signatures of causes.
//!
//! A signature is taken at a fitted state, and the state has noise of its own: the true change of
//! the readings is that at the true state, so the remainder beside the right cause holds the
//! difference. Its covariance is found by drawing: noise is laid over the readings that are free
//! of the causes, the model fitted again and moved by a draw of what smoothing may have taken away
//! of the forms, and the causes' change taken there. With B Bᵀ that
//! covariance in whitened, projected readings, the remainder has I + B Bᵀ in place of I; along
//! each eigenvector of B Bᵀ with eigenvalue λ a part λ/(1 + λ) of every product is taken away. The
//! same draws give what the noise of the state adds to the uncertainty of the causes' sizes.

use errsep_models::model::FittedModel;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::bench::{Bench, Cause};

/// Draws of the state.
const DRAWS: usize = 128;
/// Rounds of fitting a drawn state without the causes' change at that state: noise of the state
/// comes back by the change that is taken out, greatest where the causes hide the state.
pub(super) const ROUNDS: usize = 4;
/// Eigenvalues below this change no product by more than three hundredths.
const LEAST: f64 = 0.03;
/// Greatest number of directions.
const MOST: usize = 80;
/// Seed of the draws: a verdict must not depend on how often it is asked for.
const SEED: u64 = 0x0064_6f75_6274;

/// Directions that are not fully trusted.
#[derive(Default)]
pub(super) struct Doubt {
    /// Orthonormal directions.
    pub directions: Vec<DVector<f64>>,
    /// The part of each that is taken away.
    pub weights: Vec<f64>,
}

/// Draws of noise over readings that are free of causes.
pub(super) struct StateDraws {
    /// The noise, whitened and projected, readings × draws.
    pub noise: DMatrix<f64>,
    /// How the causes' change moves with the state that is fitted to it, likewise.
    pub moved: DMatrix<f64>,
}

impl<M: FittedModel> Bench<'_, M> {
    /// Draws of the state; nothing where the causes' change does not depend on it.
    pub fn state_draws(&self, readings: &DVector<f64>, causes: &[Cause]) -> Option<StateDraws> {
        let (amplitudes, _) = self.amplitudes(readings, causes)?;
        let changes = self.changes(readings, causes)?;
        let clean = self.without(readings, causes, &changes);
        let changes_at = |state: &M| {
            let mut changed = DMatrix::zeros(readings.len(), causes.len());
            let mut at = 0;
            for (k, cause) in causes.iter().enumerate() {
                let state = self.seen_by(k, state, causes, &changes);
                for column in self.catalogue[cause.effect].columns(&state, &cause.shape) {
                    for (&row, value) in column.rows.iter().zip(&column.values) {
                        changed[(row, k)] += amplitudes[at] * value;
                    }
                    at += 1;
                }
            }
            changed
        };
        let base = changes_at(&self.model.refit_as_smooth(clean)).column_sum();
        let drawn = |draw: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(SEED);
            random.set_stream(draw);
            let noise = self.law.draw(self.model, &mut random);
            let other = self.law.draw(self.model, &mut random);
            let noisy = readings + &noise;
            let mut moved = changes.clone();
            for _ in 0..ROUNDS {
                let clean = self.without(&noisy, causes, &moved);
                let state = self.model.refit_as_smooth(clean).roughened(&other);
                moved = changes_at(&state);
            }
            (noise, moved.column_sum() - &base)
        };
        if drawn(0).1.norm() <= 1e-9 * base.norm() {
            return None;
        }
        let (noise, moved): (Vec<DVector<f64>>, Vec<DVector<f64>>) =
            (0..DRAWS as u64).into_par_iter().map(drawn).unzip();
        let forward =
            |columns: &[DVector<f64>]| self.space.forward(DMatrix::from_columns(columns)).0;
        Some(StateDraws {
            noise: forward(&noise),
            moved: forward(&moved),
        })
    }

    /// The doubt about causes beside what the model and they themselves absorb (`basis`).
    pub fn doubt(&self, readings: &DVector<f64>, causes: &[Cause], basis: &DMatrix<f64>) -> Doubt {
        let Some(StateDraws { mut moved, .. }) = self.state_draws(readings, causes) else {
            return Doubt::default();
        };
        let along = basis.tr_mul(&moved);
        moved.gemm(-1.0, basis, &along, 1.0);
        let eigen = SymmetricEigen::new(moved.tr_mul(&moved) / DRAWS as f64);
        let mut order: Vec<usize> = (0..DRAWS)
            .filter(|k| eigen.eigenvalues[*k] > LEAST)
            .collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        order.truncate(MOST);
        let mut doubt = Doubt::default();
        for k in order {
            let value = eigen.eigenvalues[k];
            let direction = &moved * eigen.eigenvectors.column(k);
            doubt
                .directions
                .push(direction / (value * DRAWS as f64).sqrt());
            doubt.weights.push(value / (1.0 + value));
        }
        doubt
    }
}

impl StateDraws {
    /// What the noise of the state adds to the covariance of estimates that are `gain` times
    /// whitened, projected readings: the same noise is in readings and state, so it may also take
    /// away.
    pub fn added(&self, gain: &DMatrix<f64>) -> DMatrix<f64> {
        let own = gain * &self.noise;
        let all = &own - gain * &self.moved;
        (&all * all.transpose() - &own * own.transpose()) / DRAWS as f64
    }
}
