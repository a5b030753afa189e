//! What the answer holds: JSON, folder, sentences, and what it says of readings that tell nothing.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::{json, readings, run, simulated, wide};

#[test]
fn json_is_what_the_documentation_says() {
    let page =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/json/reversal.md"))
            .unwrap();
    let mut documented = page
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split('`').next())
        .collect::<Vec<_>>();
    documented.sort_unstable();
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    for method in [
        &["--method", "shear"][..],
        &["--method", "rotation"],
        &["--simultaneous"],
    ] {
        let result = json(folder.path(), &[&["reversal", "data.csv"], method].concat());
        let mut keys = result
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect::<Vec<_>>();
        keys.sort_unstable();
        assert_eq!(keys, documented);
        assert_eq!(result["schema"], "errsep.reversal/1");
        assert_eq!(
            result["method"],
            *method.last().unwrap().trim_start_matches("--")
        );
        for tilt in ["alpha", "beta", "gamma"] {
            assert!(
                result["tilts"][tilt]["value"].is_f64() && result["tilts"][tilt]["std"].is_f64()
            );
            assert_eq!(result["tilts"][tilt]["unit"], "rad");
            let expanded = &result["tilts"][tilt]["expanded"];
            assert!(expanded["coverage_factor"].as_f64().unwrap() > 1.95);
            assert_eq!(expanded["coverage_probability"], 0.95);
            assert!(!result["tilts"][tilt]["degrees_of_freedom"].is_null());
        }
        for form in ["M", "M_std", "S_A", "S_A_std", "S_B", "S_B_std"] {
            let length = result["forms"]["x"].as_array().unwrap().len();
            assert_eq!(
                result["forms"][form].as_array().unwrap().len(),
                length,
                "{form}"
            );
        }
        assert!(
            result["closure"]["slope"]["std"].is_f64()
                && result["closure"]["rms"]["value"].is_f64()
        );
        for key in ["rms", "noise", "degrees_of_freedom"] {
            assert!(result["residual"][key].is_f64(), "{key}");
        }
        assert_eq!(result["convergence"]["converged"], true);
        assert!(result["convergence"]["iterations"].is_u64());
    }
}

#[test]
fn the_folder_holds_report_result_and_tables() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    fs::create_dir(folder.path().join("there")).unwrap();
    fs::write(folder.path().join("there/mine.txt"), "kept").unwrap();
    for out in ["new/deep", "there"] {
        let (code, stdout, err) = run(
            folder.path(),
            &["reversal", "data.csv", "--out", out, "--format", "json"],
        );
        assert_eq!(code, Some(0), "{err}");
        let place = folder.path().join(out);
        assert_eq!(
            fs::read_to_string(place.join("result.json")).unwrap(),
            stdout
        );
        let page = fs::read_to_string(place.join("report.html")).unwrap();
        assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<svg"));
        let result: Value = serde_json::from_str(&stdout).unwrap();
        let hash = result["provenance"]["inputs"][0]["sha256"]
            .as_str()
            .unwrap();
        assert!(hash.len() == 64 && page.contains(hash));
        let profiles = fs::read_to_string(place.join("profiles.csv")).unwrap();
        let mut lines = profiles.lines();
        assert_eq!(
            lines.next(),
            Some("x_mm,M_um,M_std_um,S_A_um,S_A_std_um,S_B_um,S_B_std_um")
        );
        // Numbers are written so that they read back the same.
        let first = lines
            .next()
            .unwrap()
            .split(',')
            .map(|v| v.parse::<f64>().unwrap())
            .collect::<Vec<_>>();
        let in_json = result["forms"]["M"][0].as_f64().unwrap();
        // Epsilons: the reader of JSON used here is good to one rounding.
        assert!((first[1] - in_json).abs() <= f64::EPSILON * in_json.abs());
        assert_eq!(lines.count() + 1, readings().len());
    }
    assert_eq!(
        fs::read_to_string(folder.path().join("there/mine.txt")).unwrap(),
        "kept"
    );
    let left = fs::read_dir(folder.path().join("there")).unwrap().count();
    assert_eq!(
        left, 6,
        "mine, report, result and three tables, nothing temporary"
    );
}

