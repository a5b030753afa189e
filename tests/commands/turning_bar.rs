//! A bar that turns while the slide feeds, from file to answer.

use std::fmt::Write;

use serde_json::Value;

use crate::command::{Folder, bad_input, data, documented, run};

/// A run that `errsep simulate` makes.
fn simulated(options: &[&str]) -> Folder {
    let folder = Folder::with(&[]);
    let fixed = [
        "simulate",
        "turning-bar",
        "--readings",
        "1500",
        "--turns",
        "24",
        "--out",
        "run",
    ];
    let out = run(&folder, &[&fixed, options].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    folder
}

fn diagnosed(folder: &Folder, file: &str, options: &[&str]) -> Value {
    let fixed = ["diagnose", file, "--format", "json"];
    let out = run(folder, &[&fixed, options].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The figures of the recipe's run, where the record lies.
#[test]
fn the_measured_bar() {
    let Some(record) = data("bridgeport_spindle/testbar_712.csv") else {
        return;
    };
    let answer = diagnosed(&Folder::with(&[]), &record, &[]);
    let turning = &answer["turning"];
    assert_eq!(answer["verdict"]["kind"], "effect");
    assert_eq!(answer["verdict"]["effects"][0], "unsteady-turn");
    // Certified digits: least squares by two independent ways left 4.54 to 4.85 µm and at most 0.62 µm.
    let (before, after) = (
        number(&turning["rms"]["before"]),
        number(&turning["rms"]["after"]),
    );
    assert!((4.5..4.9).contains(&before), "{before}");
    assert!(after <= 0.62, "{after}");
    let gap = &answer["gap"];
    assert!((4.5..4.9).contains(&number(&gap["before"]["rms"])));
    assert!(number(&gap["after"]["rms"]) < 0.62);
    // Other tool: 40.8 µrad to 0.3, of which correlated noise makes 0.15.
    let slope = &turning["slope"];
    assert!(
        (number(&slope["value"]) - 40.8e-6).abs() < 0.3e-6,
        "{slope}"
    );
    assert!(
        (0.1e-6..0.25e-6).contains(&number(&slope["std"])),
        "{slope}"
    );
    // Correlation counts: three times what independent readings would say.
    assert!(number(&slope["std"]) > 2.0 * number(&slope["std_white"]));
    // Certified digits, `spindle_bar.rs`: 87 µrad, 88° of turn of the run-out.
    let bar = &turning["bar"];
    assert!(
        (number(&bar["inclination"]["value"]) - 87e-6).abs() < 1e-6,
        "{bar}"
    );
    let turned = number(&bar["turned"]["value"]).abs().to_degrees();
    assert!((turned - 88.0).abs() < 2.0, "{turned}");
    assert_eq!(bar["across_sign_known"], true);
    // Pairs of opposite angles differ by some 2 µrad, by ovality.
    let oval = number(&turning["pairs"]["of_oval"]);
    assert!((1e-6..3.5e-6).contains(&oval), "{oval}");
    documented(&answer, "docs/json/diagnosis.md");
}

/// Four runs each: nothing in a steady turn, the cause where it is put in, no cause where it is another.
#[test]
fn verdicts_on_known_causes() {
    let mut said = String::new();
    for seed in 1..=4 {
        let seed = seed.to_string();
        for (options, kind, effect) in [
            (vec![], "none", ""),
            (vec!["--stray", "60"], "effect", "unsteady-turn"),
            (vec!["--jump", "6"], "unknown", ""),
        ] {
            let options = [&options[..], &["--seed", &seed]].concat();
            let folder = simulated(&options);
            let answer = diagnosed(&folder, "run/readings.csv", &[]);
            let verdict = &answer["verdict"];
            let named = verdict["effects"][0].as_str().unwrap_or("");
            if verdict["kind"] != kind || named != effect {
                let _ = writeln!(said, "{options:?}: {}", verdict["statement"]);
            }
            if kind != "unknown" {
                // k·u: four standard uncertainties of twelve looks.
                let slope = &answer["turning"]["slope"];
                let off = number(&slope["value"]) - 40e-6;
                assert!(
                    off.abs() < 4.0 * number(&slope["std"]),
                    "{options:?}: {slope}"
                );
            }
        }
    }
    assert!(said.is_empty(), "{said}");
}

/// A bar that is bent, and a recorded angle that is right.
#[test]
fn a_bend_and_a_recorded_angle() {
    let folder = simulated(&["--bend", "6"]);
    let answer = diagnosed(&folder, "run/readings.csv", &[]);
    let verdict = &answer["verdict"];
    assert_eq!(verdict["kind"], "effect", "{verdict}");
    let causes = verdict["effects"].to_string() + &verdict["indistinguishable"].to_string();
    assert!(causes.contains("bar-bend"), "{verdict}");
    documented(&answer, "docs/json/diagnosis.md");

    let folder = simulated(&["--stray", "60", "--recorded"]);
    let answer = diagnosed(&folder, "run/readings.csv", &[]);
    assert_eq!(answer["verdict"]["kind"], "none", "{}", answer["verdict"]);
    assert_eq!(answer["turning"]["angle"], "recorded");
    let out = run(
        &folder,
        &["diagnose", "run/readings.csv", "--out", "report"],
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        folder
            .read("report/report.html")
            .contains("Axis of the bar")
    );
}

#[test]
fn runs_that_cannot_be_are_refused() {
    let mut rows = vec!["time,spindle,x,reading".to_owned()];
    for i in 0..400 {
        let degrees = 12.0 * f64::from(i);
        let value = 10.0 * degrees.to_radians().cos();
        rows.push(format!(
            "{},{degrees},{},{value}",
            0.2 * f64::from(i),
            0.1 * f64::from(i)
        ));
    }
    let with = |line: usize, row: &str| {
        let mut own = rows.clone();
        row.clone_into(&mut own[line]);
        own.join("\n")
    };
    let folder = Folder::with(&[
        ("back.csv", &with(200, "39.8,1800,19.9,1")),
        ("gap.csv", &with(200, "39.8,,19.9,1")),
        ("twice.csv", &with(200, "39.6,2388,19.9,1")),
        ("few.csv", &rows[..80].join("\n")),
        ("bare.csv", "x,reading\n1,2\n2,3\n"),
        ("setup.toml", "[bar]\nharmonics = [1]\n"),
        ("good.csv", &rows.join("\n")),
    ]);
    let at = |line: &str, words: &'static str| [line.to_owned(), words.to_owned()];
    for (file, expected) in [
        ("back.csv", at("back.csv:201", "jumps back by 576")),
        ("gap.csv", at("gap.csv:201", "spindle is missing")),
        (
            "twice.csv",
            at("twice.csv:201", "the time of the one before it"),
        ),
        ("few.csv", at("few.csv", "2.6 turns")),
        (
            "bare.csv",
            at(
                "bare.csv:1",
                "neither a column `time` nor a column `spindle`",
            ),
        ),
    ] {
        let arguments = ["diagnose", file, "--model", "turning-bar", "--out", "out"];
        bad_input(&folder, &arguments, &[&expected[0], &expected[1]]);
    }
    let arguments = [
        "diagnose",
        "good.csv",
        "--setup",
        "setup.toml",
        "--out",
        "out",
    ];
    bad_input(
        &folder,
        &arguments,
        &["setup.toml:2", "harmonic 1 cannot be fitted"],
    );
    let arguments = ["diagnose", "good.csv", "--prove", "5", "--out", "out"];
    bad_input(&folder, &arguments, &["--prove cannot be had"]);
    let arguments = ["diagnose", "good.csv", "--without", "taper", "--out", "out"];
    bad_input(&folder, &arguments, &["no effect `taper`", "unsteady-turn"]);
}
