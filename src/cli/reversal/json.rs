//! The answer for programs: schema `errsep.reversal/1`, documented in docs/json/reversal.md.

use errsep_models::reversal::simultaneous::Reached;
use errsep_models::reversal::staged::Value as Measured;
use errsep_models::reversal::{Convention, NOT_SHOWN};
use errsep_models::uncertainty::Quantity;
use serde_json::{Map, Value, json};

use super::effects;
use super::outcome::Outcome;
use crate::cli::quantity::{quantity_json, unexpandable};
use crate::io::Message;
use crate::io::reversal::ReversalData;

pub fn json(data: &ReversalData, o: &Outcome) -> Result<Value, Message> {
    let mut answer = json!({
        "schema": "errsep.reversal/1",
        "method": o.method,
        "convention": match o.convention {
            Convention::Seed => "seed",
            Convention::Rigid => "rigid",
        },
        "channels": data.observations.channels().iter().map(|c| c.name()).collect::<Vec<_>>(),
        "readings": data.observations.readings.len(),
        "input": data.in_words(),
        "tilts": tilts(o)?,
        "tilt_combinations": combinations(o)?,
        "not_determined": o.open().iter().map(|open| json!({
            "combination": open.combination, "remedy": open.remedy,
        })).collect::<Vec<_>>(),
        "contrasts": contrasts(o)?,
        "effects": effects::json(&o.effects),
        "thickness": thickness(o)?,
        "covariance": o.covariances.as_ref().map(|c| {
            json!({"names": c.names, "units": c.units, "matrix": c.matrix})
        }),
        "closure": null,
        "forms": null,
        "form_combinations": null,
        "straightness": straightness(o),
        "residual": {
            "rms": o.residual_rms,
            "noise": o.noise,
            "noise_source": o.noise_words,
            "noise_law": o.noise_law.map(|(law, correlation)| json!({
                "white": law.white.sqrt(),
                "correlated": law.correlated.sqrt(),
                "length": law.length,
                "shift": law.shift.sqrt(),
                "drift": 1e-3 * law.drift.sqrt(),
                "between_indicators": correlation,
            })),
            "degrees_of_freedom": o.degrees_of_freedom,
            "channels": o.channel_noise.iter().map(|(c, s)| (c.name().to_owned(), json!(s))).collect::<Map<_, _>>(),
        },
        "agreement": {
            "disagree": o.disagree,
            "missed": {"value": o.missed, "unit": "um"},
        },
        "convergence": {
            "converged": true,
            "reason": o.convergence.reason,
            "iterations": o.convergence.iterations,
            "seconds": o.convergence.seconds,
        },
        "method_errors": o.method_errors.iter().map(|(name, rms, meaning)| json!({
            "name": name, "rms": rms, "unit": "um", "meaning": meaning,
        })).collect::<Vec<_>>(),
        "warnings": o.warnings,
        "not_shown": NOT_SHOWN.iter().map(|(name, _)| *name).collect::<Vec<_>>(),
    });
    // The long lists are put in place afterwards: the macro copies what it is given.
    answer["closure"] = closure(o)?;
    answer["forms"] = forms(o);
    answer["form_combinations"] = form_combinations(o);
    Ok(answer)
}

/// What a fit that found no minimum had come to, in the terms of an answer: values without uncertainty.
pub fn reached(reached: &Reached, ending: &str) -> Value {
    let tilts = reached.tilts.iter().map(|(name, rad)| {
        let key = name.replace('-', "_");
        (key, json!({"value": rad, "unit": "rad"}))
    });
    let effects = reached.effects.iter().map(|(effect, unknowns)| {
        let one = |(name, value, unit): &(String, f64, &str)| {
            json!({"name": name, "value": value, "unit": unit})
        };
        let parameters: Vec<Value> = unknowns.iter().map(one).collect();
        json!({"effect": effect, "parameters": parameters})
    });
    json!({
        "method": "simultaneous",
        "tilts": tilts.collect::<Map<_, _>>(),
        "thickness": reached.thickness_mm.map(|mm| json!({"value": mm, "unit": "mm"})),
        "effects": effects.collect::<Vec<_>>(),
        "residual": {"rms": reached.residual_rms_um, "unit": "um"},
        "convergence": {
            "converged": false,
            "reason": ending,
            "iterations": reached.iterations,
        },
    })
}

