//! What a test determines, what not, and what a further measurement adds.

use serde_json::Value;

use super::{PLANE, component, json};
use crate::command::{Folder, bad_input, run};

#[test]
fn plane_says_what_cannot_be_told_apart() {
    let folder = Folder::with(&[]);
    folder.write("plane.csv", &run(&folder, &PLANE).stdout);
    let answer = json(&folder, &["step-diagonal", "plane.csv", "--format", "json"]);
    assert_eq!(answer["schema"], "errsep.step-diagonal/1");
    assert_eq!(answer["rank"], 20);
    assert_eq!(component(&answer, "ECY")["determined"], "wholly");
    assert_eq!(component(&answer, "ECX")["determined"], "nothing");
    assert_eq!(component(&answer, "EZZ")["determined"], "not-touched");
    let statements: Vec<&str> = answer["ambiguities"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a["statement"].as_str().unwrap())
        .collect();
    assert!(
        statements.contains(
            &"positioning slope of X (EXX), positioning slope of Y (EYY) and mirror misalignment cannot be told apart: measure one slope"
        ),
        "{statements:?}"
    );
    let out = run(&folder, &["step-diagonal", "plane.csv"]);
    assert!(out.stdout.contains("measure one slope"), "{}", out.stdout);
}

#[test]
fn both_targets_and_a_measured_slope_find_the_true_errors() {
    let folder = Folder::with(&[]);
    let arguments = [
        "simulate",
        "step-diagonal",
        "--steps",
        "3",
        "--target",
        "both",
        "--noise",
        "0.05",
        "--seed",
        "5",
    ];
    let made = json(&folder, &[&arguments[..], &["--format", "json"]].concat());
    folder.write("both.csv", &run(&folder, &arguments).stdout);
    let positioning = made["truth"]["functions"]["EXX"][3].as_f64().unwrap();
    folder.write(
        "s.toml",
        &format!(
            "[test]\nnoise = 0.05\n[[measured]]\naxis = \"X\"\nslope = {}\nstd = 1e-5\n",
            positioning / 600.0
        ),
    );
    let answer = json(
        &folder,
        &[
            "step-diagonal",
            "both.csv",
            "--setup",
            "s.toml",
            "--choose",
            "--format",
            "json",
        ],
    );
    let (mut squares, mut count) = (0.0, 0.0);
    for c in answer["components"].as_array().unwrap() {
        if c["determined"] != "wholly" {
            continue;
        }
        let truth = &made["truth"]["functions"][c["name"].as_str().unwrap()];
        for i in 0..4 {
            let std = c["std"][i].as_f64().unwrap();
            if std > 0.0 {
                let error = c["value"][i].as_f64().unwrap() - truth[i].as_f64().unwrap();
                squares += (error / std).powi(2);
                count += 1.0;
            }
        }
    }
    assert!(count >= 30.0, "{count}");
    // Tolerance: k·u of a mean square of correlated values, some 15 independent: 3 √(2/15).
    let mean: f64 = squares / count;
    assert!(mean < 2.1 && mean > 0.1, "{mean} of {count}");
    assert_eq!(answer["sequence_choices"].as_array().unwrap().len(), 6);
    assert_eq!(answer["uncertainty"]["degrees_of_freedom"], "infinite");
    expanded_as_the_guide_has_it(&answer, 1.959_963_984_540_054);
    crate::command::documented(&answer, "docs/json/step-diagonal.md");
}

/// Squareness comes as quantities too, with the coverage factor `k`.
fn expanded_as_the_guide_has_it(answer: &Value, k: f64) {
    // Tolerance: digits of the factors in print (normal distribution; GUM table G.2, two decimals).
    let close = |found: &Value, wanted: f64, relative: f64| {
        let found = found.as_f64().unwrap();
        assert!(
            (found / wanted - 1.0).abs() < relative,
            "{found}, not {wanted}"
        );
    };
    close(&answer["uncertainty"]["coverage_factor"], k, 0.0025);
    let squareness = answer["squareness"].as_array().unwrap();
    let determined: Vec<&Value> = squareness.iter().filter(|s| !s["std"].is_null()).collect();
    assert!(!determined.is_empty(), "{squareness:?}");
    for s in determined {
        let quantities = answer["quantities"].as_array().unwrap();
        let same = quantities.iter().find(|q| q["label"] == s["name"]).unwrap();
        for key in ["value", "std", "unit"] {
            assert_eq!(same[key], s[key], "{key}");
        }
        let expanded = k * s["std"].as_f64().unwrap();
        close(&same["expanded"]["expanded_uncertainty"], expanded, 0.0025);
    }
}

