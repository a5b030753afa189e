//! Sizes and shapes of causes with their uncertainty.
//!
//! The causes' amplitudes a solve Sᵀ(r − Σ aE(a)) = 0, where the signatures E(a) are taken at the
//! state that is left without the causes and at the sizes that belong to them. With D the total
//! derivative of Σ aE(a), noise ν of the readings moves them by G ν, G = (SᵀD)⁻¹Sᵀ; D = S where a
//! signature depends on nothing. Noise also moves the state at which signatures are taken: that is
//! drawn. What the state leaves open, W of one standard deviation each, adds G W (G W)ᵀ.
//!
//! What the state interpolates falsely makes sizes small, however many readings there are: errors of the square
//! |W|² in a change of the square |aE|² leave of a size the part |aE|²/(|aE|² + |W|²) (attenuation; Fuller,
//! Measurement Error Models (1987), section 1.1). How much of W is such is not known, as where a form keeps to what is
//! interpolated there are none: anything from none to all is as probable (GUM 4.3.7), for all amplitudes of a cause alike.

use std::sync::Arc;

use errsep_models::model::{Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::attribution::doubt::{ROUNDS, StateDraws};
use crate::attribution::moments::Moment;

/// What the noise of the state may take away of a variance, at most: it is known from draws.
const LEAST: f64 = -0.5;

/// Part of the change by a step of an amplitude that a further round may leave out of its derivative.
const AT_REST: f64 = 1e-3;

/// Part of a shape's step over which a derivative is taken, either way: where a signature jumps between two readings
/// a longer one would count the jump as known to less than their distance.
const SLOPE: f64 = 1e-3;

/// Part of the time between two readings that is rounding.
const ROUNDING: f64 = 1e-9;

/// Variance of where a signature falls, by the square of the distance of two readings: as the search settles anywhere between
/// two, not midway, anywhere up to that distance to either side is as probable.
const BETWEEN: f64 = 1.0 / 3.0;

/// What the noise adds to it, by the fourth power of the fall in units of the noise: that of the place of a step that is
/// found among many readings (Yao, Annals of Statistics 15 (1987) 1321).
const BLURRED: f64 = 26.0;

/// Amplitudes and shapes of causes fitted together.
pub(crate) struct Sizes {
    /// The amplitudes, cause by cause.
    pub amplitudes: DVector<f64>,
    /// Covariance of the parameters.
    pub covariance: DMatrix<f64>,
    /// How noise of whitened, projected readings moves the parameters.
    pub gain: DMatrix<f64>,
    /// What the parameters are: those that readings determine at all.
    pub parameters: Vec<Unknown>,
    /// Draws of the state, where signatures depend on it.
    pub draws: Option<Arc<StateDraws>>,
    /// The moment of each cause that begins at one and its standard uncertainty, once they are worked out.
    moments: Vec<Option<(f64, f64)>>,
}

/// One parameter of several causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// An amplitude: the cause, and its place among the cause's own.
    Amplitude(usize, usize),
    /// A shape parameter, likewise.
    Shape(usize, usize),
}

impl Sizes {
    /// Causes at fixed signatures.
    pub fn fitted(
        context: &Context<'_>,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<Self> {
        let (amplitudes, _) = context.amplitudes(readings, causes)?;
        let (columns, parameters) = instruments(context, causes, &amplitudes);
        let gram = columns.tr_mul(&columns) + fallen(context, causes, &amplitudes, &parameters);
        let covariance = gram
            .clone()
            .cholesky()
            .map(|c| c.inverse())
            .or_else(|| gram.pseudo_inverse(1e-12).ok())?;
        Some(Self {
            amplitudes,
            gain: &covariance * columns.transpose(),
            covariance,
            parameters,
            draws: None,
            moments: vec![None; causes.len()],
        })
    }

