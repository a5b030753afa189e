//! `errsep reversal --simultaneous --with …` on readings of a machine with a fault.

use crate::command::{Folder, Output, run};
use crate::faulty_machine::{Fault, Machine};
use errsep_models::reversal::{Channel, Direction, Observations};
use serde_json::Value;

const SETUP: &str = "[artefact]\nthickness = 42.0\n[model]\nknots = 8\n";
const FIT: [&str; 5] = [
    "reversal",
    "data.csv",
    "--setup",
    "setup.toml",
    "--simultaneous",
];

fn machine() -> Machine {
    Machine::random(5, 8, 61, 2, 0.05)
}

/// The readings as a file has them.
fn tidy(observations: &Observations) -> String {
    let mut text = "channel,repeat,direction,time,x,reading\n".to_owned();
    for r in &observations.readings {
        let direction = match r.direction {
            Direction::Forward => "forward",
            Direction::Backward => "backward",
        };
        text += &format!(
            "{},{},{direction},{},{},{:.4}\n",
            r.channel.name(),
            r.repeat,
            r.time.unwrap(),
            r.x,
            r.value
        );
    }
    text
}

fn folder(faults: &[Fault]) -> Folder {
    let data = tidy(&machine().measured(faults, 21));
    Folder::with(&[("data.csv", &data), ("setup.toml", SETUP)])
}

fn with(folder: &Folder, more: &[&str]) -> Output {
    run(folder, &[&FIT[..], more].concat())
}

