//! Positions that one repeat lacks: taken from the others, told, and counted in the uncertainty.

use super::{json, numbers};
use crate::command::{Folder, run};
use serde_json::Value;

const SETUP: &str = "[section]\nlength = 100.0\n";

/// Scans of three repeats, and the same without some rows, readings of P1 and of P2.
fn scans(noise: &str) -> (Folder, String) {
    let folder = Folder::with(&[("s.toml", SETUP)]);
    let words = format!("simulate fourier --samples 200 --repeats 3 --noise {noise}");
    let made = run(&folder, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write("whole.csv", &made.stdout);
    let mut out = String::new();
    for line in made.stdout.lines() {
        let mut fields: Vec<&str> = line.split(',').collect();
        match fields.get(..3) {
            Some(["48.5", "1", "10"] | ["34.1", "2", "60.5"]) => continue,
            Some(["48.5", "2", "20"]) => fields[3] = "",
            Some(["78.6", "3", "5"]) => fields[4] = "",
            _ => {}
        }
        out += &format!("{}\n", fields.join(","));
    }
    folder.write("lacking.csv", &out);
    (folder, made.stdout)
}

fn answer(folder: &Folder, data: &str, setup: &str) -> Value {
    let arguments = ["fourier", data, "--setup", setup, "--format", "json"];
    json(folder, &arguments)
}

#[test]
fn what_a_repeat_lacks_is_taken_from_the_others() {
    let (folder, whole) = scans("1");
    assert!(whole.contains("\n48.5,1,10,") && whole.contains("\n34.1,2,60.5,"));
    let [whole, lacking] = ["whole.csv", "lacking.csv"].map(|f| answer(&folder, f, "s.toml"));
    let filled: Vec<(f64, u64, Vec<f64>)> = lacking["scans"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| {
            let of = |key: &str| s[key].as_f64().unwrap();
            (of("spacing"), of("repeat") as u64, numbers(s, "/filled"))
        })
        .filter(|(.., filled)| !filled.is_empty())
        .collect();
    let expected = [
        (48.5, 1, vec![10.0]),
        (48.5, 2, vec![20.0]),
        (34.1, 2, vec![60.5]),
        (78.6, 3, vec![5.0]),
    ];
    assert_eq!(filled, expected);
    // Each takes one from the degrees of freedom of the noise.
    let freedom = |a: &Value| a["uncertainty"]["degrees_of_freedom"].as_f64().unwrap();
    assert_eq!(freedom(&whole) - freedom(&lacking), 4.0);
    let remarks = lacking["remarks"].to_string();
    for part in [
        "4 positions are missing",
        "x = 10 mm in repeat 1 of spacing 48.5 mm",
    ] {
        assert!(remarks.contains(part), "{part}: {remarks}");
    }
    // Where P1 was read by eight scans of nine the slide is known as well as that; beside it as before.
    let std = numbers(&lacking, "/profiles/slide_std");
    let first = lacking["noise"]["first_probe"].as_f64().unwrap();
    let (at, beside) = (std[20].powi(2), 0.5 * (std[19].powi(2) + std[21].powi(2)));
    let expected = first * first * (1.0 / 8.0 - 1.0 / 9.0);
    // Tolerance: the uncertainty of the workpiece bends between neighbours by less than a tenth of this.
    assert!(
        ((at - beside) / expected - 1.0).abs() < 0.1,
        "{at} {beside} {expected}"
    );
    // P1 was read where P2 was not.
    let (at, beside) = (std[10].powi(2), 0.5 * (std[9].powi(2) + std[11].powi(2)));
    assert!((at - beside).abs() < 0.1 * expected, "{at} {beside}");
}

/// Exact limit: without noise the others have exactly what a repeat lacks, whatever the heights of the repeats.
#[test]
fn nothing_is_lost_without_noise() {
    let (folder, _) = scans("0");
    folder.write("n.toml", &format!("{SETUP}[probe]\nnoise = 1\n"));
    let lifted: String = folder
        .read("lacking.csv")
        .lines()
        .map(|line| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            if fields.get(1).is_some_and(|f| f == "2") {
                for (field, height) in fields.iter_mut().skip(3).zip([7.0, -3.0, 11.0]) {
                    if let Ok(value) = field.parse::<f64>() {
                        *field = (value + height).to_string();
                    }
                }
            }
            fields.join(",") + "\n"
        })
        .collect();
    folder.write("lifted.csv", &lifted);
    let of = |file: &str| numbers(&answer(&folder, file, "n.toml"), "/profiles/straightness");
    let whole = of("whole.csv");
    for file in ["lacking.csv", "lifted.csv"] {
        let worst = whole
            .iter()
            .zip(of(file))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        // Tolerance: readings of up to 100 µm that are written with their last digits.
        assert!(worst < 1e-9, "{file}: {worst}");
    }
}
