//! `errsep plan` of one design: sizes, rivals, and what more measurements are worth.

use serde_json::Value;

use crate::command::{Folder, run};

/// What a plan says holds in itself: nothing is seen, told apart or imitated at a size that is not
/// plausible, more repeats show smaller sizes, and no unit is left in the programs' spelling.
#[test]
fn a_plan_names_only_sizes_and_rivals_that_are_plausible() {
    let plan = "noise = 0.02\ntravel = 300.0\npositions = 61\nrepeats = 2\n";
    let folder = Folder::with(&[("p.toml", plan)]);
    let out = run(&folder, &["plan", "p.toml", "--format", "json"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    let of = |name: &str| {
        let effects = answer["effects"].as_array().unwrap();
        effects.iter().find(|e| e["effect"] == name).unwrap()
    };
    // At tilts of 50 µrad a thickness shows only at metres; lost motion not at all one way.
    assert!(of("thickness-shift")["detectable"].is_null());
    assert!(of("axis-backlash")["detectable"].is_null());
    assert!(of("taper")["detectable"].as_f64().unwrap() < 1e-6);
    for effect in answer["effects"].as_array().unwrap() {
        assert_ne!(effect["confused_with"], "thickness-shift", "{effect}");
        let (seen, told) = (
            effect["detectable"].as_f64(),
            effect["identifiable"].as_f64(),
        );
        assert!(told.is_none() || told >= seen, "{effect}");
    }
    let extra = answer["extra_measurements"].as_array().unwrap();
    let repeats = extra
        .iter()
        .find(|e| e["measure"] == "take twice the repeats")
        .unwrap();
    // Noise averages: √2, but for thresholds that hang on the number of draws.
    let gain = repeats["gain"].as_f64().unwrap();
    assert!((gain / 2f64.sqrt() - 1.0).abs() < 0.15, "{gain}");
    let text = run(&folder, &["plan", "p.toml"]).stdout;
    // Wide chips pass for form, narrow ones do not: their sizes differ.
    assert!(
        text.contains("local-contamination: in some shapes from "),
        "{text}"
    );
    assert!(!text.contains(" um") && !text.contains("urad"), "{text}");
}

/// *Limit*: noise averages, also beyond the positions that are gathered into as many readings of the diagnosis as before: √2,
/// but for thresholds that hang on the number of draws, and for effects that act at single positions.
#[test]
fn twice_the_positions_of_a_long_plan_show_smaller_sizes() {
    let plan = "noise = 0.02\ntravel = 300.0\npositions = 701\n";
    let folder = Folder::with(&[("p.toml", plan)]);
    let out = run(&folder, &["plan", "p.toml", "--format", "json"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    let extra = answer["extra_measurements"].as_array().unwrap();
    let positions = (extra.iter()).find(|e| e["measure"] == "read twice the positions");
    let gain = positions.unwrap()["gain"].as_f64().unwrap();
    assert!((gain / 2f64.sqrt() - 1.0).abs() < 0.15, "{gain}");
}
