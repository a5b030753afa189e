//! Effects that are given, fitted along with the model: nothing is sought, and all is one fit.
//!
//! State, amplitudes and shapes are those of the least-squares fit with the effects in it, with one
//! covariance: what an effect takes up is missing from what is known of the answer, and the other way
//! round (`attribution/sizes.rs`, `attribution/bias.rs`). The noise is what the repeats leave without
//! the effects.

mod fitting;

pub(crate) use fitting::in_the_fit;

use errsep_models::model::{AnyModel, Effect, FittedModel};
use nalgebra::DVector;
use serde::Serialize;
use thiserror::Error;

use crate::attribution::allowed::{Allowed, allowed_fits, answers_widened, widened};
use crate::attribution::bias::biases;
use crate::attribution::candidates::elsewhere;
use crate::attribution::context::{Cause, Context, raw_signatures, span};
use crate::attribution::reported::{Bias, Elsewhere, ParameterOut};
use crate::attribution::shrink::{GapMeter, HeldOut, Size, shrink};
use crate::attribution::sizes::{Sizes, first_amplitude};
use crate::levels::{SEPARABLE, WEAK};
use crate::noise::dependence::Dependence;
use crate::options::Options;
use crate::verdict::told::{no_noise, of_what};
use crate::verdict::types::NoiseOut;

/// Why effects cannot join the fit.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NotJoined {
    /// No such effect.
    #[error("there is no effect `{name}`")]
    NoSuch {
        /// As it was given.
        name: String,
        /// The catalogue.
        known: Vec<String>,
    },
    /// Named more than once.
    #[error("`{0}` is given twice")]
    Twice(String),
    /// The model has the like already.
    #[error("the fit absorbs `{0}` whatever its size: these readings do not determine it")]
    Absorbed(String),
    /// Nothing in these readings could show it.
    #[error("nothing in these readings could show `{0}`")]
    Nowhere(String),
    /// Only together are the effects known.
    #[error("these readings do not tell `{0}` from the other effects that are given")]
    Mixed(String),
    /// The parameters of one effect are known only together.
    #[error("these readings do not determine `{0}`: its parameters are known only together")]
    Undetermined(String),
}

/// An effect as it stands in the fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JoinedEffect {
    /// Its name.
    pub effect: String,
    /// Variant in words, where it has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Probability of as much with nothing of it there, corrected for every shape tried.
    pub p_value: f64,
    /// Part of the effect that the fit cannot absorb.
    pub visible: f64,
    /// Whether sizes and shape are physically possible.
    pub plausible: bool,
    /// Its parameters; `std` is `null` where readings do not bound one.
    pub parameters: Vec<ParameterOut>,
    /// Its other variants that fit as well.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub elsewhere: Vec<Elsewhere>,
}

/// The gap of the fit without and with the effects, in the unit of the readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JoinedGap {
    /// Unit of the readings.
    pub unit: &'static str,
    /// Standard deviation of one reading, or of the mean of those that each is gathered from.
    pub noise: f64,
    /// How many those are.
    pub readings_in_each: f64,
    /// Without them.
    pub before: Size,
    /// With them.
    pub after: Size,
    /// 1 − after / before.
    pub shrink: f64,
    /// On repeats that were not used, where there are enough.
    pub held_out: Option<HeldOut>,
    /// Probability that as much would stand out of what remains with nothing else there.
    pub remains_p: f64,
}

impl JoinedGap {
    /// Of what `noise` is: one reading, or a mean of several.
    #[must_use]
    pub fn of_what(&self) -> String {
        of_what(self.readings_in_each)
    }
}

/// A profile of the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JoinedProfile {
    /// Its name.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Positions.
    pub x: Vec<f64>,
    /// Without the effects.
    pub before: Vec<f64>,
    /// With them.
    pub after: Vec<f64>,
}

/// A fit with effects in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Joined {
    /// `errsep.fit-with/1`.
    pub schema: &'static str,
    /// The model.
    pub model: &'static str,
    /// The effects, in the order in which they were given.
    pub effects: Vec<JoinedEffect>,
    /// What the fit misses.
    pub gap: JoinedGap,
    /// The noise; its degrees of freedom are those of every standard uncertainty here.
    pub noise: NoiseOut,
    /// The numbers of the answer, without and with the effects; a profile by its root mean square.
    pub quantities: Vec<Bias>,
    /// The profiles of the answer.
    pub profiles: Vec<JoinedProfile>,
    /// What should be known beside.
    pub notes: Vec<String>,
    /// What the fit leaves of every reading without the effects.
    #[serde(skip)]
    pub before: Vec<f64>,
    /// With them.
    #[serde(skip)]
    pub after: Vec<f64>,
    /// What the effects change in every reading.
    #[serde(skip)]
    pub change: Vec<f64>,
}

/// `joined` of a model of any kind.
pub(super) fn joined(
    model: &AnyModel,
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
    names: &[String],
    options: &Options,
) -> Result<Joined, NotJoined> {
    in_the_fit(
        model,
        catalogue,
        names,
        options,
        |context, readings, causes, notes| told(context, readings, causes, notes, options),
    )?
}

