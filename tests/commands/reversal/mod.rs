//! `errsep reversal` as a person and a script meet it.

mod answers;
mod channels;
mod disagreement;
mod tables;

use std::fs;
use std::path::Path;

use serde_json::Value;

fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_errsep"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap();
    (
        output.status.code(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

fn json(folder: &Path, args: &[&str]) -> Value {
    let (code, out, err) = run(folder, &[args, &["--format", "json"]].concat());
    assert_eq!(code, Some(0), "{err}");
    serde_json::from_str(&out).unwrap()
}

/// Readings of one wave and four slopes at 41 positions, in µm to four decimals.
fn readings() -> Vec<(f64, [f64; 4])> {
    (0..41)
        .map(|k| {
            let x = f64::from(k) * 2.5;
            let m = (x / 9.0).sin();
            let wiggle = 0.01 * f64::from((k * 7919) % 13 - 6);
            let value = |i: f64, slope: f64, s: f64| {
                ((i * m + s + slope * x + wiggle * i * s) * 1e4).round() / 1e4
            };
            let (a, b) = ((x / 13.0).cos(), (x / 17.0).sin());
            (
                x,
                [
                    value(1.0, 0.05, a),
                    value(-1.0, -0.04, b),
                    value(-1.0, 0.03, a),
                    value(1.0, -0.02, b),
                ],
            )
        })
        .collect()
}

fn wide(delimiter: &str, end: &str, decimal: &str, mark: &str) -> String {
    let mut text = format!(
        "{mark}# readings{end}{}{end}",
        ["x", "1A", "1B", "2A", "2B"].join(delimiter)
    );
    for (x, values) in readings() {
        let row = std::iter::once(x)
            .chain(values)
            .map(|v| v.to_string().replace('.', decimal));
        text += &format!("{}{end}", row.collect::<Vec<_>>().join(delimiter));
    }
    text
}

/// Readings made by the program itself: 61 positions, noise 0.05 µm.
fn simulated(folder: &Path, options: &[&str]) {
    let base = [
        "simulate",
        "reversal",
        "--positions",
        "61",
        "--noise",
        "0.05",
    ];
    let (code, text, err) = run(folder, &[&base, options].concat());
    assert_eq!(code, Some(0), "{err}");
    fs::write(folder.join("data.csv"), text).unwrap();
}
