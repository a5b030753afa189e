//! A circle through points.

use serde_json::Value;

use super::{Entry, Group, Numbers, left};

pub fn read(result: &Value) -> Option<Numbers> {
    let fit = &result["fit"];
    let mut circle = Group::new("Circle of least squares", "");
    for (key, name) in [
        ("radius", "radius"),
        ("centre_x", "centre, x"),
        ("centre_y", "centre, y"),
    ] {
        let quantity = &fit[key];
        circle
            .entries
            .extend(Entry::quantity(name, quantity, &quantity["expanded"]));
    }
    if fit["neighbours_alike"]["form"] == true {
        circle.about =
            "Neighbouring points deviate alike: the deviations hold form, which the uncertainties do not count."
                .to_owned();
    }
    circle.entries.extend(Entry::bare(
        "standard deviation of a point",
        &fit["noise"]["value"],
        "um",
    ));
    let mut circularity = Group::new(
        "Circularity",
        "Roundness deviation from each reference circle.",
    );
    for found in result["circularity"].as_array()? {
        let name = format!("circularity {}", found["reference"].as_str()?);
        circularity
            .entries
            .extend(Entry::bare(&name, &found["deviation"]["value"], "um"));
    }
    Some(Numbers {
        title: "Circle through measured points".to_owned(),
        method: "Circle of least squared distances from the points.".to_owned(),
        groups: vec![circle, circularity],
        left: left(&[
            (
                "covariance",
                "the format has it for lists of one unit alone, and a certificate of a circle states its uncertainties",
            ),
            (
                "circles of algebraic fits",
                "they are starts of the fit and no results",
            ),
            (
                "reference circles",
                "centres and radii have no uncertainty; their deviations are stated",
            ),
            ("residuals", "they are of the readings, not of the item"),
        ]),
        ..Numbers::default()
    })
}