    /// The same where signatures depend on the sizes and on the state.
    pub fn fitted_with_state(
        context: &Context<'_>,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<Self> {
        let plain = Self::fitted(context, readings, causes)?;
        let Some(draws) = context.state_draws(readings, causes) else {
            return Some(plain);
        };
        let (columns, _) = instruments(context, causes, &plain.amplitudes);
        let slope = |parameter: usize| {
            let Unknown::Amplitude(cause, k) = plain.parameters[parameter] else {
                return None;
            };
            let at = first_amplitude(causes, cause) + k;
            let step = 0.5 * plain.covariance[(parameter, parameter)].sqrt();
            let own = &causes[cause].columns[k].values;
            let length = step * own.iter().map(|v| v * v).sum::<f64>().sqrt();
            let predicted = |sign: f64| {
                let mut moved = plain.amplitudes.clone();
                moved[at] += sign * step;
                predicted(context, readings, causes, &moved, length)
            };
            let slope = (predicted(1.0) - predicted(-1.0)) / (2.0 * step);
            slope.iter().all(|v| v.is_finite()).then_some(slope)
        };
        let all = (0..plain.parameters.len()).into_par_iter();
        let slopes: Vec<Option<DVector<f64>>> = all.map(slope).collect();
        let mut derivatives = columns.clone();
        for (parameter, slope) in slopes.into_iter().enumerate() {
            if let Some(slope) = slope {
                derivatives.set_column(parameter, &slope);
            }
        }
        let fallen = fallen(context, causes, &plain.amplitudes, &plain.parameters);
        let Some(inverse) = (columns.tr_mul(&derivatives) + &fallen).try_inverse() else {
            return Some(plain);
        };
        let gain = &inverse * columns.transpose();
        let own = &gain * gain.transpose() + &inverse * fallen * inverse.transpose();
        // What the state leaves open is independent of the noise.
        let open = &gain * context.open(readings, causes);
        let added = draws.added(&gain) + &open * open.transpose();
        Some(Self {
            covariance: with_state(own, &added),
            gain,
            draws: Some(draws),
            ..plain
        })
    }

    /// The same with what falsely interpolated states may take away of the sizes: as they are told.
    pub fn told(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> Option<Self> {
        let mut sizes = Self::fitted_with_state(context, readings, causes)?;
        for (which, open) in context.open_of_each(readings, causes).iter().enumerate() {
            let first = first_amplitude(causes, which);
            let count = causes[which].projected.ncols();
            let own = sizes.amplitudes.rows(first, count);
            let change = (&causes[which].projected * own).norm_squared();
            let open = open.norm_squared();
            if open <= 0.0 {
                continue;
            }
            let taken = open / (change + open) / 3f64.sqrt();
            let spread = |parameter: &Unknown| match *parameter {
                Unknown::Amplitude(of, k) if of == which => taken * own[k],
                _ => 0.0,
            };
            let spread =
                DVector::from_iterator(sizes.parameters.len(), sizes.parameters.iter().map(spread));
            sizes.covariance.ger(1.0, &spread, &spread, 1.0);
        }
        Some(sizes.with_moments(context, readings, causes))
    }

    /// The same with how well the moments are known at which causes begin, and what that leaves open of their sizes.
    pub fn with_moments(
        mut self,
        context: &Context<'_>,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Self {
        for which in 0..causes.len() {
            let of = |unknown: Unknown| self.parameters.iter().position(|p| *p == unknown);
            let within =
                of(Unknown::Shape(which, 0)).map(|at| self.covariance[(at, at)].max(0.0).sqrt());
            let Some(moment) = Moment::of(context, readings, (causes, which), within) else {
                continue;
            };
            let count = causes[which].projected.ncols();
            let places: Vec<Option<usize>> = (0..count)
                .map(|k| of(Unknown::Amplitude(which, k)))
                .collect();
            for (i, row) in places.iter().enumerate() {
                for (j, column) in places.iter().enumerate() {
                    if let (Some(row), Some(column)) = (row, column) {
                        self.covariance[(*row, *column)] += moment.added[(i, j)];
                    }
                }
            }
            self.moments[which] = Some((moment.value, moment.std));
        }
        self
    }

    /// What is reported of one of the causes.
    pub fn of(&self, context: &Context<'_>, causes: &[Cause], which: usize) -> Vec<Estimate> {
        let cause = &causes[which];
        let (effect, shape) = (&context.catalogue[cause.effect], &cause.shape);
        let first = first_amplitude(causes, which);
        let count = cause.projected.ncols();
        let place = |i: usize| {
            let unknown = if i < count {
                Unknown::Amplitude(which, i)
            } else {
                Unknown::Shape(which, i - count)
            };
            self.parameters.iter().position(|p| *p == unknown)
        };
        let places: Vec<Option<usize>> = (0..count + shape.values.len()).map(place).collect();
        let covariance = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            let known = places[i].zip(places[j]);
            known.map_or(f64::NAN, |at| self.covariance[at])
        });
        let mut estimates = effect.estimates(
            shape,
            &self.amplitudes.as_slice()[first..first + count],
            &covariance,
        );
        // Shape parameters follow the amplitudes; a moment is the only one of its cause.
        if let (Some(moment), Some(estimate)) = (self.moments[which], estimates.get_mut(count)) {
            (estimate.value, estimate.std) = moment;
        }
        estimates
    }
}

