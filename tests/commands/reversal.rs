//! `errsep reversal` as a person and a script meet it.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

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

fn tidy() -> String {
    let mut text = String::from("reading,x,channel\n");
    for (x, values) in readings().into_iter().rev() {
        for (channel, value) in ["1A", "1B", "2A", "2B"].into_iter().zip(values) {
            text += &format!("{value},{x},{channel}\n\n");
        }
    }
    text
}

#[test]
fn every_dialect_and_layout_is_the_same_data() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("plain.csv"), wide(",", "\n", ".", "")).unwrap();
    let plain = json(folder.path(), &["reversal", "plain.csv"]);
    for (name, text, said) in [
        (
            "semicolon",
            wide(";", "\n", ".", ""),
            "LF line ends, fields separated by semicolon, decimal point; one column",
        ),
        (
            "german",
            wide(";", "\r\n", ",", "\u{feff}"),
            "UTF-8 with byte-order mark, CRLF line ends, fields separated by semicolon, decimal comma",
        ),
        (
            "tab",
            wide("\t", "\r\n", ".", ""),
            "CRLF line ends, fields separated by tab, decimal point",
        ),
        (
            "tab_comma",
            wide("\t", "\n", ",", ""),
            "fields separated by tab, decimal comma",
        ),
        ("old_mac", wide(",", "\r", ".", ""), "CR line ends"),
        ("tidy", tidy(), "decimal point; one row a reading"),
        (
            "capitals",
            tidy().replace("reading,x,channel", "Reading,X,Channel"),
            "decimal point; one row a reading",
        ),
        (
            "minus_signs",
            tidy().replace('-', "\u{2212}"),
            "decimal point; one row a reading",
        ),
        (
            "empty_rows",
            wide(",", "\n", ".", "") + ",,,,\n,, ,,\n",
            "fields separated by comma, decimal point",
        ),
    ] {
        fs::write(folder.path().join("other.csv"), text).unwrap();
        let other = json(folder.path(), &["reversal", "other.csv"]);
        assert!(
            other["input"].as_str().unwrap().contains(said),
            "{name}: {}",
            other["input"]
        );
        // The same numbers in another order of rows: exactly the same result.
        for key in ["tilts", "forms", "closure", "contrasts"] {
            assert_eq!(other[key], plain[key], "{name} {key}");
        }
        let (_, text, _) = run(folder.path(), &["reversal", "other.csv"]);
        assert!(text.contains(said), "{name}: not said");
    }
}

#[test]
fn json_is_what_the_documentation_says() {
    let page =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/json/reversal.md"))
            .unwrap();
    let mut documented = page
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split('`').next())
        .collect::<Vec<_>>();
    documented.sort_unstable();
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    for method in [
        &["--method", "shear"][..],
        &["--method", "rotation"],
        &["--simultaneous"],
    ] {
        let result = json(folder.path(), &[&["reversal", "data.csv"], method].concat());
        let mut keys = result
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect::<Vec<_>>();
        keys.sort_unstable();
        assert_eq!(keys, documented);
        assert_eq!(result["schema"], "errsep.reversal/1");
        assert_eq!(
            result["method"],
            *method.last().unwrap().trim_start_matches("--")
        );
        for tilt in ["alpha", "beta", "gamma"] {
            assert!(
                result["tilts"][tilt]["value"].is_f64() && result["tilts"][tilt]["std"].is_f64()
            );
            assert_eq!(result["tilts"][tilt]["unit"], "rad");
            let expanded = &result["tilts"][tilt]["expanded"];
            assert!(expanded["coverage_factor"].as_f64().unwrap() > 1.95);
            assert_eq!(expanded["coverage_probability"], 0.95);
            assert!(!result["tilts"][tilt]["degrees_of_freedom"].is_null());
        }
        for form in ["M", "M_std", "S_A", "S_A_std", "S_B", "S_B_std"] {
            let length = result["forms"]["x"].as_array().unwrap().len();
            assert_eq!(
                result["forms"][form].as_array().unwrap().len(),
                length,
                "{form}"
            );
        }
        assert!(
            result["closure"]["slope"]["std"].is_f64()
                && result["closure"]["rms"]["value"].is_f64()
        );
        for key in ["rms", "noise", "degrees_of_freedom"] {
            assert!(result["residual"][key].is_f64(), "{key}");
        }
        assert_eq!(result["convergence"]["converged"], true);
        assert!(result["convergence"]["iterations"].is_u64());
    }
}

