//! What a solution tells of the effects in it.

use super::descent;
use super::effects::{HEIGHTS, Kind};
use super::error::ReversalError;
use super::problem::Reversal;
use super::solution::Simultaneous;
use crate::reversal::staged::Value;

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty; `None` for a shape at its bound.
    pub std: Option<f64>,
    /// Degrees of freedom of that.
    pub degrees_of_freedom: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Its weights on the border's unknowns, to first order; `None` where its uncertainty is not theirs.
    pub(super) weights: Option<Vec<f64>>,
}

/// An effect in the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedEffect {
    /// Its name.
    pub effect: &'static str,
    /// Which of its variants fits best, in words, where it has several.
    pub variant: Option<String>,
    /// Its parameters.
    pub parameters: Vec<EffectParameter>,
}

/// A size is implausible where it lies so many standard uncertainties outside its range.
const OUTSIDE: f64 = 2.0;

/// The effects of a solved problem.
///
/// # Errors
/// [`ReversalError::EffectNotDetermined`] where the readings leave a size open over more than its plausible
/// range, [`ReversalError::EffectImplausible`] where it lies outside.
pub fn effects(
    solution: &Simultaneous,
    problem: &Reversal,
) -> Result<Vec<FittedEffect>, ReversalError> {
    let Some(joined) = &problem.joined else {
        return Ok(Vec::new());
    };
    let unknowns = &problem.unknowns;
    let border = &solution.parameters.border;
    let steps = descent::steps(problem, &solution.parameters)?;
    let is_held = |k: usize| problem.is_held(unknowns.effect(k));
    let mut effects = Vec::new();
    for member in joined.members().iter().filter(|m| m.name != HEIGHTS) {
        for (k, unknown) in member.unknowns.iter().enumerate() {
            if unknown.kind == Kind::Amplitude && !is_held(member.from + k) {
                let mut weights = vec![0.0; border.len()];
                weights[unknowns.effect(member.from + k)] = 1.0;
                let (own, _) = solution.border_combination(&weights);
                is_plausible(member.name, unknown, own)?;
            }
        }
        let range =
            unknowns.effect(member.from)..unknowns.effect(member.from + member.unknowns.len());
        let parameters = member.effect.told(&border[range]).into_iter().map(|told| {
            let mut weights = vec![0.0; border.len()];
            for (k, slope) in &told.gradient {
                weights[unknowns.effect(member.from + k)] = *slope;
            }
            let (spread, degrees_of_freedom) = solution.border_combination(&weights);
            let step = steps
                .iter()
                .find(|s| told.gradient.iter().any(|g| member.from + g.0 == s.0));
            let held = told.gradient.iter().any(|g| is_held(member.from + g.0));
            let std = match step {
                Some((_, _, resolution)) => Some(*resolution),
                None => (!held).then_some(spread.std),
            };
            EffectParameter {
                name: told.name,
                value: told.value,
                std,
                degrees_of_freedom,
                unit: told.unit,
                weights: (step.is_none() && !held).then_some(weights),
            }
        });
        effects.push(FittedEffect {
            effect: member.name,
            variant: member.effect.variant(),
            parameters: parameters.collect(),
        });
    }
    Ok(effects)
}

/// Refuses a size that the readings leave open, or that no machine has.
fn is_plausible(
    effect: &'static str,
    unknown: &super::effects::Unknown,
    own: Value,
) -> Result<(), ReversalError> {
    let parameter = unknown.name.clone().into_owned();
    if !(own.std <= unknown.high - unknown.low) {
        return Err(ReversalError::EffectNotDetermined {
            effect,
            parameter,
            std: own.std,
            unit: unknown.unit,
        });
    }
    let slack = OUTSIDE * own.std;
    if !(own.value >= unknown.low - slack && own.value <= unknown.high + slack) {
        return Err(ReversalError::EffectImplausible {
            effect,
            parameter,
            value: own.value,
            unit: unknown.unit,
            low: unknown.low,
            high: unknown.high,
        });
    }
    Ok(())
}

/// What the effects change in each reading, µm, in the order of the observations: the model with them less
/// the same without, nothing else changed. Heights of repeats are none of them.
///
/// # Errors
/// [`ReversalError::NoStart`] where the model is not defined.
pub fn changes(solution: &Simultaneous, problem: &Reversal) -> Result<Vec<f64>, ReversalError> {
    let mut without = problem.joining_none();
    without.weights.clone_from(&problem.weights);
    let mut at = solution.parameters.clone();
    at.border.truncate(problem.unknowns.effect(0));
    let with = problem.residuals(&solution.parameters)?;
    let without = without.residuals(&at)?;
    let heights = heights(solution, problem);
    let count = problem.channels.iter().map(|c| c.len()).sum();
    let mut changes = vec![0.0; count];
    for ((channel, with), without) in problem.channels.iter().zip(&with).zip(&without) {
        for ((i, with), without) in channel.source.iter().zip(with).zip(without) {
            let height = heights.as_ref().map_or(0.0, |all| all[*i as usize]);
            changes[*i as usize] = without - with - height;
        }
    }
    Ok(changes)
}

/// The height of each reading's repeat, µm, in the order of the observations, where heights are unknowns of the fit.
fn heights(solution: &Simultaneous, problem: &Reversal) -> Option<Vec<f64>> {
    let joined = problem.joined.as_ref()?;
    let member = joined.members().iter().find(|m| m.name == HEIGHTS)?;
    let values = problem.unknowns.effect_values(&solution.parameters.border);
    let own = &values[member.from..member.from + member.unknowns.len()];
    let mut by = vec![0.0; own.len()];
    let readings = 0..joined.observations.readings.len() as u32;
    let height = |i| {
        (member
            .effect
            .shown(&joined.circumstances(i), 0.0, own, &mut by))
        .0
    };
    Some(readings.map(height).collect())
}

/// The greatest of the heights of repeats that are unknowns of the fit, µm.
pub fn greatest_height(solution: &Simultaneous, problem: &Reversal) -> Option<f64> {
    let heights = heights(solution, problem)?;
    Some(
        heights
            .into_iter()
            .fold(0.0, |most: f64, h| most.max(h.abs())),
    )
}
