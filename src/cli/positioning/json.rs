//! `errsep.positioning/1`.

use errsep_models::positioning::{COVERAGE, Direction, Figure};
use serde_json::{Map, Value, json};

use super::{Found, words};
use crate::cli::quantity::quantity_json;
use crate::io::Message;

/// The answer for programs.
///
/// # Errors
/// A drift whose uncertainty cannot be expanded.
pub(super) fn as_json(found: &Found) -> Result<Value, Message> {
    let (setup, result) = (&found.setup, &found.result);
    let deviations = &result.deviations;
    let directions: Vec<&str> = deviations.directions().map(|(d, _)| d.name()).collect();
    let influences = setup.influences;
    Ok(json!({
        "schema": "errsep.positioning/1",
        "axis": {
            "name": setup.name,
            "kind": setup.kind.name(),
            "travel": setup.travel.map(|(from, to)| json!({"from": from, "to": to})),
        },
        "unit": setup.kind.deviation_unit(),
        "position_unit": setup.kind.position_unit(),
        "targets": deviations.targets.len(),
        "runs": deviations.runs,
        "directions": directions,
        "missing": missing(found),
        "iso230_2": figures(found, &Figure::ISO),
        "vdi3441": figures(found, &Figure::VDI),
        "uncertainty": {
            "coverage_probability": COVERAGE,
            "device": influences.device,
            "misalignment": influences.misalignment,
            "expansion": influences.expansion,
            "drift": influences.drift,
            "contents": words::contents(found),
            "withheld": words::withheld(result),
        },
        "scatter": result.scatter.map(|s| json!({
            "std": s.std,
            "degrees_of_freedom": s.degrees_of_freedom,
            "equal": {"p_value": s.equal, "differs": s.differs()},
            "independent": {"p_value": s.independent, "depends": s.depends()},
            "runs": {"p_value": s.level, "differ": s.runs_differ()},
        })),
        "points": points(found),
        "drift": drift(found)?,
        "temperature": found.data.temperature.map(|(from, to)| {
            json!({"from": from, "to": to, "unit": "degC"})
        }),
        "warnings": found.warnings,
    }))
}

/// Value, expanded and standard uncertainty of each figure; null where the readings do not tell it.
fn figures(found: &Found, which: &[Figure]) -> Map<String, Value> {
    which
        .iter()
        .map(|figure| {
            let expanded = found.result.uncertainty(*figure).and_then(Result::ok);
            let value = found.result.value(*figure);
            let std = found.result.standard_uncertainty(*figure);
            let told = value.map(|value| json!({"value": value, "U": expanded, "std": std}));
            (figure.key().to_owned(), told.unwrap_or(Value::Null))
        })
        .collect()
}

/// Readings that are missing, and whether means are freed of the heights of the runs.
fn missing(found: &Found) -> Value {
    let readings: Vec<Value> = (found.result.deviations.missing.iter())
        .map(|m| json!({"target": m.target, "direction": m.direction.name(), "run": m.run}))
        .collect();
    json!({"readings": readings, "freed_of_heights": found.result.freed_of_heights})
}

fn points(found: &Found) -> Vec<Value> {
    let profile = &found.result.profile;
    let of = |values: Option<&[f64]>, i: usize| values.and_then(|v| v.get(i)).copied();
    let (means, reversals) = (profile.bidirectional_means(), profile.reversals());
    let repeatabilities = profile.repeatabilities();
    let readings = |direction: Direction, i: usize| {
        let rows = found.result.deviations.by_direction[direction.index()].as_ref();
        rows.and_then(|rows| rows.get(i))
            .map(|row| row.iter().flatten().count())
    };
    let targets = found.result.deviations.targets.iter().enumerate();
    targets
        .map(|(i, target)| {
            json!({
                "target": target,
                "readings_forward": readings(Direction::Forward, i),
                "readings_backward": readings(Direction::Backward, i),
                "mean_forward": of(profile.means(Direction::Forward), i),
                "mean_backward": of(profile.means(Direction::Backward), i),
                "s_forward": of(profile.stds(Direction::Forward), i),
                "s_backward": of(profile.stds(Direction::Backward), i),
                "mean": of(means.as_deref(), i),
                "B": of(reversals.as_deref(), i),
                "R": of(repeatabilities.as_deref(), i),
            })
        })
        .collect()
}

fn drift(found: &Found) -> Result<Value, Message> {
    let Some((drift, rate)) = words::rate(found)? else {
        return Ok(Value::Null);
    };
    Ok(json!({
        "rate": quantity_json(&rate)?,
        "duration": {"value": drift.duration, "unit": "s"},
    }))
}
