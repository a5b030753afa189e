//! The answer for programs, `docs/json/step-diagonal.md`.

use errsep_models::diagonal::{Assumptions, ComponentEstimate, Location, Total};
use serde_json::{Value, json};

use super::Found;
use crate::cli::disagreement;
use crate::cli::quantity::{COVERAGE, coverage_json, quantity_json, unexpandable};
use crate::io::Message;

pub(super) fn as_json(found: &Found, assumptions: &Assumptions) -> Result<Value, Message> {
    let fit = &found.fit;
    let angles = fit.angles().map_err(unexpandable)?;
    Ok(json!({
        "schema": "errsep.step-diagonal/1",
        "work_zone": {"travel": found.zone.travel, "steps": found.zone.steps, "unit": "mm"},
        "readings": found.readings.len(),
        "assumptions": {
            "zero": assumptions.zero.iter().map(|c| c.name()).collect::<Vec<_>>(),
            "slopes": assumptions.slopes,
        },
        "unknowns": fit.parameters,
        "rank": fit.rank,
        "noise": fit.noise.map(|v| json!({"value": v, "unit": "um"})),
        "degrees_of_freedom": fit.degrees_of_freedom,
        "disagreement": disagreement::as_json(fit.disagreement),
        "remarks": found.remarks,
        "uncertainty": coverage_json(fit.noise_degrees_of_freedom)?,
        "quantities": angles.iter().map(quantity_json).collect::<Result<Vec<_>, _>>()?,
        "components": functions(&fit.components)?,
        "reversals": functions(&fit.reversals)?,
        "squareness": fit.squareness.iter().map(|l| json!({
            "name": l.location.name(),
            "meaning": l.location.words(),
            "determined": l.determined,
            "value": l.value.map(|s| l.location.iso_sign() * s),
            "std": l.std,
            "degrees_of_freedom": l.degrees_of_freedom,
            "unit": "rad",
        })).collect::<Vec<_>>(),
        "mirrors": fit.mirrors.iter().map(|m| json!({
            "diagonal": m.diagonal,
            "target": m.target,
            "direction": m.direction,
            "value": m.value,
            "std": m.std,
            "degrees_of_freedom": m.degrees_of_freedom,
            "unit": "rad",
        })).collect::<Vec<_>>(),
        "ambiguities": fit.ambiguities,
        "remedies": fit.remedies,
        "closed_forms": found.forms.iter().map(|f| {
            let rotation = f.component.is_some_and(|c| c.rotation);
            json!({
                "equation": f.equation,
                "target": f.target,
                "motion": f.motion,
                "stands_for": f.component.map(|c| c.name()),
                "steps": f.steps,
                "profile": f.profile,
                "profile_std": fit.noise.map(|sigma| {
                    f.profile_gains.iter().map(|g| g * sigma).collect::<Vec<_>>()
                }),
                "unit": unit(rotation),
            })
        }).collect::<Vec<_>>(),
        "diagonals": found.totals.errors.iter().map(|(d, (value, runs))| json!({
            "diagonal": d, "error": {"value": value, "unit": "um"}, "runs": runs,
            "reversal": found.totals.reversals.get(d).map(|v| json!({"value": v, "unit": "um"})),
        })).collect::<Vec<_>>(),
        "totals": found.totals.estimates.iter().map(|e| {
            let (name, value, unit) = match e.quantity {
                Total::PositioningSum => ("positioning-sum", e.value, "um"),
                Total::Squareness(l) => (Location::name(l), l.iso_sign() * e.value, "rad"),
            };
            json!({"equation": e.equation, "name": name, "value": value, "gain": e.gain, "unit": unit})
        }).collect::<Vec<_>>(),
        "sequence_choices": found.choices.iter().map(|c| json!({
            "sequences": c.sequences,
            "angular": c.angular.iter().map(|c| c.name()).collect::<Vec<_>>(),
            "translational": c.translational.iter().map(|c| c.name()).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "residuals": {"value": fit.residuals, "unit": "um"},
    }))
}

const fn unit(rotation: bool) -> &'static str {
    if rotation { "rad" } else { "um" }
}

/// Error functions or reversals.
fn functions(all: &[ComponentEstimate]) -> Result<Vec<Value>, Message> {
    all.iter()
        .map(|c| {
            let quantities = c.quantities().map_err(unexpandable)?;
            let expanded = quantities
                .iter()
                .map(|q| {
                    Ok(q.expanded(COVERAGE)
                        .map_err(unexpandable)?
                        .expanded_uncertainty)
                })
                .collect::<Result<Vec<f64>, Message>>()?;
            Ok(json!({
                "name": c.component.name(),
                "meaning": c.component.words(),
                "determined": c.determined,
                "position": c.positions,
                "value": c.values,
                "std": c.std,
                "degrees_of_freedom": c.degrees_of_freedom,
                "expanded_uncertainty": expanded,
                "unit": unit(c.component.rotation),
            }))
        })
        .collect()
}
