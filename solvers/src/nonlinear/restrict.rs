//! Steps that respect box bounds.
//!
//! An active-set step: parameters pressed against a bound are held; the others take the
//! strategy's step in the space they span. Those that would cross a bound are put on it and the
//! step is sought again for the rest, so that the final step minimises the (damped) model on the
//! face it ends on. With growing damping the step turns into a projected gradient step, for which
//! descent is certain (Bertsekas, SIAM J. Control Optim. 20 (1982) 221).

use nalgebra::DVector;

use super::strategy::Strategy;
use crate::bounds::{Bounds, Side};
use crate::linear::LinearModel;
use crate::outcome::FitError;

/// A step and the parameters it leads to, on their bounds exactly where it ends on one.
pub(super) struct Proposal {
    pub step: DVector<f64>,
    pub parameters: DVector<f64>,
}

/// The parameters that are not pressed against a bound.
pub(super) fn free_parameters(
    bounds: Option<&Bounds>,
    parameters: &DVector<f64>,
    gradient: &DVector<f64>,
) -> Vec<usize> {
    (0..parameters.len())
        .filter(|&j| pressed(bounds, j, parameters[j], gradient[j]).is_none())
        .collect()
}

pub(super) fn pressed(
    bounds: Option<&Bounds>,
    index: usize,
    value: f64,
    gradient: f64,
) -> Option<Side> {
    bounds.and_then(|b| b.pressed(index, value, gradient))
}

/// The model in some of the parameters; the model itself is borrowed when all are free.
pub(super) fn restricted<M: LinearModel>(
    model: &M,
    free: &[usize],
    shift: &DVector<f64>,
) -> Result<M, FitError> {
    model
        .restricted(free, shift)
        .ok_or_else(|| FitError::Setting {
            setting: "bounds",
            value: "given".to_string(),
            must: "left out for this structure of Jacobian",
        })
}

/// The step that `choose` makes of the model, within the bounds.
pub(super) fn propose<M: LinearModel>(
    model: &M,
    scale: &DVector<f64>,
    parameters: &DVector<f64>,
    bounds: Option<&Bounds>,
    mut choose: impl Chooser,
) -> Result<Proposal, FitError> {
    let Some(bounds) = bounds else {
        let step = choose.choose(model, scale);
        let parameters = parameters + &step;
        return Ok(Proposal { step, parameters });
    };
    let n = parameters.len();
    let mut free = free_parameters(Some(bounds), parameters, model.gradient());
    let mut step = DVector::zeros(n);
    let mut on_bound: Vec<(usize, f64)> = Vec::new();
    while !free.is_empty() {
        let reduced = restricted(model, &free, &step)?;
        let reduced_scale = DVector::from_fn(free.len(), |k, _| scale[free[k]]);
        let moved = choose.choose(&reduced, &reduced_scale);
        let mut crossed = Vec::new();
        for (k, &j) in free.iter().enumerate() {
            if let Some(limit) = bounds.beyond(j, parameters[j] + moved[k]) {
                crossed.push((j, limit));
            }
        }
        if crossed.is_empty() {
            for (k, &j) in free.iter().enumerate() {
                step[j] = moved[k];
            }
            break;
        }
        for &(j, limit) in &crossed {
            step[j] = limit - parameters[j];
        }
        free.retain(|j| crossed.iter().all(|(c, _)| c != j));
        on_bound.extend(crossed);
    }
    let mut reached = parameters + &step;
    for (j, limit) in on_bound {
        reached[j] = limit;
    }
    Ok(Proposal {
        step,
        parameters: reached,
    })
}

/// What makes a step of a model; a strategy, or the undamped step of the polish.
pub(super) trait Chooser {
    fn choose<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64>;
}

impl<S: Strategy> Chooser for &mut S {
    fn choose<M: LinearModel>(&mut self, model: &M, scale: &DVector<f64>) -> DVector<f64> {
        self.step(model, scale)
    }
}

/// Chooses the undamped step.
pub(super) struct Undamped;

impl Chooser for Undamped {
    fn choose<M: LinearModel>(&mut self, model: &M, _scale: &DVector<f64>) -> DVector<f64> {
        model.undamped_step()
    }
}
