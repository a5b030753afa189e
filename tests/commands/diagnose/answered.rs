//! What an answer holds: effects withheld and of the user's own, numbers in words.

use serde_json::Value;

use super::effects;
use crate::command::{Folder, bad_input, run};

#[test]
fn one_effect_may_be_withheld_by_name_only() {
    let folder = Folder::with(&[]);
    let made = run(&folder, &["simulate", "circle", "--effect", "lobes=8"]);
    folder.write("d.csv", &made.stdout);
    bad_input(
        &folder,
        &[
            "diagnose",
            "d.csv",
            "--model",
            "circle",
            "--without",
            "lobe",
        ],
        &["no effect `lobe`", "lobes"],
    );
    let out = run(
        &folder,
        &[
            "diagnose",
            "d.csv",
            "--model",
            "circle",
            "--without",
            "lobes",
            "--format",
            "json",
        ],
    );
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(answer["verdict"]["kind"], "unknown");
    // Nor is it put in, nor named, in a proof.
    let plain = run(&folder, &["simulate", "circle"]);
    folder.write("plain.csv", &plain.stdout);
    let proof = |without: &[&str]| -> Value {
        let arguments = [
            "diagnose",
            "plain.csv",
            "--model",
            "circle",
            "--prove",
            "30",
        ];
        let out = run(
            &folder,
            &[&arguments[..], &["--format", "json"], without].concat(),
        );
        assert_eq!(out.status, 0, "{}", out.stderr);
        serde_json::from_str::<Value>(&out.stdout).unwrap()["proof"].clone()
    };
    let names = |proof: &Value| proof["truths"].to_string() + &proof["answers"].to_string();
    let all = names(&proof(&[]));
    let put_in = proof(&[])["truths"].as_array().unwrap().clone();
    let effects = put_in.iter().map(|t| t.as_str().unwrap());
    let first = effects.into_iter().find(|t| *t != "none").unwrap();
    assert!(all.contains(first));
    let rest = names(&proof(&["--without", first]));
    assert!(!rest.contains(first), "{first} is withheld: {rest}");
}

/// Numbers of an answer have the minus sign of typography, and nouns their number.
#[test]
fn an_answer_in_words_has_one_minus_sign() {
    let folder = Folder::with(&[]);
    let hyphened = |text: &str| {
        let words = text.split(['\n', ' ', '(', ',', '[']);
        let minus = words.filter_map(|word| word.strip_prefix('-'));
        let numbers = minus.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        numbers.map(str::to_owned).collect::<Vec<_>>()
    };
    let made =
        "simulate reversal --alpha -20 --effect taper=-2e-5 --repeats 2 --positions 31 --out d";
    let one = "simulate reversal --design 0/0,0/90,0/180,0/270 --repeats 2 --both-directions \
               --positions 21 --alpha -20 --out one";
    for (made, asked) in [
        (made, "diagnose d/readings.csv"),
        (made, "reversal d/readings.csv --simultaneous --diagnose"),
        (one, "diagnose one/readings.csv"),
    ] {
        let words = |line: &'static str| line.split_whitespace().collect::<Vec<_>>();
        assert_eq!(
            run(&folder, &[&words(made)[..], &["--force"]].concat()).status,
            0
        );
        let out = run(&folder, &words(asked));
        assert_eq!(out.status, 0, "{asked}: {}", out.stderr);
        let found = hyphened(&out.stdout);
        assert!(found.is_empty(), "{asked}: {found:?} in {}", out.stdout);
        let told = match made == one {
            true => "4 channels of 1 indicator in 4 positions of the spindle",
            false => "\u{2212}",
        };
        assert!(out.stdout.contains(told), "{asked}: {}", out.stdout);
    }
}

/// An effect of the user's own, as a formula: a dent of 0.01 over a calibration line is unknown to the
/// catalogue, is named with it, at its size, and a slip in the formula is shown at its place.
#[test]
fn an_effect_of_the_users_own_is_named_by_its_formula() {
    let folder = Folder::with(&[
        (
            "e.toml",
            "[[effect]]\nname = \"dent\"\nformula = \"exp(-((x - 6) / 0.8)^2)\"\n",
        ),
        (
            "slip.toml",
            "[[effect]]\nname = \"dent\"\nformula = \"exp(-((x - 6) / 0.8)^2\"\n",
        ),
    ]);
    let made = run(&folder, &["simulate", "calibration-line", "--sets", "4"]);
    let dented: Vec<String> = made
        .stdout
        .lines()
        .map(|line| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            if let Ok(x) = fields[0].parse::<f64>() {
                let y: f64 = fields[1].parse().unwrap();
                fields[1] = (y + 0.01 * (-((x - 6.0) / 0.8).powi(2)).exp()).to_string();
            }
            fields.join(",")
        })
        .collect();
    folder.write("d.csv", &dented.join("\n"));
    let line = ["diagnose", "d.csv", "--model", "calibration-line"];
    let answer = |more: &[&str]| -> Value {
        let out = run(&folder, &[&line[..], &["--format", "json"], more].concat());
        assert_eq!(out.status, 0, "{}", out.stderr);
        serde_json::from_str(&out.stdout).unwrap()
    };
    assert_eq!(answer(&[])["verdict"]["kind"], "unknown");
    let named = answer(&["--effects", "e.toml"]);
    assert_eq!(
        effects(&named),
        ["dent"],
        "{}",
        named["verdict"]["statement"]
    );
    let candidates = named["candidates"].as_array().unwrap();
    let dent = candidates.iter().find(|c| c["effect"] == "dent").unwrap();
    let size = &dent["parameters"][0];
    let (value, std) = (
        size["value"].as_f64().unwrap(),
        size["std"].as_f64().unwrap(),
    );
    // k·u: three standard uncertainties of the size.
    assert!((value - 0.01).abs() < 3.0 * std && std < 1e-3, "{size}");
    let slip = [&line[..], &["--effects", "slip.toml"]].concat();
    bad_input(&folder, &slip, &["slip.toml:3:11", "a `)` is missing"]);
}