/// The place of a cause's first amplitude among those of all.
pub(crate) fn first_amplitude(causes: &[Cause], which: usize) -> usize {
    causes[..which].iter().map(|c| c.projected.ncols()).sum()
}

/// Signatures and their derivatives by the shapes, and what they belong to.
fn instruments(
    context: &Context<'_>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
) -> (DMatrix<f64>, Vec<Unknown>) {
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let mut parameters = Vec::new();
    for (which, cause) in causes.iter().enumerate() {
        let count = cause.projected.ncols();
        let used = amplitudes
            .rows(first_amplitude(causes, which), count)
            .clone_owned();
        for (k, column) in cause.projected.column_iter().enumerate() {
            parameters.push(Unknown::Amplitude(which, k));
            columns.push(column.clone_owned());
        }
        for j in 0..cause.shape.values.len() {
            let Some((low, high, apart)) = beside(context, cause, j) else {
                continue;
            };
            let at =
                |shape: Shape| context.cause(context.model, cause.effect, shape).projected * &used;
            let slope = (at(high) - at(low)) / apart;
            if slope.norm() > 0.0 {
                parameters.push(Unknown::Shape(which, j));
                columns.push(slope);
            }
        }
    }
    if columns.is_empty() {
        return (DMatrix::zeros(context.space.readings(), 0), parameters);
    }
    (DMatrix::from_columns(&columns), parameters)
}

/// What the readings tell of shapes by between which of them signatures fall, as inverse variances of the parameters.
fn fallen(
    context: &Context<'_>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
    parameters: &[Unknown],
) -> DMatrix<f64> {
    let mut told = DMatrix::zeros(parameters.len(), parameters.len());
    for (which, cause) in causes.iter().enumerate() {
        if cause.projected.ncols() != 1 {
            continue;
        }
        let amplitude = amplitudes[first_amplitude(causes, which)];
        let falls = context.catalogue[cause.effect].falls(context.model, &cause.shape);
        for fall in falls {
            let (seen, _) = context
                .space
                .forward_columns(std::slice::from_ref(&fall.height));
            let height = amplitude.powi(2) * seen.norm_squared();
            let variance = fall.apart.powi(2) * (BETWEEN + BLURRED / height.powi(2));
            let of = |value: usize| {
                let own = Unknown::Shape(which, value);
                parameters.iter().position(|p| *p == own)
            };
            let by: Vec<(usize, f64)> = (fall.by.iter())
                .filter_map(|(value, slope)| Some((of(*value)?, *slope)))
                .collect();
            for (i, a) in &by {
                for (j, b) in &by {
                    told[(*i, *j)] += a * b / variance;
                }
            }
        }
    }
    told
}

