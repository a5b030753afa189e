//! The gap as an effect of its own: smooth, orthogonal to the model, with its band.

use errsep_models::model::{AnyModel, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use crate::attribution::context::Context;
use crate::catalogue::curve::Curve;
use crate::catalogue::tabulated::Tabulated;
use crate::detection::calm::calmed;
use crate::detection::estimate::estimate;
use crate::detection::space::Space;
use crate::learning::ground::Ground;
use crate::learning::smooth::Smooth;
use crate::learning::weighed::{HeldOutAlong, Weighed, seen_with_prior, weighed};
use crate::levels::ADEQUATE;
use crate::noise::law::NoiseLaw;
use crate::options::Options;

/// Rounds of learning: noise and state are found again without what was learnt.
const ROUNDS: usize = 2;

/// A gap as an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// The effect, without its name and where it was seen.
    pub effect: Tabulated,
    /// What it is bound to, in words.
    pub along: String,
    /// The ways to bind it on held-out repeats, the chosen one first.
    pub ways: Vec<HeldOutAlong>,
    /// Part by which the mean square of the held-out residual falls, its noise included.
    pub fall: f64,
    /// Standard deviations by which held-out repeats confirm it.
    pub confirmed: f64,
    /// Probability of what remains beside it.
    pub adequacy: f64,
    /// Root mean square of its change of the readings.
    pub rms: f64,
}

/// Why a gap cannot be learnt.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NotLearnt {
    /// Nothing to hold out.
    #[error("there are no repeats to hold out, so nothing tells what the gap is bound to")]
    NoRepeats,
    /// Repeats that were held out do not confirm any curve.
    #[error("no smooth function of {along} predicts repeats that were held out")]
    NotConfirmed {
        /// What was tried.
        along: String,
        /// Part by which the mean square of the held-out residual falls with the best of them.
        fall: f64,
    },
    /// Something is left that the best curve does not resolve.
    #[error(
        "the best smooth curve, along {along}, leaves something that stands out, most by its {place}"
    )]
    Unresolved {
        /// What the best curve is bound to.
        along: String,
        /// Where most of what remains shows.
        place: String,
        /// Probability of what remains.
        p_value: f64,
        /// Part by which the mean square of the held-out residual falls.
        fall: f64,
    },
}

impl NotLearnt {
    /// Part by which the mean square of the held-out residual falls, as far as any curve was fitted.
    #[must_use]
    pub fn fall(&self) -> f64 {
        match self {
            Self::NoRepeats => 0.0,
            Self::NotConfirmed { fall, .. } | Self::Unresolved { fall, .. } => *fall,
        }
    }
}

/// `learn` of a model of any kind.
pub(crate) fn learn(model: &AnyModel, options: &Options) -> Result<Learnt, NotLearnt> {
    let (calmed, calm) = calmed(model);
    let model = calmed.as_ref().unwrap_or(model);
    let grounds = Ground::all(model);
    let mut readings = model.linearised();
    let mut law = estimate(model, &readings);
    let mut found = bound(model, &law, &readings, &grounds)?;
    let mut state = model.clone();
    for _ in 1..ROUNDS {
        let change = found.change();
        state = model.refit(model.observed() - &change);
        let clean = state.linearised();
        law = estimate(&state, &clean);
        readings = clean + change;
        found = bound(&state, &law, &readings, &grounds)?;
    }
    let law = law.with_tails(calm.tails);
    let fall = found.weighed.fall;
    let along = found.ground.name();
    if !found.weighed.is_confirmed() {
        return Err(NotLearnt::NotConfirmed {
            along: "position, direction, time or reading".to_owned(),
            fall,
        });
    }
    let effect = found.effect(model);
    let (adequacy, place) = left_beside(&state, &effect, law, &readings, options);
    if let Some(place) = place {
        return Err(NotLearnt::Unresolved {
            along,
            place,
            p_value: adequacy,
            fall,
        });
    }
    let change = found.change();
    Ok(Learnt {
        effect,
        along,
        fall,
        confirmed: found.weighed.confirmed,
        ways: found.weighed.ways,
        adequacy,
        rms: (change.norm_squared() / change.len().max(1) as f64).sqrt(),
    })
}

