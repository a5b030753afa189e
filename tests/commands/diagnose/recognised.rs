//! Every model is recognised by its readings, and its effect named.

use serde_json::Value;

use super::{diagnosed, effects};
use crate::command::{Folder, bad_input, documented, run};

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

/// A line with sets is no circle.
#[test]
fn a_calibration_with_sets_is_recognised() {
    let answer = diagnosed(&["calibration-line"], "# nothing stated\n", &[]);
    assert_eq!(answer["model"], "calibration line");
}
