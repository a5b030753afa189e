//! What a further measurement will show, sealed before it is made and scored afterwards.

use errsep_models::reversal::{Direction, Observations};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::command::{Folder, bad_input, documented, run};
use crate::sealed_machine::{Fault, Layout, Machine};

const LAYOUT: Layout = Layout {
    positions: 31,
    repeats: 3,
    both: true,
};

fn csv(observations: &Observations, readings: bool) -> String {
    let mut text = "channel,repeat,direction,time,x".to_owned();
    text += if readings { ",reading\n" } else { "\n" };
    for r in &observations.readings {
        let direction = match r.direction {
            Direction::Forward => "forward",
            Direction::Backward => "backward",
        };
        text += &format!(
            "{},{},{direction},{:?},{}",
            r.channel.name(),
            r.repeat,
            r.time.unwrap(),
            r.x
        );
        text += &if readings {
            format!(",{}\n", r.value)
        } else {
            "\n".to_owned()
        };
    }
    text
}

/// A machine with a cone, measured twice, and the plan of the second time.
fn measured() -> Folder {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let machine = Machine::drawn(Fault::Taper, &mut random);
    let now = machine.measured(LAYOUT, Some(&mut random));
    let next = machine.measured(LAYOUT, Some(&mut random));
    let plan = machine.measured(LAYOUT, None);
    let folder = Folder::with(&[
        ("now.csv", &csv(&now, true)),
        ("next.csv", &csv(&next, true)),
    ]);
    folder.write("plan.csv", &csv(&plan, false));
    folder
}

const SEAL: [&str; 8] = [
    "diagnose",
    "now.csv",
    "--severity",
    "0",
    "--seal",
    "seal.toml",
    "--next",
    "plan.csv",
];

