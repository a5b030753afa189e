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

use std::sync::{Arc, Mutex, OnceLock};

use errsep_models::model::{AnyModel, Column, FittedModel, Shape};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::detection::basis::inner_products;

/// Draws of the state.
pub(crate) const DRAWS: usize = 128;
/// Draws of the state behind the doubt about a rival: many rivals are judged, none of them told.
pub(crate) const FEW_DRAWS: usize = 32;
/// Most rounds of fitting a drawn state without the causes' change at that state: noise of the state
/// comes back by the change that is taken out, greatest where the causes hide the state.
pub(crate) const ROUNDS: usize = 4;
/// Relative change of a draw by a further round at which no more are made: it is of the order of what
/// 128 draws leave open of a standard deviation (6 %).
const SETTLED: f64 = 0.03;
/// Eigenvalues below this change no product by more than three hundredths.
const LEAST: f64 = 0.03;
/// Greatest number of directions.
const MOST: usize = 80;
/// Seed of the draws: a verdict must not depend on how often it is asked for.
const SEED: u64 = 0x0064_6f75_6274;

/// Directions that are not fully trusted.
#[derive(Default)]
pub(crate) struct Doubt {
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
        let gram = DMatrix::identity(count, count) + inner_products(changes, changes);
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

/// Draws of noise, the same for all causes at one state and law.
pub(crate) struct NoiseDraws {
    /// As it stands in the readings, readings × draws.
    in_readings: DMatrix<f64>,
    /// Whitened and projected, likewise.
    projected: DMatrix<f64>,
    /// What smoothing may have taken away of the state, by draw.
    away: Vec<Option<DMatrix<f64>>>,
}

/// What is drawn at one state and law once it is asked for: the noise, and the states behind the sizes of the
/// causes that were asked for last.
#[derive(Default)]
pub(crate) struct Drawn {
    noise: OnceLock<Arc<NoiseDraws>>,
    states: Mutex<Option<KnownStates>>,
}

/// Readings and causes with the draws of the state behind their sizes.
struct KnownStates {
    readings: DVector<f64>,
    causes: Vec<(usize, Shape)>,
    draws: Option<Arc<StateDraws>>,
}

/// Draws of noise over readings that are free of causes.
pub(crate) struct StateDraws {
    noise: Arc<NoiseDraws>,
    /// How the causes' change moves with the state that is fitted to it, whitened and projected, readings ×
    /// draws.
    pub moved: DMatrix<f64>,
    /// The same as it stands in the readings, with the state as read where the change is linear in it.
    pub moved_as_read: DMatrix<f64>,
}

impl Context<'_> {
    /// The noise of all draws.
    fn noise_draws(&self) -> Arc<NoiseDraws> {
        let drawn = |draw: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(SEED);
            random.set_stream(draw);
            let noise = self.law.draw(self.model, &mut random);
            let other = self.law.draw(self.model, &mut random);
            (noise, self.model.smoothed_away(&other))
        };
        let all = || {
            let draws = (0..DRAWS as u64).into_par_iter().map(drawn);
            let (noise, away): (Vec<DVector<f64>>, Vec<_>) = draws.unzip();
            let in_readings = DMatrix::from_columns(&noise);
            Arc::new(NoiseDraws {
                projected: self.space.forward(in_readings.clone()).0,
                in_readings,
                away,
            })
        };
        if let Some(known) = self.drawn.noise.get() {
            return Arc::clone(known);
        }
        // Not held locked meanwhile, as in `best`.
        let drawn = all();
        let _ = self.drawn.noise.set(Arc::clone(&drawn));
        drawn
    }

    /// Draws of the state; nothing where the causes' change does not depend on it.
    pub fn state_draws(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<Arc<StateDraws>> {
        let shapes: Vec<(usize, Shape)> =
            causes.iter().map(|c| (c.effect, c.shape.clone())).collect();
        if let Ok(known) = self.drawn.states.lock()
            && let Some(known) = &*known
            && known.causes == shapes
            && known.readings == *readings
        {
            return known.draws.clone();
        }
        let moved = self.moved_states(readings, causes, DRAWS, true);
        let draws = moved.map(|(moved, moved_as_read)| {
            Arc::new(StateDraws {
                moved: self.space.forward(moved).0,
                noise: self.noise_draws(),
                moved_as_read,
            })
        });
        if let Ok(mut known) = self.drawn.states.lock() {
            *known = Some(KnownStates {
                readings: readings.clone(),
                causes: shapes,
                draws: draws.clone(),
            });
        }
        draws
    }

    /// How the causes' change moves with the drawn states, as it stands in the readings, and the same with
    /// the state as read where the change is linear in it, if that is asked for: readings × draws.
    fn moved_states(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        draws: usize,
        also_as_read: bool,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (amplitudes, _) = self.amplitudes(readings, causes)?;
        let changes = self.changes(readings, causes)?;
        let noise = self.noise_draws();
        let mut states = States {
            context: self,
            readings,
            causes,
            amplitudes: &amplitudes,
            changes: &changes,
            noise: &noise,
            fixed: vec![None; causes.len()],
        };
        let fitted = self
            .model
            .refit_as_smooth(self.without(readings, causes, &changes));
        let apart = states.change_at((&fitted, &fitted));
        let base_as_read = states.change_at((&fitted, &fitted.as_read())).column_sum();
        states.hold(&apart);
        let base = apart.column_sum();
        let rounds = states.rounds(&base)?;
        let all = (0..draws).into_par_iter().map(|draw| {
            let (fitted, state) = states.drawn(draw, rounds);
            let moved = states.change_at((&state, &state)).column_sum() - &base;
            let as_read = also_as_read.then(|| {
                states.change_at((&state, &fitted.as_read())).column_sum() - &base_as_read
            });
            (moved, as_read)
        });
        let (moved, as_read): (Vec<DVector<f64>>, Vec<Option<DVector<f64>>>) = all.unzip();
        let side_by_side = |columns: Vec<DVector<f64>>| match columns.len() {
            0 => DMatrix::zeros(readings.len(), 0),
            _ => DMatrix::from_columns(&columns),
        };
        let as_read = as_read.into_iter().flatten().collect();
        Some((side_by_side(moved), side_by_side(as_read)))
    }

    /// The signatures of one of the causes at a state, taken at the state as read where they are
    /// linear in it.
    pub fn columns_at(
        &self,
        which: usize,
        (state, read): (&AnyModel, &AnyModel),
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
        let mut each = self.open_of_each(readings, causes);
        if causes.len() == 1 {
            return each.remove(0);
        }
        let widths = each.iter().map(DMatrix::ncols);
        let mut open = DMatrix::zeros(readings.len(), widths.sum());
        let mut at = 0;
        for own in each {
            open.columns_mut(at, own.ncols()).copy_from(&own);
            at += own.ncols();
        }
        open
    }

    /// The same for each of the causes.
    pub fn open_of_each(&self, readings: &DVector<f64>, causes: &[Cause]) -> Vec<DMatrix<f64>> {
        let Some(changes) = self.changes(readings, causes) else {
            return vec![DMatrix::zeros(readings.len(), 0); causes.len()];
        };
        let state = self
            .model
            .refit_as_smooth(self.without(readings, causes, &changes));
        let of = |cause: &Cause| {
            let columns = self.catalogue[cause.effect].open(&state, &cause.shape);
            if columns.is_empty() {
                DMatrix::zeros(readings.len(), 0)
            } else {
                self.space.forward_columns(&columns).0
            }
        };
        causes.iter().map(of).collect()
    }

    /// The doubt about causes beside what the model and they themselves absorb (`basis`), with what the model
    /// leaves open beside them (`open`, clear of the basis).
    pub fn doubt(
        &self,
        readings: &DVector<f64>,
        (causes, basis): (&[Cause], &DMatrix<f64>),
        open: DMatrix<f64>,
        draws: usize,
    ) -> Doubt {
        let Some((moved, _)) = self.moved_states(readings, causes, draws, false) else {
            return Doubt::of_open(&open);
        };
        let mut moved = self.space.forward(moved).0;
        let along = inner_products(basis, &moved);
        moved.gemm(-1.0, basis, &along, 1.0);
        if open.ncols() > 0 {
            let at = open.ncols();
            let mut all = open.resize_horizontally(at + draws, 0.0);
            all.columns_mut(at, draws)
                .copy_from(&(moved / (draws as f64).sqrt()));
            return Doubt::of_open(&all);
        }
        let eigen = SymmetricEigen::new(inner_products(&moved, &moved) / draws as f64);
        let mut order: Vec<usize> = (0..draws)
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
                .push(direction / (value * draws as f64).sqrt());
            doubt.weights.push(value / (1.0 + value));
        }
        doubt
    }
}