#[test]
fn two_channels_say_what_they_determine() {
    let folder = TempDir::new().unwrap();
    let mut text = String::from("x,1A,2B\n");
    for (x, v) in readings() {
        text += &format!("{x},{},{}\n", v[0], v[3]);
    }
    fs::write(folder.path().join("data.csv"), text).unwrap();
    for method in [&[][..], &["--simultaneous"]] {
        let result = json(folder.path(), &[&["reversal", "data.csv"], method].concat());
        assert!(result["tilts"]["alpha"]["value"].is_f64());
        assert!(result["tilts"]["beta"].is_null() && result["tilts"]["gamma"].is_null());
        assert_eq!(result["tilt_combinations"][0]["name"], "beta + gamma");
        assert!(result["closure"].is_null() && result["forms"]["M"].is_null());
        let names = result["form_combinations"].as_array().unwrap().iter();
        let names = names
            .map(|f| f["name"].as_str().unwrap())
            .collect::<Vec<_>>();
        assert_eq!(names, ["M + S_A/2 + S_B/2", "S_A/2 - S_B/2"]);
    }
    let (code, text, _) = run(folder.path(), &["reversal", "data.csv"]);
    assert_eq!(code, Some(0));
    for said in [
        "not read: 1B, 2A",
        "beta + gamma",
        "nothing closes",
        "gravity-sag",
    ] {
        assert!(text.contains(said), "{said:?} is not in:\n{text}");
    }
}

#[test]
fn missing_readings_are_no_taper_and_lost_positions_are_told() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, is_read: &dyn Fn(f64, &str) -> bool| {
        let mut text = String::from("channel,x,reading\n");
        for (x, values) in readings() {
            for (channel, value) in ["1A", "1B", "2A", "2B"].iter().zip(values) {
                if is_read(x, channel) {
                    text += &format!("{channel},{x},{}\n", value);
                }
            }
        }
        fs::write(folder.path().join(name), text).unwrap();
        json(folder.path(), &["reversal", name])
    };
    let warnings = |answer: &Value| answer["warnings"].to_string();
    let slope = |answer: &Value, key: &str| answer["closure"]["slope"][key].as_f64().unwrap();
    let all = write("all.csv", &|_, _| true);
    let third = write("third.csv", &|x, channel| channel != "2A" || x > 33.0);
    let moved = slope(&third, "value") - slope(&all, "value");
    // k·u; the forms of these readings have straight parts, which stand in the slope of both.
    assert!(moved.abs() < 4.0 * slope(&third, "std"), "{moved}");
    // The slopes do not close, with all readings as well, and where to look: nothing besides.
    let count = |answer: &Value| answer["warnings"].as_array().unwrap().len();
    assert_eq!(count(&third), count(&all), "{}", third["warnings"]);
    assert_eq!(third["forms"]["x"].as_array().unwrap().len(), 41);
    assert_eq!(third["closure"]["x"].as_array().unwrap().len(), 27);
    let ends = write("ends.csv", &|x, channel| {
        x > 0.0 || channel == "1B" || channel == "2B"
    });
    assert!(
        warnings(&ends).contains("at 1 of the measured positions too few channels"),
        "{}",
        warnings(&ends)
    );
    assert_eq!(ends["forms"]["x"][0], 2.5);
}

#[test]
fn the_folder_holds_report_result_and_tables() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    fs::create_dir(folder.path().join("there")).unwrap();
    fs::write(folder.path().join("there/mine.txt"), "kept").unwrap();
    for out in ["new/deep", "there"] {
        let (code, stdout, err) = run(
            folder.path(),
            &["reversal", "data.csv", "--out", out, "--format", "json"],
        );
        assert_eq!(code, Some(0), "{err}");
        let place = folder.path().join(out);
        assert_eq!(
            fs::read_to_string(place.join("result.json")).unwrap(),
            stdout
        );
        let page = fs::read_to_string(place.join("report.html")).unwrap();
        assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<svg"));
        let result: Value = serde_json::from_str(&stdout).unwrap();
        let hash = result["provenance"]["inputs"][0]["sha256"]
            .as_str()
            .unwrap();
        assert!(hash.len() == 64 && page.contains(hash));
        let profiles = fs::read_to_string(place.join("profiles.csv")).unwrap();
        let mut lines = profiles.lines();
        assert_eq!(
            lines.next(),
            Some("x_mm,M_um,M_std_um,S_A_um,S_A_std_um,S_B_um,S_B_std_um")
        );
        // Numbers are written so that they read back the same.
        let first = lines
            .next()
            .unwrap()
            .split(',')
            .map(|v| v.parse::<f64>().unwrap())
            .collect::<Vec<_>>();
        let in_json = result["forms"]["M"][0].as_f64().unwrap();
        // Epsilons: the reader of JSON used here is good to one rounding.
        assert!((first[1] - in_json).abs() <= f64::EPSILON * in_json.abs());
        assert_eq!(lines.count() + 1, readings().len());
    }
    assert_eq!(
        fs::read_to_string(folder.path().join("there/mine.txt")).unwrap(),
        "kept"
    );
    let left = fs::read_dir(folder.path().join("there")).unwrap().count();
    assert_eq!(
        left, 6,
        "mine, report, result and three tables, nothing temporary"
    );
}

