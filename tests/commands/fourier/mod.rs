//! `errsep fourier` and `errsep simulate fourier` as people and programs use them.

mod missing;
mod refused;

use crate::command::{Folder, bad_input, run};
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
    // Tolerance: k·u of a standard deviation with 591 degrees of freedom.
    let noise = answer["noise"]["value"].as_f64().unwrap();
    assert!(
        (noise / 2.0 - 1.0).abs() < 3.0 / 1182.0_f64.sqrt(),
        "{noise}"
    );
    // Three spacings of 99 orders, two repeats, less a step each; the factor is that of Student's
    // distribution. Tolerance: digits in print (1.964 for 591 degrees of freedom).
    assert_eq!(answer["uncertainty"]["degrees_of_freedom"], 591.0);
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
    crate::command::documented(&answer, "docs/json/fourier.md");
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
    // Tolerance: epsilons of 40 µm times the condition of the fitted step.
    let value = |key: &str| answer[key]["value"].as_f64().unwrap();
    assert!((value("height_difference") - 20.0).abs() < 1e-9);
    assert!((value("rise") - 4.0 * std::f64::consts::PI).abs() < 1e-9);
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
    assert_eq!(answer["methods"].as_array().unwrap().len(), 5);
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
fn form_beyond_the_orders_is_told_with_what_it_does_to_the_joint() {
    // A wave of 45 undulations: 3 µm from peak to mean, beyond the 30 orders kept by default.
    let rows: String = (0..=200)
        .map(|k| {
            let x = 0.5 * f64::from(k);
            let f = |x: f64| 3.0 * (std::f64::consts::TAU * 45.0 * x / 100.0).sin();
            let jitter =
                |i: f64| ((12.9898 * f64::from(k) + 78.233 * i).sin() * 43_758.545).fract();
            let (m1, m2, m3) = (
                f(x) + jitter(1.0),
                f(x + 34.0) + jitter(2.0),
                f(x - 66.0) + jitter(3.0),
            );
            format!("34,{x},{m1},{m2},{m3}\n")
        })
        .collect();
    let folder = Folder::with(&[("d.csv", &format!("spacing,x,m1,m2,m3\n{rows}"))]);
    let arguments = ["fourier", "d.csv", "--length", "100"];
    let answer = json(&folder, &[&arguments[..], &["--format", "json"]].concat());
    // Tolerance: truncation; 3/√2 µm rms and what order 45 passes at d = 34, |T|²/2 = 1.31.
    let rms = answer["beyond_orders"]["rms"].as_f64().unwrap();
    let passed = 3.0 * (1.0 - (std::f64::consts::TAU * 45.0 * 0.34).cos()).sqrt() / 2f64.sqrt();
    assert!((rms / passed - 1.0).abs() < 0.1, "{rms} {passed}");
    assert_eq!(answer["compensation"], "chord");
    let text = run(&folder, &arguments).stdout;
    for part in ["finer than the 30 orders", "not fitted"] {
        assert!(text.contains(part), "{text}");
    }
    folder.write("s.toml", "[section]\nlength = 100\norders = 50\n");
    let arguments = ["fourier", "d.csv", "--setup", "s.toml", "--format", "json"];
    let answer = json(&folder, &arguments);
    assert!(answer["beyond_orders"].is_null());
    assert_eq!(answer["compensation"], "fitted");
    crate::command::documented(&answer, "docs/json/fourier.md");
}

/// What a simulation writes can be worked with as it stands, by the command that it names; without noise
/// none is told.
#[test]
fn a_simulation_writes_its_set_up() {
    for (noise, stated) in [("0.7", true), ("0", false)] {
        let folder = Folder::with(&[]);
        let out = run(
            &folder,
            &[
                "simulate",
                "fourier",
                "--samples",
                "200",
                "--length",
                "120",
                "--noise",
                noise,
                "--out",
                "made",
            ],
        );
        assert_eq!(out.status, 0, "{}", out.stderr);
        let next = "errsep fourier made/scans.csv --setup made/setup.toml";
        assert!(out.stdout.contains(next), "{}", out.stdout);
        assert_eq!(folder.read("made/setup.toml").contains("noise"), stated);
        let arguments: Vec<&str> = next
            .split(' ')
            .skip(1)
            .chain(["--format", "json"])
            .collect();
        let answer = json(&folder, &arguments);
        let positions = numbers(&answer, "/profiles/x");
        assert_eq!(positions.len(), 200);
        assert!((positions[199] - 120.0 * 199.0 / 200.0).abs() < 1e-9);
        if stated {
            assert_eq!(answer["noise"]["source"], "given");
            assert_eq!(answer["noise"]["value"], 0.7);
        }
    }
}

/// The straightness of the slide is that of noisy points: its interval, not its value, holds the truth, and
/// the uncertainty of its points is what they scatter by.
#[test]
fn straightness_has_an_interval_and_the_slide_its_uncertainty() {
    let folder = Folder::with(&[]);
    let straight = |x: &[f64], y: &[f64]| {
        let found = errsep_models::fourier::straightness(x, y);
        found.iter().copied().fold(f64::MIN, f64::max)
            - found.iter().copied().fold(f64::MAX, f64::min)
    };
    let (mut held, mut beyond, mut squares) = ([0, 0], 0, 0.0);
    for seed in 1..=20 {
        let seed = seed.to_string();
        let made = ["simulate", "fourier", "--samples", "200", "--seed", &seed];
        folder.write("scans.csv", &run(&folder, &made).stdout);
        let truth = json(&folder, &[&made[..], &["--format", "json"]].concat());
        let args = [
            "fourier",
            "scans.csv",
            "--length",
            "100",
            "--format",
            "json",
        ];
        let answer = json(&folder, &args);
        let x = numbers(&answer, "/profiles/x");
        for (k, of) in ["workpiece", "slide"].into_iter().enumerate() {
            let width = straight(&x, &numbers(&truth, &format!("/truth/profiles/{of}")));
            let error = &answer["straightness"][of];
            let interval = numbers(error, "/interval");
            held[k] += usize::from(interval[0] <= width && width <= interval[1]);
            beyond += usize::from(k == 1 && error["value"].as_f64().unwrap() > width);
            assert!(error["std"].as_f64().unwrap() > 0.0);
        }
        let straightened = |y: &[f64]| errsep_models::fourier::straightness(&x, y);
        let found = straightened(&numbers(&answer, "/profiles/slide"));
        let truth = straightened(&numbers(&truth, "/truth/profiles/slide"));
        let std = numbers(&answer, "/profiles/slide_std");
        let own = found
            .iter()
            .zip(&truth)
            .zip(&std)
            .map(|((f, t), u)| ((f - t) / u).powi(2));
        squares += own.sum::<f64>() / x.len() as f64 / 20.0;
    }
    // 95 % of 20: fewer than 16 have a probability of 0.3 %.
    assert!(held.iter().all(|n| *n >= 16), "{held:?}");
    // Half of 20 without a bias: 15 and more have a probability of 2 %.
    assert!(beyond >= 15, "the noise widens the slide: {beyond}");
    // Truncation: the line is taken out of both, a hundredth of the variance.
    assert!((squares - 1.0).abs() < 0.1, "{squares}");
    let text = run(
        &folder,
        &["fourier", "scans.csv", "--length", "100", "--out", "out"],
    )
    .stdout;
    for said in [&text, &folder.read("out/report.html")] {
        assert!(
            said.contains("95 % interval") && said.contains("as much noise again would add"),
            "{said}"
        );
    }
}
