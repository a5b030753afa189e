//! Designs whose styluses stand beside the crest of a bar, a fitted thickness, knots of each form, and the sign
//! of an indicator, from file to answer.

use serde_json::Value;

use crate::command::{Folder, run};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";

fn simulated(more: &[&str]) -> Folder {
    let folder = Folder::with(&[]);
    let fixed = [
        "simulate",
        "reversal",
        "--design",
        EIGHT,
        "--out",
        "made",
        "--seed",
        "3",
        "--positions",
        "61",
    ];
    let made = run(&folder, &[&fixed[..], more].concat());
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder
}

fn solved(folder: &Folder, setup: &str) -> Value {
    let arguments = [
        "reversal",
        "made/readings.csv",
        "--setup",
        setup,
        "--format",
        "json",
    ];
    let output = run(folder, &arguments);
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

fn value(answer: &Value, name: &str) -> f64 {
    answer["tilts"][name]["value"].as_f64().unwrap()
}

/// A bar of 40 mm, a stylus of 1.5 mm, half a millimetre beside the crest, a slide 200 µrad askew in the
/// vertical: left out, α_h moves by −4.65 µrad; stated, it does not. The diagnosis finds nothing there then.
#[test]
fn the_crest_is_a_term_where_it_is_stated() {
    let folder = simulated(&[
        "--alpha",
        "0",
        "--gamma",
        "0",
        "--alpha-v",
        "200",
        "--thickness",
        "40",
        "--tip-radius",
        "1.5",
        "--off-crest",
        "0.5",
        "--noise",
        "0.001",
    ]);
    let setup = std::fs::read_to_string(folder.path().join("made/setup.toml")).unwrap();
    assert!(
        setup.contains("tip_radius = 1.5") && setup.contains("off_crest = 0.5"),
        "{setup}"
    );
    let bare = "[artefact]\nthickness = 40.0\n";
    std::fs::write(folder.path().join("bare.toml"), bare).unwrap();
    let (with, without) = (
        solved(&folder, "made/setup.toml"),
        solved(&folder, "bare.toml"),
    );
    // k·u: u is 1 nm / (2 · 710 mm) of 61 positions, and splines miss waves by less.
    assert!(value(&with, "alpha_h").abs() < 1e-8, "{}", with["tilts"]);
    assert!(
        (value(&without, "alpha_h") + 4.65e-6).abs() < 2e-8,
        "{}",
        without["tilts"]
    );
    // Every form has its number of cells.
    let forms: Vec<&String> = with["knots"].as_object().unwrap().keys().collect();
    assert_eq!(forms, ["M_h", "M_v", "S_0", "S_90", "S_180", "S_270"]);
    assert_eq!(with["thickness"], Value::Null);

    let data = "made/readings.csv";
    let told = run(
        &folder,
        &[
            "diagnose",
            data,
            "--setup",
            "made/setup.toml",
            "--format",
            "json",
        ],
    );
    let diagnosis: Value = serde_json::from_str(&told.stdout).unwrap();
    assert_eq!(
        diagnosis["verdict"]["kind"], "none",
        "{}",
        diagnosis["verdict"]
    );
    let notes = diagnosis["notes"].to_string();
    assert!(notes.contains("taken out of the readings"), "{notes}");
}

/// One figure for each indicator, in the set-up as by the simulation.
#[test]
fn each_indicator_stands_where_it_stands() {
    let folder = simulated(&[
        "--alpha-v",
        "300",
        "--gamma",
        "400",
        "--gamma-2",
        "-200",
        "--thickness",
        "40",
        "--tip-radius",
        "2",
        "--off-crest",
        "0.8,-0.5,0.3,1.2",
        "--noise",
        "0.001",
    ]);
    let answer = solved(&folder, "made/setup.toml");
    for (name, urad) in [
        ("alpha_h", 40.0),
        ("alpha_v", 300.0),
        ("gamma_1", 400.0),
        ("gamma_2", -200.0),
    ] {
        // k·u: as above.
        assert!(
            (1e6 * value(&answer, name) - urad).abs() < 0.01,
            "{name} {}",
            answer["tilts"]
        );
    }
}

/// What cannot be is told with its place.
#[test]
fn a_set_up_that_contradicts_itself_is_told() {
    let folder = simulated(&["--thickness", "40"]);
    let bar = "[artefact]\nthickness = 40.0\n[indicator]\n";
    let cases = [
        ("tip_radius = 1.5\n", "tip_radius says nothing by itself"),
        (
            "off_crest = 0.5\n",
            "off_crest needs the radius of the stylus",
        ),
        (
            "tip_radius = -1\noff_crest = 0.5\n",
            "a stylus of -1 mm radius cannot be",
        ),
        (
            "tip_radius = 1.5\noff_crest = 25\n",
            "would not touch a bar of 40 mm",
        ),
        (
            "tip_radius = 1.5\noff_crest = \"left\"\n",
            "a number in mm is wanted",
        ),
        (
            "tip_radius = 1.5\noff_crest = { top = 0.1 }\n",
            "off_crest of `top`: no angle",
        ),
        (
            "tip_radius = 1.5\noff_crest = { 0 = 0.1 }\n",
            "not given for the indicator at 180",
        ),
        (
            "tip_radius = 1.5\noff_crest = { 45 = 0.1 }\n",
            "off_crest of 45: no indicator stands there",
        ),
    ];
    for (text, told) in cases {
        std::fs::write(folder.path().join("s.toml"), format!("{bar}{text}")).unwrap();
        let output = run(
            &folder,
            &["reversal", "made/readings.csv", "--setup", "s.toml"],
        );
        assert_eq!(output.status, 2, "{text}: {}", output.stderr);
        assert!(output.stderr.contains(told), "{text}: {}", output.stderr);
        assert!(
            output.stderr.contains("s.toml") && output.stdout.is_empty(),
            "{}",
            output.stderr
        );
    }
    let no_bar = "[indicator]\ntip_radius = 1.5\noff_crest = 0.5\n";
    std::fs::write(folder.path().join("s.toml"), no_bar).unwrap();
    let output = run(
        &folder,
        &["reversal", "made/readings.csv", "--setup", "s.toml"],
    );
    assert!(
        output
            .stderr
            .contains("off_crest needs the diameter of the bar"),
        "{}",
        output.stderr
    );
    // The four channels do not see how slide and bar run across.
    let four = run(
        &folder,
        &["simulate", "reversal", "--out", "four", "--thickness", "40"],
    );
    assert_eq!(four.status, 0, "{}", four.stderr);
    std::fs::write(
        folder.path().join("s.toml"),
        format!("{bar}tip_radius = 1.5\noff_crest = 0.5\n"),
    )
    .unwrap();
    for command in ["reversal", "diagnose"] {
        let output = run(
            &folder,
            &[command, "four/readings.csv", "--setup", "s.toml"],
        );
        assert_eq!(output.status, 2, "{}", output.stderr);
        assert!(
            output.stderr.contains("indicators in two planes"),
            "{}",
            output.stderr
        );
    }
}

/// A thickness that shows is fitted, told in text and JSON.
#[test]
fn a_thickness_that_shows_is_told() {
    let folder = simulated(&[
        "--alpha",
        "8000",
        "--alpha-v",
        "-6000",
        "--gamma",
        "9000",
        "--thickness",
        "40",
        "--forms",
        "2,10",
    ]);
    let setup = "[artefact]\nthickness = 35.0\nfit_thickness = true\n";
    std::fs::write(folder.path().join("fitted.toml"), setup).unwrap();
    let answer = solved(&folder, "fitted.toml");
    let found = &answer["thickness"];
    let (mm, std) = (
        found["value"].as_f64().unwrap(),
        found["std"].as_f64().unwrap(),
    );
    // k·u: one seed, four standard uncertainties.
    assert!(std < 1.0 && (mm - 40.0).abs() < 4.0 * std, "{found}");
    assert_eq!(found["unit"], "mm");
    let warnings = answer["warnings"].to_string();
    assert!(warnings.contains("the thickness was fitted"), "{warnings}");
}

/// An indicator that reads with the other sign is named, with the one that faces it: either may be wrong.
#[test]
fn an_indicator_of_the_wrong_sign_is_told() {
    let folder = simulated(&["--thickness", "40"]);
    let path = folder.path().join("made/readings.csv");
    let turned: String = std::fs::read_to_string(&path)
        .unwrap()
        .lines()
        .map(
            |line| match (line.starts_with("180,"), line.rsplit_once(',')) {
                (true, Some((head, reading))) => match reading.strip_prefix('-') {
                    Some(positive) => format!("{head},{positive}\n"),
                    None => format!("{head},-{reading}\n"),
                },
                _ => format!("{line}\n"),
            },
        )
        .collect();
    std::fs::write(&path, turned).unwrap();
    let answer = solved(&folder, "made/setup.toml");
    let warnings = answer["warnings"].to_string();
    assert!(
        warnings.contains("with the sign of the readings of the indicator at 0° or 180° turned"),
        "{warnings}"
    );
}