/// The shapes on either side of a cause's along one of its free parameters, and how far apart: where it begins at a
/// moment between the readings about it, as at a reading the signature steps.
pub(crate) fn beside(
    context: &Context<'_>,
    cause: &Cause,
    parameter: usize,
) -> Option<(Shape, Shape, f64)> {
    let step = *cause.shape.steps.get(parameter)?;
    if step == 0.0 {
        return None;
    }
    let here = cause.shape.values[parameter];
    let (mut low, mut high) = (here - SLOPE * step, here + SLOPE * step);
    let moments = context.catalogue[cause.effect].moments(context.model, &cause.shape);
    let after = moments.partition_point(|m| *m <= here);
    if let (Some(from), Some(until)) = (
        after.checked_sub(1).map(|before| moments[before]),
        moments.get(after),
    ) {
        low = low.max(from);
        high = high.min(until - ROUNDING * (until - from));
    }
    let at = |value: f64| {
        let mut shape = cause.shape.clone();
        shape.values[parameter] = value;
        shape
    };
    (high > low).then(|| (at(low), at(high), high - low))
}

/// The whitened, projected change by causes of given amplitudes, at the state that is left without
/// them: in as many rounds as move it by no more than a part of `step`.
fn predicted(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
    step: f64,
) -> DVector<f64> {
    let mut changes = context.changes_at(causes, amplitudes);
    for _ in 0..ROUNDS {
        let clean = context.without(readings, causes, &changes);
        let state = context.model.refit_as_smooth(clean);
        let mut at = 0;
        let mut next = DMatrix::zeros(changes.nrows(), causes.len());
        for (k, cause) in causes.iter().enumerate() {
            let own = &amplitudes.as_slice()[at..at + cause.columns.len()];
            at += own.len();
            let effect = &context.catalogue[cause.effect];
            let shape = effect.settled(&cause.shape, own);
            let shape = shape.as_ref().unwrap_or(&cause.shape);
            let state = context.seen_by(k, &state, causes, &changes);
            let columns = effect.columns(&state, shape);
            for (column, amplitude) in columns.iter().zip(own) {
                for (&row, value) in column.rows.iter().zip(&column.values) {
                    next[(row, k)] += amplitude * value;
                }
            }
        }
        let moved = (&next - &changes).norm();
        changes = next;
        if moved <= AT_REST * step {
            break;
        }
    }
    context.space.forward_vector(&changes.column_sum())
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

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, FittedModel};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::Sizes;
    use crate::attribution::context::Context;
    use crate::detection::estimate::estimate;

    /// *Definition*: two causes of one signature have no sizes, whatever rounding leaves of it; each by itself has.
    #[test]
    fn no_size_is_told_of_what_is_a_sum_of_others() {
        let noise = SceneNoise {
            white: 0.1,
            ..SceneNoise::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let scene = Scene::random(40, 3, 1e-5, 2.0, noise, &mut random);
        let fitted = Linearised::new(&scene.measured(5), Assumptions::default()).unwrap();
        let model = AnyModel::new(&fitted);
        let catalogue = model.effects();
        let readings = model.linearised();
        let law = estimate(&model, &readings);
        let context = Context::new(&model, &catalogue, law, 40, 1);
        let of = |name: &str| {
            let effect = catalogue.iter().position(|e| e.name() == name).unwrap();
            let first = catalogue[effect].grid(&model).into_iter().next().unwrap();
            context.cause(&model, effect, first)
        };
        let gain = of("gain-mismatch");
        assert!(Sizes::fitted(&context, &readings, std::slice::from_ref(&gain)).is_some());
        for part in 1..40 {
            let mut again = gain.clone();
            again.projected *= 1.0 + 0.1 * f64::from(part);
            assert!(Sizes::fitted(&context, &readings, &[gain.clone(), again]).is_none());
        }
    }
}