#[test]
fn renamed_columns_in_other_units_are_the_same_data() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    let plain = json(folder.path(), &["reversal", "data.csv"]);
    let mut text = String::from("note,z_m,near0,far0,far180,near180\n");
    for (x, v) in readings() {
        text += &format!(
            "a,{},{},{},{},{}\n",
            x / 1e3,
            v[0] / 1e3,
            v[1] / 1e3,
            v[2] / 1e3,
            v[3] / 1e3
        );
    }
    fs::write(folder.path().join("odd.csv"), text).unwrap();
    let names = [
        ("x", "z_m:m"),
        ("1A", "near0:mm"),
        ("1B", "far0:mm"),
        ("2A", "far180:mm"),
        ("2B", "near180:mm"),
    ];
    let option = names
        .map(|(role, column)| format!("{role}={column}"))
        .join(",");
    let setup = names
        .map(|(role, column)| format!("{role} = \"{column}\"\n"))
        .concat();
    fs::write(
        folder.path().join("setup.toml"),
        format!("[columns]\n{setup}"),
    )
    .unwrap();
    for args in [["--columns", option.as_str()], ["--setup", "setup.toml"]] {
        let odd = json(
            folder.path(),
            &[&["reversal", "odd.csv"], &args[..]].concat(),
        );
        for tilt in ["alpha", "beta", "gamma"] {
            let value = |r: &Value| r["tilts"][tilt]["value"].as_f64().unwrap();
            // Epsilons: readings up to 6 µm over 100 mm, divided and multiplied by powers of ten.
            assert!((value(&odd) - value(&plain)).abs() < 1e-15);
        }
        assert!(
            odd["input"]
                .as_str()
                .unwrap()
                .ends_with("columns not read: note")
        );
    }
}

#[test]
fn help_has_an_example() {
    let folder = TempDir::new().unwrap();
    for command in ["reversal", "straightness", "traces"] {
        let (code, text, _) = run(folder.path(), &[command, "--help"]);
        assert_eq!(code, Some(0));
        assert!(
            text.contains(&format!("errsep {command} ")) && text.contains("Example"),
            "{text}"
        );
    }
}

