//! The reversal on data of others, read where they lie: `../shared/data`, or the folder that the
//! environment variable `ERRSEP_DATA` names. Absent: skipped, and said.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

fn data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ERRSEP_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = folder.join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there", path.display());
    None
}

fn json(args: &[&str]) -> Value {
    let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(args)
        .args(["--format", "json"])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

const CAD_COLUMNS: &str = "x=z_mm:mm,1A=I_0_0:mm,1B=I_180_0:mm,2B=I_0_180:mm,2A=I_180_180:mm";

fn degrees(value: &Value) -> f64 {
    value["value"].as_f64().unwrap().to_degrees()
}

/// The file's readings are rounded to 1e-5 or 1e-6 mm, which is 1e-5/100 rad or 6e-6 degrees; the
/// author of the data states the truth to 1e-5 degrees. Certified digits.
const CAD: f64 = 1e-5;

#[test]
fn cad_model_with_slide_set_up_and_cone() {
    let Some(file) = data("cad_reversal/cad_reversal_2.csv") else {
        return;
    };
    let folder = TempDir::new().unwrap();
    let rigid = folder.path().join("rigid.toml");
    std::fs::write(&rigid, "[model]\nconvention = \"rigid\"\n").unwrap();
    let args = ["reversal", file.to_str().unwrap(), "--columns", CAD_COLUMNS];
    for method in [&["--method", "shear"][..], &["--method", "rotation"]] {
        let seed = json(&[&args, method].concat());
        for (tilt, truth) in [("alpha", -0.4), ("beta", 0.0), ("gamma", -0.1)] {
            assert!(
                (degrees(&seed["tilts"][tilt]) - truth).abs() < CAD,
                "{tilt} {seed}"
            );
        }
        assert!((degrees(&seed["closure"]["slope"]) - 0.05).abs() < CAD);
        let rigid = json(&[&args, method, &["--setup", rigid.to_str().unwrap()]].concat());
        for (tilt, truth) in [("alpha", -0.4), ("set_up", -0.1), ("cone", 0.05)] {
            assert!(
                (degrees(&rigid["tilts"][tilt]) - truth).abs() < CAD,
                "{tilt} {rigid}"
            );
        }
        assert!(degrees(&rigid["closure"]["slope"]).abs() < CAD);
        // What is left is the rounding of the file: 1e-6 to 1e-5 mm uniform, below 3 nm.
        assert!(rigid["residual"]["rms"].as_f64().unwrap() < 3e-3);
        // The seed has no cone: 0.05° over 100 mm is left, 872.7 µm/m × 100 mm/√12 at the ends.
        assert!(seed["residual"]["rms"].as_f64().unwrap() > 25.0);
    }
}

/// The cone of the artefact is not in the model of the convention `seed`: what it leaves must not make
/// one channel worthless and move the tilt that symmetry leaves alone.
#[test]
fn cad_model_in_one_fit() {
    let Some(file) = data("cad_reversal/cad_reversal_2.csv") else {
        return;
    };
    let args = ["reversal", file.to_str().unwrap(), "--columns", CAD_COLUMNS];
    let staged = json(&args);
    let one_fit = json(&[&args, &["--simultaneous"][..]].concat());
    let alpha = |answer: &Value| answer["tilts"]["alpha"]["value"].as_f64().unwrap();
    // Certified digits: the readings are rounded to 0.01 µm over 100 mm; 0.02 µrad.
    assert!((alpha(&one_fit) - alpha(&staged)).abs() < 2e-8, "{one_fit}");
    assert!((alpha(&one_fit).to_degrees() + 0.4).abs() < CAD);
    assert_eq!(one_fit["agreement"]["disagree"], true);
    assert!(one_fit["tilts"]["alpha"]["std"].as_f64().unwrap() > 1e-6);
    assert!(one_fit["warnings"].to_string().contains("errsep diagnose"));
}

/// With the cone in the fit nothing is left but the rounding of the file: neither tilts nor forms take it.
#[test]
fn cad_model_with_its_cone_in_the_fit() {
    let Some(file) = data("cad_reversal/cad_reversal_2.csv") else {
        return;
    };
    let args = ["reversal", file.to_str().unwrap(), "--columns", CAD_COLUMNS];
    let fit = json(&[&args, &["--simultaneous", "--with", "taper"][..]].concat());
    let cone = &fit["effects"][0]["parameters"][0];
    assert_eq!(
        (&fit["effects"][0]["effect"], &cone["unit"]),
        (&"taper".into(), &"rad".into())
    );
    assert!((degrees(cone) - 0.05).abs() < CAD, "{cone}");
    for (tilt, truth) in [("alpha", -0.4), ("beta", 0.0), ("gamma", -0.1)] {
        assert!(
            (degrees(&fit["tilts"][tilt]) - truth).abs() < CAD,
            "{tilt} {fit}"
        );
    }
    // The attitude is exact: a column for the cone added outside alone would move β by 0.02 µrad.
    assert!(
        degrees(&fit["tilts"]["beta"]).to_radians().abs() < 5e-9,
        "{fit}"
    );
    // Certified digits: readings rounded to 1e-6 to 1e-5 mm, below 3 nm root mean square.
    assert!(fit["residual"]["rms"].as_f64().unwrap() < 3e-3);
    assert!(fit["closure"]["rms"]["value"].as_f64().unwrap() < 3e-3);
    assert!(fit["closure"]["slope"].is_null());
    for form in ["M", "S_A", "S_B"] {
        let values = fit["forms"][form].as_array().unwrap();
        let most = values
            .iter()
            .map(|v| v.as_f64().unwrap().abs())
            .fold(0.0, f64::max);
        assert!(most < 1e-2, "{form} {most}");
    }
}

/// The fit has the cone within its uncertainty. The diagnosis is of first order: traces at angles of ± α ± γ climb by
/// 1 + α² + γ² times the cone on average.
#[test]
fn a_cone_of_first_order_is_that_of_the_fit_at_its_tilts() {
    let Some(file) = data("cad_reversal/cad_reversal_2.csv") else {
        return;
    };
    let file = file.to_str().unwrap();
    let fit = [
        "reversal",
        file,
        "--columns",
        CAD_COLUMNS,
        "--simultaneous",
        "--with",
        "taper",
    ];
    let fit = json(&fit);
    let cone = &fit["effects"][0]["parameters"][0];
    let [value, std] = ["value", "std"].map(|key| cone[key].as_f64().unwrap());
    // Kind: k·u.
    assert!((value - 0.05_f64.to_radians()).abs() < 3.0 * std, "{cone}");
    let diagnosis = json(&["diagnose", file, "--columns", CAD_COLUMNS]);
    let found = diagnosis["candidates"][0]["parameters"][0]["value"]
        .as_f64()
        .unwrap();
    let squares: f64 = ["alpha", "gamma"]
        .map(|t| degrees(&fit["tilts"][t]).to_radians().powi(2))
        .iter()
        .sum();
    // Certified digits: readings rounded to 1e-5 mm over 100 mm in eleven positions of four traces.
    assert!(
        (found - value * (1.0 + squares)).abs() < 2.0 * std,
        "{found} {value}"
    );
    assert!((found - value).abs() > 10.0 * std);
}

#[test]
fn cad_model_whose_slide_was_shifted_not_tilted() {
    let Some(file) = data("cad_reversal/cad_reversal_1.csv") else {
        return;
    };
    let result = json(&["reversal", file.to_str().unwrap(), "--columns", CAD_COLUMNS]);
    for (tilt, found) in [("alpha", 0.0), ("beta", 0.0), ("gamma", -0.05)] {
        assert!(
            (degrees(&result["tilts"][tilt]) - found).abs() < CAD,
            "{tilt} {result}"
        );
    }
    assert!((degrees(&result["closure"]["slope"]) - 0.025).abs() < CAD);
}

/// A test bar turned in a milling spindle while the slide feeds. No truth is known.
#[test]
fn test_bar_at_opposite_spindle_angles() {
    let Some(file) = data("bridgeport_spindle/testbar_712.csv") else {
        return;
    };
    let folder = TempDir::new().unwrap();
    let tilts = |angle: i32| {
        let out = folder.path().join(format!("traces{angle}"));
        let run = json(&[
            "traces",
            file.to_str().unwrap(),
            "--columns",
            "time=t_s,x=z_mm:mm,reading=reading_mm:mm",
            "--angle",
            &angle.to_string(),
            "--out",
            out.to_str().unwrap(),
        ]);
        // Other tool's figure: 2.5625 turns a minute, four decimals.
        let rpm = run["frequency"]["value"].as_f64().unwrap() * 60.0;
        assert!((rpm - 2.5625).abs() < 1e-3, "{rpm}");
        let result = json(&["reversal", out.join("traces.csv").to_str().unwrap()]);
        assert!(result["tilts"]["beta"].is_null());
        let number = |v: &Value, key: &str| v[key].as_f64().unwrap() * 1e6;
        let alpha = &result["tilts"]["alpha"];
        let mount = &result["tilt_combinations"][0];
        (
            number(alpha, "value"),
            number(alpha, "std"),
            number(mount, "value"),
        )
    };
    let printed = |row: &str| -> Vec<f64> {
        let page = crate::command::document("recipes/one-indicator-and-a-test-bar.md");
        let line = page.lines().find(|line| line.starts_with(row)).unwrap();
        let cells = line.split('|').skip(2).map(str::trim);
        let numbers = cells.filter(|cell| !cell.is_empty());
        numbers
            .map(|n| n.replace('−', "-").parse().unwrap())
            .collect()
    };
    let six = [0, 30, 60, 90, 120, 150].map(tilts);
    for (row, of) in [
        ("| α,", six.map(|t| t.0)),
        ("| u(α)", six.map(|t| t.1)),
        ("| β + γ,", six.map(|t| t.2)),
    ] {
        let rounded = of.map(|v| (10.0 * v).round() / 10.0);
        assert_eq!(
            printed(row),
            rounded,
            "the recipe prints other figures of {row}"
        );
    }
    let angles = [0, 60, 120];
    let found = [six[0], six[2], six[4]];
    for (angle, (alpha, std, _)) in angles.iter().zip(&found) {
        println!("angle {angle}: alpha {alpha:.2} ± {std:.2} µrad");
        assert!((0.1..0.5).contains(std));
        // k·u: 4 u of what the sides of the bar scatter, 1.6 µrad, about the mean of six pairs.
        assert!((alpha - 41.0).abs() < 6.4, "{alpha}");
    }
    // The tilt of the bar in the spindle turns with it: cosines 120° apart in the double angle sum to
    // zero, (0°) − (60°) + (120°) in the single one. k·u: the three scatter as α does, √3 × 1.4 × 4.
    let around = found[0].2 - found[1].2 + found[2].2;
    assert!(around.abs() < 9.7, "{found:?}");
    // Half a turn on, the two channels change places: the same α but for the readings at the ends.
    let (alpha, std, mount) = tilts(180);
    assert!((alpha - found[0].0).abs() < 4.0 * std, "{alpha}");
    assert!((mount + found[0].2).abs() < 4.0 * std, "{mount}");
}
