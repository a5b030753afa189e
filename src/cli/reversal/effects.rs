//! Effects in the fit: how they are told, and the readings without them.

use std::path::Path;

use errsep_models::reversal::effects::amplitude;
use errsep_models::reversal::simultaneous::effects::CATALOGUE;
use errsep_models::reversal::simultaneous::{EffectParameter, FittedEffect, ReversalError};
use serde_json::{Value, json};

use super::outcome::Outcome;
use crate::diagnosis::scaled;
use crate::io::message::{list, nearest};
use crate::io::reversal::{ReversalData, ReversalSetup, corrected};
use crate::io::{Message, OutFile};
use crate::report::number;

/// The effects as `result.json` has them.
pub fn json(effects: &[FittedEffect]) -> Vec<Value> {
    let parameter = |p: &EffectParameter| json!({"name": p.name, "value": p.value, "std": p.std, "unit": p.unit});
    effects
        .iter()
        .map(|e| {
            json!({
                "effect": e.effect,
                "variant": e.variant,
                "parameters": e.parameters.iter().map(parameter).collect::<Vec<_>>(),
            })
        })
        .collect()
}

/// Name and variant.
pub fn title(effect: &FittedEffect) -> String {
    match &effect.variant {
        Some(variant) => format!("{} ({variant})", effect.effect),
        None => effect.effect.to_owned(),
    }
}

/// Value and standard uncertainty with the unit, for people.
pub fn in_words(parameter: &EffectParameter) -> String {
    let (factor, unit) = scaled(parameter.unit);
    let value = factor * parameter.value;
    let words = match parameter.std {
        Some(std) => number::measured(value, Some(factor * std)),
        None => format!("{} (at its bound)", number::plain(value, 4)),
    };
    if unit.is_empty() {
        words
    } else {
        format!("{words} {unit}")
    }
}

/// Writes the readings less what the effects change in them.
pub fn write_corrected(
    path: &Path,
    setup: &ReversalSetup,
    data: &ReversalData,
    o: &Outcome,
    file: OutFile,
) -> Result<(), Message> {
    let names: Vec<String> = o.effects.iter().map(title).collect();
    let change = if names.len() == 1 {
        "changes"
    } else {
        "change"
    };
    let comment = format!(
        "readings of {} less what {} {change} in them by the fit of these same readings: no independent evidence",
        path.display().to_string().replace(['\n', '\r'], " "),
        names.join(" and ")
    );
    let content = corrected(
        path,
        &setup.columns,
        data.dialect,
        &o.effect_changes,
        &comment,
    )?;
    file.write(&content)
}

/// Why effects cannot join, and what to do; `None` for what has nothing to do with them.
pub fn refusal(why: &ReversalError) -> Option<Message> {
    let not_determined =
        |remedy: String| Some(Message::not_determined(why.to_string()).remedy(remedy));
    match why {
        ReversalError::UnknownEffect { effect } if amplitude(effect).is_some() => {
            Some(of_diagnosis_alone(effect))
        }
        ReversalError::UnknownEffect { effect } => {
            let names: Vec<&str> = CATALOGUE.iter().map(|e| e.name).collect();
            let remedy = match nearest(effect, names.iter().copied()) {
                Some(near) => format!("did you mean `{near}`? Known are {}", list(&names)),
                None => format!("known are {}", list(&names)),
            };
            Some(Message::bad_input(why.to_string()).remedy(remedy))
        }
        ReversalError::EffectTwice { effect } => {
            Some(Message::bad_input(why.to_string()).remedy(format!("name {effect} once")))
        }
        ReversalError::EffectStart { .. } => not_determined(
            "leave it out of --with: these readings have no channel that it could change".to_owned(),
        ),
        ReversalError::EffectRefused { remedy, .. } => not_determined((*remedy).to_owned()),
        ReversalError::EffectNotDetermined { effect, .. } => not_determined(format!(
            "leave {effect} out of --with, or take readings that show it: all four channels, repeats, both directions"
        )),
        ReversalError::EffectImplausible { effect, .. } => not_determined(format!(
            "leave {effect} out of --with, and ask errsep diagnose what else the readings show"
        )),
        ReversalError::EffectsNotConverged { .. } => Some(
            Message::not_converged(why.to_string()).remedy(
                "leave an effect out of --with, or take readings that tell it apart: all four channels, repeats, both directions",
            ),
        ),
        _ => None,
    }
}

/// Why an effect that the diagnosis knows is no unknown of the fit, and what to do.
fn of_diagnosis_alone(effect: &str) -> Message {
    let (why, remedy) = match effect {
        "indexing-error" => (
            "two positions half a turn apart show it as a tilt of slide and artefact, so alpha and beta take it up whatever its size",
            "check the angles of the spindle with a level or an encoder, and align the artefact sideways too",
        ),
        "stick-slip" | "sticking-plunger" => (
            "where it sticks and lets go is followed from reading to reading, which is no size or shape that a fit could have as an unknown",
            "leave it out of --with: errsep diagnose tells whether these readings show it",
        ),
        _ => (
            "it has no unknowns that tilts and forms could be fitted along with",
            "leave it out of --with: errsep diagnose tells whether these readings show it",
        ),
    };
    Message::not_determined(format!(
        "{effect}, an effect that errsep diagnose knows, cannot join this fit: {why}"
    ))
    .remedy(remedy)
}
