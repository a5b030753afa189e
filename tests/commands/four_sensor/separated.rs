//! The fixture is separated, a simulation is read back, bad input is named.

use serde_json::Value;

use super::{answered, errsep, fixture, simulated, text};

/// Every key of docs/json/four-sensor.md is there, and S lies within four of its standard
/// deviations and the bound of the penalty's pull from the truth of the fixture.
#[test]
fn the_fixture_is_separated_and_answered_as_documented() {
    let out = errsep(&[
        "four-sensor",
        text(&fixture("data.csv")),
        "--setup",
        text(&fixture("setup.toml")),
        "--format",
        "json",
    ]);
    assert_eq!(
        out.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let answer: Value = serde_json::from_slice(&out.stdout).expect("JSON and nothing else");
    assert_eq!(answer["schema"], "errsep.four-sensor/1");
    let documented: &[(&str, &[&str])] = &[
        (
            "geometry",
            &[
                "step",
                "spacing",
                "unit",
                "slide_positions",
                "surface_points",
                "repeats",
            ],
        ),
        (
            "straightness",
            &["x", "S", "S_std", "S_bias", "S_bias_bound", "unit"],
        ),
        (
            "tilt",
            &[
                "x",
                "gamma",
                "gamma_std",
                "gamma_bias",
                "gamma_bias_bound",
                "unit",
            ],
        ),
        (
            "surface",
            &["x", "f", "f_std", "f_bias", "f_bias_bound", "unit"],
        ),
        ("zero_adjustment", &["value", "unit"]),
        ("parabola", &["determined", "from", "surface_curvature"]),
        (
            "regularization",
            &[
                "penalty",
                "penalties",
                "lambda",
                "rule",
                "instead",
                "note",
                "effective_parameters",
                "condition_number",
                "l_curve",
                "gcv",
                "discrepancy",
            ],
        ),
        (
            "residual",
            &["rms", "noise", "noise_estimated", "degrees_of_freedom"],
        ),
        (
            "uncertainty",
            &[
                "degrees_of_freedom",
                "coverage_probability",
                "coverage_factor",
            ],
        ),
        ("published", &["lambda", "rule", "S", "gamma", "f"]),
    ];
    for (part, keys) in documented {
        let object = answer[part].as_object().expect(part);
        let mut found: Vec<&str> = object.keys().map(String::as_str).collect();
        let mut wanted = keys.to_vec();
        found.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(found, wanted, "{part}");
    }
    assert_eq!(answer["uncertainty"]["degrees_of_freedom"], "infinite");
    let truth = std::fs::read_to_string(fixture("truth.csv")).expect("the fixture has its truth");
    let numbers = |value: &Value| -> Vec<f64> {
        value
            .as_array()
            .expect("an array")
            .iter()
            .map(|v| v.as_f64().expect("a number"))
            .collect()
    };
    let s = &answer["straightness"];
    let (values, std, bound) = (
        numbers(&s["S"]),
        numbers(&s["S_std"]),
        numbers(&s["S_bias_bound"]),
    );
    assert_eq!(values.len(), 62);
    for (n, line) in truth.lines().skip(1).take(62).enumerate() {
        let expected: f64 = line
            .split(',')
            .nth(2)
            .expect("S")
            .parse()
            .expect("a number");
        let off = (values[n] - expected).abs();
        assert!(off < 4.0 * std[n] + bound[n], "{n}: {off}");
    }
}

#[test]
fn a_simulation_is_read_back_and_is_the_same_each_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("data.csv");
    let simulate = || errsep(&["simulate", "four-sensor", "--noise", "0.2", "--seed", "5"]).stdout;
    let csv = simulate();
    assert_eq!(csv, simulate());
    std::fs::write(&data, &csv).expect("written");
    let report = folder.path().join("out");
    let out = errsep(&[
        "four-sensor",
        text(&data),
        "--setup",
        text(&fixture("setup.toml")),
        "--out",
        text(&report),
    ]);
    assert_eq!(
        out.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let page = std::fs::read_to_string(report.join("report.html")).expect("a report");
    for part in ["L-curve", "Straightness of the slide", "do not determine"] {
        assert!(page.contains(part), "{part}");
    }
    for name in [
        "surface.csv",
        "slide.csv",
        "residuals.csv",
        "l_curve.csv",
        "result.json",
    ] {
        assert!(report.join(name).is_file(), "{name}");
    }
}

/// What a simulation writes can be worked with as it stands, by the command that it names; the set-up
/// holds the spacings and the noise that were asked for.
#[test]
fn a_simulation_writes_its_set_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = folder.path().join("made");
    let out = errsep(&[
        "simulate",
        "four-sensor",
        "--spacing",
        "2,3,5",
        "--noise",
        "0.25",
        "--out",
        text(&made),
    ]);
    assert_eq!(out.status.code(), Some(0));
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    let (data, setup) = (made.join("data.csv"), made.join("setup.toml"));
    let named = format!(
        "errsep four-sensor {} --setup {}",
        text(&data),
        text(&setup)
    );
    assert!(said.contains(&named), "{said}");
    let answer = answered(&data, &setup);
    assert_eq!(
        answer["geometry"]["spacing"],
        serde_json::json!([10.0, 15.0, 25.0])
    );
    assert_eq!(answer["residual"]["noise"], 0.25);
    assert_eq!(answer["residual"]["noise_estimated"], false);
}