#[test]
fn what_is_sealed_is_scored_and_a_seal_that_was_touched_is_refused() {
    let folder = measured();
    let out = run(&folder, &[&SEAL[..], &["--format", "json"]].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    documented(&answer, "docs/json/diagnosis.md");
    let sealed = &answer["sealed"];
    assert_eq!(sealed["effects"][0]["effect"], "taper");
    assert_eq!(sealed["readings"], 4 * 31 * 3 * 2);
    let file = folder.read("seal.toml");
    let first = format!("sha256 = {}\n", sealed["sha256"]);
    assert!(file.starts_with(&first), "{}", &file[..100]);

    let out = run(
        &folder,
        &["check", "seal.toml", "next.csv", "--format", "json"],
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    let score: Value = serde_json::from_str(&out.stdout).unwrap();
    documented(&score, "docs/json/check.md");
    assert_eq!(score["effects"][0]["standing"], "stands");
    // Monte Carlo: 744 readings, of which 95 % are expected; 4 standard deviations are 3.2 %.
    let coverage = score["trace"]["coverage"].as_f64().unwrap();
    assert!((0.918..0.982).contains(&coverage), "{coverage}");
    let said = run(
        &folder,
        &["check", "seal.toml", "next.csv", "--out", "checked"],
    );
    assert!(said.stdout.contains("taper stands"), "{}", said.stdout);
    assert!(
        folder
            .read("checked/report.html")
            .contains("Readings against their bands")
    );

    // Its own readings are no evidence.
    let own = run(&folder, &["check", "seal.toml", "now.csv"]);
    assert!(own.stdout.contains("no evidence"), "{}", own.stdout);

    // One byte: of the digest, of a number, of a comment, of the last line; and one more at the end.
    for place in [15, 120, file.len() / 2, file.len() - 2] {
        let mut bytes = file.clone().into_bytes();
        bytes[place] = if bytes[place] == b'1' { b'2' } else { b'1' };
        folder.write("touched.toml", &String::from_utf8(bytes).unwrap());
        bad_input(
            &folder,
            &["check", "touched.toml", "next.csv"],
            &["the seal is broken", "touched.toml"],
        );
    }
    folder.write("touched.toml", &format!("{file} "));
    bad_input(
        &folder,
        &["check", "touched.toml", "next.csv"],
        &["the seal is broken"],
    );
    bad_input(
        &folder,
        &["check", "now.csv", "next.csv"],
        &["does not begin with the digest"],
    );
    // Nothing is replaced.
    bad_input(&folder, &SEAL, &["exists already", "seal.toml"]);
}

#[test]
fn columns_of_other_names_and_units_are_sealed_with_them() {
    let folder = measured();
    let sealed = |seal: &str, more: &[&str]| {
        let [data, next, plan] = if more.is_empty() {
            ["now.csv", "next.csv", "plan.csv"]
        } else {
            ["other-now.csv", "other-next.csv", "other-plan.csv"]
        };
        let line = [
            "diagnose",
            data,
            "--severity",
            "0",
            "--seal",
            seal,
            "--next",
            plan,
        ];
        let out = run(&folder, &[&line[..], more].concat());
        assert_eq!(out.status, 0, "{}", out.stderr);
        let out = run(&folder, &["check", seal, next, "--format", "json"]);
        assert_eq!(out.status, 0, "{}", out.stderr);
        let score: Value = serde_json::from_str(&out.stdout).unwrap();
        score["trace"]["coverage"].as_f64().unwrap()
    };
    // The same readings in nm under another name, beside a column more.
    for file in ["now.csv", "next.csv", "plan.csv"] {
        let mut text = String::new();
        for line in folder.read(file).lines() {
            let line = line.replace(
                "channel,repeat,direction,time,x",
                "probe,repeat,direction,time,z",
            );
            text += &match line.rsplit_once(',') {
                Some((rest, "reading")) => format!("{rest},signal,note\n"),
                Some((rest, last)) if file != "plan.csv" => {
                    format!("{rest},{},-\n", 1e3 * last.parse::<f64>().unwrap())
                }
                _ => format!("{line}\n"),
            };
        }
        folder.write(&format!("other-{file}"), &text);
    }
    let columns =
        "channel=probe,repeat=repeat,direction=direction,time=time:s,x=z:mm,reading=signal:nm";
    let (own, renamed) = (
        sealed("a.toml", &[]),
        sealed("b.toml", &["--columns", columns]),
    );
    // Monte Carlo: bands are drawn from readings that differ in their last digit: two of 744 on an edge.
    assert!((own - renamed).abs() <= 2.5 / 744.0, "{own} {renamed}");
    let file = folder.read("b.toml");
    assert!(
        file.contains(&format!("columns = \"{columns}\"")),
        "{}",
        &file[..600]
    );
}

#[test]
fn a_plan_that_cannot_be_sealed_is_refused() {
    let folder = measured();
    let plan = folder.read("plan.csv");
    folder.write("read.csv", &folder.read("now.csv"));
    folder.write("far.csv", &plan.replace(",300\n", ",330\n"));
    folder.write("text.csv", &plan.replacen(",0\n", ",zero\n", 1));
    let with = |next: &'static str| {
        let mut line = SEAL;
        line[7] = next;
        line
    };
    bad_input(
        &folder,
        &with("read.csv"),
        &["the plan has readings", "read.csv:1"],
    );
    bad_input(&folder, &with("text.csv"), &["text.csv (plan):2"]);
    bad_input(
        &folder,
        &with("far.csv"),
        &["far.csv", "330", "from 0 to 300"],
    );
    bad_input(&folder, &SEAL[..6], &["--next"]);
    folder.write(
        "points.csv",
        "x,y\n10,0\n0,10\n-10,0\n0,-10\n7,7.2\n-7,-7\n",
    );
    let circle = [
        "diagnose",
        "points.csv",
        "--model",
        "circle",
        "--seal",
        "c.toml",
        "--next",
        "plan.csv",
    ];
    let out = run(&folder, &circle);
    assert_eq!(out.status, 1, "{}", out.stderr);
    assert!(
        out.stderr.contains("a circle cannot be sealed"),
        "{}",
        out.stderr
    );
    assert!(!folder.path().join("seal.toml").exists() && !folder.path().join("c.toml").exists());
}
