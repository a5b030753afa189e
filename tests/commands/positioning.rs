//! `errsep positioning` and `errsep simulate positioning` as people and programs use them.

use crate::command::{Folder, bad_input, run};
use serde_json::Value;

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn simulated(folder: &Folder, name: &str, options: &[&str]) {
    let made = run(folder, &[&["simulate", "positioning"], options].concat());
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write(name, &made.stdout);
}

fn value(answer: &Value, standard: &str, figure: &str) -> f64 {
    answer[standard][figure]["value"]
        .as_f64()
        .unwrap_or_else(|| panic!("{standard} {figure}: {}", answer[standard]))
}

/// The figures of an acceptance report, with E and R↑ as its readings give them: it prints 14.85 and
/// 7.50 there, which are E↓ and R↑ (the bidirectional values are greater).
#[test]
fn an_acceptance_report_if_it_is_there() {
    let Some(path) = crate::command::data("iso230_2/readings.csv") else {
        return;
    };
    let folder = Folder::with(&[]);
    let answer = json(&folder, &["positioning", &path, "--format", "json"]);
    // Tolerance: half a unit of the last printed digit.
    for (standard, figure, expected) in [
        ("iso230_2", "A", 18.571),
        ("iso230_2", "A_forward", 18.065),
        ("iso230_2", "A_backward", 16.543),
        ("iso230_2", "E", 15.988),
        ("iso230_2", "E_forward", 15.052),
        ("iso230_2", "E_backward", 14.852),
        ("iso230_2", "M", 14.952),
        ("iso230_2", "R", 8.354),
        ("iso230_2", "R_forward", 7.502),
        ("iso230_2", "R_backward", 3.883),
        ("iso230_2", "B", 4.564),
        ("iso230_2", "B_mean", 0.696),
        ("vdi3441", "P", 19.516),
        ("vdi3441", "Ps", 8.124),
        ("vdi3441", "Pa", 14.952),
        ("vdi3441", "U", 4.564),
    ] {
        let found = value(&answer, standard, figure);
        assert!(
            (found - expected).abs() < 5.001e-4,
            "{figure}: {found} for {expected}"
        );
    }
    for figure in ["A", "E", "M", "R", "B"] {
        assert!(
            answer["iso230_2"][figure]["U"].as_f64().unwrap() > 0.0,
            "{figure}"
        );
    }
}

