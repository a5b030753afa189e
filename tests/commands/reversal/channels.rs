//! What is told with fewer than four channels, and where single readings are missing.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use super::{json, readings, run, simulated};

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
