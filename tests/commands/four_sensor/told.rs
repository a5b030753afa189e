//! What the answer says of itself: its condition, its noise, waves that are not seen, the ends of the surface.

use std::path::Path;

use serde_json::Value;

use super::{answered, errsep, simulated, text};

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
