//! A gap that no effect explains, as a formula.

use crate::command::{Folder, bad_input, documented, run};
use serde_json::Value;

/// A calibration line whose readings are changed by a function of the load.
fn campaign(folder: &Folder, name: &str, seed: &str, sets: &str, change: impl Fn(f64) -> f64) {
    let line = [
        "simulate",
        "calibration-line",
        "--sets",
        sets,
        "--seed",
        seed,
    ];
    let made = run(folder, &line);
    assert_eq!(made.status, 0, "{}", made.stderr);
    let changed = made.stdout.lines().map(|line| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(x) = fields[0].parse::<f64>() {
            let y: f64 = fields[1].parse().unwrap();
            fields[1] = (y + change(x)).to_string();
        }
        fields.join(",")
    });
    folder.write(name, &changed.collect::<Vec<_>>().join("\n"));
}

const LINE: [&str; 3] = ["diagnose", "--model", "calibration-line"];

fn diagnose(folder: &Folder, more: &[&str]) -> (i32, Value) {
    let out = run(folder, &[&LINE[..], &["--format", "json"], more].concat());
    assert!(out.status < 2, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap_or_else(|e| {
        panic!("{e}: {}{}", out.stdout, out.stderr);
    });
    documented(&answer, "docs/json/diagnosis.md");
    (out.status, answer)
}

fn swing(x: f64) -> f64 {
    0.02 * (2.0 * std::f64::consts::PI * x / 3.1 + 0.4).cos()
}

/// The law is told with its period and its unit, written, and tested and named on another campaign.
#[test]
fn a_law_is_told_and_found_again() {
    let folder = Folder::with(&[]);
    campaign(&folder, "monday.csv", "1", "6", swing);
    campaign(&folder, "friday.csv", "2", "6", swing);
    let (status, answer) = diagnose(&folder, &["monday.csv", "--law", "swing.toml"]);
    assert_eq!(status, 0);
    let law = &answer["law"];
    assert_eq!(law["found"], true, "{law}");
    assert_eq!(law["terms"][0]["function"], "cosine", "{law}");
    let parameters = law["terms"][0]["parameters"].as_array().unwrap();
    let period = parameters.iter().find(|p| p["name"] == "period").unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    // k·u: four standard uncertainties.
    let off = number(&period["value"]) - 3.1;
    assert!(off.abs() < 4.0 * number(&period["std"]), "{period}");
    assert_eq!(period["unit"], "x");
    assert!(number(&law["false_alarm"]["noise"]) < 0.01, "{law}");
    assert!(number(&law["false_alarm"]["smooth"]) <= 0.01, "{law}");
    let file = folder.read("swing.toml");
    for what in [
        "formula = \"",
        "cos(2 * pi * x / 3.",
        "file = \"monday.csv\"",
    ] {
        assert!(file.contains(what), "{what} is not in\n{file}");
    }
    let (_, other) = diagnose(&folder, &["friday.csv", "--effects", "swing.toml"]);
    assert_eq!(
        other["verdict"]["effects"][0], "swing",
        "{}",
        other["verdict"]
    );
    let test = &other["tested"][0];
    // k·u: three standard uncertainties of the size, which is one, and the law's own.
    let off = (number(&test["size"]) - 1.0).abs();
    assert!(off < 3.0 * 1.5 * number(&test["size_std"]), "{test}");
    assert!(
        number(&test["shrink"]) > 0.7 && number(&test["p_value"]) < 0.05,
        "{test}"
    );
    let out = run(&folder, &[&LINE[..], &["monday.csv", "--law"]].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    for what in [
        "Law `law`: ",
        "cosine of the position",
        "period 3.",
        "noise alone would show",
    ] {
        assert!(
            out.stdout.contains(what),
            "{what} is not in\n{}",
            out.stdout
        );
    }
    bad_input(
        &folder,
        &[&LINE[..], &["monday.csv", "--law", "swing.toml"]].concat(),
        &["swing.toml", "exists already"],
    );
}

/// A curve that is no law is told as none, with the power; a file that was asked for makes it exit 1.
#[test]
fn no_law_is_told_with_its_power() {
    let folder = Folder::with(&[]);
    let curve = |x: f64| {
        let u = x / 10.0;
        0.02 * (2.0 * (u - 0.3)).sinh().sin() * (1.0 + u) + 0.012 * (9.0 * u * u).cos()
    };
    campaign(&folder, "curve.csv", "3", "4", curve);
    let (status, answer) = diagnose(&folder, &["curve.csv", "--law"]);
    assert_eq!(status, 0, "{answer}");
    let law = &answer["law"];
    assert_eq!(law["found"], false, "{law}");
    let power = &law["power"];
    let part = power["probability"].as_f64().unwrap();
    assert!(power["draws"] == 40 && (0.0..=1.0).contains(&part), "{law}");
    let out = run(
        &folder,
        &[&LINE[..], &["curve.csv", "--law", "l.toml"]].concat(),
    );
    assert_eq!(out.status, 1, "{}{}", out.stdout, out.stderr);
    assert!(out.stdout.contains("No simple law"), "{}", out.stdout);
    assert!(!folder.path().join("l.toml").exists());
}

/// Only after `unknown`: else the diagnosis says why none is sought, with exit 1 where a file was to be written. Without
/// repeats it is refused.
#[test]
fn what_has_no_law_to_seek_says_so() {
    let folder = Folder::with(&[]);
    campaign(&folder, "none.csv", "4", "4", |_| 0.0);
    campaign(&folder, "bend.csv", "5", "4", |x| 1e-3 * (x - 5.0).powi(2));
    campaign(&folder, "once.csv", "6", "1", swing);
    for (data, what, verdict) in [
        ("none.csv", "nothing stands out of the noise", "none"),
        ("bend.csv", "--without quadratic", "effect"),
    ] {
        let out = run(&folder, &[&LINE[..], &[data, "--law", "l.toml"]].concat());
        assert_eq!(out.status, 1, "{data}: {}{}", out.stdout, out.stderr);
        assert!(out.stdout.contains(what), "{data}: {}", out.stdout);
        assert!(
            out.stdout.contains("l.toml is not written"),
            "{}",
            out.stdout
        );
        assert!(!folder.path().join("l.toml").exists());
        let json = [&LINE[..], &["--format", "json", data, "--law"]].concat();
        let out = run(&folder, &json);
        assert_eq!(out.status, 0, "{data}: {}{}", out.stdout, out.stderr);
        let answer: serde_json::Value = serde_json::from_str(&out.stdout).unwrap();
        assert_eq!(answer["verdict"]["kind"], verdict);
        assert_eq!(answer["law"]["found"], false);
    }
    let out = run(
        &folder,
        &[&LINE[..], &["once.csv", "--law", "l.toml"]].concat(),
    );
    assert_eq!(out.status, 1, "{}{}", out.stdout, out.stderr);
    assert!(
        out.stderr.contains("there are no repeats to hold out"),
        "{}",
        out.stderr
    );
}