/// A million rows; ten million by `cargo run --release -p errsep-campaigns --bin many_rows`.
#[test]
fn a_million_rows() {
    use std::io::Write;
    let rows = 1_000_000_u32;
    let mut file = tempfile::NamedTempFile::new().unwrap();
    {
        let mut out = std::io::BufWriter::new(&mut file);
        writeln!(out, "channel,x,reading").unwrap();
        for k in 0..rows {
            let channel = ["1A", "1B", "2A", "2B"][(k % 4) as usize];
            writeln!(out, "{channel},{},{}", f64::from(k / 4) / 1e3, k % 7).unwrap();
        }
        out.flush().unwrap();
    }
    let data = errsep::io::reversal::read(file.path(), &Default::default()).unwrap();
    assert_eq!(data.observations.readings.len(), rows as usize);
    let last = data.observations.readings.last().unwrap();
    assert_eq!(
        (last.channel.name(), last.x, last.value),
        ("2B", 249.999, f64::from((rows - 1) % 7))
    );
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

#[test]
fn a_misfit_is_told_and_the_diagnosis_named() {
    let folder = TempDir::new().unwrap();
    for (seed, repeats) in [("1", "1"), ("2", "1"), ("3", "3")] {
        simulated(
            folder.path(),
            &[
                "--effect",
                "taper=5e-6",
                "--seed",
                seed,
                "--repeats",
                repeats,
            ],
        );
        let args = ["reversal", "data.csv", "--simultaneous"];
        let answer = json(folder.path(), &args);
        let alpha = &answer["tilts"]["alpha"];
        let (value, std) = (
            alpha["value"].as_f64().unwrap(),
            alpha["std"].as_f64().unwrap(),
        );
        // k·u: α is 40 µrad, and the misfit leaves it alone.
        assert!((value - 40e-6).abs() < 2.0 * std && std < 1e-6, "{alpha}");
        assert_eq!(answer["agreement"]["disagree"], true);
        // 5 µrad over 300 mm: 1.5 µm/√12.
        let missed = answer["agreement"]["missed"]["value"].as_f64().unwrap();
        assert!((0.3..0.6).contains(&missed), "{missed}");
        let (_, text, _) = run(folder.path(), &args);
        for said in ["model and readings disagree", "errsep diagnose data.csv"] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(text.contains("errsep diagnose data.csv"), "{text}");
    }
    simulated(folder.path(), &["--seed", "5"]);
    let (_, text, _) = run(folder.path(), &["reversal", "data.csv", "--simultaneous"]);
    assert!(!text.contains("diagnose"), "{text}");
    // With one repeat it is said what is assumed, and what it would be otherwise.
    assert!(text.contains("only repeats would"), "{text}");
}

/// The angle stands with its value in seconds of arc, the expanded uncertainty by itself.
#[test]
fn seconds_of_arc_belong_to_the_value() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--seed", "5"]);
    for method in [&[][..], &["--simultaneous"]] {
        let (_, text, _) = run(folder.path(), &[&["reversal", "data.csv"], method].concat());
        let line = text.lines().find(|l| l.starts_with("  alpha")).unwrap();
        let (value, expanded) = line.split_once(", U = ").unwrap();
        // 40 µrad are 8.25″.
        assert!(value.ends_with("″)") && value.contains("(8."), "{line}");
        assert!(!expanded.contains('″'), "{line}");
    }
}

#[test]
fn more_knots_than_readings_carry_are_refused_at_once() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--seed", "3"]);
    for knots in ["59", "86", "20000", "100000000", "4294967295"] {
        let setup = format!("[model]\nknots = {knots}\n");
        fs::write(folder.path().join("k.toml"), setup).unwrap();
        let args = [
            "reversal",
            "data.csv",
            "--setup",
            "k.toml",
            "--simultaneous",
        ];
        let (code, out, err) = run(folder.path(), &args);
        assert_eq!(code, Some(1), "{err}");
        assert!(out.is_empty());
        assert!(
            err.contains("at most 58") && err.contains("leave them out"),
            "{err}"
        );
    }
}

#[test]
fn an_indicator_that_stands_still_is_told() {
    let folder = TempDir::new().unwrap();
    let mut still = "x,1A,1B,2A,2B\n".to_owned();
    for k in 0..20 {
        still += &format!("{},1.5,1.5,1.5,1.5\n", 5 * k);
    }
    fs::write(folder.path().join("still.csv"), still).unwrap();
    for method in [&[][..], &["--simultaneous"]] {
        let args = [&["reversal", "still.csv"], method].concat();
        let (code, text, err) = run(folder.path(), &args);
        assert_eq!(code, Some(0), "{err}");
        assert!(
            text.contains("all readings of 1A, 1B, 2A, 2B are equal"),
            "{text}"
        );
        assert!(!text.contains("Noise of one reading: 1"), "{text}");
        // In place of a tilt of 0 ± 0.
        assert!(
            text.contains("All readings are equal, which tells neither tilt nor form"),
            "{text}"
        );
        assert!(
            !text.contains("The slide is") && !text.contains("the slide runs"),
            "{text}"
        );
    }
}

