//! Whether a point is the last: the undamped step from it, and what that step says of the end.

use nalgebra::DVector;

use super::minimiser::{Minimiser, Point, felt_length};
use super::restrict::{self, Proposal, Undamped, free_parameters};
use super::strategy::Strategy;
use crate::linear::LinearModel;
use crate::options::Finish;
use crate::outcome::{Convergence, FitError};

/// A step that moves a parameter by more than this share of all that it has ever been ends nothing,
/// however little the residuals change: roots up to the tenth order are approached by less.
const FAR: f64 = 1e-2;

/// Iterations in a row that go on so before a parameter is said to run away.
const MOST_FADING: usize = 30;

/// A step that changes the linear prediction of the residuals by no more than this share of it is a
/// few roundings.
const FEW_ROUNDINGS: f64 = 4.0 * f64::EPSILON;

/// The undamped step from a point.
#[derive(Default)]
pub(super) struct Full {
    /// The fall that it promises.
    pub promised: f64,
    /// ‖D s‖.
    pub length: f64,
    /// ‖N s‖.
    pub felt: f64,
    /// A parameter that it moves far.
    pub far: Option<usize>,
    /// Whether its effect is nothing beside what was felt of the parameters somewhere on the way.
    fades: bool,
    /// Where it leads; `None` where the point is at rest without it.
    pub reached: Option<DVector<f64>>,
}

impl<S: Strategy, M: LinearModel> Minimiser<S, M> {
    pub(super) fn undamped(&self, point: &Point<M>) -> Result<Proposal, FitError> {
        restrict::propose(
            &point.model,
            &self.scale,
            &point.parameters,
            self.options.bounds.as_ref(),
            Undamped,
        )
    }

    /// The rounding of the cost: that of the residuals times the residuals. A residual is a
    /// difference whose terms are about as large as J p.
    pub(super) fn cost_rounding(point: &Point<M>) -> f64 {
        let size: f64 = point
            .model
            .column_norms()
            .iter()
            .zip(point.parameters.iter())
            .map(|(norm, p)| norm * p.abs())
            .sum();
        let residual = (2.0 * point.evaluation.cost).sqrt();
        f64::EPSILON * residual * (residual + size)
    }

    /// The largest cosine between the residuals and a column of a free parameter.
    fn largest_cosine(&self, point: &Point<M>) -> f64 {
        let residual = (2.0 * point.evaluation.cost).sqrt();
        let gradient = point.model.gradient();
        let norms = point.model.column_norms();
        free_parameters(self.options.bounds.as_ref(), &point.parameters, gradient)
            .into_iter()
            .filter(|&j| norms[j] > 0.0)
            .map(|j| gradient[j].abs() / (norms[j] * residual))
            .fold(0.0, f64::max)
    }

    /// Whether the point is a minimum, to rounding or on the promise of the undamped step, and that step.
    pub(super) fn at_rest(
        &self,
        point: &Point<M>,
    ) -> Result<(Option<Convergence>, Full), FitError> {
        let rest = |by| Ok((Some(by), Full::default()));
        if point.evaluation.cost == 0.0 {
            return rest(Convergence::Cost);
        }
        if self.largest_cosine(point) <= self.options.gradient_tolerance {
            return rest(Convergence::Gradient);
        }
        let proposal = self.undamped(point)?;
        let step = &proposal.step;
        let promised = point.model.predicted_reduction(step);
        let felt = felt_length(point, step);
        let full = Full {
            promised,
            length: self.scaled_length(step),
            felt,
            far: self.goes_far(step),
            fades: felt <= f64::EPSILON * self.longest,
            reached: None,
        };
        let rest = match self.options.finish {
            Finish::Promised => self.rests_on_promise(point, step, promised),
            Finish::Polish | Finish::Evaluated => self.rests_by_rounding(point, &full),
        };
        let reached = Some(proposal.parameters);
        Ok((rest, Full { reached, ..full }))
    }

    /// The test by which neither cost nor parameters can show that a point is no minimum.
    fn rests_by_rounding(&self, point: &Point<M>, full: &Full) -> Option<Convergence> {
        if full.promised.abs() <= Self::cost_rounding(point) {
            return Some(Convergence::Cost);
        }
        // Beside what the parameters have been, felt as they are felt here: after a start with residuals of
        // 1e16 times those of the minimum every step is nothing beside what was felt there.
        let nothing = full.felt <= f64::EPSILON * felt_length(point, &self.farthest);
        (full.far.is_none() && nothing).then_some(Convergence::Step)
    }

    /// The test by which the undamped step is the last: it promises next to nothing of the cost, or
    /// changes the residuals' linear prediction by a few roundings of it.
    fn rests_on_promise(
        &self,
        point: &Point<M>,
        step: &DVector<f64>,
        promised: f64,
    ) -> Option<Convergence> {
        if promised <= self.options.cost_tolerance * point.evaluation.cost {
            return Some(Convergence::Cost);
        }
        let size = point.model.image_norm(&point.parameters);
        let nothing = point.model.image_norm(step) <= FEW_ROUNDINGS * size;
        nothing.then_some(Convergence::Step)
    }

    /// A parameter that a step moves by a good part of all that it has ever been, if there is one.
    fn goes_far(&self, step: &DVector<f64>) -> Option<usize> {
        (0..step.len()).find(|&j| step[j].abs() > FAR * self.farthest[j])
    }

    /// The parameter that runs away, if one does: residuals may vanish along a way that does not end.
    pub(super) fn runs_away(&mut self, full: &Full) -> Option<usize> {
        let far = full.far.filter(|_| full.fades);
        self.fading = far.map_or(0, |_| self.fading + 1);
        far.filter(|_| self.fading > MOST_FADING)
    }
}
