//! `errsep diagnose` recognises the model, and `errsep simulate --effect` switches its effects on.

mod command;

use command::{Folder, bad_input, documented, run};
use serde_json::Value;

/// Simulates, diagnoses and gives the answer.
fn diagnosed(simulate: &[&str], setup: &str, options: &[&str]) -> Value {
    let folder = Folder::with(&[("s.toml", setup)]);
    let mut arguments = vec!["simulate"];
    arguments.extend(simulate);
    let made = run(&folder, &arguments);
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write("d.csv", &made.stdout);
    let mut arguments = vec!["diagnose", "d.csv", "--setup", "s.toml", "--format", "json"];
    arguments.extend(options);
    let out = run(&folder, &arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn effects(answer: &Value) -> Vec<&str> {
    let named = answer["verdict"]["effects"].as_array().unwrap();
    named.iter().map(|e| e.as_str().unwrap()).collect()
}

#[test]
fn every_model_is_recognised_and_its_effect_named() {
    for (kind, setup, effect, model, name) in [
        (
            "calibration-line",
            "[line]\nnoise = 1e-3\n",
            "quadratic=0.05",
            "calibration line",
            "quadratic",
        ),
        (
            "circle",
            "[circle]\nnoise = 1.0\n",
            "lobes=6",
            "circle",
            "lobes",
        ),
        (
            "four-sensor",
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n",
            "gain=0.05",
            "four-sensor",
            "gain",
        ),
        (
            "fourier",
            "[section]\nlength = 100.0\n[probe]\nnoise = 2.0\n",
            "height-difference=30",
            "fourier",
            "height-difference",
        ),
        (
            "step-diagonal",
            "[test]\nnoise = 0.2\n",
            "mirror-misalignment=1e-4",
            "step-diagonal",
            "mirror-misalignment",
        ),
    ] {
        let mut arguments = vec![kind, "--effect", effect];
        if kind == "fourier" {
            arguments.extend(["--samples", "100"]);
        }
        let answer = diagnosed(&arguments, setup, &[]);
        assert_eq!(answer["model"], model);
        assert_eq!(
            effects(&answer),
            [name],
            "{kind}: {}",
            answer["verdict"]["statement"]
        );
        documented(&answer, "docs/json/diagnosis.md");
    }
}

#[test]
fn parts_need_the_machine_and_the_points() {
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.0, -0.02]\n";
    let points = "point,x,y\n1,10,10\n2,140,10\n3,140,130\n";
    let parts = "part,point,axis,replicate,value\n1,1,x,1,0.1\n";
    let folder = Folder::with(&[("m.toml", machine), ("p.csv", points), ("d.csv", parts)]);
    bad_input(&folder, &["diagnose", "d.csv"], &["--setup"]);
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--setup", "m.toml"],
        &["--points"],
    );
    let simulated = run(
        &folder,
        &[
            "simulate",
            "machine",
            "m.toml",
            "--points",
            "p.csv",
            "--effect",
            "squareness-change=3e-5",
            "--out",
            "made",
        ],
    );
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    let out = run(
        &folder,
        &[
            "diagnose",
            "made/parts.csv",
            "--setup",
            "m.toml",
            "--points",
            "p.csv",
            "--format",
            "json",
            "--out",
            "report",
        ],
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(
        effects(&answer),
        ["squareness-change"],
        "{}",
        answer["verdict"]["statement"]
    );
    // Rows of the maps are parts.
    assert!(folder.read("report/report.html").contains("part  21"));
}

#[test]
fn what_cannot_be_told_is_asked_for() {
    let folder = Folder::with(&[
        ("c.csv", "x,y\n1,0\n0,1\n-1,0\n0,-1\n0.7,0.7\n"),
        ("u.csv", "a,b\n1,2\n"),
    ]);
    bad_input(
        &folder,
        &["diagnose", "c.csv"],
        &["calibration-line and circle", "--model circle"],
    );
    bad_input(
        &folder,
        &["diagnose", "u.csv"],
        &["no model", "--model", "reversal"],
    );
    bad_input(
        &folder,
        &["diagnose", "c.csv", "--model", "square"],
        &["step-diagonal"],
    );
    for (kind, near) in [
        ("circle", "ovality"),
        ("calibration-line", "quadratic"),
        ("four-sensor", "sensor-position"),
        ("fourier", "probe-spacing"),
        ("step-diagonal", "dead-path"),
    ] {
        let misspelt = format!("{}x=1", &near[..near.len() - 1]);
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &misspelt],
            &["did you mean", near],
        );
        bad_input(
            &folder,
            &["simulate", kind, "--effect", near],
            &["NAME=VALUE"],
        );
        let wordy = format!("{near}=much");
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &wordy],
            &["`much` is not a number"],
        );
    }
}

#[test]
fn one_effect_may_be_withheld_by_name_only() {
    let folder = Folder::with(&[]);
    let made = run(&folder, &["simulate", "circle", "--effect", "lobes=8"]);
    folder.write("d.csv", &made.stdout);
    bad_input(
        &folder,
        &[
            "diagnose",
            "d.csv",
            "--model",
            "circle",
            "--without",
            "lobe",
        ],
        &["no effect `lobe`", "lobes"],
    );
    let out = run(
        &folder,
        &[
            "diagnose",
            "d.csv",
            "--model",
            "circle",
            "--without",
            "lobes",
            "--format",
            "json",
        ],
    );
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(answer["verdict"]["kind"], "unknown");
}
