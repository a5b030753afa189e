//! The answer as JSON, schema `errsep.four-sensor/1` (docs/json/four-sensor.md).

use errsep_models::four_sensor::{Excess, Parabola, Penalised, Profile, ToldBy};
use serde_json::{Value, json};

use super::Found;
use super::words::{
    ENDS_OFF, ZONE_NOTE, averaged, counted_from_ends, discrepancy_key, ends, excess,
    not_determined, refuted, status_key,
};
use crate::cli::disagreement;
use crate::cli::quantity::{COVERAGE, coverage_json, unexpandable};
use crate::io::Message;

pub(super) fn json(found: &Found) -> Result<Value, Message> {
    let s = &found.separation;
    let outputs = &found.measured.outputs;
    let geometry = outputs.geometry();
    let places = geometry.positions();
    let curve = &s.chosen.curve;
    let rows = 2 * outputs.readings().len();
    let zone = &found.straightness_error;
    let (low, high) = zone.interval(COVERAGE).map_err(unexpandable)?;
    Ok(json!({
        "schema": "errsep.four-sensor/1",
        "method": "direct",
        "geometry": {
            "step": geometry.step(),
            "spacing": [places[1], places[2] - places[1], places[3] - places[2]],
            "unit": "mm",
            "slide_positions": geometry.output_count(),
            "surface_points": geometry.point_count(),
            "repeats": found.measured.repeats,
        },
        "average": averaged(found).map(|text| json!({"of": "outputs", "text": text})),
        "missing": found.measured.missing.iter().map(|m| json!({
            "sensor": m.sensor, "x": m.x, "repeat": m.repeat,
        })).collect::<Vec<_>>(),
        "straightness_error": {
            "reference": "minimum_zone",
            "value": zone.value,
            "std": zone.std,
            "widening": zone.widening,
            "interval": [low, high],
            "coverage_probability": COVERAGE,
            "note": ZONE_NOTE,
            "unit": "um",
            "parabola_open": found.parabola_is_open(),
        },
        "straightness": profile(&s.straightness, "S", "um", outputs.slide_positions()),
        "tilt": profile(&s.tilt, "gamma", "rad", outputs.slide_positions()),
        "surface": profile(&s.surface, "f", "um", outputs.surface_positions()),
        "zero_adjustment": {"value": s.zero_adjustment, "unit": "um"},
        "zero_adjustment_std": {"value": s.zero_adjustment_std, "unit": "um"},
        "parabola": {
            "determined": false,
            "from": parabola_key(found.setup.settings.parabola),
            "surface_curvature": {"value": s.curvature, "unit": "um/mm2"},
        },
        "invisible_periods": {"value": geometry.invisible_periods(), "unit": "mm"},
        "not_determined": not_determined(found),
        "surface_scatter": {
            "even": s.scatter.even,
            "held_back": s.scatter.held_back,
            "uneven": s.scatter.is_uneven(),
            "unit": "um",
        },
        "surface_ends": found.ends.map(|of| json!({
            "offset": of.offset,
            "std": of.std,
            "unit": "um",
            "may_lie_on_mean_line": !of.contradict(ENDS_OFF),
            "text": ends(found),
        })),
        "regularization": {
            "penalty": found.setup.penalised.name(),
            "penalties": found.likeliest.as_ref().map(|likeliest| {
                let of = |(penalised, against): &(Penalised, f64)| (penalised.name().to_owned(), json!(against));
                likeliest.against.iter().map(of).collect::<serde_json::Map<_, _>>()
            }),
            "lambda": s.chosen.point.lambda,
            "rule": s.chosen.rule,
            "instead": s.chosen.instead,
            "note": counted_from_ends(found),
            "effective_parameters": s.chosen.point.effective_parameters,
            "condition_number": found.condition_number,
            "l_curve": {
                "status": status_key(curve.status),
                "corners": curve.corners.iter().map(|corner| json!({
                    "lambda": corner.point.lambda,
                    "curvature": corner.curvature,
                    "turn": {"value": corner.turn, "unit": "rad"},
                })).collect::<Vec<_>>(),
                "lambda": curve.points.iter().map(|p| p.lambda).collect::<Vec<_>>(),
                "residual_norm": curve.points.iter().map(|p| p.residual_norm).collect::<Vec<_>>(),
                "seminorm": curve.points.iter().map(|p| p.seminorm).collect::<Vec<_>>(),
            },
            "gcv": {"lambda": s.chosen.gcv},
            "discrepancy": s.chosen.discrepancy.as_ref().map(|found| json!({
                "status": discrepancy_key(found),
                "lambda": found.lambda(),
            })),
        },
        "residual": {
            "rms": residual_rms(&s.residuals),
            "noise": s.noise,
            "noise_estimated": s.noise_estimated,
            "degrees_of_freedom": s.chosen.point.residual_degrees_of_freedom(rows),
        },
        "disagreement": disagreement::as_json(found.disagreement()),
        "repeats": s.excess.and_then(|excess| match excess.told_by {
            ToldBy::Repeats { p_value } => Some(json!({
                "factors": factors(&excess),
                "p_value": p_value,
            })),
            ToldBy::Outputs { .. } => None,
        }),
        "correlated_noise": s.excess.and_then(|excess| match excess.told_by {
            ToldBy::Repeats { .. } => None,
            ToldBy::Outputs { law } => Some(json!({
                "white": law.white.sqrt(),
                "correlated": law.correlated.sqrt(),
                "length": law.length,
                "factors": factors(&excess),
            })),
        }),
        "remarks": excess(found).into_iter().chain(refuted(found)).collect::<Vec<_>>(),
        "uncertainty": coverage_json(found.degrees_of_freedom())?,
        "published": found.published.as_ref().map(|way| json!({
            "lambda": way.chosen.as_ref().map(|chosen| chosen.point.lambda),
            "rule": way.chosen.as_ref().map(|chosen| chosen.rule),
            "S": way.straightness.as_slice(),
            "gamma": way.tilt.as_slice(),
            "f": way.surface.as_slice(),
        })),
    }))
}

fn profile(profile: &Profile, name: &str, unit: &str, x: Vec<f64>) -> Value {
    let mut object = serde_json::Map::new();
    object.insert("x".to_owned(), json!(x));
    for (suffix, values) in [
        ("", &profile.values),
        ("_std", &profile.std),
        ("_bias", &profile.bias),
        ("_bias_bound", &profile.bias_bound),
    ] {
        object.insert(format!("{name}{suffix}"), json!(values.as_slice()));
    }
    object.insert("unit".to_owned(), json!(unit));
    Value::Object(object)
}

const fn parabola_key(parabola: Parabola) -> &'static str {
    match parabola {
        Parabola::LeastNorm => "least-norm",
        Parabola::SurfaceCurvature(_) => "surface-curvature",
        Parabola::ZeroAdjustment(_) => "zero-adjustment",
        Parabola::TiltSlope(_) => "tilt-slope",
    }
}

/// Root mean square of output less model, µm.
pub(super) fn residual_rms(residuals: &[[f64; 4]]) -> f64 {
    let squares: f64 = residuals.iter().flatten().map(|r| r * r).sum();
    (squares / (4 * residuals.len()) as f64).sqrt()
}

fn factors(excess: &Excess) -> Value {
    json!({"f": excess.factors[0], "S": excess.factors[1], "gamma": excess.factors[2]})
}
