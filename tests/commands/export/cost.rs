//! What a table costs: how far its straight lines miss what was found, and how well its values are known.

use crate::command::{Folder, run};
use serde_json::Value;

fn done(folder: &Folder, arguments: &str) -> String {
    let out = run(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(out.status, 0, "{arguments}: {}", out.stderr);
    out.stdout
}

fn about(folder: &Folder, file: &str) -> Value {
    serde_json::from_str(&folder.read(&format!("{file}.about.json"))).unwrap()
}

fn numbers(list: &Value) -> Vec<f64> {
    let list = list.as_array().unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

/// A parabola c x² is missed by c h²/4 in the middle of a step h; a straight line and a table on its own points by nothing.
#[test]
fn straight_lines_miss_a_curve() {
    const MACHINE: &str = "\
chain = \"XYFZ\"
[errors.EXX]
polynomial = [0.1, 0.02, 4e-4]
[errors.ECX]
polynomial = [0.0, 1e-8]
[errors.EAY]
table = { positions = [0, 100, 150, 200], values = [0, 1e-5, 3e-5, 0] }
";
    let folder = Folder::with(&[("machine.toml", MACHINE)]);
    for (format, comment) in [("etalon", "//"), ("isg-volumetric", "//"), ("csv", "")] {
        let options =
            format!("export {format} machine.toml --travel X=0:200 --points 3 --out {format}");
        let told = done(&folder, &options);
        let resampling = &about(&folder, format)["resampling"];
        // 4e-4 (100 mm)²/4 = 1 µm at 50 (or 150) mm; epsilons.
        assert!(
            (resampling["value"].as_f64().unwrap() - 1.0).abs() < 1e-12,
            "{resampling}"
        );
        assert_eq!(
            (&resampling["of"], &resampling["unit"]),
            (&"EXX".into(), &"um".into())
        );
        assert_eq!(resampling["at"].as_f64().unwrap() % 100.0, 50.0);
        let each = resampling["each"].as_array().unwrap();
        let of = |name: &str| each.iter().find(|e| e["of"] == name).unwrap();
        assert!(of("ECX")["value"].as_f64().unwrap() < 1e-20);
        // Between 1e-5 at 100 and 0 at 200 mm stands 3e-5 at 150.
        let table = of("EAY");
        assert!(
            (table["value"].as_f64().unwrap() - 2.5e-5).abs() < 1e-19,
            "{table}"
        );
        assert_eq!(
            (&table["at"], &table["unit"]),
            (&150.0.into(), &"rad".into())
        );
        let sentence =
            "straight lines between the points miss what was found by 1.0 um at most (EXX at ";
        assert!(told.contains(&sentence.replace(" um ", " µm ")), "{told}");
        let file = folder.read(format);
        let comments: Vec<&str> = file.lines().filter(|l| l.starts_with("//")).collect();
        assert_eq!(comments.len(), if comment.is_empty() { 0 } else { 2 });
        assert!(
            comment.is_empty() || comments[0].contains(sentence),
            "{file}"
        );
        assert!(
            comments.iter().all(|l| l.is_ascii() && !l.contains('#')),
            "{comments:?}"
        );
    }
    // Nothing is missed on the points of the table.
    done(
        &folder,
        "export etalon machine.toml --travel X=0:200 --step 1 --out fine",
    );
    let fine = about(&folder, "fine")["resampling"]["each"].clone();
    let of = |name: &str| {
        fine.as_array()
            .unwrap()
            .iter()
            .find(|e| e["of"] == name)
            .unwrap()
    };
    assert!(of("EAY")["value"].as_f64().unwrap() < 1e-19);
}

/// Scatter of one reading over the root of the readings at a target, between two targets by their shares, and what
/// is stated in proportion to length; kind: epsilons.
#[test]
fn values_are_as_well_known_as_their_means() {
    let setup = "[uncertainty]\ndevice = 3.0\nexpansion = 4.0\n";
    let folder = Folder::with(&[("s.toml", setup)]);
    let made = done(&folder, "simulate positioning --targets 6 --seed 3");
    let fewer: String = made
        .lines()
        .filter(|l| !l.starts_with("100,2,forward,"))
        .map(|l| format!("{l}\n"))
        .collect();
    assert_eq!(fewer.lines().count() + 1, made.lines().count());
    folder.write("p.csv", &fewer);
    for (data, of_length) in [("plain", 0.0), ("stated", 2.5)] {
        let options = if of_length > 0.0 {
            " --setup s.toml"
        } else {
            ""
        };
        let result = done(
            &folder,
            &format!("positioning p.csv{options} --format json"),
        );
        let answer: Value = serde_json::from_str(&result).unwrap();
        assert_eq!(answer["scatter"]["equal"]["differs"], false);
        let std = answer["scatter"]["std"].as_f64().unwrap();
        folder.write("r.json", &result);
        done(
            &folder,
            &format!("export linuxcnc r.json --points 11 --out {data}"),
        );
        let known = about(&folder, data)["uncertainty"].clone();
        assert_eq!(known[0]["of"], "mean forward");
        let freedom = |a: &Value| a["degrees_of_freedom"].as_f64().unwrap();
        assert_eq!(freedom(&known[0]), freedom(&answer["scatter"]));
        let (at, forward) = (numbers(&known[0]["at"]), numbers(&known[0]["std"]));
        let of_mean = |k: usize| std * std / if k == 2 { 4.0 } else { 5.0 };
        for (i, (x, u)) in at.iter().zip(&forward).enumerate() {
            let mean = match (i / 2, i % 2) {
                (k, 0) => of_mean(2 * k),
                (k, _) => 0.25 * (of_mean(2 * k) + of_mean(2 * k + 2)),
            };
            let expected = (mean + (of_length * x / 500.0).powi(2)).sqrt();
            assert!((u - expected).abs() < 1e-9, "{x}: {u} for {expected}");
        }
    }
    // At the reference the mean of both directions is zero: half of either mean is left, and nothing of the length.
    let told = done(
        &folder,
        "export linuxcnc r.json --reference 300 --out reference",
    );
    let forward = numbers(&about(&folder, "reference")["uncertainty"][0]["std"]);
    let answer: Value = serde_json::from_str(&folder.read("r.json")).unwrap();
    let std = answer["scatter"]["std"].as_f64().unwrap();
    assert!((forward[3] - std * (0.25_f64 / 5.0 + 0.25 / 5.0).sqrt()).abs() < 1e-9);
    assert!(
        told.contains("standard uncertainty of a value up to"),
        "{told}"
    );
}

#[test]
fn profiles_and_machines_pass_on_what_they_know() {
    let folder = Folder::with(&[]);
    for (data, made, command, export) in [
        (
            "traces.csv",
            "simulate reversal --positions 11",
            "reversal traces.csv",
            "siemens-cec r.json --axis X:Z",
        ),
        (
            "steps.csv",
            "simulate step-diagonal --steps 3 --target retro-reflector",
            "step-diagonal steps.csv",
            "etalon r.json",
        ),
    ] {
        folder.write(data, &done(&folder, made));
        let result = done(&folder, &format!("{command} --format json"));
        folder.write("r.json", &result);
        done(&folder, &format!("export {export} --out {data}.out"));
        let known = about(&folder, &format!("{data}.out"))["uncertainty"][0].clone();
        let answer: Value = serde_json::from_str(&result).unwrap();
        let own = match data {
            "traces.csv" => answer["forms"]["M_std"].clone(),
            _ => {
                let all = answer["components"].as_array().unwrap();
                all.iter().find(|c| c["name"] == known["of"]).unwrap()["std"].clone()
            }
        };
        // On its own points a table is as well known as the result; epsilons of a change of units.
        for (a, b) in numbers(&known["std"]).iter().zip(numbers(&own)) {
            assert!((a - b).abs() < 1e-12, "{data}: {a} for {b}");
        }
    }
}

/// Kind: k·u. Exported values of 60 tests of an axis, on points of their own and counted from a reference, against the
/// axis: within two standard uncertainties 95 %; less than 90 % or more than 99 % happen less than once in a thousand.
#[test]
fn exported_values_lie_within_their_uncertainty() {
    let folder = Folder::with(&[]);
    let truth = done(&folder, "simulate positioning --noise 0 --targets 6");
    let (mut held, mut all) = (0, 0);
    folder.write("t.csv", &truth);
    folder.write("t.json", &done(&folder, "positioning t.csv --format json"));
    let export = |file: &str| {
        done(
            &folder,
            &format!(
                "export isg-leadscrew {file} --axis 1 --points 11 --reference 100 --out o --force"
            ),
        );
        let text = folder.read("o");
        let of = |name: &str| -> Vec<f64> {
            let rows = text
                .lines()
                .filter_map(|l| l.split_once(&format!("].{name} ")));
            rows.map(|(_, v)| 0.1 * v.parse::<f64>().unwrap()).collect()
        };
        (of("pos"), of("neg"))
    };
    let exact = export("t.json");
    for seed in 1..=60 {
        folder.write(
            "p.csv",
            &done(
                &folder,
                &format!("simulate positioning --noise 2 --targets 6 --seed {seed}"),
            ),
        );
        folder.write("p.json", &done(&folder, "positioning p.csv --format json"));
        let found = export("p.json");
        let known = about(&folder, "o")["uncertainty"].clone();
        for (d, found, exact) in [(0, &found.0, &exact.0), (1, &found.1, &exact.1)] {
            for ((u, a), b) in numbers(&known[d]["std"]).iter().zip(found).zip(exact) {
                all += 1;
                held += usize::from((a - b).abs() < 2.0 * u);
            }
        }
    }
    let share = held as f64 / all as f64;
    assert!(all == 60 * 22 && (0.90..=0.99).contains(&share), "{share}");
}