/// What drawn states are made of.
struct States<'s> {
    context: &'s Context<'s>,
    readings: &'s DVector<f64>,
    causes: &'s [Cause],
    amplitudes: &'s DVector<f64>,
    changes: &'s DMatrix<f64>,
    noise: &'s NoiseDraws,
    /// The change of each cause that does not depend on the state.
    fixed: Vec<Option<DVector<f64>>>,
}

impl States<'_> {
    /// Holds the causes that change the same at a drawn state as at the fitted one, `apart`.
    fn hold(&mut self, apart: &DMatrix<f64>) {
        let (_, state) = self.fitted(0, &self.noisy(0), self.changes);
        let drawn = self.change_at((&state, &state));
        let read = self.change_at((&state, &state.as_read()));
        for (k, own) in apart.column_iter().enumerate() {
            let still = drawn.column(k) == own && read.column(k) == own;
            self.fixed[k] = still.then(|| own.clone_owned());
        }
    }

    /// What each cause changes at a state, and at the state as read, readings × causes.
    fn change_at(&self, states: (&AnyModel, &AnyModel)) -> DMatrix<f64> {
        let mut changed = DMatrix::zeros(self.readings.len(), self.causes.len());
        let mut at = 0;
        for (k, mut changed) in changed.column_iter_mut().enumerate() {
            if let Some(fixed) = &self.fixed[k] {
                changed.copy_from(fixed);
                at += self.causes[k].columns.len();
                continue;
            }
            let columns = self
                .context
                .columns_at(k, states, self.causes, self.changes);
            for column in columns {
                let amplitude = self.amplitudes[at];
                at += 1;
                for (&row, value) in column.rows.iter().zip(&column.values) {
                    changed[row] += amplitude * value;
                }
            }
        }
        changed
    }

    /// The state fitted to noisy readings less a change, and the same with a draw of what its smoothing may
    /// have taken away.
    fn fitted(
        &self,
        draw: usize,
        noisy: &DVector<f64>,
        change: &DMatrix<f64>,
    ) -> (AnyModel, AnyModel) {
        let clean = self.context.without(noisy, self.causes, change);
        let fitted = self.context.model.refit_as_smooth(clean);
        let state = match &self.noise.away[draw] {
            Some(away) => fitted.clone().roughened(away),
            None => fitted.clone(),
        };
        (fitted, state)
    }

    fn noisy(&self, draw: usize) -> DVector<f64> {
        self.readings + self.noise.in_readings.column(draw)
    }

    /// The rounds that a draw needs until its change rests; nothing where it does not depend on the state.
    fn rounds(&self, base: &DVector<f64>) -> Option<usize> {
        let noisy = self.noisy(0);
        let mut before: Option<DVector<f64>> = None;
        let mut changes = self.changes.clone();
        for round in 1..=ROUNDS {
            let (_, state) = self.fitted(0, &noisy, &changes);
            changes = self.change_at((&state, &state));
            let moved = changes.column_sum() - base;
            if moved.norm() <= 1e-9 * base.norm() {
                return None;
            }
            if before.is_some_and(|b| (&moved - b).norm() <= SETTLED * moved.norm()) {
                return Some(round - 1);
            }
            before = Some(moved);
        }
        Some(ROUNDS)
    }

    /// The state that is fitted to a draw of noise without the causes' changes there, and the same with what its
    /// smoothing may have taken away.
    fn drawn(&self, draw: usize, rounds: usize) -> (AnyModel, AnyModel) {
        let noisy = self.noisy(draw);
        let mut changes = self.changes.clone();
        for _ in 1..rounds {
            let (_, state) = self.fitted(draw, &noisy, &changes);
            changes = self.change_at((&state, &state));
        }
        self.fitted(draw, &noisy, &changes)
    }
}

impl StateDraws {
    /// What the noise of the state adds to the covariance of estimates that are `gain` times
    /// whitened, projected readings: the same noise is in readings and state, so it may also take
    /// away.
    pub fn added(&self, gain: &DMatrix<f64>) -> DMatrix<f64> {
        let own = gain * &self.noise.projected;
        let all = self.errors(gain);
        (&all * all.transpose() - &own * own.transpose()) / DRAWS as f64
    }

    /// The noise as it stands in the readings, readings × draws.
    pub fn noise_in_readings(&self) -> &DMatrix<f64> {
        &self.noise.in_readings
    }

    /// The same whitened and projected.
    pub fn projected_noise(&self) -> &DMatrix<f64> {
        &self.noise.projected
    }

    /// The errors of such estimates, estimates × draws.
    pub fn errors(&self, gain: &DMatrix<f64>) -> DMatrix<f64> {
        gain * (&self.noise.projected - &self.moved)
    }
}