#[test]
fn simulated_readings_give_the_truth_back() {
    let folder = Folder::with(&[]);
    let made = run(
        &folder,
        &[
            "simulate",
            "positioning",
            "--noise",
            "0",
            "--drift",
            "0",
            "--lost-motion",
            "4",
            "--out",
            "made",
        ],
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    assert!(
        made.stdout.contains("errsep positioning"),
        "{}",
        made.stdout
    );
    let truth: Value = serde_json::from_str(&folder.read("made/result.json")).unwrap();
    let answer = json(
        &folder,
        &[
            "positioning",
            "made/readings.csv",
            "--setup",
            "made/setup.toml",
            "--format",
            "json",
        ],
    );
    for (standard, figures) in [
        (
            "iso230_2",
            &["A", "E", "E_forward", "M", "R", "B", "B_mean"][..],
        ),
        ("vdi3441", &["P", "Ps", "Pa", "U"]),
    ] {
        for figure in figures {
            let expected = truth["truth"][*figure]["value"].as_f64().unwrap();
            let found = value(&answer, standard, figure);
            // Tolerance: epsilons of positions of 500 mm, in µm.
            assert!(
                (found - expected).abs() < 1e-9,
                "{figure}: {found} for {expected}"
            );
        }
    }
    assert_eq!(answer["axis"]["name"], "X");
    assert_eq!(answer["axis"]["travel"]["to"], 500.0);
    assert!(answer["iso230_2"]["E"]["U"].is_null());
    assert_eq!(answer["warnings"], Value::Array(Vec::new()));
}

#[test]
fn units_and_kinds_are_one_axis() {
    let folder = Folder::with(&[]);
    simulated(&folder, "mm.csv", &["--seed", "5"]);
    let mm = json(&folder, &["positioning", "mm.csv", "--format", "json"]);
    let rows = folder.read("mm.csv");
    let mut inch = String::new();
    let mut deviations = String::new();
    for line in rows.lines().filter(|l| !l.starts_with('#')) {
        let f: Vec<&str> = line.split(',').collect();
        if f[0] == "target" {
            inch += "target,run,direction,position\n";
            deviations += "target,run,direction,deviation\n";
            continue;
        }
        let (target, position): (f64, f64) = (f[0].parse().unwrap(), f[3].parse().unwrap());
        inch += &format!("{},{},{},{}\n", target / 25.4, f[1], f[2], position / 25.4);
        deviations += &format!("{target},{},{},{}\n", f[1], f[2], (position - target) * 1e3);
    }
    folder.write("inch.csv", &inch);
    folder.write("deviations.csv", &deviations);
    folder.write("inch.toml", "[axis]\nunit = \"inch\"\n");
    folder.write("rotary.toml", "[axis]\nkind = \"rotary\"\n");
    let by_option = [
        "positioning",
        "inch.csv",
        "--unit",
        "inch",
        "--format",
        "json",
    ];
    let by_setup = [
        "positioning",
        "inch.csv",
        "--setup",
        "inch.toml",
        "--format",
        "json",
    ];
    let as_deviations = ["positioning", "deviations.csv", "--format", "json"];
    for arguments in [&by_option[..], &by_setup, &as_deviations] {
        let other = json(&folder, arguments);
        assert_eq!(other["unit"], "um");
        for figure in ["A", "E", "R", "B"] {
            let (a, b) = (
                value(&mm, "iso230_2", figure),
                value(&other, "iso230_2", figure),
            );
            // Tolerance: epsilons of 500 mm, in µm, some dozens of times.
            assert!((a - b).abs() < 1e-8, "{arguments:?} {figure}: {a} {b}");
        }
    }
    // Degrees and seconds of arc: 3600 in place of 1000.
    let rotary = json(
        &folder,
        &[
            "positioning",
            "mm.csv",
            "--setup",
            "rotary.toml",
            "--format",
            "json",
        ],
    );
    assert_eq!(
        (&rotary["unit"], &rotary["position_unit"]),
        (&"arcsec".into(), &"deg".into())
    );
    let ratio = value(&rotary, "iso230_2", "A") / value(&mm, "iso230_2", "A");
    assert!((ratio - 3.6).abs() < 1e-9, "{ratio}");
    bad_input(
        &folder,
        &[
            "positioning",
            "mm.csv",
            "--setup",
            "rotary.toml",
            "--unit",
            "mm",
        ],
        &["--unit is of a linear axis"],
    );
    bad_input(
        &folder,
        &[
            "positioning",
            "inch.csv",
            "--setup",
            "inch.toml",
            "--unit",
            "mm",
        ],
        &["differ"],
    );
}

#[test]
fn drift_and_temperature_are_told() {
    let folder = Folder::with(&[]);
    simulated(&folder, "drift.csv", &["--drift", "6", "--noise", "0.2"]);
    let answer = json(&folder, &["positioning", "drift.csv", "--format", "json"]);
    let rate = &answer["drift"]["rate"];
    assert_eq!(rate["unit"], "um/h");
    let (found, std) = (
        rate["value"].as_f64().unwrap(),
        rate["std"].as_f64().unwrap(),
    );
    // Kind: k·u, five standard uncertainties.
    assert!(
        (found - 6.0).abs() < 5.0 * std && std < 0.3,
        "{found} {std}"
    );
    let text = run(&folder, &["positioning", "drift.csv"]).stdout;
    assert!(
        text.contains("µm/h") && text.contains("over the test 1."),
        "{text}"
    );
    let warm = folder
        .read("drift.csv")
        .replace("position,time", "position,time,temperature");
    let warm: String = warm
        .lines()
        .enumerate()
        .map(|(i, l)| match l.starts_with(['#', 't']) {
            true => format!("{l}\n"),
            false => format!("{l},{}\n", 20.0 + 0.01 * i as f64),
        })
        .collect();
    folder.write("warm.csv", &warm);
    let text = run(&folder, &["positioning", "warm.csv"]).stdout;
    assert!(text.contains("Temperature from 20.0"), "{text}");
}

#[test]
fn what_a_test_lacks_is_said() {
    let folder = Folder::with(&[]);
    let notes = |options: &[&str], arguments: &[&str]| {
        simulated(&folder, "data.csv", options);
        run(&folder, &[&["positioning", "data.csv"], arguments].concat()).stdout
    };
    let text = notes(&["--runs", "1", "--to", "3000"], &[]);
    assert!(text.contains("one run, as ISO 230-2 asks"), "{text}");
    assert!(!text.contains("R   ") && !text.contains("A   "), "{text}");
    assert!(text.contains("one run does not show"), "{text}");
    let text = notes(&["--runs", "1"], &[]);
    assert!(text.contains("asks for five runs"), "{text}");
    let text = notes(&["--runs", "3"], &[]);
    assert!(text.contains("3 runs: ISO 230-2 asks for five"), "{text}");
    let text = notes(&["--to", "3000", "--targets", "30"], &[]);
    assert!(text.contains("go beyond it"), "{text}");
    let text = notes(&["--to", "1900"], &[]);
    assert!(!text.contains("Note"), "{text}");
    let text = notes(&["--targets", "4"], &[]);
    assert!(text.contains("4 targets: ISO 230-2 asks for 5"), "{text}");
    folder.write("long.toml", "[axis]\ntravel_from = 0\ntravel_to = 900\n");
    let text = notes(&[], &["--setup", "long.toml"]);
    assert!(text.contains("cover 56 % of the travel"), "{text}");
    folder.write("other.toml", "[axis]\ntravel_from = 10\ntravel_to = 19\n");
    let text = notes(&[], &["--setup", "other.toml"]);
    assert!(text.contains("outside the travel"), "{text}");
    simulated(&folder, "data.csv", &[]);
    let one: String = folder
        .read("data.csv")
        .lines()
        .filter(|l| !l.contains("backward"))
        .map(|l| format!("{l}\n"))
        .collect();
    folder.write("one.csv", &one);
    let text = run(&folder, &["positioning", "one.csv"]).stdout;
    assert!(
        text.contains("one direction of approach") && !text.contains("VDI"),
        "{text}"
    );
}

#[test]
fn report_shows_the_bands() {
    let folder = Folder::with(&[]);
    simulated(&folder, "data.csv", &[]);
    let out = run(&folder, &["positioning", "data.csv", "--out", "out"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let page = folder.read("out/report.html");
    for part in [
        "<svg",
        "± 2 s",
        "forward",
        "backward",
        "ISO 230-2",
        "VDI 3441",
        "A 1",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(folder.read("out/points.csv").lines().count(), 12);
    let again = run(&folder, &["positioning", "data.csv", "--seed", "2"]).stdout;
    assert_ne!(again, run(&folder, &["positioning", "data.csv"]).stdout);
}

#[test]
fn every_key_is_documented() {
    let folder = Folder::with(&[]);
    simulated(&folder, "data.csv", &["--drift", "3"]);
    let answer = json(&folder, &["positioning", "data.csv", "--format", "json"]);
    crate::command::documented(&answer, "docs/json/positioning.md");
}

/// A row left out and a field left empty are the same: told by name, in the figures of the others.
#[test]
fn readings_may_be_missing() {
    let folder = Folder::with(&[]);
    simulated(&folder, "whole.csv", &["--seed", "3"]);
    let (mut out, mut empty) = (String::new(), String::new());
    for line in folder.read("whole.csv").lines() {
        let mut fields: Vec<&str> = line.split(',').collect();
        let missing = matches!(
            fields.get(..3),
            Some(["50", "2", "forward"] | ["500", "5", "backward"])
        );
        if !missing {
            out += &format!("{line}\n");
        } else {
            fields[3] = "";
        }
        empty += &format!("{}\n", fields.join(","));
    }
    folder.write("out.csv", &out);
    folder.write("empty.csv", &empty);
    let [whole, out, empty] = ["whole.csv", "out.csv", "empty.csv"]
        .map(|name| json(&folder, &["positioning", name, "--format", "json"]));
    for key in ["iso230_2", "vdi3441", "points", "missing", "scatter"] {
        assert_eq!(out[key], empty[key], "{key}");
    }
    let none: [Value; 0] = [];
    assert_eq!(whole["missing"]["readings"], Value::from(none.to_vec()));
    let missing = &out["missing"]["readings"];
    assert_eq!(missing.as_array().unwrap().len(), 2);
    assert_eq!(missing[0]["target"], 50.0);
    assert_eq!(
        (&missing[0]["direction"], &missing[0]["run"]),
        (&"forward".into(), &2.into())
    );
    assert_eq!(out["points"][1]["readings_forward"], 4);
    assert_eq!(out["points"][1]["readings_backward"], 5);
    assert_eq!(out["scatter"]["degrees_of_freedom"], 86);
    assert!(
        value(&out, "iso230_2", "A") > 0.0 && out["iso230_2"]["A"]["U"].as_f64().unwrap() > 0.0
    );
    let text = run(&folder, &["positioning", "empty.csv"]).stdout;
    for part in [
        "forward and backward, 2 readings missing",
        "2 readings are missing (run 2 at 50 mm forward, run 5 at 500 mm backward)",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    folder.write("none.csv", "target,run,position\n0,1,\n10,1,\n");
    bad_input(
        &folder,
        &["positioning", "none.csv"],
        &["no reading in 2 rows", "help: "],
    );
}

#[test]
fn bad_readings_are_refused() {
    const GOOD: &str = "\
target,run,direction,position
0,1,forward,0.001
10,1,forward,10.002
0,2,forward,0.0012
10,2,forward,10.0021
0,1,backward,0.002
10,1,backward,10.003
0,2,backward,0.0022
10,2,backward,10.0031
";
    let folder = Folder::with(&[("good.csv", GOOD)]);
    assert_eq!(run(&folder, &["positioning", "good.csv"]).status, 0);
    for (from, to, expected) in [
        (
            "10,2,backward,10.0031\n",
            "",
            "data.csv:7:1: target 10 has one backward reading, of run 1, others have up to 2",
        ),
        (
            "10,2,backward,10.0031",
            "10,1,backward,10.0031",
            "data.csv:9:1: target 10 backward has run 1 twice",
        ),
        (
            "10,1,backward,10.003\n",
            "",
            "data.csv:8:1: target 10 has one backward reading, of run 2, others have up to 2",
        ),
        (
            "10,1,forward",
            "10,1,up",
            "data.csv:3:6: direction \"up\" is unknown",
        ),
        ("10,1,forward", "10,0,forward", "data.csv:3:4"),
        (
            "10.002",
            "ten",
            "data.csv:3:14: position \"ten\" is not a number",
        ),
        (
            "10.002",
            "1e12",
            "data.csv:3:14: position 1e12 is beyond any axis",
        ),
        ("position", "pos", "unknown column `pos`"),
        ("target", "soll", "unknown column `soll`"),
    ] {
        assert!(GOOD.contains(from));
        folder.write("data.csv", &GOOD.replacen(from, to, 1));
        bad_input(
            &folder,
            &["positioning", "data.csv", "--out", "out"],
            &[expected, "help: "],
        );
    }
    for (content, expected) in [
        ("target,position\n5,5.1\n", "one target alone, 5"),
        ("target,position\n", "no row"),
        (
            "target,position,deviation\n1,1,1\n",
            "both `position` and `deviation`",
        ),
        ("target,run\n1,1\n", "column `position` is missing"),
        ("", "empty"),
        (
            "target,direction,position\n0,forward,0\n0,backward,0\n9,forward,9\n",
            "target 9 has no backward reading",
        ),
    ] {
        folder.write("data.csv", content);
        bad_input(
            &folder,
            &["positioning", "data.csv", "--out", "out"],
            &[expected],
        );
    }
    for (setup, expected) in [
        ("[axis]\nkind = \"turning\"\n", "setup.toml:2:8"),
        ("[axis]\nunit = \"furlong\"\n", "no unit of its positions"),
        (
            "[axis]\nkind = \"rotary\"\nunit = \"mm\"\n",
            "positions of a rotary axis are in degrees",
        ),
        ("[axis]\ntravel_from = 5\n", "the travel has one end"),
        ("[axis]\ntravel_from = 5\ntravel_to = 5\n", "cannot be"),
        (
            "[uncertainty]\ndevice = -1\n",
            "device = -1 is no uncertainty",
        ),
        ("[uncertainty]\ndrfit = 1\n", "did you mean `drift`"),
    ] {
        folder.write("setup.toml", setup);
        bad_input(
            &folder,
            &["positioning", "good.csv", "--setup", "setup.toml"],
            &[expected],
        );
    }
    for arguments in [
        &["simulate", "positioning", "--targets", "1"][..],
        &["simulate", "positioning", "--to", "-1"],
        &["simulate", "positioning", "--noise", "-1"],
        &["simulate", "positioning", "--period", "0"],
        &["simulate", "positioning", "--gain", "1e309"],
    ] {
        bad_input(&folder, arguments, &[]);
    }
}
