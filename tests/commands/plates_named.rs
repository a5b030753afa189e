//! Tables of plates with other names of columns, and what is learnt from several of them.

use super::plates::{MACHINE, answer};
use crate::command::{Folder, bad_input, run};

/// A bump of 4 µm along x that no effect of the catalogue explains: four measurements of 12 × 4 points, in
/// columns that nothing but a map can tell.
fn bent(turn: f64, height: f64) -> String {
    let mut text = "Messprotokoll\nLoch;Sollwert A;Sollwert B;Wert A;Wert B;Lauf\n".to_owned();
    for run in 1..=4_u32 {
        for i in 0..12_u32 {
            for j in 0..4_u32 {
                let [x, y] = [20.0 * f64::from(i), 60.0 * f64::from(j)];
                let noise =
                    |k: u32| f64::from((37 * i + 71 * j + 113 * run + 17 * k) % 11) * 1e-4 - 5e-4;
                let bump = height * (-((x - 90.0) / 40.0).powi(2)).exp();
                let a = x - y * turn + 0.02 + noise(1) + bump;
                let b = y + x * turn - 0.013 + noise(2);
                text += &format!("H{i}_{j};{x:.3};{y:.3};{a:.5};{b:.5};{run}\n");
            }
        }
    }
    text
}

const COLUMNS: &str = "point=Loch,nominal x=Sollwert A:mm,nominal y=Sollwert B:mm,measured x=Wert A:mm,\
    measured y=Wert B:mm,replicate=Lauf";

/// The same table with names that are known by themselves.
fn known(table: &str) -> String {
    let names = "point;nominal x;nominal y;measured x;measured y;replicate";
    table.replace("Loch;Sollwert A;Sollwert B;Wert A;Wert B;Lauf", names)
}

#[test]
fn columns_are_read_by_the_names_that_are_given() {
    let table = bent(3e-4, 0.004);
    let folder = Folder::with(&[("machine.toml", MACHINE)]);
    let parts = ["machine", "machine.toml", "parts", "plate.csv"];
    let quick = ["--setup", "machine.toml", "--severity", "0"];
    let diagnose = [&["diagnose", "plate.csv"], &quick[..]].concat();
    for words in [&parts[..], &diagnose] {
        folder.write("plate.csv", &table);
        let named = answer(&folder, &[words, &["--columns", COLUMNS]].concat());
        folder.write("plate.csv", &known(&table));
        assert_eq!(named, answer(&folder, words));
    }
    folder.write("plate.csv", &table);
    bad_input(&folder, &parts, &["--points"]);
    let wrong = COLUMNS.replace("Wert B", "Wert C");
    let told = ["plate.csv:2:1", "no column `Wert C`"];
    bad_input(
        &folder,
        &[&parts[..], &["--columns", &wrong]].concat(),
        &told,
    );
}

#[test]
fn what_several_plates_show_is_learnt_and_tested_on_another() {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        ("first.csv", &known(&bent(3e-4, 0.004))),
        ("second.csv", &known(&bent(-1e-4, 0.004))),
        ("third.csv", &known(&bent(2e-4, 0.003))),
    ]);
    let quick = ["--setup", "machine.toml", "--severity", "0"];
    let both = ["diagnose", "first.csv", "second.csv"];
    let learnt = answer(
        &folder,
        &[&both[..], &quick, &["--learn", "bent.toml"]].concat(),
    );
    assert_eq!(learnt["learnt"]["effect"], "bent");
    let on = |files: &[&str]| {
        let words = [
            &["diagnose"],
            files,
            &quick[..],
            &["--effects", "bent.toml"],
        ]
        .concat();
        answer(&folder, &words)
    };
    let tested = &on(&["third.csv"])["tested"][0];
    assert_eq!(tested["seen"]["file"], "first.csv, second.csv");
    let digests = tested["seen"]["sha256"].as_str().unwrap();
    assert_eq!(
        digests.split(' ').map(str::len).collect::<Vec<_>>(),
        [64, 64]
    );
    // Three quarters of the bump, to 5 of the standard uncertainties that are told.
    let number = |name: &str| tested[name].as_f64().unwrap();
    let off = (number("size") - 0.75).abs();
    assert!(off < 5.0 * number("size_std"), "{tested}");
    // What it was learnt from is no test of it, whichever of the files comes again.
    for (files, told) in [
        (&["second.csv", "first.csv"][..], "these very readings"),
        (
            &["third.csv", "second.csv"],
            "some of these readings (second.csv)",
        ),
    ] {
        let again = on(files);
        assert!(again["tested"].is_null(), "{files:?}");
        assert!(again["notes"].to_string().contains(told), "{files:?}");
    }
}

#[test]
fn a_plate_is_not_sealed() {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        ("first.csv", &known(&bent(3e-4, 0.004))),
        ("second.csv", &known(&bent(-1e-4, 0.004))),
        ("plan.csv", "point,nominal x,nominal y\nH0_0,0,0\n"),
    ]);
    for files in [&["first.csv"][..], &["first.csv", "second.csv"]] {
        let sealed = [
            "--setup",
            "machine.toml",
            "--seal",
            "seal.toml",
            "--next",
            "plan.csv",
        ];
        let out = run(&folder, &[&["diagnose"], files, &sealed[..]].concat());
        assert_eq!(out.status, 1, "{}", out.stderr);
        assert!(
            out.stderr.contains("a machine cannot be sealed"),
            "{}",
            out.stderr
        );
        assert!(
            out.stderr.contains("--learn and --effects"),
            "{}",
            out.stderr
        );
        assert!(!folder.path().join("seal.toml").exists());
    }
}
