//! What is stated beside the readings, the noise and a slope, and how sure it is; what is refused.

use serde_json::Value;

use super::{PLANE, component, json};
use crate::command::{Folder, bad_input, run};

#[test]
fn noise_found_from_the_readings_widens_the_coverage_factor() {
    let folder = Folder::with(&[]);
    folder.write("plane.csv", &run(&folder, &PLANE).stdout);
    let answer = json(&folder, &["step-diagonal", "plane.csv", "--format", "json"]);
    let degrees = answer["degrees_of_freedom"].as_u64().unwrap();
    assert_eq!(
        answer["uncertainty"]["degrees_of_freedom"].as_f64(),
        Some(degrees as f64)
    );
    assert_eq!(degrees, 12);
    // Tolerance: digits in print, GUM table G.2 for 12 degrees of freedom and 95 %.
    let k = answer["uncertainty"]["coverage_factor"].as_f64().unwrap();
    assert!((k - 2.18).abs() < 0.005, "{k}");
}

#[test]
fn a_slope_known_from_few_measurements_widens_what_rests_on_it() {
    let folder = Folder::with(&[]);
    folder.write("plane.csv", &run(&folder, &PLANE).stdout);
    let slope = |degrees: &str| {
        folder.write(
            "s.toml",
            &format!(
                "[assume]\nzero = [\"ECX\"]\n[[measured]]\naxis = \"X\"\nslope = 0\nstd = 1e-3\n{degrees}"
            ),
        );
        let answer = json(
            &folder,
            &[
                "step-diagonal",
                "plane.csv",
                "--setup",
                "s.toml",
                "--format",
                "json",
            ],
        );
        let x = component(&answer, "EXX");
        let at = |key: &str| x[key][4].as_f64();
        at("expanded_uncertainty").unwrap() / at("std").unwrap()
    };
    // Tolerance: digits in print, GUM table G.2 for 4 and infinitely many degrees of freedom.
    assert!((slope("degrees_of_freedom = 4\n") - 2.78).abs() < 0.005);
    assert!((slope("") - 1.96).abs() < 0.005);
}

/// How well a slope is known changes no rank, and each of what it settles by as much as it must.
#[test]
fn a_slope_of_any_uncertainty_is_used_as_it_is() {
    let folder = Folder::with(&[]);
    let simulate = ["simulate", "step-diagonal", "--steps", "2"];
    folder.write("d.csv", &run(&folder, &simulate).stdout);
    let answer = |std: &str| {
        let setup = format!("[[measured]]\naxis = \"X\"\nslope = 0.004\nstd = {std}\n");
        folder.write("s.toml", &setup);
        json(
            &folder,
            &[
                "step-diagonal",
                "d.csv",
                "--setup",
                "s.toml",
                "--format",
                "json",
            ],
        )
    };
    let usual = answer("5e-4");
    for std in ["1e-12", "1e-9", "1e3"] {
        let found = answer(std);
        assert_eq!(found["rank"], usual["rank"], "{std}");
        assert_eq!(
            found["degrees_of_freedom"], usual["degrees_of_freedom"],
            "{std}"
        );
        let end = |answer: &Value, what: &str| component(answer, "EXX")[what][2].as_f64().unwrap();
        // The far end of EXX rests on the slope alone: travel times the slope, and its uncertainty.
        let expected = 600.0 * std.parse::<f64>().unwrap();
        // epsilons through the condition of the readings
        assert!((end(&found, "value") / 2.4 - 1.0).abs() < 1e-9, "{std}");
        assert!((end(&found, "std") / expected - 1.0).abs() < 1e-9, "{std}");
        // What the readings alone determine stays as it is.
        let other = |answer: &Value| component(answer, "EBY")["std"][2].as_f64().unwrap();
        assert!((other(&found) / other(&usual) - 1.0).abs() < 1e-9, "{std}");
    }
    for std in ["1e-200", "1e-60", "1e60"] {
        let setup = format!("[[measured]]\naxis = \"X\"\nslope = 0.004\nstd = {std}\n");
        folder.write("s.toml", &setup);
        bad_input(
            &folder,
            &[
                "step-diagonal",
                "d.csv",
                "--setup",
                "s.toml",
                "--out",
                "out",
            ],
            &["standard uncertainty of the measured positioning slope of X"],
        );
    }
}

