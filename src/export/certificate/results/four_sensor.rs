//! Straightness, tilt and surface by four sensors.

use serde_json::Value;

use super::super::numbers::Uncertainty;
use super::{Coverage, Entry, Group, Numbers, left};

pub fn read(result: &Value) -> Option<Numbers> {
    let coverage = Coverage::of(&result["uncertainty"]);
    let mut width = Group::new("Straightness deviation", "");
    width
        .entries
        .extend(deviation(&result["straightness_error"]));
    let mut groups = vec![width];
    let open = result["not_determined"].as_array().into_iter().flatten();
    let open: Vec<&str> = open.filter_map(Value::as_str).collect();
    let open = open.join(" ");
    for (key, letter, name) in [
        ("straightness", "S", "straightness of the slide"),
        ("tilt", "gamma", "tilt of the slide"),
        ("surface", "f", "surface"),
    ] {
        let told = &result[key];
        let unit = told["unit"].as_str()?;
        let mut group = Group::new(name, &open);
        group
            .entries
            .push(Entry::nominal("position", &told["x"], "mm")?);
        let lists = (&told[letter], &told[format!("{letter}_std")]);
        group
            .entries
            .extend(Entry::with_std(name, lists, unit, coverage));
        groups.push(group);
    }
    let mut zeros = Group::new("Zeros of the sensors", "e1 and e4 are zero by definition.");
    let (values, std) = (&result["zero_adjustment"], &result["zero_adjustment_std"]);
    let lists = (&values["value"], &std["value"]);
    zeros
        .entries
        .extend(Entry::with_std("zero adjustment", lists, "um", coverage));
    groups.push(zeros);
    Some(Numbers {
        title: "Straightness and tilt of a slide by four sensors".to_owned(),
        method: "Four sensors side by side read a surface along the slide; surface, straightness and tilt are separated by \
                 regularized least squares."
            .to_owned(),
        groups,
        left: left(&[
            (
                "bias of the regularization",
                "it is what the penalty pulls, no uncertainty; the result tells it",
            ),
            ("published way", "the same quantities by another way"),
        ]),
        ..Numbers::default()
    })
}

fn deviation(told: &Value) -> Option<Entry> {
    let mut entry = Entry::bare(
        "straightness, minimum zone",
        &told["value"],
        told["unit"].as_str()?,
    )?;
    let interval = &told["interval"];
    entry.uncertainty = Uncertainty::interval(
        &told["std"],
        [&interval[0], &interval[1]],
        &told["coverage_probability"],
    );
    let note = told["note"].as_str().unwrap_or_default();
    if entry.uncertainty != Uncertainty::None {
        entry.about = note.to_owned();
    }
    Some(entry)
}
