//! Readings that a repeat lacks: taken from the others, told, and counted in the uncertainty.

use super::{answered, errsep, simulated, text};
use serde_json::{Value, json};

const SETUP: &str = "[sensors]\nspacing = [5.0, 5.0, 25.0]\n";

/// Tidy rows of some outputs, with heights added by sensor and repeat, without those that `lacks` names.
fn rows(wide: &str, heights: [[f64; 4]; 2], lacks: &[(usize, usize, &str)], empty: bool) -> String {
    let mut out = "sensor,repeat,x,reading\n".to_owned();
    for line in wide
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
    {
        let fields: Vec<&str> = line.split(',').collect();
        let [x, readings @ ..] = &fields[..] else {
            panic!("{line}")
        };
        for (repeat, heights) in heights.iter().enumerate() {
            for (sensor, (reading, height)) in readings.iter().zip(heights).enumerate() {
                let value: f64 = reading.parse().unwrap();
                let value = value + height;
                match lacks.contains(&(sensor + 1, repeat + 1, *x)) {
                    true if empty => out += &format!("{},{},{x},\n", sensor + 1, repeat + 1),
                    true => {}
                    false => out += &format!("{},{},{x},{value}\n", sensor + 1, repeat + 1),
                }
            }
        }
    }
    out
}

/// Exact limit: two repeats that differ by their zeros alone say the same whatever one of them lacks.
#[test]
fn what_a_repeat_lacks_is_taken_from_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let stated = format!("{SETUP}noise = 0.05\n");
    let (data, setup) = simulated(folder.path(), &["--noise", "0.05"], &stated);
    let wide = std::fs::read_to_string(&data).unwrap();
    let header = wide.lines().find(|l| l.starts_with('x')).unwrap();
    assert_eq!(header, "x,m1,m2,m3,m4");
    let heights = [[0.0; 4], [3.0, -7.0, 2.0, 5.0]];
    let lacks = [(2, 1, "35"), (4, 2, "35"), (1, 2, "100")];
    let of = |lacks: &[(usize, usize, &str)], empty: bool| -> Value {
        std::fs::write(&data, rows(&wide, heights, lacks, empty)).unwrap();
        answered(&data, &setup)
    };
    let (whole, out, empty) = (of(&[], false), of(&lacks, false), of(&lacks, true));
    assert_eq!(whole["missing"], json!([]));
    assert_eq!(
        out["missing"][0],
        json!({"sensor": 1, "x": 100.0, "repeat": 2})
    );
    assert_eq!(out["missing"].as_array().unwrap().len(), 3);
    assert_eq!(out["geometry"]["repeats"], 2);
    assert!(
        out["average"]["text"]
            .as_str()
            .unwrap()
            .contains("3 readings")
    );
    let list = |answer: &Value, key: &str| -> Vec<f64> {
        let list = answer["straightness"][key].as_array().unwrap();
        list.iter().map(|v| v.as_f64().unwrap()).collect()
    };
    for answer in [&out, &empty] {
        let pairs = list(&whole, "S").into_iter().zip(list(answer, "S"));
        // Tolerance: readings of up to 100 µm that are written with their last digits; a λ that is sought to 1e-6.
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{worst}");
    }
    // S at a place is the line through what is left of its four outputs, at sensor 1: the weight of the output at p is
    // 1/4 + m(m − p)/Σ(p − m)², m the mean of the places. One reading in place of two doubles the variance of its mean.
    let places = [0.0, 5.0, 10.0, 35.0];
    let mean = places.iter().sum::<f64>() / 4.0;
    let inertia: f64 = places.iter().map(|p| (p - mean) * (p - mean)).sum();
    let weight = |sensor: usize| 0.25 + mean * (mean - places[sensor - 1]) / inertia;
    let variance = 0.05 * 0.05 / 2.0;
    for (k, (a, b)) in list(&whole, "S_std")
        .iter()
        .zip(list(&out, "S_std"))
        .enumerate()
    {
        let expected = match k {
            7 => variance * (weight(2).powi(2) + weight(4).powi(2)),
            20 => variance * weight(1).powi(2),
            _ => 0.0,
        };
        let more = b * b - a * a;
        // Tolerance: a λ that is sought to 1e-6, of variances a hundred times as large.
        assert!(
            (more - expected).abs() < 1e-3 * variance,
            "{k}: {more} for {expected}"
        );
    }
}

#[test]
fn what_no_repeat_has_is_told_where_it_would_stand() {
    let folder = tempfile::tempdir().unwrap();
    let (data, setup) = simulated(folder.path(), &[], SETUP);
    let wide = std::fs::read_to_string(&data).unwrap();
    let refused = |content: &str, command: &str| -> String {
        std::fs::write(&data, content).unwrap();
        let out = errsep(&[command, text(&data), "--setup", text(&setup)]);
        assert_eq!(out.status.code(), Some(2));
        String::from_utf8(out.stderr).unwrap()
    };
    let lines: Vec<&str> = wide.lines().collect();
    let (at, line) = lines
        .iter()
        .enumerate()
        .find(|(_, l)| l.starts_with("35,"))
        .unwrap();
    let mut fields: Vec<&str> = line.split(',').collect();
    fields[2] = "";
    let one = wide.replace(line, &fields.join(","));
    let told = refused(&one, "four-sensor");
    let place = format!("data.csv:{}:1: sensor 2 has no reading at 35 mm\n", at + 1);
    assert!(
        told.contains(&place) && told.contains("help: read the position again"),
        "{told}"
    );

    let heights = [[0.0; 4]; 2];
    let told = refused(
        &rows(&wide, heights, &[(2, 1, "35"), (2, 2, "35")], true),
        "four-sensor",
    );
    assert!(
        told.contains("sensor 2 has no reading at 35 mm in any repeat"),
        "{told}"
    );
    // Causes are sought in each repeat by itself.
    let told = refused(&rows(&wide, heights, &[(2, 1, "35")], false), "diagnose");
    assert!(
        told.contains("sensor 2 has no reading at 35 mm in repeat 1"),
        "{told}"
    );
    assert!(told.contains("leave out repeat 1"), "{told}");
    // A repeat that was broken off.
    let ends: Vec<String> = (40..62).map(|k| (5 * k).to_string()).collect();
    let broken: Vec<(usize, usize, &str)> = (1..=4)
        .flat_map(|sensor| ends.iter().map(move |x| (sensor, 2, x.as_str())))
        .collect();
    let told = refused(&rows(&wide, heights, &broken, false), "four-sensor");
    assert!(
        told.contains("repeat 2 lacks more than a tenth of its readings"),
        "{told}"
    );
}
