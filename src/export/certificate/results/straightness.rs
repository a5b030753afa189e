//! A straightness profile.

use serde_json::Value;

use super::{Entry, Group, Numbers, left};

const LINES: [(&str, &str); 3] = [
    ("least_squares", "line of least squares"),
    ("end_point", "line through the ends"),
    ("minimum_zone", "line of the minimum zone"),
];

pub fn read(result: &Value) -> Option<Numbers> {
    let mut deviations = Group::new(
        "Straightness deviation",
        "Width of the zone along each reference line.",
    );
    let of = |key: &str| {
        let mut lines = result["reference_lines"].as_array()?.iter();
        lines.find(|line| line["reference"] == key)
    };
    let mut profile = Group::new(
        "Profile",
        "Deviations from each reference line over the position.",
    );
    profile
        .entries
        .push(Entry::nominal("position", &result["profile"]["x"], "mm")?);
    for (key, name) in LINES {
        if let Some(line) = of(key) {
            let (width, slope) = (&line["error"]["value"], &line["slope"]["value"]);
            deviations
                .entries
                .extend(Entry::bare(&format!("straightness, {name}"), width, "um"));
            deviations
                .entries
                .extend(Entry::bare(&format!("slope of the {name}"), slope, "rad"));
        }
        let name = format!("deviation from the {name}");
        profile
            .entries
            .extend(Entry::list(&name, &result["profile"][key], "um"));
    }
    Some(Numbers {
        title: "Straightness".to_owned(),
        method: "Deviations of a measured profile from its reference lines.".to_owned(),
        groups: vec![deviations, profile],
        left: left(&[("uncertainties", "a profile alone does not tell them")]),
        ..Numbers::default()
    })
}
