//! `errsep fourier` and `errsep simulate fourier` as people and programs use them.

mod command;

use command::{Folder, bad_input, run};
use serde_json::Value;

fn simulated(arguments: &[&str]) -> String {
    let folder = Folder::with(&[]);
    let all = [&["simulate", "fourier", "--samples", "200"], arguments].concat();
    let made = run(&folder, &all);
    assert_eq!(made.status, 0, "{}", made.stderr);
    made.stdout
}

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn numbers(value: &Value, pointer: &str) -> Vec<f64> {
    let list = value.pointer(pointer).and_then(Value::as_array).unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn simulated_profile_is_found_within_its_uncertainty() {
    let setup = "[section]\nlength = 100.0\n[method]\ncompensation = \"none\"\n";
    let folder = Folder::with(&[("s.toml", setup)]);
    let arguments = [
        "simulate",
        "fourier",
        "--samples",
        "200",
        "--slope",
        "0",
        "--repeats",
        "2",
    ];
    let made = json(&folder, &[&arguments[..], &["--format", "json"]].concat());
    folder.write("scans.csv", &run(&folder, &arguments).stdout);
    let answer = json(
        &folder,
        &[
            "fourier",
            "scans.csv",
            "--setup",
            "s.toml",
            "--format",
            "json",
        ],
    );
    assert_eq!(answer["schema"], "errsep.fourier/1");
    assert_eq!(answer["noise"]["source"], "repeats");
    // Tolerance: k·u of a standard deviation with 600 degrees of freedom.
    let noise = answer["noise"]["value"].as_f64().unwrap();
    assert!(
        (noise / 2.0 - 1.0).abs() < 3.0 / 1200.0_f64.sqrt(),
        "{noise}"
    );
    // Three spacings of 200 differences, two repeats; the factor is that of Student's distribution.
    // Tolerance: digits in print (1.964 for 600 degrees of freedom).
    assert_eq!(answer["uncertainty"]["degrees_of_freedom"], 600.0);
    let k = answer["uncertainty"]["coverage_factor"].as_f64().unwrap();
    assert!((k - 1.964).abs() < 5e-4, "{k}");
    let truth = numbers(&made, "/truth/profiles/workpiece");
    let found = numbers(&answer, "/profiles/workpiece");
    let std = numbers(&answer, "/profiles/workpiece_std");
    let squares: f64 = found
        .iter()
        .zip(&truth)
        .zip(&std)
        .map(|((f, t), u)| ((f - t) / u).powi(2))
        .sum();
    // Tolerance: mean square of 60 coefficients' worth of normal deviates, k·u = 3 √(2/60).
    let mean = squares / found.len() as f64;
    assert!((mean - 1.0).abs() < 0.55, "{mean}");
    assert!(answer["repeatability"]["value"].as_f64().unwrap() > 0.0);
    command::documented(&answer, "docs/json/fourier.md");
}

#[test]
fn height_difference_and_rise_are_given_beside_the_profile() {
    let table = simulated(&["--noise", "0", "--slope", "2", "--height-difference", "20"]);
    let folder = Folder::with(&[("scans.csv", &table)]);
    let answer = json(
        &folder,
        &[
            "fourier",
            "scans.csv",
            "--length",
            "100",
            "--format",
            "json",
        ],
    );
    // Tolerance: epsilons of 40 µm; m₂ − m₃ is the same on both sides of a joint off the grid.
    let value = |key: &str| answer[key]["value"].as_f64().unwrap();
    assert!((value("height_difference") - 20.0).abs() < 1e-11);
    assert!((value("rise") - 4.0 * std::f64::consts::PI).abs() < 1e-11);
}

#[test]
fn one_file_a_spacing_with_a_set_up() {
    let setup = "[section]\nlength = 100.0\norders = 20\n[probe]\nspacing = [48.5, 34.1]\nnoise = 2.0\n[method]\ncombination = \"hybrid\"\ncompensation = \"none\"\n";
    let folder = Folder::with(&[("s.toml", setup)]);
    for (name, spacing) in [("a.csv", "48.5"), ("b.csv", "34.1")] {
        let table = simulated(&["--spacing", spacing]);
        let kept: Vec<String> = table
            .lines()
            .filter(|l| !l.starts_with('#'))
            .map(|l| l.split_once(',').unwrap().1.to_owned())
            .collect();
        folder.write(name, &kept.join("\n"));
    }
    let answer = json(
        &folder,
        &[
            "fourier", "a.csv", "b.csv", "--setup", "s.toml", "--format", "json",
        ],
    );
    assert_eq!(answer["combination"], "hybrid");
    assert_eq!(answer["orders"].as_array().unwrap().len(), 20);
    assert_eq!(answer["scans"][1]["spacing"], 34.1);
    assert_eq!(answer["methods"].as_array().unwrap().len(), 4);
    bad_input(
        &folder,
        &["fourier", "a.csv", "--setup", "s.toml", "--out", "out"],
        &["2 probe spacings for 1 files"],
    );
}

#[test]
fn lost_orders_are_named_and_the_report_is_written() {
    let folder = Folder::with(&[("scans.csv", &simulated(&["--spacing", "25"]))]);
    let out = run(
        &folder,
        &["fourier", "scans.csv", "--length", "100", "--out", "out"],
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        out.stdout.contains("4, 8, 12, 16, 20, 24, 28"),
        "{}",
        out.stdout
    );
    let page = folder.read("out/report.html");
    for part in ["<svg", "Lost orders: 4, 8", "determinant"] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(folder.read("out/orders.csv").lines().count(), 31);
    assert_eq!(folder.read("out/profiles.csv").lines().count(), 201);
}

#[test]
fn two_probes_are_enough_for_a_profile_that_repeats() {
    let folder = Folder::with(&[(
        "scans.csv",
        &simulated(&["--two-probes", "--spacing", "34.1"]),
    )]);
    let answer = json(
        &folder,
        &[
            "fourier",
            "scans.csv",
            "--length",
            "100",
            "--format",
            "json",
        ],
    );
    assert_eq!(answer["scans"][0]["probes"], 2);
    assert!(answer["height_difference"].is_null());
}

#[test]
fn bad_scans_are_refused() {
    let header = "spacing,x,m1,m2,m3\n";
    let rows = |from: usize, skip: usize| -> String {
        (from..=100)
            .filter(|i| *i != skip)
            .map(|i| format!("34.1,{i},0.1,0.2,0.3\n"))
            .collect()
    };
    for (name, content, expected) in [
        ("gap.csv", format!("{header}{}", rows(0, 50)), "even grid"),
        ("late.csv", format!("{header}{}", rows(5, 200)), "even grid"),
        (
            "short.csv",
            format!("{header}34.1,0,0,0,0\n34.1,1,0,0,0\n"),
            "grid must fill",
        ),
        (
            "text.csv",
            format!("{header}34.1,0,zero,0,0\n"),
            "not a number",
        ),
        ("empty.csv", String::new(), "empty"),
        ("none.csv", header.to_owned(), "no row"),
        (
            "column.csv",
            format!("{}34.1,0,0,0,0\n", header.replace("m3", "m4")),
            "unknown column",
        ),
        (
            "missing.csv",
            "spacing,x,m1\n34.1,0,0\n".to_owned(),
            "`m2` is missing",
        ),
        (
            "spacing.csv",
            "x,m1,m2\n0,0,0\n".to_owned(),
            "probe spacing is not known",
        ),
        (
            "far.csv",
            format!("{header}134.1,0,0,0,0\n134.1,1,0,0,0\n"),
            "between 0 and",
        ),
        (
            "joint.csv",
            format!(
                "{header}{}",
                rows(0, 200).replace("34.1,65,0.1,0.2,0.3", "34.1,65,0.1,0.2,")
            ),
            "height difference",
        ),
    ] {
        let folder = Folder::with(&[(name, &content)]);
        bad_input(
            &folder,
            &["fourier", name, "--length", "100", "--out", "out"],
            &[name, expected],
        );
    }
    let folder = Folder::with(&[
        ("d.csv", &format!("{header}{}", rows(0, 200))),
        ("s.toml", "[section]\nlenght = 100\n"),
    ]);
    bad_input(
        &folder,
        &["fourier", "d.csv", "--out", "out"],
        &["length of the section"],
    );
    bad_input(
        &folder,
        &["fourier", "d.csv", "--setup", "s.toml"],
        &["s.toml:2", "did you mean `length`"],
    );
    bad_input(
        &folder,
        &["simulate", "fourier", "--spacing", "200"],
        &["spacing"],
    );
}
