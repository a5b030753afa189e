//! `errsep circle` and `errsep simulate circle` as people and programs use them.

use crate::command::{Folder, bad_input, run};
use serde_json::Value;

const SIX: &str = include_str!("../../fixtures/circle/six_points.csv");

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn number(value: &Value, pointer: &str) -> f64 {
    value
        .pointer(pointer)
        .and_then(Value::as_f64)
        .unwrap_or_else(|| panic!("{pointer}: {value}"))
}

#[test]
fn six_points_as_json() {
    let folder = Folder::with(&[("six.csv", SIX)]);
    let answer = json(
        &folder,
        &["circle", "six.csv", "--nistir", "--format", "json"],
    );
    assert_eq!(answer["schema"], "errsep.circle/1");
    // Tolerance: half a unit of the last published digit (Gander, Golub, Strebel).
    assert!((number(&answer, "/fit/radius/value") - 4.714226).abs() < 5.1e-7);
    assert!((number(&answer, "/fit/centre_x/value") - 4.739782).abs() < 5.1e-7);
    assert!(number(&answer, "/fit/radius/std") > 0.0);
    assert_eq!(answer["fit"]["radius"]["degrees_of_freedom"], 3.0);
    assert_eq!(answer["algebraic"].as_array().unwrap().len(), 4);
    assert_eq!(answer["circularity"].as_array().unwrap().len(), 4);
    // Appendix F ends at the Kåsa fit: its step test.
    assert!(
        (number(&answer, "/nistir/radius") - number(&answer, "/algebraic/0/radius")).abs() < 1e-8
    );
    assert_eq!(answer["residuals"]["value"].as_array().unwrap().len(), 6);
    assert_eq!(answer["convergence"]["converged"], true);
}

