//! Causes at another measurement: their shapes as they were, their sizes fitted or carried over.

use errsep_models::model::{AnyModel, Effect, Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};

use crate::attribution::context::{Cause, Context};
use crate::attribution::sizes::{Unknown, beside, first_amplitude};

/// Rounds in which causes that see each other are taken.
const ROUNDS: usize = 4;
/// Most rounds in which a state and the causes that are seen there come to agree.
pub(super) const SETTLED: usize = 24;
/// Relative change at which they do.
pub(super) const AT_REST: f64 = 1e-5;

/// The same shape, which no search moves.
pub(super) fn held(shape: &Shape) -> Shape {
    Shape {
        steps: vec![0.0; shape.values.len()],
        ..shape.clone()
    }
}

/// Causes of given shapes and amplitudes at the state of a context, and what each changes, readings × causes.
pub(super) fn placed(
    context: &Context<'_>,
    shapes: &[(usize, Shape)],
    amplitudes: &DVector<f64>,
) -> (Vec<Cause>, DMatrix<f64>) {
    let own = |k: usize, state: &AnyModel| {
        let (effect, shape) = &shapes[k];
        context.cause(state, *effect, shape.clone())
    };
    let mut causes: Vec<Cause> = (0..shapes.len()).map(|k| own(k, context.model)).collect();
    let mut changes = context.changes_at(&causes, amplitudes);
    if shapes.len() > 1 {
        for _ in 0..ROUNDS {
            let seen = |k: usize| context.seen_by(k, context.model, &causes, &changes);
            causes = (0..shapes.len()).map(|k| own(k, &seen(k))).collect();
            changes = context.changes_at(&causes, amplitudes);
        }
    }
    (causes, changes)
}

/// Causes of given shapes with their sizes fitted, the state without them.
pub(super) fn fitted(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: Vec<Cause>,
) -> Option<Vec<Cause>> {
    let mut causes = causes;
    let mut before = DMatrix::zeros(readings.len(), causes.len());
    for _ in 0..SETTLED {
        let (amplitudes, _) = context.amplitudes(readings, &causes)?;
        let changes = context.changes_at(&causes, &amplitudes);
        if (&changes - &before).norm() <= AT_REST * changes.norm() {
            break;
        }
        before.copy_from(&changes);
        let state = context
            .model
            .refit_as_smooth(context.without(readings, &causes, &changes));
        let again = (0..causes.len()).map(|k| {
            let first = first_amplitude(&causes, k);
            let own = &amplitudes.as_slice()[first..first + causes[k].columns.len()];
            let effect = causes[k].effect;
            let shape = context.catalogue[effect].settled(&causes[k].shape, own);
            let shape = shape.map_or_else(|| causes[k].shape.clone(), |s| held(&s));
            let state = context.seen_by(k, &state, &causes, &changes);
            context.cause(&state, effect, shape)
        });
        let again: Vec<Cause> = again.collect();
        let alike = (again.iter().zip(&causes)).all(|(a, b)| a.columns.len() == b.columns.len());
        if !alike {
            break;
        }
        causes = again;
    }
    Some(causes)
}

/// The change of the readings per unit of each unknown of the causes, readings × unknowns.
pub(super) fn derivatives(
    context: &Context<'_>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
    unknowns: &[Unknown],
) -> DMatrix<f64> {
    let readings = context.space.readings();
    let of = |unknown: &Unknown| match *unknown {
        Unknown::Amplitude(which, k) => causes[which].columns[k].dense(readings),
        Unknown::Shape(which, j) => {
            let cause = &causes[which];
            let used = amplitudes.rows(first_amplitude(causes, which), cause.columns.len());
            let mut slope = DVector::zeros(readings);
            if let Some((low, high, apart)) = beside(context, cause, j) {
                for (shape, sign) in [(low, -1.0), (high, 1.0)] {
                    let columns = context.catalogue[cause.effect].columns(context.model, &shape);
                    for (column, amplitude) in columns.iter().zip(used.iter()) {
                        slope += column.dense(readings) * (sign * amplitude / apart);
                    }
                }
            }
            slope
        }
    };
    let columns: Vec<DVector<f64>> = unknowns.iter().map(of).collect();
    if columns.is_empty() {
        return DMatrix::zeros(readings, 0);
    }
    DMatrix::from_columns(&columns)
}

/// What is reported of a cause whose unknowns have a covariance.
pub(super) fn reported(
    effect: &dyn Effect<AnyModel>,
    (which, shape): (usize, &Shape),
    amplitudes: &[f64],
    unknowns: &[Unknown],
    covariance: &DMatrix<f64>,
) -> Vec<Estimate> {
    let count = amplitudes.len();
    let place = |i: usize| {
        let unknown = match i.checked_sub(count) {
            None => Unknown::Amplitude(which, i),
            Some(j) => Unknown::Shape(which, j),
        };
        unknowns.iter().position(|u| *u == unknown)
    };
    let size = count + shape.values.len();
    let own = DMatrix::from_fn(size, size, |i, j| match (place(i), place(j)) {
        (Some(i), Some(j)) => covariance[(i, j)],
        _ => f64::NAN,
    });
    effect.estimates(shape, amplitudes, &own)
}