fn told(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    mut notes: Vec<String>,
    options: &Options,
) -> Result<Joined, NotJoined> {
    let name = |k: usize| context.catalogue[causes[k].effect].name().to_owned();
    for k in 0..causes.len() {
        let mut others = causes.to_vec();
        let own = others.remove(k);
        let basis = span(&others, context.space.readings());
        let left = &own.projected - &basis * basis.tr_mul(&own.projected);
        if left.norm_squared() < SEPARABLE * own.projected.norm_squared() {
            return Err(NotJoined::Mixed(name(k)));
        }
    }
    let sizes =
        Sizes::told(context, readings, causes).ok_or_else(|| NotJoined::Undetermined(name(0)))?;
    let allowed = allowed_fits(context, readings, causes, &sizes);
    let change = context.change(causes, &sizes.amplitudes);
    let mut effects = Vec::with_capacity(causes.len());
    for (k, cause) in causes.iter().enumerate() {
        effects.push(effect(context, readings, causes, (&sizes, &allowed), k)?);
        let weak = effects.last().is_some_and(|e| e.p_value > WEAK);
        if weak && cause.shape.free() > 0 {
            notes.push(format!(
                "`{}` does not stand out of the noise: of a size that may be zero its other parameters say nothing.",
                name(k)
            ));
        }
    }
    for effect in effects.iter().filter(|e| !e.elsewhere.is_empty()) {
        let others: Vec<&str> = effect
            .elsewhere
            .iter()
            .map(|e| e.variant.as_str())
            .collect();
        notes.push(format!(
            "`{}` fits as well in {}: sizes and answer are those of {}.",
            effect.effect,
            others.join(" or in "),
            effect.variant.as_deref().unwrap_or("one place"),
        ));
    }
    for effect in effects.iter().filter(|e| !e.plausible) {
        notes.push(format!(
            "`{}` would have a size or a shape that is not plausible: something else is likely to be behind it.",
            effect.effect
        ));
    }
    let remainder = context.remainder(readings, causes);
    let remains_p = context.global(&remainder);
    let unknowns: usize = causes.iter().map(Cause::unknowns).sum();
    let meter = GapMeter::new(context.model, &context.law, options.seed);
    let clean = readings - &change;
    let (before, after) = (meter.size(readings, 0), meter.size(&clean, unknowns));
    let dependence = Dependence::of(context.model, &context.law, &clean, || {
        context.repeats_show_whole()
    });
    notes.extend(no_noise(context.model, &dependence));
    let (quantities, moved) = biases(context, readings, causes);
    let quantities = answers_widened(context, readings, quantities, &moved, &allowed);
    let profiles = context.model.profiles().into_iter().zip(moved);
    Ok(Joined {
        schema: "errsep.fit-with/1",
        model: context.model.name(),
        effects,
        gap: JoinedGap {
            unit: context.model.reading_unit(),
            noise: context.law.sigma(),
            readings_in_each: context.model.readings_in_each(),
            before,
            after,
            shrink: shrink(before.rms, after.rms),
            held_out: meter.held_out(context.model, readings, &raw_signatures(context, causes)),
            remains_p,
        },
        noise: NoiseOut::of(context.model, &context.law, &dependence),
        quantities,
        profiles: profiles
            .map(|(profile, (name, before, after))| JoinedProfile {
                name,
                unit: profile.unit,
                x: profile.positions,
                before,
                after,
            })
            .collect(),
        notes,
        before: meter.residuals(readings),
        after: meter.residuals(&clean),
        change: change.as_slice().to_vec(),
    })
}

/// One of the effects as it stands in the fit.
fn effect(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    (sizes, allowed): (&Sizes, &[Allowed]),
    which: usize,
) -> Result<JoinedEffect, NotJoined> {
    let cause = &causes[which];
    let description = &context.catalogue[cause.effect];
    let mut others = causes.to_vec();
    others.remove(which);
    let first = first_amplitude(causes, which);
    let count = cause.columns.len();
    let amplitudes = &sizes.amplitudes.as_slice()[first..first + count];
    let estimates = sizes.of(context, causes, which);
    let stds: Vec<f64> = estimates.iter().take(count).map(|e| e.std).collect();
    if !amplitudes.iter().chain(&stds).all(|v| v.is_finite()) {
        return Err(NotJoined::Undetermined(description.name().to_owned()));
    }
    let beside = context.remainder(readings, &others);
    let family = context.family_of(cause.effect);
    Ok(JoinedEffect {
        effect: description.name().to_owned(),
        variant: description.variant_name(context.model, &cause.shape),
        p_value: context.p_value(&beside, cause.effect),
        visible: family.map_or(0.0, |f| context.dictionary.families[f].visible),
        plausible: context.plausible(cause.effect, &cause.shape, amplitudes, &stds),
        parameters: widened(context, readings, causes, which, estimates, allowed)
            .into_iter()
            .map(Into::into)
            .collect(),
        elsewhere: elsewhere(context, readings, causes, which),
    })
}