#[test]
fn simulated_points_are_read_back() {
    let folder = Folder::with(&[]);
    let made = run(
        &folder,
        &[
            "simulate", "circle", "--noise", "0", "--lobe", "2:3", "--seed", "4",
        ],
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write("points.csv", &made.stdout);
    let answer = json(&folder, &["circle", "points.csv", "--format", "json"]);
    assert_eq!(answer["points"], 36);
    // Two lobes of 3 µm: zone of 6 µm to second order, (3 µm)²/50 mm = 2e-4 µm.
    let zone = &answer["circularity"][1];
    assert_eq!(zone["reference"], "MZCI");
    assert!(
        (number(zone, "/deviation/value") - 6.0).abs() < 1e-3,
        "{zone}"
    );
}

#[test]
fn folder_holds_report_result_and_table() {
    let folder = Folder::with(&[("six.csv", SIX)]);
    let out = run(&folder, &["circle", "six.csv", "--out", "out"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let page = folder.read("out/report.html");
    for part in ["<svg", "Orthogonal-distance fit", "Circularity", "MZCI"] {
        assert!(page.contains(part), "{part}");
    }
    let result: Value = serde_json::from_str(&folder.read("out/result.json")).unwrap();
    assert_eq!(result["schema"], "errsep.circle/1");
    assert_eq!(folder.read("out/deviations.csv").lines().count(), 7);
}

#[test]
fn form_is_told_and_so_is_what_an_arc_cannot_show() {
    let folder = Folder::with(&[]);
    let told = |name: &str, extra: &[&str]| {
        let made = run(
            &folder,
            &[&["simulate", "circle", "--points", "72"][..], extra].concat(),
        );
        assert_eq!(made.status, 0, "{}", made.stderr);
        folder.write(name, &made.stdout);
        let text = run(&folder, &["circle", name]).stdout;
        (
            text.contains("are alike"),
            text.contains("passes for centre and radius"),
        )
    };
    assert_eq!(told("noise.csv", &["--seed", "3"]), (false, false));
    assert_eq!(told("lobes.csv", &["--lobe", "5:8"]), (true, false));
    assert_eq!(
        told("arc.csv", &["--arc", "90", "--seed", "3"]),
        (false, true)
    );
    let answer = json(&folder, &["circle", "arc.csv", "--format", "json"]);
    // Truncation: 1 µm of noise turns the ends by 2e-5 of 50 mm; the centre is known to some µm.
    assert!((number(&answer, "/fit/arc/value") - std::f64::consts::FRAC_PI_2).abs() < 1e-3);
    assert_eq!(answer["fit"]["neighbours_alike"]["form"], false);
    // The circumscribed circle is refused where the inscribed one is, with the same reason.
    for k in [2, 3] {
        let reason = answer["circularity"][k]["reason"].as_str().unwrap();
        assert!(reason.contains("too short an arc"), "{reason}");
    }
}

/// Three passes whose centres differ by 1 µm, read to some tenths: known no better than they agree.
#[test]
fn passes_that_differ_are_counted() {
    let mut table = "x,y,repeat\n".to_owned();
    for (pass, off) in [(1, 1e-3), (2, -1e-3), (3, 0.0)] {
        for k in 0..36 {
            let angle = f64::from(k).to_radians() * 10.0;
            let radius = 50.0 + 2e-4 * f64::from(37 * k * k + 11 * pass * k).sin();
            let (x, y) = (radius * angle.cos() + off, radius * angle.sin());
            table += &format!("{x:.9},{y:.9},{pass}\n");
        }
    }
    let without: Vec<&str> = table.lines().map(|l| &l[..l.rfind(',').unwrap()]).collect();
    let folder = Folder::with(&[("three.csv", &table), ("one.csv", &without.join("\n"))]);
    let answer = json(&folder, &["circle", "three.csv", "--format", "json"]);
    assert_eq!(answer["fit"]["passes"]["count"], 3);
    assert_eq!(answer["fit"]["passes"]["degrees_of_freedom"], 6.0);
    crate::command::documented(&answer, "docs/json/circle.md");
    let text = run(&folder, &["circle", "three.csv"]).stdout;
    assert!(
        text.contains("The circles of the 3 passes differ by"),
        "{text}"
    );
    let one = json(&folder, &["circle", "one.csv", "--format", "json"]);
    assert!(one["fit"]["passes"].is_null());
    // Three centres 1 µm apart: 0.6 µm of their mean, by six degrees of freedom of centre and radius; without the passes, of 108
    // points that scatter by 0.7 µm, a sixth.
    let std = |answer| number(answer, "/fit/centre_x/std");
    assert!(
        std(&answer) > 2.0 * std(&one),
        "{} {}",
        std(&answer),
        std(&one)
    );
}

#[test]
fn every_key_is_documented() {
    let folder = Folder::with(&[("six.csv", SIX)]);
    let answer = json(
        &folder,
        &["circle", "six.csv", "--nistir", "--format", "json"],
    );
    crate::command::documented(&answer, "docs/json/circle.md");
}

#[test]
fn bad_points_are_refused() {
    for (name, content, expected) in [
        ("line.csv", "x,y\n0,0\n1,1\n2,2\n", "straight line"),
        ("two.csv", "x,y\n0,0\n1,1\n", "three different points"),
        ("equal.csv", "x,y\n3,4\n3,4\n3,4\n", "same point"),
        ("nan.csv", "x,y\n0,0\n1,NaN\n2,0\n", "not a finite number"),
        ("text.csv", "x,y\n0,0\n1,one\n2,0\n", "not a number"),
        ("column.csv", "x,yy\n0,0\n1,1\n2,0\n", "unknown column"),
        ("missing.csv", "x\n0\n1\n2\n", "missing"),
        ("none.csv", "x,y\n", "no row"),
        ("empty.csv", "", "empty"),
        (
            "three.csv",
            "x,y\n0,0\n1,0\n0,1\n",
            "three points fit any circle",
        ),
        (
            "huge.csv",
            "x,y\n1,0\n-1,0\n0,1e160\n0,-1\n",
            "huge.csv:4:3: 1e160 mm is more than",
        ),
        (
            "tiny.csv",
            "x,y\n1e-160,0\n-1e-160,0\n0,1e-160\n0,-1e-160\n",
            "mm of each other, less than",
        ),
    ] {
        let folder = Folder::with(&[(name, content)]);
        bad_input(
            &folder,
            &["circle", name, "--out", "out"],
            &[name, expected],
        );
    }
    let folder = Folder::with(&[("six.csv", SIX)]);
    bad_input(
        &folder,
        &["circle", "six.csv", "--noise", "0"],
        &["--noise"],
    );
    bad_input(
        &folder,
        &["simulate", "circle", "--radius", "0"],
        &["radius"],
    );
}

#[test]
fn straight_noise_is_not_solved() {
    let rows: String = (0..20)
        .map(|i| format!("{i},{}\n", f64::from(i % 2) * 1e-3))
        .collect();
    let folder = Folder::with(&[("flat.csv", &format!("x,y\n{rows}"))]);
    let out = run(&folder, &["circle", "flat.csv"]);
    assert_eq!(out.status, 1, "{}", out.stderr);
    assert!(out.stderr.contains("straight line"), "{}", out.stderr);
}

#[test]
fn axle_section_if_it_is_there() {
    let Some(path) = crate::command::data("roundness_emu_axle/dataset1.csv") else {
        return;
    };
    let folder = Folder::with(&[]);
    let answer = json(&folder, &["circle", &path, "--format", "json"]);
    assert_eq!(answer["points"], 100);
    let width = |k: usize| number(&answer["circularity"][k], "/deviation/value");
    // No reference circle can be narrower than the minimum zone; tolerance: epsilons.
    for k in 0..4 {
        assert!(width(k) >= width(1) * (1.0 - 1e-12));
    }
}

#[test]
fn simulation_into_a_folder_is_told_in_short() {
    let folder = Folder::with(&[]);
    let arguments = ["simulate", "circle", "--noise", "2", "--seed", "4"];
    let printed = run(&folder, &arguments).stdout;
    assert_eq!(printed.lines().filter(|l| !l.starts_with('#')).count(), 37);
    let told = run(&folder, &[&arguments[..], &["--out", "made"]].concat()).stdout;
    for part in [
        "circle, seed 4",
        "points.csv: 36 rows",
        "noise 2.0 um",
        "Written to",
    ] {
        assert!(told.contains(part), "{told}");
    }
    assert!(told.lines().count() < 8, "{told}");
    assert!(
        printed.ends_with(&folder.read("made/points.csv")),
        "{printed}"
    );
}

/// Without noise the deviations are those of rounding: 50 mm in 15 digits.
#[test]
fn points_exactly_on_a_circle_are_a_circle() {
    let folder = Folder::with(&[]);
    let arguments = ["simulate", "circle", "--noise", "0", "--positions", "72"];
    folder.write("exact.csv", &run(&folder, &arguments).stdout);
    let answer = json(&folder, &["circle", "exact.csv", "--format", "json"]);
    assert!((number(&answer, "/fit/radius/value") - 50.0).abs() < 1e-12);
}

/// A noise that the points refute is told, in the words of the answer, to programs and on the page; the
/// right one is not.
#[test]
fn a_given_noise_is_held_against_the_deviations() {
    let folder = Folder::with(&[]);
    for seed in 1..=20 {
        let seed = seed.to_string();
        let made = run(
            &folder,
            &["simulate", "circle", "--noise", "1", "--seed", &seed],
        );
        folder.write("points.csv", &made.stdout);
        let args = ["circle", "points.csv", "--noise", "1", "--format", "json"];
        let answer = json(&folder, &args);
        assert!(
            answer["disagreement"].is_null(),
            "{seed}: {}",
            answer["disagreement"]
        );
        assert_eq!(answer["remarks"], serde_json::json!([]));
    }
    let args = ["circle", "points.csv", "--noise", "0.1", "--out", "out"];
    let told = run(&folder, &args).stdout;
    let page = folder.read("out/report.html");
    for said in [&told, &page] {
        assert!(
            said.contains("--noise states 0.100 µm: the uncertainties are too small"),
            "{said}"
        );
        assert!(said.contains("errsep diagnose"), "{said}");
    }
    assert!(page.contains("summary caution"));
    let answer: Value = serde_json::from_str(&folder.read("out/result.json")).unwrap();
    crate::command::documented(&answer, "docs/json/circle.md");
    // k·u: 33 degrees of freedom tell the noise to 12 %.
    assert!((number(&answer, "/disagreement/observed") - 1.0).abs() < 0.4);
    assert!(number(&answer, "/disagreement/p_value") < 1e-3);
}

#[test]
fn the_zone_is_the_distance_of_two_circles_and_three_points_show_none() {
    let folder = Folder::with(&[("six.csv", SIX), ("three.csv", "x,y\n1,0\n0,1\n-1,0\n")]);
    run(&folder, &["circle", "six.csv", "--out", "six"]);
    let page = folder.read("six/report.html");
    assert!(page.contains("between two concentric circles"), "{page}");
    let told = run(&folder, &["circle", "three.csv", "--noise", "1"]).stdout;
    assert!(
        told.contains("Three points always lie on a circle"),
        "{told}"
    );
}

/// A radius that grows, or a centre that moves, evenly from the first point to the last: a spiral of our own making is named.
/// One turn shows the step where it closes and little else, which either makes; four turns tell them apart.
#[test]
fn a_spiral_is_named() {
    let folder = Folder::with(&[]);
    for (turns, radius, along) in [
        ("1", 0.010, [0.0, 0.0]),
        ("4", 0.010, [0.0, 0.0]),
        ("4", 0.0, [0.008, -0.005]),
    ] {
        let words = [
            "simulate",
            "circle",
            "--positions",
            "72",
            "--repeats",
            turns,
            "--seed",
            "3",
        ];
        let made = run(&folder, &words);
        assert_eq!(made.status, 0, "{}", made.stderr);
        let rows: Vec<&str> = made
            .stdout
            .lines()
            .filter(|l| !l.starts_with('#'))
            .collect();
        let header: Vec<&str> = rows[0].split(',').collect();
        let [at_x, at_y] = ["x", "y"].map(|name| header.iter().position(|h| *h == name).unwrap());
        let mut text = rows[0].to_owned() + "\n";
        for (k, row) in rows[1..].iter().enumerate() {
            let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
            let [x, y]: [f64; 2] = [at_x, at_y].map(|i| fields[i].parse().unwrap());
            let share = k as f64 / (rows.len() - 2) as f64;
            let grown = 1.0 + share * radius / x.hypot(y);
            fields[at_x] = (grown * x + share * along[0]).to_string();
            fields[at_y] = (grown * y + share * along[1]).to_string();
            text += &(fields.join(",") + "\n");
        }
        folder.write("spiral.csv", &text);
        let answer = json(
            &folder,
            &[
                "diagnose",
                "spiral.csv",
                "--model",
                "circle",
                "--format",
                "json",
            ],
        );
        let verdict = &answer["verdict"];
        let (name, size) = match radius > 0.0 {
            true => ("radius-growth", 10.0),
            false => ("centre-drift", 8.0),
        };
        assert_eq!(verdict["effects"], serde_json::json!([name]), "{verdict}");
        if turns == "1" {
            let group = verdict["indistinguishable"].to_string();
            assert!(group.contains("centre-drift"), "{group}");
            let told = run(&folder, &["circle", "spiral.csv"]).stdout;
            assert!(told.contains("`errsep diagnose --model circle`"), "{told}");
        }
        let candidates = answer["candidates"].as_array().unwrap();
        let own = candidates.iter().find(|c| c["effect"] == name).unwrap();
        let [value, std] = ["value", "std"].map(|key| own["parameters"][0][key].as_f64().unwrap());
        // Kind: k·u.
        assert!((value - size).abs() < 4.0 * std, "{own}");
    }
}
