//! Sizes and shapes of causes with their uncertainty.
//!
//! The causes' amplitudes a solve Sᵀ(r − Σ aE(a)) = 0, where the signatures E(a) are taken at the
//! state that is left without the causes and at the sizes that belong to them. With D the total
//! derivative of Σ aE(a), noise ν of the readings moves them by G ν, G = (SᵀD)⁻¹Sᵀ; D = S where a
//! signature depends on nothing. Noise also moves the state at which signatures are taken: that is
//! drawn.

use errsep_models::model::{Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::bench::{Bench, Cause, stack};
use super::doubt::ROUNDS;

/// What the noise of the state may take away of a variance, at most: it is known from draws.
const LEAST: f64 = -0.5;

/// Amplitudes and shapes of causes fitted together.
pub(super) struct Sizes {
    amplitudes: DVector<f64>,
    covariance: DMatrix<f64>,
    /// For each cause its first amplitude and its first parameter.
    own: Vec<(usize, usize)>,
}

impl Sizes {
    /// Causes at fixed signatures.
    pub fn fitted<M: FittedModel>(
        bench: &Bench<'_, M>,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<Self> {
        let (amplitudes, _) = bench.amplitudes(readings, causes)?;
        let (columns, own) = instruments(bench, causes, &amplitudes);
        let gram = columns.tr_mul(&columns);
        let covariance = gram
            .clone()
            .cholesky()
            .map(|c| c.inverse())
            .or_else(|| gram.pseudo_inverse(1e-12).ok())?;
        Some(Self {
            amplitudes,
            covariance,
            own,
        })
    }

    /// The same where signatures depend on the sizes and on the state.
    pub fn fitted_with_state<M: FittedModel>(
        bench: &Bench<'_, M>,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<Self> {
        let plain = Self::fitted(bench, readings, causes)?;
        let Some(draws) = bench.state_draws(readings, causes) else {
            return Some(plain);
        };
        let (columns, _) = instruments(bench, causes, &plain.amplitudes);
        let mut derivatives = columns.clone();
        for (cause, (first, parameter)) in causes.iter().zip(&plain.own) {
            for k in 0..cause.columns.len() {
                let step = 0.5 * plain.covariance[(parameter + k, parameter + k)].sqrt();
                let predicted = |sign: f64| {
                    let mut moved = plain.amplitudes.clone();
                    moved[first + k] += sign * step;
                    predicted(bench, readings, causes, &moved)
                };
                let slope = (predicted(1.0) - predicted(-1.0)) / (2.0 * step);
                if slope.iter().all(|v| v.is_finite()) {
                    derivatives.set_column(parameter + k, &slope);
                }
            }
        }
        let Some(inverse) = columns.tr_mul(&derivatives).try_inverse() else {
            return Some(plain);
        };
        let gain = inverse * columns.transpose();
        let added = draws.added(&gain);
        Some(Self {
            covariance: with_state(&gain * gain.transpose(), &added),
            ..plain
        })
    }

    /// What is reported of one of the causes.
    pub fn of<M: FittedModel>(
        &self,
        bench: &Bench<'_, M>,
        causes: &[Cause],
        which: usize,
    ) -> Vec<Estimate> {
        let cause = &causes[which];
        let (effect, shape) = (&bench.catalogue[cause.effect], &cause.shape);
        let (first, parameter) = self.own[which];
        let count = cause.projected.ncols();
        let size = count + shape.values.len();
        let next = self
            .own
            .get(which + 1)
            .map_or(self.covariance.nrows(), |n| n.1);
        let covariance = DMatrix::from_fn(size, size, |i, j| {
            let (i, j) = (parameter + i, parameter + j);
            if i < next && j < next {
                self.covariance[(i, j)]
            } else {
                f64::NAN
            }
        });
        let mut estimates = effect.estimates(
            shape,
            &self.amplitudes.as_slice()[first..first + count],
            &covariance,
        );
        // Shape parameters follow the amplitudes. A step between two readings has no derivative.
        for (estimate, own) in estimates
            .iter_mut()
            .skip(count)
            .zip(effect.resolution(bench.model, shape))
        {
            estimate.std = if estimate.std.is_nan() {
                own
            } else {
                estimate.std.hypot(own)
            };
        }
        estimates
    }
}

/// Signatures and their derivatives by the shapes, and where each cause's own begin.
fn instruments<M: FittedModel>(
    bench: &Bench<'_, M>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
) -> (DMatrix<f64>, Vec<(usize, usize)>) {
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let mut own = Vec::new();
    let mut at = 0;
    for cause in causes {
        let count = cause.projected.ncols();
        let used = amplitudes.rows(at, count).clone_owned();
        own.push((at, columns.len()));
        columns.extend(cause.projected.column_iter().map(|c| c.clone_owned()));
        for (j, step) in cause.shape.steps.iter().enumerate() {
            if *step == 0.0 {
                continue;
            }
            let moved = |sign: f64| {
                let mut shape: Shape = cause.shape.clone();
                shape.values[j] += sign * 0.1 * step;
                bench.cause(bench.model, cause.effect, shape).projected * &used
            };
            let slope = (moved(1.0) - moved(-1.0)) / (0.2 * step);
            if slope.norm() > 0.0 {
                columns.push(slope);
            }
        }
        at += count;
    }
    if columns.is_empty() {
        return (DMatrix::zeros(bench.space.readings(), 0), own);
    }
    (DMatrix::from_columns(&columns), own)
}

/// The whitened, projected change by causes of given amplitudes, at the state that is left without
/// them.
fn predicted<M: FittedModel>(
    bench: &Bench<'_, M>,
    readings: &DVector<f64>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
) -> DVector<f64> {
    let mut changes = bench.changes_at(causes, amplitudes);
    let mut moved: Vec<Cause> = Vec::new();
    for _ in 0..ROUNDS {
        let clean = bench.without(readings, causes, &changes);
        let state = bench.model.refit_as_smooth(clean);
        let mut at = 0;
        moved.clear();
        for (k, cause) in causes.iter().enumerate() {
            let own = &amplitudes.as_slice()[at..at + cause.columns.len()];
            at += own.len();
            let shape = bench.catalogue[cause.effect]
                .settled(&cause.shape, own)
                .unwrap_or_else(|| cause.shape.clone());
            let state = bench.seen_by(k, &state, causes, &changes);
            moved.push(bench.cause(&state, cause.effect, shape));
        }
        changes = bench.changes_at(&moved, amplitudes);
    }
    stack(&moved, readings.len()) * amplitudes
}

/// A covariance with what the noise of the state adds to it.
fn with_state(own: DMatrix<f64>, added: &DMatrix<f64>) -> DMatrix<f64> {
    let Some(root) = own.clone().cholesky().map(|c| c.unpack()) else {
        return own;
    };
    let Some(inverse) = root.clone().try_inverse() else {
        return own;
    };
    let relative = &inverse * added * inverse.transpose();
    let mut eigen = SymmetricEigen::new(0.5 * (&relative + relative.transpose()));
    eigen.eigenvalues.apply(|v| *v = v.max(LEAST));
    own + &root * eigen.recompose() * root.transpose()
}
