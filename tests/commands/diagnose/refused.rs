//! What is asked for in vain, cannot be told, or is no number that can be.

use crate::command::{Folder, bad_input, run};

#[test]
fn what_cannot_be_told_is_asked_for() {
    let folder = Folder::with(&[
        ("c.csv", "x,y\n1,0\n0,1\n-1,0\n0,-1\n0.7,0.7\n"),
        ("u.csv", "a,b\n1,2\n"),
    ]);
    bad_input(
        &folder,
        &["diagnose", "c.csv"],
        &["calibration-line and circle", "--model circle"],
    );
    bad_input(
        &folder,
        &["diagnose", "u.csv"],
        &["no model", "--model", "reversal"],
    );
    bad_input(
        &folder,
        &["diagnose", "c.csv", "--model", "square"],
        &["step-diagonal"],
    );
    for (kind, near) in [
        ("circle", "ovality"),
        ("calibration-line", "quadratic"),
        ("four-sensor", "sensor-position"),
        ("fourier", "probe-spacing"),
        ("step-diagonal", "dead-path"),
    ] {
        let misspelt = format!("{}x=1", &near[..near.len() - 1]);
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &misspelt],
            &["did you mean", near],
        );
        bad_input(
            &folder,
            &["simulate", kind, "--effect", near],
            &["NAME=VALUE"],
        );
        let wordy = format!("{near}=much");
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &wordy],
            &["`much` is not a number"],
        );
    }
}

/// What an option asks for in vain is said, and a channel that is missing is told.
#[test]
fn options_in_vain_are_refused_and_missing_channels_told() {
    let mut readings = "channel,repeat,x,reading\n".to_owned();
    for channel in ["1A", "1B", "2A"] {
        for repeat in 1..=2 {
            for k in 0..20 {
                let wave = (f64::from(k * 7 + repeat * 3) * 1.7).sin();
                readings += &format!("{channel},{repeat},{},{}\n", 10 * k, 5.0 + 0.02 * wave);
            }
        }
    }
    let own = "[[effect]]\nname = \"\"\nformula = \"x\"\n";
    let never = "[[effect]]\nname = \"nothing\"\nformula = \"0 * x\"\n";
    let folder = Folder::with(&[("d.csv", &readings), ("e.toml", own), ("n.toml", never)]);
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--prove", "0"],
        &["--prove"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--points", "p.csv"],
        &["--points"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--effects", "e.toml"],
        &["no name"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--effects", "n.toml"],
        &["changes no reading"],
    );
    let out = run(&folder, &["diagnose", "d.csv"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        out.stdout.contains("only 1A, 1B, 2A are there"),
        "{}",
        out.stdout
    );
}

/// Slopes, uncertainties and weights that are no numbers are refused, and so is a proof without end.
#[test]
fn what_is_no_number_is_refused() {
    let folder = Folder::with(&[]);
    let made = run(&folder, &["simulate", "step-diagonal"]);
    folder.write("d.csv", &made.stdout);
    let steps = [
        "diagnose",
        "d.csv",
        "--model",
        "step-diagonal",
        "--setup",
        "s.toml",
    ];
    for (slope, std, what) in [
        ("nan", "0.001", "slope is NaN"),
        ("inf", "0.001", "slope is inf"),
        ("0.004", "-1.0", "uncertainty of a measured slope is -1"),
        ("0.004", "0.0", "uncertainty of a measured slope is 0"),
        ("0.004", "nan", "uncertainty of a measured slope is NaN"),
    ] {
        let setup = format!("[[measured]]\naxis = \"X\"\nslope = {slope}\nstd = {std}\n");
        folder.write("s.toml", &setup);
        bad_input(&folder, &steps, &["s.toml", what]);
    }
    let made = run(&folder, &["simulate", "reversal", "--positions", "13"]);
    folder.write("r.csv", &made.stdout);
    for (weights, what) in [
        ("{ 1A = nan }", "gives the channel `1A` the weight NaN"),
        ("{ 1A = 1.0, 2B = inf }", "`2B`"),
        ("{ 1A = 0.0 }", "changes no reading"),
        ("{ 1A = 1e300 }", "no finite number"),
    ] {
        let effect = format!(
            "[[effect]]\nname = \"own\"\nformula = \"1e30 * x^2 * 1e10\"\nchannels = {weights}\n"
        );
        folder.write("e.toml", &effect);
        bad_input(
            &folder,
            &["diagnose", "r.csv", "--effects", "e.toml"],
            &["e.toml", what],
        );
    }
    let endless = ["diagnose", "r.csv", "--prove", "18446744073709551615"];
    bad_input(&folder, &endless, &["--prove", "at most"]);
}

/// A reading of 1e308 is refused whatever the model: its square is no number.
#[test]
fn readings_beyond_reach_are_refused() {
    let sensors = "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n";
    let section = "[section]\nlength = 100.0\n";
    for (model, setup, column) in [
        ("reversal", "", 5),
        ("calibration-line", "", 1),
        ("circle", "", 0),
        ("four-sensor", sensors, 2),
        ("fourier", section, 3),
        ("step-diagonal", "", 7),
    ] {
        let folder = Folder::with(&[("s.toml", setup)]);
        let made = run(&folder, &["simulate", model]);
        let lines = made.stdout.lines().enumerate();
        let spoilt: Vec<String> = lines
            .map(|(k, line)| {
                let mut fields: Vec<&str> = line.split(',').collect();
                if k == 9 && fields.len() > column {
                    fields[column] = "1e308";
                }
                fields.join(",")
            })
            .collect();
        folder.write("d.csv", &spoilt.join("\n"));
        let arguments = ["diagnose", "d.csv", "--model", model, "--setup", "s.toml"];
        let told = match model {
            "fourier" => "are not numbers that a probe can give",
            _ => "1e308",
        };
        bad_input(&folder, &arguments, &["d.csv", told]);
    }
}