#[test]
fn the_way_back_gives_the_reversals() {
    let folder = Folder::with(&[]);
    let arguments = [
        "simulate",
        "step-diagonal",
        "--steps",
        "3",
        "--backward",
        "--noise",
        "0.05",
    ];
    let made = json(&folder, &[&arguments[..], &["--format", "json"]].concat());
    folder.write("back.csv", &run(&folder, &arguments).stdout);
    let answer = json(&folder, &["step-diagonal", "back.csv", "--format", "json"]);
    let reversals = answer["reversals"].as_array().unwrap();
    assert_eq!(reversals.len(), 18);
    let yaw = reversals.iter().find(|c| c["name"] == "EBY").unwrap();
    assert_eq!(yaw["determined"], "wholly");
    for i in 0..4 {
        let truth = made["truth"]["reversals"]["EBY"][i].as_f64().unwrap();
        let (value, u) = (&yaw["value"][i], &yaw["expanded_uncertainty"][i]);
        // k·u: five standard uncertainties and more; the coverage is the library's test.
        let error = value.as_f64().unwrap() - truth;
        assert!(error.abs() < 2.5 * u.as_f64().unwrap(), "{i}: {error} {u}");
    }
    let motions: Vec<&str> = answer["closed_forms"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|f| f["equation"] == "(35)")
        .map(|f| f["motion"].as_str().unwrap())
        .collect();
    assert_eq!(motions, ["either", "positive", "negative"]);
    assert!(answer["diagonals"][0]["reversal"]["value"].is_number());
    crate::command::documented(&answer, "docs/json/step-diagonal.md");
    let out = run(&folder, &["step-diagonal", "back.csv", "--out", "out"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        out.stdout.contains("forward less backward"),
        "{}",
        out.stdout
    );
    assert!(out.stdout.contains("(k = "), "{}", out.stdout);
    assert!(
        folder
            .read("out/report.html")
            .contains("reversal of yaw of Y")
    );
    assert!(folder.read("out/components.csv").contains("EBY reversal"));
    assert!(folder.read("out/residuals.csv").contains("backward"));
    bad_input(
        &Folder::with(&[]),
        &["simulate", "step-diagonal", "--reversal", "1"],
        &["--both-directions"],
    );
}

#[test]
fn report_shows_errors_and_ambiguities() {
    let folder = Folder::with(&[]);
    folder.write("plane.csv", &run(&folder, &PLANE).stdout);
    let out = run(&folder, &["step-diagonal", "plane.csv", "--out", "out"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let page = folder.read("out/report.html");
    for part in [
        "<svg",
        "yaw of Y",
        "yaw of X (ECX)",
        "cannot be told apart",
        "two face diagonals",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(folder.read("out/components.csv").contains("ECY"));
    assert!(folder.read("out/residuals.csv").lines().count() > 30);
}

/// Readings times a power of two: everything else too, also where squares leave the range of numbers.
#[test]
fn the_size_of_the_readings_does_not_matter() {
    let folder = Folder::with(&[]);
    let simulate = ["simulate", "step-diagonal", "--steps", "2"];
    let readings = run(&folder, &simulate).stdout;
    let answer = |factor: f64| {
        let scaled: Vec<String> = readings
            .lines()
            .map(|line| match line.rsplit_once(',') {
                Some((rest, value)) => match value.parse::<f64>() {
                    Ok(value) => format!("{rest},{:e}", factor * value),
                    Err(_) => line.to_owned(),
                },
                None => line.to_owned(),
            })
            .collect();
        folder.write("d.csv", &(scaled.join("\n") + "\n"));
        json(&folder, &["step-diagonal", "d.csv", "--format", "json"])
    };
    let usual = answer(1.0);
    let noise = |answer: &Value| answer["noise"]["value"].as_f64().unwrap();
    for factor in [2f64.powi(-600), 2f64.powi(515)] {
        let found = answer(factor);
        assert_eq!(found["rank"], usual["rank"]);
        // epsilons
        assert!((noise(&found) / factor / noise(&usual) - 1.0).abs() < 1e-12);
    }
}