/// With fewer than four channels the untapered convention counts the cone of the artefact as alpha; the
/// answer says so in its first sentence, to programs and on the page, and four channels say nothing of it.
#[test]
fn what_passes_for_alpha_with_fewer_channels_is_told() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--effect", "taper=20e-6"]);
    let all = fs::read_to_string(folder.path().join("data.csv")).unwrap();
    let keep = |channels: &[&str]| {
        let kept: Vec<&str> = all
            .lines()
            .filter(|line| {
                channels.iter().any(|c| line.starts_with(c)) || line.starts_with("channel")
            })
            .collect();
        fs::write(folder.path().join("part.csv"), kept.join("\n")).unwrap();
    };
    fs::write(
        folder.path().join("rigid.toml"),
        "[model]\nconvention = \"rigid\"\n",
    )
    .unwrap();
    for (channels, remedy) in [
        (&["1A", "2B"][..], "read 1A, 1B, 2A and 2B"),
        (&["1B", "2A"], "read 1A, 1B, 2A and 2B"),
        (
            &["1A", "1B", "2B"],
            "with which these channels tell them apart",
        ),
    ] {
        keep(channels);
        for method in [&[][..], &["--simultaneous"]] {
            let args = [&["reversal", "part.csv", "--out", "out"], method].concat();
            let (code, text, err) = run(folder.path(), &args);
            assert_eq!(code, Some(0), "{err}");
            let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
            for said in ["if the two sides of the artefact are parallel", remedy] {
                assert!(text.contains(said), "{said:?} is not in:\n{text}");
                assert!(page.contains(said), "{said:?} is not on the page");
            }
            let result = fs::read_to_string(folder.path().join("out/result.json")).unwrap();
            let result: Value = serde_json::from_str(&result).unwrap();
            let open = &result["not_determined"][0];
            assert!(
                open["combination"].as_str().unwrap().contains("cone"),
                "{open}"
            );
            // What is told is so: the cone of 20 µrad lies in alpha, which is 40 µrad.
            let alpha = result["tilts"]["alpha"]["value"].as_f64().unwrap();
            assert!(((alpha - 40e-6).abs() - 20e-6).abs() < 1e-6, "{alpha}");
            fs::remove_dir_all(folder.path().join("out")).unwrap();
        }
    }
    // Three channels with the rigid convention do tell them apart.
    let args = ["reversal", "part.csv", "--setup", "rigid.toml"];
    let apart = json(folder.path(), &args);
    assert_eq!(apart["not_determined"], serde_json::json!([]));
    let alpha = apart["tilts"]["alpha"]["value"].as_f64().unwrap();
    assert!((alpha - 40e-6).abs() < 1e-6, "{alpha}");
    keep(&["1A", "2B"]);
    let together = json(folder.path(), &args);
    assert!(together["not_determined"][0]["remedy"].is_string());
    let four = json(folder.path(), &["reversal", "data.csv"]);
    assert_eq!(four["not_determined"], serde_json::json!([]));
}

/// Whole traces that moved between their repeats are no noise of a reading: the answer says so and names
/// the diagnosis. Independent noise raises no alarm, whatever the channels' own noise.
#[test]
fn traces_that_moved_between_repeats_are_told() {
    let folder = TempDir::new().unwrap();
    let methods = [
        &["reversal", "data.csv"][..],
        &["reversal", "data.csv", "--simultaneous"],
    ];
    let both = ["--repeats", "3", "--both-directions"];
    simulated(
        folder.path(),
        &[&both[..], &["--effect", "zero-jump=0.4"]].concat(),
    );
    for args in methods {
        let (_, text, _) = run(folder.path(), args);
        for said in ["model and readings disagree", "errsep diagnose data.csv"] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
        assert_eq!(json(folder.path(), args)["agreement"]["disagree"], true);
    }
    for (seed, repeats) in [("1", "2"), ("2", "2"), ("3", "3"), ("4", "5"), ("5", "3")] {
        simulated(folder.path(), &["--seed", seed, "--repeats", repeats]);
        for args in methods {
            let (_, text, _) = run(folder.path(), args);
            assert!(!text.contains("disagree"), "{seed}: {text}");
        }
    }
}

/// By chance the closure of a few positions is half as large again as the noise explains: no alarm.
#[test]
fn a_closure_of_few_positions_raises_no_alarm() {
    let folder = TempDir::new().unwrap();
    for seed in 1..=40 {
        let seed = seed.to_string();
        let few = ["--positions", "7", "--repeats", "3", "--seed", &seed];
        let (_, data, _) = run(
            folder.path(),
            &[&["simulate", "reversal"][..], &few].concat(),
        );
        fs::write(folder.path().join("data.csv"), data).unwrap();
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(
            !text.contains("disagree") && !text.contains("explains"),
            "{seed}: {text}"
        );
    }
}

/// Without repeats the closure is told from the noise by neighbouring readings, which bound it.
#[test]
fn a_jump_without_repeats_is_told_by_the_closure() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--effect", "zero-jump=2"]);
    let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
    for said in ["model and readings disagree", "errsep diagnose data.csv"] {
        assert!(text.contains(said), "{said:?} is not in:\n{text}");
    }
    for seed in ["1", "2", "3", "4", "5"] {
        simulated(folder.path(), &["--seed", seed]);
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(!text.contains("disagree"), "{seed}: {text}");
    }
}