/// An angle with its degrees of freedom and expanded uncertainty.
fn angle(o: &Outcome, label: &str, v: Measured) -> Result<Value, Message> {
    quantity_json(&o.quantity(label, v).map_err(unexpandable)?)
}

/// The thickness that was fitted; null where it was not.
fn thickness(o: &Outcome) -> Result<Value, Message> {
    let Some(found) = o.thickness else {
        return Ok(Value::Null);
    };
    let quantity = Quantity::new("thickness", found.value, found.std, "mm");
    let quantity = quantity.map_err(unexpandable)?;
    quantity_json(&quantity.with_degrees_of_freedom(o.noise_freedom))
}

/// Every tilt of the convention by its name; null where these channels do not determine it.
fn tilts(o: &Outcome) -> Result<Map<String, Value>, Message> {
    o.convention
        .tilts()
        .into_iter()
        .map(|contrast| {
            let found = o.tilts.iter().find(|t| t.contrast == Some(contrast));
            let key = contrast.name(o.convention).replace('-', "_");
            let value = found.map_or(Ok(Value::Null), |t| angle(o, &t.name, t.angle))?;
            Ok((key, value))
        })
        .collect()
}

fn combinations(o: &Outcome) -> Result<Vec<Value>, Message> {
    let together = o.tilts.iter().filter(|t| t.contrast.is_none());
    together
        .map(|t| {
            let mut value = angle(o, &t.name, t.angle)?;
            value["name"] = json!(t.name);
            Ok(value)
        })
        .collect()
}

fn contrasts(o: &Outcome) -> Result<Vec<Value>, Message> {
    o.contrasts
        .iter()
        .flatten()
        .map(|(contrast, v)| {
            let name = contrast.name(o.convention);
            let mut value = angle(o, name, *v)?;
            value["pattern"] = json!(contrast.pattern());
            value["name"] = json!(name);
            value["meaning"] = json!(contrast.meaning(o.convention));
            Ok(value)
        })
        .collect()
}

fn closure(o: &Outcome) -> Result<Value, Message> {
    let Some(c) = &o.closure else {
        return Ok(Value::Null);
    };
    Ok(json!({
        "slope": match c.slope {
            Some(slope) => angle(o, "closure slope", slope)?,
            None => Value::Null,
        },
        "rms": {"value": c.rms, "unit": "um"},
        "expected_rms": {"value": c.expected_rms, "unit": "um"},
        "x": c.x,
        "profile": c.profile,
    }))
}

fn forms(o: &Outcome) -> Value {
    let mut forms = Map::new();
    forms.insert("x".to_owned(), json!(o.x));
    for name in errsep_models::reversal::staged::FORMS {
        let found = o.forms.iter().find(|f| f.is_single && f.name == name);
        forms.insert(
            name.to_owned(),
            found.map_or(Value::Null, |f| json!(f.values)),
        );
        forms.insert(
            format!("{name}_std"),
            found.map_or(Value::Null, |f| json!(f.std)),
        );
    }
    Value::Object(forms)
}

fn form_combinations(o: &Outcome) -> Value {
    let together = o.forms.iter().filter(|f| !f.is_single);
    together
        .map(|f| json!({"name": f.name, "values": f.values, "std": f.std, "unit": "um"}))
        .collect()
}

fn straightness(o: &Outcome) -> Map<String, Value> {
    o.straightness()
        .into_iter()
        .map(|(name, lines)| {
            let lines = lines
                .into_iter()
                .map(|(r, e)| (r.key().to_owned(), json!(e)));
            (name.to_owned(), Value::Object(lines.collect()))
        })
        .collect()
}
