//! Tilts, straightness and forms of a reversal.

use serde_json::Value;

use super::{Coverage, Entry, Group, Numbers, left};

const METHOD: &str = "Reversal: a straightedge or test bar read from both sides and in turned spindle positions; tilts and forms are \
                      separated by least squares.";

/// Four channels.
pub fn read(result: &Value) -> Option<Numbers> {
    // Every quantity of such a result but the slope of the closure has the degrees of freedom of the noise.
    let coverage = tilts(result)
        .next()
        .and_then(|(_, tilt)| Coverage::of(tilt));
    let mut straightness = Group::new("Straightness deviation", "");
    for (form, widths) in result["straightness"].as_object().into_iter().flatten() {
        for (line, width) in widths.as_object().into_iter().flatten() {
            let name = format!("straightness of {form}, {}", line.replace('_', " "));
            straightness.entries.extend(Entry::bare(&name, width, "um"));
        }
    }
    let forms = &result["forms"];
    let names = ["M", "S_A", "S_B"]
        .map(|name| (name.to_owned(), &forms[name], &forms[format!("{name}_std")]));
    let mut numbers = whole(result, &names, coverage)?;
    numbers.groups.push(straightness);
    Some(numbers)
}

/// Other designs, whose uncertainties have degrees of freedom of their own.
pub fn read_designs(result: &Value) -> Option<Numbers> {
    let forms = &result["forms"];
    let mut names: Vec<(String, &Value, &Value)> = ["M_h", "M_v"]
        .map(|name| (name.to_owned(), &forms[name], &forms[format!("{name}_std")]))
        .into();
    for (side, values) in forms["S"].as_object().into_iter().flatten() {
        names.push((format!("S at {side}°"), values, &forms["S_std"][side]));
    }
    let mut numbers = whole(result, &names, one_noise(result))?;
    let told = result["eccentricity"].as_object().into_iter().flatten();
    let mut eccentricity = Group::new("Eccentricity and zeros", "");
    eccentricity.entries = told
        .filter_map(|(name, value)| Entry::quantity(name, value, &value["expanded"]))
        .collect();
    numbers.groups.push(eccentricity);
    Some(numbers)
}

/// Tilts and what is determined together, with their names; not those that the channels do not tell.
fn tilts(result: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let single = result["tilts"].as_object().into_iter().flatten();
    let single = single.map(|(name, tilt)| (name.as_str(), tilt));
    let together = result["tilt_combinations"].as_array().into_iter().flatten();
    let together = together.map(|tilt| (tilt["name"].as_str().unwrap_or_default(), tilt));
    single.chain(together).filter(|(_, tilt)| !tilt.is_null())
}

/// The coverage that every number has where one noise, alike in all channels, is behind all of them.
fn one_noise(result: &Value) -> Option<Coverage> {
    let residual = &result["residual"];
    let mut noises = residual["channel_noise"].as_object()?.values();
    let first = noises.next()?;
    let alike = residual["noise_law"].is_null() && noises.all(|noise| noise == first);
    let coverage = tilts(result)
        .next()
        .and_then(|(_, tilt)| Coverage::of(tilt))?;
    let same = tilts(result).all(|(_, tilt)| Coverage::of(tilt) == Some(coverage));
    (alike && same).then_some(coverage)
}

fn whole(
    result: &Value,
    names: &[(String, &Value, &Value)],
    coverage: Option<Coverage>,
) -> Option<Numbers> {
    let mut angles = Group::new("Tilts", "");
    angles.entries = tilts(result)
        .filter_map(|(name, tilt)| Entry::quantity(name, tilt, &tilt["expanded"]))
        .collect();
    let about = "Deviations without their straight-line part over the position.";
    let mut forms = Group::new("Forms", about);
    forms
        .entries
        .push(Entry::nominal("position", &result["forms"]["x"], "mm")?);
    for (name, values, std) in names {
        let name = format!("form {name}");
        forms
            .entries
            .extend(Entry::with_std(&name, (*values, *std), "um", coverage));
    }
    for form in result["form_combinations"].as_array().into_iter().flatten() {
        let name = format!("form {}", form["name"].as_str()?);
        let lists = (&form["values"], &form["std"]);
        forms
            .entries
            .extend(Entry::with_std(&name, lists, "um", coverage));
    }
    if forms.entries.len() == 1 {
        forms.entries.clear();
    }
    let mut not_stated = left(&[(
        "closure, residuals, noise",
        "they are of the readings, not of the item",
    )]);
    let not_told = result["tilts"].as_object().into_iter().flatten();
    let not_told = not_told.filter(|(_, tilt)| tilt.is_null());
    let why = "the channels do not determine it by itself";
    not_stated.extend(not_told.map(|(name, _)| (name.clone(), why.to_owned())));
    let effects = result["effects"].as_array().into_iter().flatten();
    let why = "an effect of the measurement, fitted along";
    not_stated
        .extend(effects.filter_map(|e| Some((e["effect"].as_str()?.to_owned(), why.to_owned()))));
    Some(Numbers {
        title: "Tilts and forms by reversal".to_owned(),
        method: METHOD.to_owned(),
        groups: vec![angles, forms],
        left: not_stated,
        ..Numbers::default()
    })
}
