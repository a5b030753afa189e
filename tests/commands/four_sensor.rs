//! `errsep four-sensor` and `errsep simulate four-sensor` as a user runs them.

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/four_sensor")
        .join(name)
}

fn errsep(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(args)
        .output()
        .expect("the program starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

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

fn simulated(folder: &Path, options: &[&str], setup: &str) -> (PathBuf, PathBuf) {
    let (data, toml) = (folder.join("data.csv"), folder.join("setup.toml"));
    let mut args = vec!["simulate", "four-sensor"];
    args.extend(options);
    std::fs::write(&data, errsep(&args).stdout).expect("written");
    std::fs::write(&toml, setup).expect("written");
    (data, toml)
}

fn answered(data: &Path, setup: &Path) -> Value {
    let out = errsep(&[
        "four-sensor",
        text(data),
        "--setup",
        text(setup),
        "--format",
        "json",
    ]);
    assert_eq!(
        out.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    serde_json::from_slice(&out.stdout).expect("JSON and nothing else")
}

/// The headline names its reference line and its interval, and is no clean bill while the parabola is
/// open; with the slope of the tilt stated it is.
#[test]
fn the_headline_is_a_minimum_zone_under_its_condition() {
    let folder = tempfile::tempdir().expect("a folder");
    let sensors = "[sensors]\nspacing = [5.0, 5.0, 25.0]\n";
    let (data, open) = simulated(folder.path(), &["--seed", "3"], sensors);
    let closed = folder.path().join("closed.toml");
    let known =
        format!("{sensors}[parabola]\ntilt_slope = 0.0\n[separation]\nchoice = \"likelihood\"\n");
    std::fs::write(&closed, known).expect("written");
    for (setup, standing, condition) in [(&open, "caution", true), (&closed, "good", false)] {
        let report = folder.path().join(standing);
        let (data, setup) = (text(&data), text(setup));
        let args = [
            "four-sensor",
            data,
            "--setup",
            setup,
            "--out",
            text(&report),
        ];
        let out = errsep(&args);
        assert_eq!(out.status.code(), Some(0));
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        let headline = said
            .lines()
            .find(|line| line.trim_start().starts_with("straightness "))
            .expect("a headline");
        assert!(headline.contains("(minimum zone), 95 % interval"), "{said}");
        assert_eq!(
            headline.contains("if the surface has no parabola"),
            condition
        );
        let page = std::fs::read_to_string(report.join("report.html")).expect("a report");
        assert!(page.contains(&format!("summary {standing}")), "{standing}");
        let json = std::fs::read_to_string(report.join("result.json")).expect("JSON");
        let json: Value = serde_json::from_str(&json).expect("JSON");
        let zone = &json["straightness_error"];
        assert_eq!(zone["reference"], "minimum_zone");
        assert_eq!(zone["parabola_open"], condition);
        let at = |value: &Value| value.as_f64().expect("a number");
        assert!(at(&zone["interval"][0]) < at(&zone["value"]));
        assert!(at(&zone["interval"][1]) > at(&zone["interval"][0]));
    }
}

/// Exact limit: four repeats of the same readings are these readings with half their noise, whether λ
/// follows from the noise or not; the answer says that the outputs were averaged.
#[test]
fn a_stated_noise_is_that_of_one_repeat() {
    let folder = tempfile::tempdir().expect("a folder");
    let setup = |noise: f64| {
        format!(
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = {noise}\n[separation]\nchoice = \"discrepancy\"\n"
        )
    };
    let (data, half) = simulated(folder.path(), &["--seed", "3"], &setup(0.1));
    let once = answered(&data, &half);
    assert_eq!(once["average"], Value::Null);
    let lines: Vec<String> = std::fs::read_to_string(&data)
        .expect("the data")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(str::to_owned)
        .collect();
    let mut repeated = format!("{},repeat\n", lines[0]);
    for repeat in 1..=4 {
        for line in &lines[1..] {
            repeated.push_str(&format!("{line},{repeat}\n"));
        }
    }
    std::fs::write(&data, repeated).expect("written");
    std::fs::write(&half, setup(0.2)).expect("written");
    let averaged = answered(&data, &half);
    for key in ["straightness", "tilt", "residual"] {
        assert_eq!(once[key], averaged[key], "{key}");
    }
    assert_eq!(averaged["average"]["of"], "outputs");
}

/// Spacings of five steps each: the waves that repeat with them are named by their periods.
#[test]
fn waves_that_the_spacings_do_not_show_are_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, setup) = simulated(
        folder.path(),
        &["--seed", "3", "--spacing", "5,5,5"],
        "[sensors]\nspacing = [25.0, 25.0, 25.0]\n",
    );
    let answer = answered(&data, &setup);
    let periods = &answer["invisible_periods"]["value"];
    assert_eq!(periods, &serde_json::json!([25.0, 12.5]));
    let listed = answer["not_determined"].as_array().expect("sentences");
    let named = |text: &Value| {
        text.as_str()
            .is_some_and(|t| t.contains("every 25.00, 12.50 mm"))
    };
    assert!(listed.iter().any(named), "{listed:?}");
}

/// The paper's surface lies with its ends near its mean line, a bowl of waves that end on a crest does not:
/// the answer says so with numbers, in text, JSON and page, and what speaks for which penalty; the penalty
/// that counts from the ends tells what its uncertainties are worth.
#[test]
fn the_ends_of_the_surface_are_told_with_the_penalty_they_speak_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = |penalty: &str| {
        format!("[sensors]\nspacing = [5.0, 5.0, 25.0]\n[separation]\npenalty = \"{penalty}\"\n")
    };
    let (data, setup) = simulated(
        folder.path(),
        &["--seed", "3", "--noise", "0.02"],
        &table("profile"),
    );
    let raised = folder.path().join("raised.csv");
    std::fs::write(&raised, with_raised_ends(&data)).expect("written");
    let from_ends = folder.path().join("from_ends.toml");
    std::fs::write(&from_ends, table("profile-from-ends")).expect("written");
    for (data, may_lie_on_line) in [(&data, true), (&raised, false)] {
        let answer = answered(data, &setup);
        let ends = &answer["surface_ends"];
        assert_eq!(ends["may_lie_on_mean_line"], may_lie_on_line, "{ends}");
        assert_eq!(answer["regularization"]["note"], Value::Null);
        let counted = answered(data, &from_ends);
        assert_eq!(&counted["surface_ends"]["offset"], &ends["offset"]);
        assert_eq!(counted["surface_ends"]["std"], ends["std"]);
        let note = counted["regularization"]["note"].as_str().expect("a note");
        assert!(note.contains("takes it for granted"), "{note}");
        let report = folder.path().join(format!("report-{may_lie_on_line}"));
        let out = errsep(&[
            "four-sensor",
            text(data),
            "--setup",
            text(&from_ends),
            "--out",
            text(&report),
        ]);
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        let page = std::fs::read_to_string(report.join("report.html")).expect("a report");
        let verdict = if may_lie_on_line {
            "which does not contradict the penalty"
        } else {
            "which contradicts the penalty"
        };
        for shown in [&said, &page] {
            assert!(shown.contains(verdict), "{shown}");
            assert!(shown.contains("takes it for granted"), "{shown}");
        }
    }
}