#[test]
fn help_has_an_example() {
    let folder = TempDir::new().unwrap();
    for command in ["reversal", "straightness", "traces"] {
        let (code, text, _) = run(folder.path(), &[command, "--help"]);
        assert_eq!(code, Some(0));
        assert!(
            text.contains(&format!("errsep {command} ")) && text.contains("Example"),
            "{text}"
        );
    }
}

/// The angle stands with its value in seconds of arc, the expanded uncertainty by itself.
#[test]
fn seconds_of_arc_belong_to_the_value() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--seed", "5"]);
    for method in [&[][..], &["--simultaneous"]] {
        let (_, text, _) = run(folder.path(), &[&["reversal", "data.csv"], method].concat());
        let line = text.lines().find(|l| l.starts_with("  alpha")).unwrap();
        let (value, expanded) = line.split_once(", U = ").unwrap();
        // 40 µrad are 8.25″.
        assert!(value.ends_with("″)") && value.contains("(8."), "{line}");
        assert!(!expanded.contains('″'), "{line}");
    }
}

#[test]
fn more_knots_than_readings_carry_are_refused_at_once() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--seed", "3"]);
    for knots in ["59", "86", "20000", "100000000", "4294967295"] {
        let setup = format!("[model]\nknots = {knots}\n");
        fs::write(folder.path().join("k.toml"), setup).unwrap();
        let args = [
            "reversal",
            "data.csv",
            "--setup",
            "k.toml",
            "--simultaneous",
        ];
        let (code, out, err) = run(folder.path(), &args);
        assert_eq!(code, Some(1), "{err}");
        assert!(out.is_empty());
        assert!(
            err.contains("at most 58") && err.contains("leave them out"),
            "{err}"
        );
    }
}

#[test]
fn an_indicator_that_stands_still_is_told() {
    let folder = TempDir::new().unwrap();
    let mut still = "x,1A,1B,2A,2B\n".to_owned();
    for k in 0..20 {
        still += &format!("{},1.5,1.5,1.5,1.5\n", 5 * k);
    }
    fs::write(folder.path().join("still.csv"), still).unwrap();
    for method in [&[][..], &["--simultaneous"]] {
        let args = [&["reversal", "still.csv"], method].concat();
        let (code, text, err) = run(folder.path(), &args);
        assert_eq!(code, Some(0), "{err}");
        assert!(
            text.contains("all readings of 1A, 1B, 2A, 2B are equal"),
            "{text}"
        );
        assert!(!text.contains("Noise of one reading: 1"), "{text}");
        // In place of a tilt of 0 ± 0.
        assert!(
            text.contains("All readings are equal, which tells neither tilt nor form"),
            "{text}"
        );
        assert!(
            !text.contains("The slide is") && !text.contains("the slide runs"),
            "{text}"
        );
    }
}

/// A thickness that is fitted is in the answer for programs as in that for people; kind: k·u.
#[test]
fn a_fitted_thickness_is_in_the_answer() {
    let folder = TempDir::new().unwrap();
    let words = "simulate reversal --alpha 60000 --thickness 42 --noise 0.02 --seed 7";
    let (code, made, err) = run(folder.path(), &words.split(' ').collect::<Vec<_>>());
    assert_eq!(code, Some(0), "{err}");
    fs::write(folder.path().join("data.csv"), made).unwrap();
    let setup = "[artefact]\nthickness = 40.0\nfit_thickness = true\n";
    fs::write(folder.path().join("s.toml"), setup).unwrap();
    let fit = [
        "reversal",
        "data.csv",
        "--simultaneous",
        "--setup",
        "s.toml",
    ];
    let answer = json(folder.path(), &fit);
    let found = &answer["thickness"];
    let of = |key: &str| found[key].as_f64().unwrap();
    assert_eq!(
        (&found["unit"], &found["label"]),
        (&"mm".into(), &"thickness".into())
    );
    assert!((of("value") - 42.0).abs() < 4.0 * of("std"), "{found}");
    assert!(of("std") < 5.0 && found["expanded"]["lower"].as_f64().unwrap() < of("value"));
    // What is known is not fitted.
    fs::write(
        folder.path().join("s.toml"),
        "[artefact]\nthickness = 42.0\n",
    )
    .unwrap();
    assert!(json(folder.path(), &fit)["thickness"].is_null());
    assert!(json(folder.path(), &["reversal", "data.csv"])["thickness"].is_null());
}
