//! Component errors and squareness by step-diagonal measurements.

use serde_json::{Value, json};

use super::{Coverage, Entry, Group, Numbers, left};

pub fn read(result: &Value) -> Option<Numbers> {
    let coverage = Coverage::of(&result["uncertainty"]);
    let mut quantities = Group::new("Squareness and what else is determined", "");
    for quantity in result["quantities"].as_array()? {
        let name = quantity["label"].as_str()?;
        quantities
            .entries
            .extend(Entry::quantity(name, quantity, &quantity["expanded"]));
    }
    let mut groups = vec![quantities];
    let mut not_stated = left(&[
        ("mirrors", "they are of the set-up"),
        (
            "diagonals, totals, residuals",
            "they are of the readings; the errors that follow from them are stated",
        ),
    ]);
    for component in result["components"].as_array()? {
        let name = component["name"].as_str()?;
        let about = match component["determined"].as_str()? {
            "wholly" => "",
            "shape-only" => "Its shape: the readings do not determine its slope.",
            other => {
                let why = format!("the readings determine it {}", other.replace('-', " "));
                not_stated.push((name.to_owned(), why));
                continue;
            }
        };
        let title = format!(
            "{name}, {}",
            component["meaning"].as_str().unwrap_or_default()
        );
        let mut group = Group::new(&title, about);
        group
            .entries
            .push(Entry::nominal("position", &component["position"], "mm")?);
        let lists = (&component["value"], &component["std"]);
        let unit = component["unit"].as_str()?;
        let coverage = common(coverage, &component["degrees_of_freedom"]);
        group
            .entries
            .extend(Entry::with_std(name, lists, unit, coverage));
        groups.push(group);
    }
    Some(Numbers {
        title: "Component errors of a machine by step-diagonal measurements".to_owned(),
        method: "Steps along the four body diagonals, one axis at a time; errors of the axes by least squares.".to_owned(),
        groups,
        left: not_stated,
        ..Numbers::default()
    })
}

/// The coverage of the result, where every position has its degrees of freedom.
fn common(all: Option<Coverage>, freedoms: &Value) -> Option<Coverage> {
    let mut own = freedoms.as_array()?.iter();
    all.filter(|all| {
        own.all(|freedom| Coverage::of(&json!({"degrees_of_freedom": freedom})) == Some(*all))
    })
}
