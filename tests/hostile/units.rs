//! Units beside the names of columns: every table in millimetres or inches gives the same answer.

use serde_json::Value;

use crate::command::{Folder, bad_input, run};

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, &[arguments, &["--format", "json"]].concat());
    assert_eq!(out.status, 0, "{arguments:?}: {}", out.stderr);
    let mut answer: Value = serde_json::from_str(&out.stdout).unwrap();
    answer.as_object_mut().unwrap().remove("provenance");
    answer
}

/// Numbers agree to rounding: an inch is no whole number of millimetres in binary.
fn alike(a: &Value, b: &Value, at: &str) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, value) in a {
                if key != "seconds" {
                    alike(value, &b[key], &format!("{at}.{key}"));
                }
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{at}");
            a.iter().zip(b).for_each(|(a, b)| alike(a, b, at));
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!(
                (a - b).abs() <= 1e-6 * a.abs().max(1e-3),
                "{at}: {a} and {b}"
            );
        }
        _ => assert_eq!(a, b, "{at}"),
    }
}

/// The columns of a table multiplied, under other headings.
fn converted(text: &str, headings: &str, factors: &[f64]) -> String {
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    lines.next();
    let rows = lines.map(|line| {
        let fields = line.split(',').enumerate().map(|(k, field)| {
            match (factors.get(k).copied().unwrap_or(1.0), field.parse::<f64>()) {
                (factor, Ok(value)) if factor != 1.0 => (value * factor).to_string(),
                _ => field.to_owned(),
            }
        });
        fields.collect::<Vec<_>>().join(",") + "\n"
    });
    format!("{headings}\n{}", rows.collect::<String>())
}

/// Model, options, file that is simulated, other headings and what its columns are multiplied by.
type Case = (
    &'static str,
    &'static [&'static str],
    &'static str,
    &'static str,
    &'static [f64],
);

#[test]
fn every_table_takes_the_units_that_stand_beside_its_names() {
    const INCH: f64 = 1.0 / 25.4;
    let cases: [Case; 4] = [
        ("circle", &[], "points.csv", "x (inch),y_in", &[INCH, INCH]),
        (
            "four-sensor",
            &["--setup", "s/setup.toml"],
            "data.csv",
            "x [m],m1 (mm),m2_nm,m3_um,m4_uinch",
            &[1e-3, 1e-3, 1e3, 1.0, 1e3 * INCH],
        ),
        (
            "fourier",
            &["--setup", "s/setup.toml"],
            "scans.csv",
            "spacing_mm,repeat,x (inch),m1_mm,m2 (µm),m3 [nm]",
            &[1.0, 1.0, INCH, 1e-3, 1.0, 1e3],
        ),
        (
            "reversal",
            &["--simultaneous"],
            "readings.csv",
            "channel,repeat,direction,time_min,x (inch),reading (mm)",
            &[1.0, 1.0, 1.0, 1.0 / 60.0, INCH, 1e-3],
        ),
    ];
    for (model, options, file, headings, factors) in cases {
        let folder = Folder::with(&[]);
        let made = run(
            &folder,
            &["simulate", model, "--positions", "80", "--out", "s"],
        );
        assert_eq!(made.status, 0, "{model}: {}", made.stderr);
        let text = folder.read(&format!("s/{file}"));
        let names = text.lines().find(|l| !l.starts_with('#')).unwrap();
        let count = headings.split(',').count();
        assert_eq!(names.split(',').count(), count, "{model}: {names}");
        folder.write("other.csv", &converted(&text, headings, factors));
        let answer = |place: &str| json(&folder, &[&[model, place], options].concat());
        let mut own = answer(&format!("s/{file}"));
        let mut other = answer("other.csv");
        for answer in [&mut own, &mut other] {
            answer.as_object_mut().unwrap().remove("data");
        }
        alike(&own, &other, model);
    }
}

#[test]
fn a_unit_that_nobody_takes_is_refused_where_it_stands() {
    let folder = Folder::with(&[
        ("time.csv", "x (s),y\n0,0\n1,2\n2,4.1\n3,5.9\n"),
        ("twice.csv", "x,x_mm,y\n0,0,1\n1,1,2\n2,2,1\n3,3,7\n"),
        ("unknown.csv", "x (furlong),y\n0,1\n1,2\n2,1\n3,7\n"),
    ]);
    bad_input(
        &folder,
        &["circle", "time.csv"],
        &["time.csv:1:1", "`x` is not taken in other units"],
    );
    bad_input(
        &folder,
        &["circle", "twice.csv"],
        &["twice.csv:1:3", "named twice"],
    );
    bad_input(
        &folder,
        &["circle", "unknown.csv"],
        &["unknown.csv:1:1", "x (furlong)"],
    );
}

/// The profiles that `errsep reversal` writes are profiles for `errsep straightness`.
#[test]
fn our_own_profiles_are_read() {
    let folder = Folder::with(&[]);
    let made = run(
        &folder,
        &["simulate", "reversal", "--positions", "80", "--out", "s"],
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    let whole = json(&folder, &["reversal", "s/readings.csv", "--out", "r"]);
    let one = json(&folder, &["straightness", "r/profiles.csv", "--of", "M"]);
    let lines = one["reference_lines"].as_array().unwrap();
    let zone = lines
        .iter()
        .find(|l| l["reference"] == "minimum_zone")
        .unwrap();
    let own = whole["forms"]["M"].as_array().unwrap().iter();
    let values: Vec<f64> = own.map(|v| v.as_f64().unwrap()).collect();
    // The range of a form is no less than its straightness, and a half of it no more.
    let range = values.iter().fold(f64::NEG_INFINITY, |a, v| a.max(*v))
        - values.iter().fold(f64::INFINITY, |a, v| a.min(*v));
    let error = zone["error"]["value"].as_f64().unwrap();
    assert!(error <= range && error > 0.5 * range, "{error} of {range}");
    bad_input(&folder, &["straightness", "r/profiles.csv"], &["--of M"]);
}
