//! `errsep step-diagonal` and `errsep simulate step-diagonal` as people and programs use them.

use crate::command::{Folder, bad_input, run};
use serde_json::Value;

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

const PLANE: [&str; 8] = [
    "simulate",
    "step-diagonal",
    "--diagonals",
    "face",
    "--steps",
    "4",
    "--noise",
    "0.1",
];

fn component<'a>(answer: &'a Value, name: &str) -> &'a Value {
    answer["components"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["name"] == name)
        .unwrap()
}

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