#[test]
fn a_stated_noise_is_held_against_the_residuals() {
    let folder = Folder::with(&[
        ("right.toml", "[test]\nnoise = 0.1\n"),
        ("small.toml", "[test]\nnoise = 0.01\n"),
    ]);
    for seed in 1..=20 {
        let seed = seed.to_string();
        let made = run(&folder, &[&PLANE[..], &["--seed", &seed]].concat());
        folder.write("plane.csv", &made.stdout);
        let args = [
            "step-diagonal",
            "plane.csv",
            "--setup",
            "right.toml",
            "--format",
            "json",
        ];
        let answer = json(&folder, &args);
        assert!(
            answer["disagreement"].is_null(),
            "{seed}: {}",
            answer["disagreement"]
        );
    }
    let args = [
        "step-diagonal",
        "plane.csv",
        "--setup",
        "small.toml",
        "--out",
        "out",
    ];
    let told = run(&folder, &args).stdout;
    let page = folder.read("out/report.html");
    for said in [&told, &page] {
        assert!(
            said.contains("the set-up states 0.0100 µm: the uncertainties are too small"),
            "{said}"
        );
    }
    let answer: Value = serde_json::from_str(&folder.read("out/result.json")).unwrap();
    crate::command::documented(&answer, "docs/json/step-diagonal.md");
    let observed = answer["disagreement"]["observed"].as_f64().unwrap();
    assert!((0.05..0.2).contains(&observed), "{observed}");
}

#[test]
fn bad_readings_are_refused() {
    let header = "diagonal,sequence,x,y,z,reading\n";
    let good = "AG,XYZ,0,0,0,0\nAG,XYZ,100,0,0,1\nAG,XYZ,100,100,0,1\nAG,XYZ,100,100,100,2\n";
    for (name, rows, expected) in [
        (
            "letter.csv",
            "AB,XYZ,0,0,0,0\n".to_owned(),
            "diagonal \"AB\"",
        ),
        (
            "order.csv",
            "AG,XXZ,0,0,0,0\n".to_owned(),
            "sequence \"XXZ\"",
        ),
        ("text.csv", "AG,XYZ,0,0,0,none\n".to_owned(), "not a number"),
        ("none.csv", String::new(), "no row"),
        ("point.csv", "AG,XYZ,0,0,0,0\n".to_owned(), "makes no grid"),
        (
            "path.csv",
            good.replace("100,0,0,1", "0,100,0,1"),
            "path.csv:3:1: position [0, 1, 0] (in steps) is no stop of diagonal AG",
        ),
        (
            "twice.csv",
            format!("{good}AG,XYZ,0,0,0,0\n"),
            "twice.csv:6:1: it repeats a stop",
        ),
        (
            "unit.csv",
            good.replace("100", "1e155"),
            "the travel of X is 1e155 mm",
        ),
        (
            "uneven.csv",
            format!("{good}AG,XYZ,30,100,100,0\n"),
            "even steps",
        ),
    ] {
        let folder = Folder::with(&[(name, &format!("{header}{rows}"))]);
        bad_input(
            &folder,
            &["step-diagonal", name, "--out", "out"],
            &[name, expected],
        );
    }
    let way = "diagonal,sequence,direction,x,y,z,reading\nAG,XYZ,back,0,0,0,0\n";
    let folder = Folder::with(&[("way.csv", way)]);
    bad_input(
        &folder,
        &["step-diagonal", "way.csv", "--out", "out"],
        &["way.csv:2:8", "direction \"back\"", "forward or backward"],
    );
    let folder = Folder::with(&[
        ("d.csv", &format!("{header}{good}")),
        ("zero.toml", "[assume]\nzero = [\"EXQ\"]\n"),
        ("key.toml", "[test]\ntraget = \"mirror\"\n"),
        (
            "std.toml",
            "[[measured]]\naxis = \"X\"\nslope = 0.0\nstd = 0.0\n",
        ),
        (
            "slope.toml",
            "[[measured]]\naxis = \"X\"\nslope = nan\nstd = 0.1\n",
        ),
        ("zero_noise.toml", "[test]\nnoise = 0\n"),
        ("less.toml", "[test]\nnoise = -1\n"),
        ("none.toml", "[test]\nnoise = nan\n"),
        ("endless.toml", "[test]\nnoise = inf\n"),
    ]);
    let with = |setup: &'static str| ["step-diagonal", "d.csv", "--out", "out", "--setup", setup];
    bad_input(&folder, &with("zero.toml"), &["zero.toml:2", "EXQ"]);
    bad_input(&folder, &with("key.toml"), &["did you mean `target`"]);
    bad_input(
        &folder,
        &with("std.toml"),
        &["std.toml:4:7", "standard uncertainty"],
    );
    bad_input(&folder, &with("slope.toml"), &["slope.toml:3:9", "NaN"]);
    for (setup, noise) in [
        ("zero_noise.toml", "0"),
        ("less.toml", "-1"),
        ("none.toml", "NaN"),
        ("endless.toml", "inf"),
    ] {
        let place = format!("{setup}:2:9: the noise of a reading is {noise}");
        bad_input(&folder, &with(setup), &[&place]);
    }
    bad_input(
        &folder,
        &["simulate", "step-diagonal", "--steps", "0"],
        &["at least one step"],
    );
}
