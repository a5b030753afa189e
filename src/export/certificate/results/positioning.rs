//! Positioning of an axis by ISO 230-2 and VDI 3441.

use serde_json::Value;

use super::super::numbers::Uncertainty;
use super::{Entry, Group, Numbers, left};

pub fn read(result: &Value) -> Option<Numbers> {
    let unit = result["unit"].as_str()?;
    let position_unit = result["position_unit"].as_str()?;
    let stated = &result["uncertainty"];
    let about = stated["contents"].as_str().unwrap_or_default();
    let groups = [
        ("iso230_2", "Figures of ISO 230-2"),
        ("vdi3441", "Figures of VDI/DGQ 3441"),
    ];
    let mut groups: Vec<Group> = groups
        .iter()
        .map(|(key, name)| {
            let mut group = Group::new(name, about);
            let told = result[*key].as_object().into_iter().flatten();
            let probability = &stated["coverage_probability"];
            group.entries = told
                .filter_map(|(name, value)| figure(name, value, unit, probability))
                .collect();
            group
        })
        .collect();
    groups.push(targets(&result["points"], unit, position_unit)?);
    let rate = &result["drift"]["rate"];
    let mut drift = Group::new("Drift", "Drift common to all targets.");
    drift
        .entries
        .extend(Entry::quantity("drift", rate, &rate["expanded"]));
    groups.push(drift);
    let axis = result["axis"]["name"].as_str();
    let mut left = left(&[(
        "scatter of readings",
        "it is of the measurement; s of each target is stated",
    )]);
    for why in stated["withheld"].as_array().into_iter().flatten() {
        let why = why.as_str().unwrap_or_default();
        left.push(("uncertainties".to_owned(), why.to_owned()));
    }
    Some(Numbers {
        title: axis.map_or_else(|| "Positioning of an axis".to_owned(), |name| format!("Positioning of axis {name}")),
        method: "Repeated approach of targets from both directions or one; figures of ISO 230-2 and VDI/DGQ 3441. \
                 Uncertainties by simulated tests (propagation of distributions, GUM Supplement 1)."
            .to_owned(),
        norm: Some("ISO 230-2"),
        groups,
        left,
        ..Numbers::default()
    })
}

/// A figure; its coverage factor is U over the standard uncertainty of the same simulated tests.
fn figure(name: &str, value: &Value, unit: &str, probability: &Value) -> Option<Entry> {
    let name = name.replace('_', " ");
    let mut entry = Entry::bare(&name, &value["value"], unit)?;
    let (u, std) = (value["U"].as_f64(), value["std"].as_f64());
    match (u, std, probability.as_f64()) {
        (Some(u), Some(std), Some(probability))
            if u >= std
                && std > 0.0
                && (u / std).is_finite()
                && probability < 1.0
                && probability > 0.0 =>
        {
            entry.uncertainty = Uncertainty::Expanded {
                expanded: vec![u],
                factors: vec![u / std],
                probability,
                distribution: None,
            };
        }
        (Some(_), None, _) => {
            let why = "The result tells U without a standard uncertainty, so that no coverage factor can be stated: run errsep \
                       positioning again with this version.";
            entry.about = why.to_owned();
        }
        _ => {}
    }
    Some(entry)
}

/// Means, standard deviations, reversal and repeatability by target.
fn targets(points: &Value, unit: &str, position_unit: &str) -> Option<Group> {
    let points = points.as_array()?;
    let of = |key: &str| Value::Array(points.iter().map(|p| p[key].clone()).collect());
    let mut group = Group::new(
        "Values by target",
        "Mean and standard deviation of the runs at each target.",
    );
    group
        .entries
        .push(Entry::nominal("target", &of("target"), position_unit)?);
    for (key, name) in [
        ("mean_forward", "mean deviation forward"),
        ("mean_backward", "mean deviation backward"),
        ("mean", "mean deviation of both directions"),
        ("s_forward", "standard deviation forward"),
        ("s_backward", "standard deviation backward"),
        ("B", "reversal"),
        ("R", "repeatability"),
    ] {
        group.entries.extend(Entry::list(name, &of(key), unit));
    }
    Some(group)
}