/// Each bad input: one message with the place and the remedy, status 2, nothing written.
#[test]
fn bad_input_is_named_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let good = std::fs::read_to_string(fixture("data.csv")).expect("the fixture");
    let setup = "[sensors]\nspacing = [5.0, 5.0, 25.0]\n";
    let without_line = |n: usize| -> String {
        good.lines()
            .enumerate()
            .filter(|(k, _)| *k != n)
            .map(|(_, l)| format!("{l}\n"))
            .collect()
    };
    let lines: Vec<&str> = good.lines().collect();
    let twice = format!("{good}{}\n", lines[lines.len() - 1]);
    let short: String = lines[..10].iter().map(|l| format!("{l}\n")).collect();
    let cases: &[(&str, &str, &str)] = &[
        ("", setup, "empty"),
        ("x,m1,m2,m3\n0,1,2,3\n", setup, "m4"),
        ("x,m1,m2,m3,m4\n", setup, "no row"),
        ("x,m1,m2,m3,m4\n0,1,NaN,3,4\n", setup, "2:5"),
        ("x,m1,m2,m3,m4\n0,1,two,3,4\n", setup, "two"),
        ("sensor,x,reading\n5,0,1\n", setup, "number the sensors"),
        (&without_line(20), setup, "mm apart"),
        (&twice, setup, "given again"),
        (&short, setup, "slide positions"),
        (
            &good,
            "[sensors]\nspacing = [5.0, 5.0, 25.3]\n",
            "multiple of the step",
        ),
        (
            &good,
            "[sensors]\nspacng = [5.0, 5.0, 25.0]\n",
            "did you mean `spacing`",
        ),
        (
            &good,
            "[sensors]\nspacing = [5.0, -5.0, 25.0]\n",
            "not positive",
        ),
        (
            &good,
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\n[parabola]\n",
            "states nothing",
        ),
        (
            &good,
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\n[parabola]\ntilt_slope = -1e200\n",
            "no slide has such a [parabola]",
        ),
        (
            &good,
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\n[separation]\nchoice = \"discrepancy\"\n",
            "noise",
        ),
    ];
    for (data, setup, expected) in cases {
        let (csv, toml) = (folder.path().join("d.csv"), folder.path().join("s.toml"));
        std::fs::write(&csv, data).expect("written");
        std::fs::write(&toml, setup).expect("written");
        let report = folder.path().join("out");
        let out = errsep(&[
            "four-sensor",
            text(&csv),
            "--setup",
            text(&toml),
            "--out",
            text(&report),
        ]);
        let message = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{expected}: {message}");
        assert!(
            message.contains(expected) && message.contains("help:"),
            "{expected}: {message}"
        );
        assert!(out.stdout.is_empty() && !report.exists());
    }
}

/// Sensors zeroed anew before each repeat: the answer and its noise know nothing of it, in whatever order the rows come.
#[test]
fn zeros_of_repeats_are_no_noise() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let options = ["--repeats", "4", "--noise", "0.05"];
    let setup = "[sensors]\nspacing = [5.0, 5.0, 25.0]\n";
    let (data, toml) = simulated(folder.path(), &options, setup);
    let before = answered(&data, &toml);
    let text = std::fs::read_to_string(&data).expect("readable");
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    for row in &mut rows {
        let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
        if let [_, outputs @ .., repeat] = &mut fields[..]
            && let Ok(repeat) = repeat.parse::<f64>()
        {
            for (sensor, output) in outputs.iter_mut().enumerate() {
                let zero = 3.0 * (7.0 * repeat + 5.0 * sensor as f64).sin();
                *output = (output.parse::<f64>().expect("a number") + zero).to_string();
            }
        }
        *row = fields.join(",");
    }
    let first = rows
        .iter()
        .position(|r| r.starts_with("x,"))
        .expect("names");
    rows[first + 1..].reverse();
    std::fs::write(&data, rows.join("\n") + "\n").expect("written");
    let after = answered(&data, &toml);
    let noise = |answer: &serde_json::Value| answer["residual"]["noise"].as_f64().expect("a noise");
    // Rounding.
    assert!(
        (noise(&after) / noise(&before) - 1.0).abs() < 1e-6,
        "{}",
        after["residual"]
    );
    // k·u: 4 × 61 × 3 degrees of freedom, 2.6 % of a mean of four; four of them.
    assert!(
        (noise(&after) / 0.025 - 1.0).abs() < 0.11,
        "{}",
        after["residual"]
    );
}
