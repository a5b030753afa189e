//! `errsep machine`: the figures of NISTIR 6868 from its machine file, and every kind of wrong
//! input with place and remedy.

mod refused;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;
use tempfile::TempDir;

const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;

fn fixture(name: &str) -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/nistir6868")
        .join(name);
    path.to_str().unwrap().to_owned()
}

fn errsep(args: &[&str]) -> Output {
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(args)
        .output()
        .unwrap()
}

/// The JSON answer of an action on the report's machine.
fn answer(action: &[&str]) -> Value {
    let machine = fixture("machine.toml");
    let output = errsep(&[&["machine", &machine], action, &["--format", "json"]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["schema"], "errsep.machine/1");
    assert_eq!(value["action"], action[0]);
    assert_eq!(value["chain"], "XYFZ");
    value
}

fn near(found: &Value, expected: f64, tolerance: f64) {
    let number = found
        .as_f64()
        .unwrap_or_else(|| panic!("{found} is no number"));
    assert!(
        (number - expected).abs() <= tolerance,
        "{number} is not {expected}"
    );
}

#[test]
fn lengths_of_table_4() {
    let found = answer(&[
        "length",
        &fixture("holes.csv"),
        "--between",
        "3:9",
        "--between",
        "9:15",
        "--between",
        "3:15",
        "--independence",
        "coordinates",
    ]);
    assert_eq!(found["independence"], "coordinates");
    let assumed = found["assumption"].as_str().unwrap();
    assert!(assumed.contains("every coordinate"), "{assumed}");
    let holes = fixture("holes.csv");
    let usual = answer(&["length", &holes, "--between", "3:9"]);
    assert_eq!(usual["independence"], "scatter");
    assert!(usual["assumption"].is_null());
    // Certified digits of print, and 0.002 of the recovered variances.
    for (result, (error, u)) in found["results"].as_array().unwrap().iter().zip([
        (-2.380, 6.72),
        (-2.970, 6.47),
        (-1.513, 6.38),
    ]) {
        near(&result["result"]["value"], error, 0.02);
        near(&result["result"]["std"], u, 0.007);
        assert!(result["expanded"]["coverage_factor"].as_f64().unwrap() > 1.96);
        for key in [
            "label",
            "value",
            "std",
            "unit",
            "sensitivity",
            "contribution",
            "share",
        ] {
            assert!(!result["contributions"][0][key].is_null(), "{key}");
        }
    }
}

#[test]
fn squareness_of_tables_5_and_6() {
    let found = answer(&[
        "squareness",
        &fixture("holes.csv"),
        "--first",
        "3,26,25,24,23,22,21",
        "--second",
        "3,4,5,6,7,8,9",
        "--independence",
        "coordinates",
        "--trials",
        "20000",
    ]);
    let result = &found["results"][0];
    near(&result["result"]["value"], -5.103 * ARCSEC, 0.03 * ARCSEC);
    near(&result["result"]["std"], 11.09 * ARCSEC, 0.007 * ARCSEC);
    // k·u: 20 000 trials.
    near(
        &result["monte_carlo"]["mean"],
        -5.103 * ARCSEC,
        4.0 * 0.08 * ARCSEC,
    );
    near(
        &result["monte_carlo"]["std"],
        11.1 * ARCSEC,
        4.0 * 0.056 * ARCSEC,
    );
    assert_eq!(result["monte_carlo"]["trials"], 20_000);
}

#[test]
fn circularity_of_tables_7_and_8() {
    let circle = |radius: &str, seed: &str| {
        let found = answer(&[
            "circularity",
            "--centre",
            "75,75",
            "--radius",
            radius,
            "--independence",
            "coordinates",
            "--trials",
            "20000",
            "--seed",
            seed,
        ]);
        found["results"][0].clone()
    };
    for (radius, mean, std, alone) in [("44.5", 17.87, 3.12, 1.06), ("55.5", 18.01, 3.16, 1.33)] {
        let result = circle(radius, "1");
        near(&result["monte_carlo"]["mean"], mean, 4.0 * 0.024 + 0.005);
        near(&result["monte_carlo"]["std"], std, 4.0 * 0.018 + 0.005);
        near(&result["without_scatter"], alone, 0.015);
    }
    // The seed makes the answer.
    assert_eq!(circle("44.5", "7"), circle("44.5", "7"));
    assert_ne!(
        circle("44.5", "7")["monte_carlo"],
        circle("44.5", "8")["monte_carlo"]
    );
}

#[test]
fn predictions_of_table_a1_and_their_folder() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let found = answer(&[
        "predict",
        &fixture("holes.csv"),
        "--out",
        out.to_str().unwrap(),
    ]);
    let points = found["points"].as_array().unwrap();
    assert_eq!(points.len(), 24);
    let ninth = points.iter().find(|p| p["point"] == "9").unwrap();
    near(&ninth["deviation"]["x"]["result"]["value"], 5.04, 0.03);
    near(
        &ninth["deviation"]["x"]["result"]["std"],
        20.96_f64.sqrt(),
        0.003,
    );
    near(&ninth["deviation"]["y"]["result"]["value"], -0.75, 0.015);
    // First order against finite rotations: the square of 30 urad over 140 mm is 0.1 nm.
    let first = ninth["deviation"]["x"]["result"]["value"].as_f64().unwrap();
    near(&ninth["deviation"]["x"]["by_finite_rotations"], first, 1e-3);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Budget"));
    let table = fs::read_to_string(out.join("deviations.csv")).unwrap();
    assert_eq!(table.lines().count(), 25);
    assert!(out.join("result.json").exists());
}

