//! `errsep.reversal/2`.

use errsep_models::reversal::designs::{Found, SLOPES};
use errsep_models::reversal::simultaneous::NoiseOrigin;
use errsep_models::uncertainty::Quantity;
use serde_json::{Map, Value, json};

use super::{Outcome, degrees};
use crate::cli::quantity::{quantity_json, unexpandable};
use crate::io::Message;

pub fn json(o: &Outcome) -> Result<Value, Message> {
    let fit = &o.fit;
    let channels = fit.design.channels().iter();
    let design: Vec<Value> = channels
        .map(|c| {
            json!({"channel": c.name, "indicator": c.indicator, "spindle": c.spindle, "side": c.side()})
        })
        .collect();
    let (slopes, constants) = (fit.slopes(), fit.constants());
    let tilts = singles(&slopes, &SLOPES, "rad")?;
    let kept = constants.iter().any(|c| c.name.starts_with("zero of"));
    let eccentricity = match kept {
        true => Value::Object(singles(&constants, &["e_1", "e_2", "o"], "um")?),
        false => Value::Null,
    };
    let together = slopes.iter().filter(|f| !f.alone);
    let tilt_combinations = together
        .map(|f| {
            let mut own = quantity(f, "rad")?;
            own["name"] = json!(f.name);
            Ok(own)
        })
        .collect::<Result<Vec<Value>, Message>>()?;
    let together = o.forms.iter().filter(|f| !f.alone);
    let form_combinations: Vec<Value> = together
        .map(|f| json!({"name": f.name, "values": f.values, "std": f.std, "unit": "um"}))
        .collect();
    let closure: Vec<Value> = fit
        .closures
        .iter()
        .map(|c| json!({"combination": c.name, "rms": {"value": c.rms, "unit": "um"}}))
        .collect();
    let not_determined: Vec<Value> = o
        .open()
        .into_iter()
        .map(|(combination, remedy)| json!({"combination": combination, "remedy": remedy}))
        .collect();
    let position_slopes: Vec<Value> = fit
        .position_slopes
        .iter()
        .map(|s| json!({"name": s.name, "value": s.value.value, "std": s.value.std, "unit": "rad"}))
        .collect();
    let by_channel: Map<String, Value> = fit
        .design
        .channels()
        .iter()
        .zip(&fit.by_channel)
        .map(|(c, own)| (c.name.clone(), json!(own.rms)))
        .collect();
    let channels = fit.design.channels().iter().zip(&fit.by_channel);
    let noise: Map<String, Value> = channels
        .map(|(c, own)| (c.name.clone(), json!(own.sigma)))
        .collect();
    Ok(json!({
        "schema": "errsep.reversal/2",
        "method": "simultaneous",
        "design": design,
        "tilts": tilts,
        "eccentricity": eccentricity,
        "thickness": match fit.thickness() {
            Some(found) => quantity(&found, "mm")?,
            None => Value::Null,
        },
        "tilt_combinations": tilt_combinations,
        "form_combinations": form_combinations,
        "forms": forms(o),
        "not_determined": not_determined,
        "closure": closure,
        "position_slopes": position_slopes,
        "residual": {
            "rms": o.residual_rms(),
            "noise": fit.noise_um,
            "noise_source": match fit.noise_origin {
                NoiseOrigin::Declared => "declared",
                NoiseOrigin::Residuals => "residuals",
                NoiseOrigin::BetweenChannels { .. } => "channels",
                NoiseOrigin::Repeats { .. } => "repeats",
            },
            "noise_words": o.noise_words(),
            "noise_law": match fit.noise_origin {
                NoiseOrigin::Repeats { law, shared } => json!({
                    "white": law.white.sqrt(),
                    "correlated": law.correlated.sqrt(),
                    "length": law.length,
                    "shift": law.shift.sqrt(),
                    "drift": 1e-3 * law.drift.sqrt(),
                    "between_indicators": shared.map(|s| s.correlation),
                }),
                NoiseOrigin::BetweenChannels { law } => json!({
                    "white": law.white.sqrt(),
                    "correlated": law.correlated.sqrt(),
                    "length": law.length,
                    "shift": 0.0,
                    "drift": 0.0,
                    "between_indicators": Value::Null,
                }),
                _ => Value::Null,
            },
            "degrees_of_freedom": fit.degrees_of_freedom,
            "channels": by_channel,
            "channel_noise": noise,
        },
        "agreement": {
            "disagree": fit.agreement.disagree,
            "missed": {"value": fit.agreement.missed, "unit": "um"},
        },
        "knots": fit.cells().into_iter().map(|(form, cells)| (form, json!(cells))).collect::<Map<_, _>>(),
        "convergence": {
            "converged": true,
            "reason": fit.convergence.ending.to_string(),
            "iterations": fit.convergence.history.len(),
            "seconds": fit.convergence.seconds,
        },
        "warnings": o.warnings,
    }))
}

/// Those of the names that are determined by themselves; `null` for others.
fn singles(found: &[Found], names: &[&str], unit: &str) -> Result<Map<String, Value>, Message> {
    names
        .iter()
        .map(|name| {
            let own = found.iter().find(|f| f.alone && f.name == *name);
            let value = own.map_or(Ok(Value::Null), |f| quantity(f, unit))?;
            Ok(((*name).to_owned(), value))
        })
        .collect()
}

fn quantity(found: &Found, unit: &str) -> Result<Value, Message> {
    let quantity = Quantity::new(found.name.clone(), found.value.value, found.value.std, unit)
        .map_err(unexpandable)?
        .with_degrees_of_freedom(degrees(found.degrees_of_freedom));
    quantity_json(&quantity)
}

fn forms(o: &Outcome) -> Value {
    let mut forms = Map::new();
    forms.insert("x".to_owned(), json!(o.x));
    for name in ["M_h", "M_v"] {
        let own = o.forms.iter().find(|f| f.alone && f.name == name);
        forms.insert(
            name.to_owned(),
            own.map_or(Value::Null, |f| json!(f.values)),
        );
        forms.insert(
            format!("{name}_std"),
            own.map_or(Value::Null, |f| json!(f.std)),
        );
    }
    let (mut sides, mut std) = (Map::new(), Map::new());
    for angle in o.fit.design.sides() {
        let own = o.forms.iter().find(|f| f.side == Some(*angle));
        let name = errsep_models::reversal::designs::angle_name(*angle);
        sides.insert(name.clone(), own.map_or(Value::Null, |f| json!(f.values)));
        std.insert(name, own.map_or(Value::Null, |f| json!(f.std)));
    }
    forms.insert("S".to_owned(), Value::Object(sides));
    forms.insert("S_std".to_owned(), Value::Object(std));
    Value::Object(forms)
}