/// The outputs over a surface that rises by 20 µm over its first two and its last two points.
fn with_raised_ends(data: &Path) -> String {
    let whole = std::fs::read_to_string(data).expect("the data");
    let rows: Vec<&str> = whole.lines().filter(|l| !l.starts_with('#')).collect();
    let last = rows.len() - 2 + 7;
    let mut raised = format!("{}\n", rows[0]);
    for (n, row) in rows[1..].iter().enumerate() {
        let mut cells: Vec<f64> = row
            .split(',')
            .map(|c| c.parse().expect("a number"))
            .collect();
        for (sensor, steps) in [0, 1, 2, 7].into_iter().enumerate() {
            let at = n + steps;
            cells[sensor + 1] += f64::from(u8::from(at < 2 || at + 1 >= last)) * 20.0;
        }
        let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
        raised.push_str(&cells.join(","));
        raised.push('\n');
    }
    raised
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

/// A stated noise is held against what the outputs leave: told where it is too small and where one output
/// lies off, not where it is right.
#[test]
fn a_stated_noise_is_held_against_the_residuals() {
    let folder = tempfile::tempdir().expect("a folder");
    let stated = |noise: f64| format!("[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = {noise}\n");
    for seed in 1..=5 {
        let (data, setup) = simulated(folder.path(), &["--seed", &seed.to_string()], &stated(0.1));
        let answer = answered(&data, &setup);
        assert_eq!(answer["disagreement"], Value::Null, "{seed}");
    }
    let (data, setup) = simulated(folder.path(), &["--seed", "3"], &stated(0.01));
    let answer = answered(&data, &setup);
    let observed = answer["disagreement"]["observed"].as_f64().expect("told");
    // k·u: some 56 degrees of freedom tell the noise to 10 %.
    assert!((observed - 0.1).abs() < 0.03, "{observed}");
    std::fs::write(&setup, stated(0.1)).expect("written");
    let whole = std::fs::read_to_string(&data).expect("the data");
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    let middle = lines.len() / 2;
    let mut fields: Vec<String> = lines[middle].split(',').map(str::to_owned).collect();
    let value: f64 = fields[2].parse().expect("an output");
    fields[2] = (value + 5.0).to_string();
    lines[middle] = fields.join(",");
    std::fs::write(&data, lines.join("\n")).expect("written");
    let report = folder.path().join("off");
    let args = [
        "four-sensor",
        text(&data),
        "--setup",
        text(&setup),
        "--out",
        text(&report),
    ];
    let told = String::from_utf8_lossy(&errsep(&args).stdout).into_owned();
    let page = std::fs::read_to_string(report.join("report.html")).expect("a report");
    for said in [&told, &page] {
        assert!(
            said.contains("the set-up states 0.100 µm: the uncertainties are too small"),
            "{said}"
        );
        assert!(said.contains("errsep diagnose"), "{said}");
    }
    let json = std::fs::read_to_string(report.join("result.json")).expect("JSON");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    crate::command::documented(&json, "docs/json/four-sensor.md");
}