#[test]
fn the_report_s_parts_scatter_more_than_its_machine() {
    let ratios = |file: &str| {
        let found = answer(&["parts", &fixture(file), "--points", &fixture("holes.csv")]);
        assert_eq!(found["readings"], 324);
        let share = found["within_two_standard_uncertainties"].as_f64().unwrap();
        (share, found["points"].as_array().unwrap().len())
    };
    let ((drilled, six), (milled, _)) = (ratios("drilled_holes.csv"), ratios("milled_holes.csv"));
    assert_eq!(six, 6);
    // The report's conclusion: up to nine times the uncertainty for drilled holes, four for milled.
    assert!(drilled < milled && milled < 0.6, "{drilled} {milled}");
}

#[test]
fn simulated_components_give_the_machine_back() {
    let folder = TempDir::new().unwrap();
    let (machine, out) = (fixture("machine.toml"), folder.path().join("simulated"));
    let output = errsep(&[
        "simulate",
        "machine",
        &machine,
        "--stations",
        "12",
        "--repeats",
        "60",
        "--points",
        &fixture("holes.csv"),
        "--parts",
        "5",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let names = ["EXX", "EYX", "ECX", "EXY", "EYY", "ECY"];
    let mut fitted = String::from("chain = \"XYFZ\"\ncoordinates = \"slide\"\nsense = \"work\"\n");
    for name in names {
        fitted.push_str(&format!("[errors.{name}]\ndegree = 1\n"));
    }
    fitted.push_str("[errors.C0Y]\ndegree = 0\n");
    let model = folder.path().join("fitted.toml");
    fs::write(&model, fitted).unwrap();
    let components = out.join("components.csv");
    let output = errsep(&[
        "machine",
        model.to_str().unwrap(),
        "--components",
        components.to_str().unwrap(),
        "parts",
        out.join("parts.csv").to_str().unwrap(),
        "--points",
        &fixture("holes.csv"),
        "--format",
        "json",
    ]);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["readings"], 24 * 2 * 5 * 2);
    // k·u: parts of the machine itself lie inside two standard uncertainties 95 times in 100.
    near(&found["within_two_standard_uncertainties"], 0.95, 0.04);
}

/// A plate that lies turned: with `align = "free"` the pose is told and is no cause.
#[test]
fn the_pose_of_a_plate_belongs_to_the_model() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let (mut plate, mut points) = (
        String::from("part,point,axis,replicate,value\n"),
        String::from("point,x,y,z\n"),
    );
    for k in 0..16 {
        let (x, y) = (50.0 * f64::from(k % 4), 50.0 * f64::from(k / 4));
        points += &format!("P{k},{x},{y},0\n");
        for replicate in 1..=3 {
            // A turn of 100 µrad about the datum and a shift of (30, -20) µm; 0.1 µm of noise, repeatable.
            let noise =
                |way: i32| 0.1 * f64::from((k * 7 + replicate * 5 + way * 3) % 11 - 5) / 3.0;
            let (dx, dy) = (30.0 - 0.1 * y + noise(0), -20.0 + 0.1 * x + noise(1));
            plate += &format!("plug,P{k},x,{replicate},{dx}\nplug,P{k},y,{replicate},{dy}\n");
        }
    }
    let (plate, points) = (write("plate.csv", &plate), write("points.csv", &points));
    let told = |machine: &str| {
        let setup = write("cmm.toml", machine);
        let output = errsep(&["diagnose", &plate, "--setup", &setup, "--points", &points]);
        String::from_utf8(output.stdout).unwrap()
    };
    let free = told("chain = \"FXYZ\"\n[part]\nalign = \"free\"\n");
    assert!(free.contains("No significant misfit"), "{free}");
    // The middle is at (75, 75): 30 - 7.5 and -20 + 7.5 µm.
    for words in [
        "Part plug: zero of x 22.",
        "zero of y −12.",
        "turn about z 100.",
    ] {
        let other = words.replace("22.", "23.").replace("100.", "99.");
        assert!(
            free.contains(words) || free.contains(&other),
            "{words}: {free}"
        );
    }
    let fixed = told("chain = \"FXYZ\"\n[part]\nalign = \"fixed\"\n");
    assert!(
        fixed.contains("datum-offset") && fixed.contains("datum-rotation"),
        "{fixed}"
    );
    assert!(!fixed.contains("Part plug: zero"), "{fixed}");
}