fn json(folder: &Folder, more: &[&str]) -> Value {
    let output = with(folder, &[more, &["--format", "json"]].concat());
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

/// Correlations by the names of the covariance, its diagonal against the standard uncertainties.
fn correlations(answer: &Value) -> std::collections::BTreeMap<(String, String), f64> {
    let covariance = &answer["covariance"];
    let names: Vec<&str> = (covariance["names"].as_array().unwrap().iter())
        .map(|n| n.as_str().unwrap())
        .collect();
    let at = |i: usize, j: usize| covariance["matrix"][i][j].as_f64().unwrap();
    for (k, name) in names.iter().enumerate() {
        let (own, unit) = match name.split_once('.') {
            None => (&answer["tilts"][name], &covariance["units"][k]),
            Some((_, parameter)) => {
                let all = answer["effects"][0]["parameters"].as_array().unwrap();
                let own = all.iter().find(|p| p["name"] == parameter).unwrap();
                (own, &covariance["units"][k])
            }
        };
        assert_eq!(&own["unit"], unit, "{name}");
        let std = own["std"].as_f64().unwrap();
        // Epsilons: a square and its root.
        assert!((at(k, k).sqrt() / std - 1.0).abs() < 1e-12, "{name}");
    }
    let mut all = std::collections::BTreeMap::new();
    for i in 0..names.len() {
        for j in 0..names.len() {
            assert_eq!(at(i, j), at(j, i));
            let r = at(i, j) / (at(i, i) * at(j, j)).sqrt();
            all.insert((names[i].to_owned(), names[j].to_owned()), r);
        }
    }
    all
}

#[test]
fn the_covariance_has_the_names_and_the_uncertainties_of_the_answer() {
    let folder = folder(&[Fault::Drift(0.9, -0.4, 600.0)]);
    let r = |all: &std::collections::BTreeMap<(String, String), f64>, a: &str, b: &str| {
        all[&(a.to_owned(), b.to_owned())]
    };
    // Four channels on one grid: the contrasts are orthogonal but for what repeats say of each channel's noise.
    let plain = correlations(&json(&folder, &[]));
    assert_eq!(plain.len(), 9);
    for (a, b) in [("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma")] {
        assert!(r(&plain, a, b).abs() < 0.2, "{a} {b} {}", r(&plain, a, b));
    }
    let drifting = correlations(&json(&folder, &["--with", "thermal-drift"]));
    assert_eq!(drifting.len(), 36);
    // The size of a drift and its time constant are told by the same readings.
    let own = r(
        &drifting,
        "thermal-drift.near-drift",
        "thermal-drift.time-constant",
    );
    assert!(own.abs() > 1e-3, "{own}");
    assert!(drifting.values().all(|r| r.abs() < 1.0 + 1e-9));
}

#[test]
fn the_answer_has_the_effect_in_every_form() {
    let folder = folder(&[Fault::Drift(0.9, -0.4, 600.0)]);
    let answer = json(&folder, &["--with", "thermal-drift", "--out", "report"]);
    let effect = &answer["effects"][0];
    assert_eq!(effect["effect"], "thermal-drift");
    for (name, unit, truth) in [
        ("near-drift", "um", 0.9),
        ("far-drift", "um", -0.4),
        ("time-constant", "s", 600.0),
    ] {
        let all = effect["parameters"].as_array().unwrap();
        let own = all.iter().find(|p| p["name"] == name).unwrap();
        assert_eq!(own["unit"], unit);
        let (value, std) = (own["value"].as_f64().unwrap(), own["std"].as_f64().unwrap());
        // k·u, one seed.
        assert!((value - truth).abs() < 5.0 * std, "{name} {value} ± {std}");
    }
    let alpha = &answer["tilts"]["alpha"];
    let error = alpha["value"].as_f64().unwrap() - machine().tilts[0];
    assert!(
        error.abs() < 5.0 * alpha["std"].as_f64().unwrap(),
        "{alpha}"
    );
    let page = folder.read("report/report.html");
    for words in [
        "Effects in the fit",
        "thermal-drift",
        "near-drift",
        "time-constant",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let written: Value = serde_json::from_str(&folder.read("report/result.json")).unwrap();
    assert_eq!(written["effects"], answer["effects"]);
    let text = with(&folder, &["--with", "thermal-drift"]).stdout;
    assert!(
        text.contains("Effects in the fit") && text.contains("far-drift"),
        "{text}"
    );
    // Without the option there are none.
    assert_eq!(json(&folder, &[])["effects"], Value::Array(Vec::new()));
}

#[test]
fn corrected_readings_are_those_without_the_effect() {
    let fault = [Fault::Jump(0.4, true, 0.4), Fault::Cone(20e-6)];
    let folder = folder(&fault);
    let answer = json(
        &folder,
        &["--with", "zero-jump,taper", "--corrected", "clean.csv"],
    );
    let clean = folder.read("clean.csv");
    let mut lines = clean.lines();
    let comment = lines.next().unwrap();
    assert!(
        comment.starts_with('#') && comment.contains("no independent evidence"),
        "{comment}"
    );
    let data = folder.read("data.csv");
    assert_eq!(lines.next(), data.lines().next());
    assert_eq!(lines.clone().count(), data.lines().count() - 1);
    let jump = answer["effects"][0]["parameters"][0]["value"]
        .as_f64()
        .unwrap();
    let cone = answer["effects"][1]["parameters"][0]["value"]
        .as_f64()
        .unwrap();
    let time = answer["effects"][0]["parameters"][1]["value"]
        .as_f64()
        .unwrap();
    for (before, after) in data.lines().skip(1).zip(lines) {
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let (before, after) = (fields(before), fields(after));
        assert_eq!(before[..5], after[..5]);
        let number = |text: &str| text.parse::<f64>().unwrap();
        let near = before[0] == "1A" || before[0] == "2B";
        let jumped = if near && number(&before[3]) > time {
            jump
        } else {
            0.0
        };
        let done = number(&before[5]) - number(&after[5]);
        // Truncation: a cone's first order; the second is 20 µrad × 200 µrad × 300 mm.
        let expected = jumped + 1e3 * cone * number(&before[4]);
        assert!(
            (done - expected).abs() < 5e-3,
            "{before:?}: {done}, {expected}"
        );
    }
    // The corrected readings have the answer without effects.
    let again = json_of(&folder, "clean.csv");
    for tilt in ["alpha", "beta", "gamma"] {
        let value = |a: &Value| a["tilts"][tilt]["value"].as_f64().unwrap();
        let std = answer["tilts"][tilt]["std"].as_f64().unwrap();
        // The same minimum up to the effects' second order.
        assert!(
            (value(&again) - value(&answer)).abs() < 0.02 * std,
            "{tilt}"
        );
    }
}

fn json_of(folder: &Folder, data: &str) -> Value {
    let arguments = [
        "reversal",
        data,
        "--setup",
        "setup.toml",
        "--simultaneous",
        "--format",
        "json",
    ];
    let output = run(folder, &arguments);
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

#[test]
fn a_corrected_file_is_written_whole_or_not_at_all() {
    let folder = folder(&[Fault::Cone(10e-6)]);
    folder.write("kept.csv", "kept");
    let refused = with(&folder, &["--with", "taper", "--corrected", "kept.csv"]);
    assert_eq!(refused.status, 2, "{}", refused.stderr);
    assert_eq!(folder.read("kept.csv"), "kept");
    let over_itself = with(&folder, &["--with", "taper", "--corrected", "data.csv"]);
    assert_eq!(over_itself.status, 2, "{}", over_itself.stderr);
    let nowhere = with(&folder, &["--with", "taper", "--corrected", "none/c.csv"]);
    assert_eq!(nowhere.status, 2, "{}", nowhere.stderr);
    let unsolved = with(&folder, &["--with", "gravity-sag", "--corrected", "c.csv"]);
    assert_eq!(unsolved.status, 1, "{}", unsolved.stderr);
    assert!(!folder.path().join("c.csv").exists());
}

#[test]
fn a_wide_table_with_decimal_commas_keeps_its_dress() {
    let machine = Machine {
        repeats: 1,
        ..machine()
    };
    let observations = machine.measured(&[Fault::Cone(30e-6)], 3);
    let mut text = "x;1A;1B;2A;2B\r\n".to_owned();
    for x in &machine.positions {
        let value = |name: &str| {
            let mut own = observations.readings.iter();
            let own = own.find(|r| r.x == *x && r.channel.name() == name).unwrap();
            format!("{:.3}", own.value).replace('.', ",")
        };
        let row = ["1A", "1B", "2A", "2B"].map(value).join(";");
        text += &format!("{};{row}\r\n", x.to_string().replace('.', ","));
    }
    let folder = Folder::with(&[("data.csv", &text), ("setup.toml", SETUP)]);
    let answer = json(&folder, &["--with", "taper", "--corrected", "clean.csv"]);
    let clean = folder.read("clean.csv");
    assert!(clean.starts_with("# ") && clean.lines().count() == 1 + text.lines().count());
    assert!(
        clean.ends_with("\r\n") && !clean.lines().nth(2).unwrap().contains('.'),
        "{clean}"
    );
    let again = json_of(&folder, "clean.csv");
    let closure = again["closure"]["slope"]["value"].as_f64().unwrap();
    // What the taper took up is gone: rounding to the last of the fit's digits.
    assert!(closure.abs() < 1e-9, "{closure}");
    assert!(answer["closure"]["slope"].is_null());
    let all = answer["contrasts"].as_array().unwrap();
    let held = all.iter().find(|c| c["pattern"] == "+ + + +").unwrap();
    assert_eq!(
        held["value"],
        answer["effects"][0]["parameters"][0]["value"]
    );
}

#[test]
fn what_cannot_join_is_said_with_the_remedy() {
    let folder = folder(&[]);
    let no = |effects: &str, status: i32, words: &[&str]| {
        let output = with(&folder, &["--with", effects]);
        assert_eq!(output.status, status, "{}{}", output.stdout, output.stderr);
        assert!(output.stdout.is_empty());
        // Lines are broken where the terminal ends.
        let said = output
            .stderr
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        for word in words {
            assert!(said.contains(word), "{word} in {said}");
        }
    };
    no(
        "gravity-sag",
        1,
        &["gravity-sag cannot join", "M takes it up", "sag"],
    );
    no(
        "tip-radius",
        1,
        &["S_A and S_B take it up", "another radius"],
    );
    no("common-gain", 1, &["scales every form", "calibrate"]);
    for effect in ["stick-slip", "sticking-plunger"] {
        let told = [
            "errsep diagnose knows",
            "from reading to reading",
            "leave it out of --with",
        ];
        no(effect, 1, &told);
    }
    no(
        "indexing-error",
        1,
        &["alpha and beta take it up", "align the artefact sideways"],
    );
    no("termal-drift", 2, &["no effect is called", "thermal-drift"]);
    no("taper,taper", 2, &["asked for twice"]);
    let without = run(&folder, &["reversal", "data.csv", "--with", "taper"]);
    assert_eq!(without.status, 2, "{}", without.stderr);
    folder.write("setup.toml", "[model]\nconvention = \"rigid\"\n");
    no("taper", 1, &["`rigid` has the cone"]);
    folder.write(
        "setup.toml",
        "[artefact]\nthickness = 42.0\nfit_thickness = true\n",
    );
    no("thickness-shift", 1, &["unknown of the fit already"]);
}

#[test]
fn effects_in_time_say_what_they_take_for_it() {
    let folder = folder(&[Fault::Jump(0.5, false, 0.3)]);
    let data = folder.read("data.csv");
    let untimed: String = data
        .lines()
        .map(|line| {
            let mut fields: Vec<&str> = line.split(',').collect();
            fields.remove(3);
            fields.join(",") + "\n"
        })
        .collect();
    folder.write("data.csv", &untimed);
    let answer = json(&folder, &["--with", "zero-jump"]);
    let warnings = answer["warnings"].to_string();
    assert!(warnings.contains("no times are given"), "{warnings}");
    let jump = &answer["effects"][0]["parameters"][0];
    let (value, std) = (
        jump["value"].as_f64().unwrap(),
        jump["std"].as_f64().unwrap(),
    );
    // The order that is assumed is the one in which these were taken. k·u.
    assert!((value - 0.5).abs() < 5.0 * std, "{jump}");
}

/// The fit is diagnosed in the same run, by itself: what is named is what `errsep diagnose` names, with the
/// command that fits it along.
#[test]
fn the_fit_is_diagnosed_in_the_same_run() {
    let folder = folder(&[Fault::Cone(5e-6)]);
    let both = json(&folder, &["--diagnose"]);
    let arguments = ["diagnose", "data.csv", "--setup", "setup.toml"];
    let alone = run(&folder, &[&arguments[..], &["--format", "json"]].concat());
    assert_eq!(alone.status, 0, "{}", alone.stderr);
    let alone: Value = serde_json::from_str(&alone.stdout).unwrap();
    assert_eq!(both["schema"], "errsep.reversal/1");
    assert_eq!(both["diagnosis"]["verdict"], alone["verdict"]);
    assert_eq!(both["diagnosis"]["verdict"]["effects"][0], "taper");
    assert_eq!(
        alone["fit_with"],
        "errsep reversal data.csv --setup setup.toml --simultaneous --with taper"
    );
    let text = with(&folder, &["--diagnose"]).stdout;
    assert!(
        text.contains("Where and why model and readings disagree"),
        "{text}"
    );
    assert!(
        !text.contains("to see where they disagree"),
        "points to what it has done: {text}"
    );
    let refused = with(&folder, &["--diagnose", "--with", "taper"]);
    assert_eq!(refused.status, 2);
}

/// Backwards the slide runs on a line of its own: named, but the fit has no unknowns for such a line, so
/// that no command is given that would fit a plain step in its place.
#[test]
fn no_command_is_given_for_a_variant_that_the_fit_lacks() {
    let mut observations = machine().measured(&[], 21);
    for r in &mut observations.readings {
        if r.direction == Direction::Backward {
            let u = r.x / 150.0 - 1.0;
            let own = 0.5 * (1.5 * u * u - 0.5) + 0.4 * (2.5 * u.powi(3) - 1.5 * u);
            let near = matches!(r.channel, Channel::C1A | Channel::C2B);
            r.value += if near { own } else { -own };
        }
    }
    let data = tidy(&observations);
    let folder = Folder::with(&[("data.csv", &data), ("setup.toml", SETUP)]);
    let arguments = ["diagnose", "data.csv", "--setup", "setup.toml"];
    let output = run(&folder, &[&arguments[..], &["--format", "json"]].concat());
    let answer: Value = serde_json::from_str(&output.stdout).unwrap();
    assert_eq!(answer["verdict"]["effects"][0], "lateral-backlash");
    let candidates = answer["candidates"].as_array().unwrap();
    let own = candidates
        .iter()
        .find(|c| c["effect"] == "lateral-backlash");
    let variant = own.unwrap()["variant"].as_str().unwrap();
    assert!(variant.starts_with("each direction"), "{variant}");
    assert!(answer["fit_with"].is_null(), "{}", answer["fit_with"]);
}