/// The way that is chosen, with its curves.
struct Bound<'g> {
    ground: &'g Ground,
    weighed: Weighed,
    /// Coefficients without what the model absorbs.
    coefficients: DVector<f64>,
    /// Independent changes of them of one standard deviation each: those of the band, and those that show.
    spread: [DMatrix<f64>; 2],
}

fn bound<'g>(
    model: &AnyModel,
    law: &NoiseLaw,
    readings: &DVector<f64>,
    grounds: &'g [Ground],
) -> Result<Bound<'g>, NotLearnt> {
    let space = Space::expecting(model, law);
    let weighed = weighed(model, law, &space, grounds, readings).ok_or(NotLearnt::NoRepeats)?;
    let ground = &grounds[weighed.chosen];
    let residual = space.forward_vector(readings);
    let made = || {
        let (seen, prior) = seen_with_prior(&space, ground)?;
        let fit = Smooth::with(&seen, &residual, &prior, weighed.size)?;
        Some((fit.coefficients(), [fit.spread(false), fit.spread(true)]))
    };
    let (coefficients, spread) = made().ok_or(NotLearnt::NotConfirmed {
        along: ground.name(),
        fall: 0.0,
    })?;
    Ok(Bound {
        ground,
        weighed,
        coefficients,
        spread,
    })
}

impl Bound<'_> {
    /// What the curves change in every reading.
    fn change(&self) -> DVector<f64> {
        self.ground.columns() * &self.coefficients
    }

    fn effect(&self, model: &AnyModel) -> Tabulated {
        let channels = model.channel_names();
        let points = self.ground.points();
        let at = |which: usize, spread: &DMatrix<f64>| -> Vec<Vec<f64>> {
            let of = |column: usize| {
                let own = spread.column(column).clone_owned();
                self.ground.curve(which, &own)
            };
            (0..spread.ncols()).map(of).collect()
        };
        let curve = |(which, (channel, way)): (usize, &(Option<usize>, _))| {
            let values = self.ground.curve(which, &self.coefficients);
            let band = at(which, &self.spread[0]);
            let std = |k: usize| band.iter().map(|b| b[k] * b[k]).sum::<f64>().sqrt();
            Curve {
                channel: channel.and_then(|c| channels.get(c).cloned()),
                direction: *way,
                points: (0..points.len())
                    .map(|k| [points[k], values[k], std(k)])
                    .collect(),
                open: at(which, &self.spread[1]),
            }
        };
        Tabulated {
            name: "learnt".to_owned(),
            along: Some(self.ground.along),
            curve: self.ground.curves.iter().enumerate().map(curve).collect(),
            ..Tabulated::default()
        }
    }
}

/// Probability of what remains beside an effect, and where most of it shows if that stands out.
fn left_beside(
    model: &AnyModel,
    effect: &Tabulated,
    law: NoiseLaw,
    readings: &DVector<f64>,
    options: &Options,
) -> (f64, Option<String>) {
    let catalogue: Vec<Box<dyn Effect<AnyModel>>> = vec![Box::new(effect.clone())];
    let context = Context::new(model, &catalogue, law, options.draws, options.seed);
    let causes = [context.cause(model, 0, Shape::only())];
    let left = context.judged(readings, &causes);
    // Cycles near the spacing of the readings show in no signature that is looked for, but in the misfit as a
    // whole.
    let p_value = context.detection(&left);
    if context.adequate(&causes, &left) && p_value > ADEQUATE[0] {
        return (p_value, None);
    }
    let families = &context.dictionary.families;
    let of = |k: usize| context.null.family(k, context.best(&left, k).0);
    let most = (0..families.len())
        .filter(|k| !families[*k].is_effect)
        .min_by(|a, b| of(*a).total_cmp(&of(*b)));
    let place = most.map_or("size", |k| families[k].name.as_str());
    (p_value, Some(place.to_owned()))
}
