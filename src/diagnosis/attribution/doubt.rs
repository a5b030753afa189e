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

use errsep_models::model::{Column, FittedModel};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::diagnosis::attribution::context::{Cause, Context};

/// Draws of the state.
const DRAWS: usize = 128;
/// Rounds of fitting a drawn state without the causes' change at that state: noise of the state
/// comes back by the change that is taken out, greatest where the causes hide the state.
pub(in crate::diagnosis) const ROUNDS: usize = 4;
/// Eigenvalues below this change no product by more than three hundredths.
const LEAST: f64 = 0.03;
/// Greatest number of directions.
const MOST: usize = 80;
/// Seed of the draws: a verdict must not depend on how often it is asked for.
const SEED: u64 = 0x0064_6f75_6274;

/// Directions that are not fully trusted.
#[derive(Default)]
pub(in crate::diagnosis) struct Doubt {
    /// Directions.
    pub directions: Vec<DVector<f64>>,
    /// The part of a product along each that is taken away.
    pub weights: Vec<f64>,
}

impl Doubt {
    /// The doubt of independent changes W of one standard deviation each:
    /// (I + W Wᵀ)⁻¹ = I − Q Qᵀ with Q = W L⁻ᵀ and L Lᵀ = I + WᵀW.
    pub fn of_open(changes: &DMatrix<f64>) -> Self {
        let count = changes.ncols();
        let gram = DMatrix::identity(count, count) + changes.tr_mul(changes);
        let Some(root) = gram.cholesky().filter(|_| count > 0) else {
            return Self::default();
        };
        let Some(directions) = root.l().solve_lower_triangular(&changes.transpose()) else {
            return Self::default();
        };
        Self {
            directions: directions.row_iter().map(|q| q.transpose()).collect(),
            weights: vec![1.0; count],
        }
    }

    /// A residual as far as it is trusted.
    pub fn trusted(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut trusted = residual.clone();
        for (direction, weight) in self.directions.iter().zip(&self.weights) {
            trusted.axpy(-weight * direction.dot(residual), direction, 1.0);
        }
        trusted
    }
}

/// Draws of noise over readings that are free of causes.
pub(in crate::diagnosis) struct StateDraws {
    /// The noise, whitened and projected, readings × draws.
    pub noise: DMatrix<f64>,
    /// How the causes' change moves with the state that is fitted to it, likewise.
    pub moved: DMatrix<f64>,
    /// Noise as it stands in the readings, and how the causes' change there moves with the state, as
    /// read where the change is linear in it.
    pub in_readings: [DMatrix<f64>; 2],
}

impl<M: FittedModel> Context<'_, M> {
    /// Draws of the state; nothing where the causes' change does not depend on it.
    pub fn state_draws(&self, readings: &DVector<f64>, causes: &[Cause]) -> Option<StateDraws> {
        let (amplitudes, _) = self.amplitudes(readings, causes)?;
        let changes = self.changes(readings, causes)?;
        let clean = self.without(readings, causes, &changes);
        let change_at = |state: &M, read: &M| {
            let mut changed = DMatrix::zeros(readings.len(), causes.len());
            let mut at = 0;
            for k in 0..causes.len() {
                for column in self.columns_at(k, (state, read), causes, &changes) {
                    for (&row, value) in column.rows.iter().zip(&column.values) {
                        changed[(row, k)] += amplitudes[at] * value;
                    }
                    at += 1;
                }
            }
            changed
        };
        let fitted = self.model.refit_as_smooth(clean);
        let base = change_at(&fitted, &fitted).column_sum();
        let base_as_read = change_at(&fitted, &fitted.as_read()).column_sum();
        let drawn = |draw: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(SEED);
            random.set_stream(draw);
            let noise = self.law.draw(self.model, &mut random);
            let other = self.law.draw(self.model, &mut random);
            let noisy = readings + &noise;
            let mut moved = changes.clone();
            let mut as_read = moved.clone();
            for _ in 0..ROUNDS {
                let clean = self.without(&noisy, causes, &moved);
                let fitted = self.model.refit_as_smooth(clean);
                let read = fitted.as_read();
                let state = fitted.roughened(&other);
                moved = change_at(&state, &state);
                as_read = change_at(&state, &read);
            }
            [
                noise,
                moved.column_sum() - &base,
                as_read.column_sum() - &base_as_read,
            ]
        };
        if drawn(0)[1].norm() <= 1e-9 * base.norm() {
            return None;
        }
        let all: Vec<[DVector<f64>; 3]> = (0..DRAWS as u64).into_par_iter().map(drawn).collect();
        let [noise, moved, as_read] = [0, 1, 2].map(|which| {
            let own: Vec<DVector<f64>> = all.iter().map(|draw| draw[which].clone()).collect();
            DMatrix::from_columns(&own)
        });
        Some(StateDraws {
            moved: self.space.forward(moved).0,
            noise: self.space.forward(noise.clone()).0,
            in_readings: [noise, as_read],
        })
    }

    /// The signatures of one of the causes at a state, taken at the state as read where they are
    /// linear in it.
    pub fn columns_at(
        &self,
        which: usize,
        (state, read): (&M, &M),
        causes: &[Cause],
        changes: &DMatrix<f64>,
    ) -> Vec<Column> {
        let effect = &self.catalogue[causes[which].effect];
        let own = if effect.is_linear_in_state() {
            read
        } else {
            state
        };
        let seen = self.seen_by(which, own, causes, changes);
        effect.columns(&seen, &causes[which].shape)
    }

    /// What the model leaves open beside causes, because they show its state where it is not known: whitened,
    /// projected changes of one standard deviation each.
    pub fn open(&self, readings: &DVector<f64>, causes: &[Cause]) -> DMatrix<f64> {
        let nothing = DMatrix::zeros(readings.len(), 0);
        let Some(changes) = self.changes(readings, causes) else {
            return nothing;
        };
        let state = self
            .model
            .refit_as_smooth(self.without(readings, causes, &changes));
        let of = |cause: &Cause| self.catalogue[cause.effect].open(&state, &cause.shape);
        let columns: Vec<Column> = causes.iter().flat_map(of).collect();
        if columns.is_empty() {
            nothing
        } else {
            self.space.forward_columns(&columns).0
        }
    }

    /// The doubt about causes beside what the model and they themselves absorb (`basis`), with what the model
    /// leaves open beside them (`open`, clear of the basis).
    pub fn doubt(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        basis: &DMatrix<f64>,
        open: DMatrix<f64>,
    ) -> Doubt {
        let Some(StateDraws { mut moved, .. }) = self.state_draws(readings, causes) else {
            return Doubt::of_open(&open);
        };
        let along = basis.tr_mul(&moved);
        moved.gemm(-1.0, basis, &along, 1.0);
        if open.ncols() > 0 {
            let at = open.ncols();
            let mut all = open.resize_horizontally(at + DRAWS, 0.0);
            all.columns_mut(at, DRAWS)
                .copy_from(&(moved / (DRAWS as f64).sqrt()));
            return Doubt::of_open(&all);
        }
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
        let all = self.errors(gain);
        (&all * all.transpose() - &own * own.transpose()) / DRAWS as f64
    }

    /// The errors of such estimates, estimates × draws.
    pub fn errors(&self, gain: &DMatrix<f64>) -> DMatrix<f64> {
        gain * (&self.noise - &self.moved)
    }
}
