//! What no effect explains is learnt from one campaign and tested on another.

use crate::command::{Folder, bad_input, documented, run};
use serde_json::Value;

/// A calibration line with a dent that no effect of the catalogue has.
fn campaign(folder: &Folder, name: &str, seed: &str, dent: impl Fn(f64) -> f64) {
    let made = run(
        folder,
        &[
            "simulate",
            "calibration-line",
            "--sets",
            "6",
            "--seed",
            seed,
        ],
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    let dented = made.stdout.lines().map(|line| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(x) = fields[0].parse::<f64>() {
            let y: f64 = fields[1].parse().unwrap();
            fields[1] = (y + dent(x)).to_string();
        }
        fields.join(",")
    });
    folder.write(name, &dented.collect::<Vec<_>>().join("\n"));
}

fn smooth(x: f64) -> f64 {
    0.008 * (-((x - 4.0) / 1.6).powi(2)).exp()
}

fn diagnose(folder: &Folder, more: &[&str]) -> Value {
    let line = [
        "diagnose",
        "--model",
        "calibration-line",
        "--format",
        "json",
    ];
    let out = run(folder, &[&line[..], more].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

/// The learnt effect is bound to what made it, explains another campaign at its own size, and is named there.
#[test]
fn a_gap_is_learnt_and_found_again() {
    let folder = Folder::with(&[]);
    campaign(&folder, "monday.csv", "1", smooth);
    campaign(&folder, "friday.csv", "2", smooth);
    let answer = diagnose(&folder, &["monday.csv", "--learn", "coolant.toml"]);
    documented(&answer, "docs/json/diagnosis.md");
    let learnt = &answer["learnt"];
    assert_eq!(learnt["effect"], "coolant");
    assert_eq!(learnt["along"], "position", "{learnt}");
    let file = folder.read("coolant.toml");
    for what in [
        "along = \"position\"",
        "file = \"monday.csv\"",
        "repeats = [1, 2, 3, 4, 5, 6]",
        "[[effect.curve]]",
    ] {
        assert!(file.contains(what), "{what} is not in\n{file}");
    }
    let other = diagnose(&folder, &["friday.csv", "--effects", "coolant.toml"]);
    documented(&other, "docs/json/diagnosis.md");
    assert_eq!(
        other["verdict"]["effects"][0], "coolant",
        "{}",
        other["verdict"]
    );
    let test = &other["tested"][0];
    let number = |key: &str| test[key].as_f64().unwrap();
    // k·u: three standard uncertainties of the size, which is one.
    assert!(
        (number("size") - 1.0).abs() < 3.0 * number("size_std"),
        "{test}"
    );
    // k·u: what the curve itself is uncertain by is a tenth of the dent at most.
    assert!(
        number("shrink") > 0.7 && number("explained") > 0.9,
        "{test}"
    );
    assert!(
        number("p_value") < 0.05 && number("by_chance") < 0.7,
        "{test}"
    );
    let hash = test["seen"]["sha256"].as_str().unwrap();
    assert!(hash.len() == 64 && file.contains(hash), "{test}");
}

/// The readings that an effect was learnt from are no test of it.
#[test]
fn its_own_readings_are_no_test() {
    let folder = Folder::with(&[]);
    campaign(&folder, "monday.csv", "1", smooth);
    let arguments = ["diagnose", "monday.csv", "--model", "calibration-line"];
    let out = run(
        &folder,
        &[&arguments[..], &["--learn", "own.toml"]].concat(),
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    for what in [
        "Learnt as `own`: a smooth function of position",
        "--effects own.toml",
    ] {
        assert!(out.stdout.contains(what), "{}", out.stdout);
    }
    let again = run(
        &folder,
        &[&arguments[..], &["--effects", "own.toml"]].concat(),
    );
    assert!(
        again.stdout.contains("these very readings"),
        "{}",
        again.stdout
    );
    assert!(
        !again.stdout.contains("drawn by chance"),
        "{}",
        again.stdout
    );
    bad_input(
        &folder,
        &[&arguments[..], &["--learn", "own.toml"]].concat(),
        &["own.toml", "exists already"],
    );
}

/// Only what is unknown is learnt, and only what is smooth: the rest is refused with exit 1, and no file.
#[test]
fn what_cannot_be_learnt_is_refused() {
    let folder = Folder::with(&[]);
    campaign(&folder, "none.csv", "3", |_| 0.0);
    campaign(&folder, "bend.csv", "4", |x| 1e-3 * (x - 5.0).powi(2));
    // Up and down from one load to the next.
    campaign(&folder, "cycle.csv", "5", |x| 0.02 * (x * 5.0).sin());
    for (data, what) in [
        ("none.csv", "there is no gap to learn"),
        ("bend.csv", "--without quadratic"),
        ("cycle.csv", "smooth"),
    ] {
        let line = [
            "diagnose",
            data,
            "--model",
            "calibration-line",
            "--learn",
            "l.toml",
        ];
        let out = run(&folder, &line);
        assert_eq!(out.status, 1, "{data}: {}{}", out.stdout, out.stderr);
        assert!(out.stderr.contains(what), "{data}: {}", out.stderr);
        assert!(!folder.path().join("l.toml").exists());
    }
    let line = ["diagnose", "none.csv", "--model", "calibration-line"];
    let own = [&line[..], &["--learn", "quadratic.toml"]].concat();
    assert_eq!(run(&folder, &own).status, 1);
}

/// A file of curves with a slip is refused where it stands.
#[test]
fn curves_with_a_slip_are_refused() {
    let folder = Folder::with(&[]);
    campaign(&folder, "d.csv", "1", smooth);
    let curve = |points: &str, more: &str| {
        format!("[[effect]]\nname = \"c\"\n{more}[[effect.curve]]\npoints = {points}\n")
    };
    let good = "[[0.0, 0.0, 0.1], [5.0, 1.0, 0.1], [10.0, 0.0, 0.1]]";
    for (text, what) in [
        (curve("[[0.0, 0.0, 0.1]]", ""), "two or more growing points"),
        (
            curve("[[0.0, 0.0, 0.1], [0.0, 1.0, 0.1]]", ""),
            "growing points",
        ),
        (
            curve("[[0.0, nan, 0.1], [5.0, 1.0, 0.1]]", ""),
            "not finite",
        ),
        (
            curve("[[0.0, 0.0, -0.1], [5.0, 1.0, 0.1]]", ""),
            "below zero",
        ),
        (curve(good, "formula = \"x\"\n"), "or curves"),
        (curve(good, "along = \"weather\"\n"), "weather"),
        (
            format!("{}channel = \"1A\"\n", curve(good, "")),
            "no readings",
        ),
        (
            format!("{}open = [[1.0]]\n", curve(good, "")),
            "one value a point",
        ),
    ] {
        folder.write("e.toml", &text);
        let line = [
            "diagnose",
            "d.csv",
            "--model",
            "calibration-line",
            "--effects",
            "e.toml",
        ];
        bad_input(&folder, &line, &["e.toml", what]);
    }
}
