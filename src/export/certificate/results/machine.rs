//! Deviations and features predicted from the component errors of a machine.

use serde_json::Value;

use super::super::numbers::Uncertainty;
use super::{Entry, Group, Numbers, left};

pub fn read(result: &Value) -> Option<Numbers> {
    let mut not_stated = left(&[
        (
            "component errors",
            "they are what was given; the result tells them without uncertainty",
        ),
        (
            "contributions",
            "they are parts of the uncertainties that are stated",
        ),
    ]);
    let groups = match result["action"].as_str()? {
        "predict" => points(result["points"].as_array()?)?,
        "length" | "squareness" | "circularity" => features(result["results"].as_array()?),
        _ => {
            let why = "parts are compared with the prediction; predict tells it".to_owned();
            not_stated.push(("parts".to_owned(), why));
            Vec::new()
        }
    };
    let assumption = result["assumption"].as_str().unwrap_or_default();
    let method = format!(
        "Rigid-body model of the machine {} with its component errors (ISO 230-1 names). {assumption}",
        result["chain"].as_str()?
    );
    Some(Numbers {
        title: "Errors of a machine predicted from its component errors".to_owned(),
        method: method.trim_end().to_owned(),
        groups,
        left: not_stated,
        ..Numbers::default()
    })
}

/// A group a point: its position and the deviation along each axis.
fn points(points: &[Value]) -> Option<Vec<Group>> {
    let group = |point: &Value| {
        let name = point["point"].as_str()?;
        let mut group = Group::new(&format!("Point {name}"), "");
        let position = &point["position"];
        for axis in ["x", "y", "z"] {
            let unit = position["unit"].as_str()?;
            let mut nominal = Entry::bare(&format!("position {axis}"), &position[axis], unit)?;
            nominal.uncertainty = Uncertainty::Nominal;
            group.entries.push(nominal);
        }
        for axis in ["x", "y", "z"] {
            let told = &point["deviation"][axis];
            let name = format!("deviation along {}", axis.to_uppercase());
            group
                .entries
                .push(Entry::quantity(&name, &told["result"], &told["expanded"])?);
        }
        Some(group)
    };
    points.iter().map(group).collect()
}

fn features(results: &[Value]) -> Vec<Group> {
    let group = |result: &Value| {
        let label = result["label"].as_str()?;
        let mut group = Group::new(label, "");
        group.entries.extend(Entry::quantity(
            label,
            &result["result"],
            &result["expanded"],
        ));
        group.entries.extend(simulated(label, result));
        Some(group)
    };
    results.iter().filter_map(group).collect()
}

/// Mean and shortest interval of the trials.
fn simulated(label: &str, result: &Value) -> Option<Entry> {
    let trials = &result["monte_carlo"];
    let interval = &trials["shortest_interval"];
    let name = format!("{label}, mean of {} trials", trials["trials"].as_u64()?);
    let mut entry = Entry::bare(&name, &trials["mean"], result["unit"].as_str()?)?;
    entry.uncertainty = Uncertainty::interval(
        &trials["std"],
        [&interval["lower"], &interval["upper"]],
        &interval["coverage_probability"],
    );
    Some(entry.about("Shortest coverage interval (GUM Supplement 1, 7.7)."))
}
