//! Scans and set-ups that cannot be used: where that stands, and what to do.

use super::simulated;
use crate::command::{Folder, bad_input};

#[test]
fn bad_scans_are_refused() {
    let header = "spacing,x,m1,m2,m3\n";
    let rows = |from: usize, skip: usize| -> String {
        (from..=100)
            .filter(|i| *i != skip)
            .map(|i| format!("34.1,{i},0.1,0.2,0.3\n"))
            .collect()
    };
    for (name, content, expected) in [
        (
            "gap.csv",
            format!("{header}{}", rows(0, 50)),
            "gap.csv:52:1: P1 has no reading at x = 50 mm, the next is at 51 mm",
        ),
        (
            "late.csv",
            format!("{header}{}", rows(5, 200)),
            "P1 has no reading at x = 0 mm, the next is at 5 mm",
        ),
        (
            "uneven.csv",
            format!("{header}{}", rows(0, 50)).replace("34.1,51,", "34.1,50.4,"),
            "even grid",
        ),
        (
            "empty_field.csv",
            format!("{header}{}", rows(0, 200)).replace("34.1,50,0.1", "34.1,50,"),
            "empty_field.csv:53:1: P1 has no reading at x = 50 mm",
        ),
        (
            "second.csv",
            format!("{header}{}", rows(0, 200)).replace("34.1,50,0.1,0.2", "34.1,50,0.1,"),
            "second.csv:52:1: no reading of P2 at x = 50 mm",
        ),
        (
            "short.csv",
            format!("{header}34.1,0,0,0,0\n34.1,1,0,0,0\n"),
            "grid must fill",
        ),
        (
            "text.csv",
            format!("{header}34.1,0,zero,0,0\n"),
            "not a number",
        ),
        ("empty.csv", String::new(), "empty"),
        ("none.csv", header.to_owned(), "no row"),
        (
            "column.csv",
            format!("{}34.1,0,0,0,0\n", header.replace("m3", "m4")),
            "unknown column",
        ),
        (
            "missing.csv",
            "spacing,x,m1\n34.1,0,0\n".to_owned(),
            "`m2` is missing",
        ),
        (
            "spacing.csv",
            "x,m1,m2\n0,0,0\n".to_owned(),
            "probe spacing is not known",
        ),
        (
            "far.csv",
            format!("{header}134.1,0,0,0,0\n134.1,1,0,0,0\n"),
            "between 0 and",
        ),
        (
            "twice.csv",
            format!("{header}{}34.1,7,0.1,0.2,0.3\n", rows(0, 200)),
            "twice.csv:103",
        ),
    ] {
        let folder = Folder::with(&[(name, &content)]);
        bad_input(
            &folder,
            &["fourier", name, "--length", "100", "--out", "out"],
            &[name, expected],
        );
    }
    // The joint lies between 65 and 66 mm; the published way needs both probes there.
    let joint = rows(0, 200).replace("34.1,65,0.1,0.2,0.3", "34.1,65,0.1,0.2,");
    let chord = "[section]\nlength = 100\n[method]\ncompensation = \"chord\"\n";
    let folder = Folder::with(&[("j.csv", &format!("{header}{joint}")), ("s.toml", chord)]);
    bad_input(
        &folder,
        &["fourier", "j.csv", "--setup", "s.toml"],
        &["j.csv:67", "height difference", "fitted"],
    );
    let folder = Folder::with(&[
        ("d.csv", &format!("{header}{}", rows(0, 200))),
        ("s.toml", "[section]\nlenght = 100\n"),
    ]);
    bad_input(
        &folder,
        &["fourier", "d.csv", "--out", "out"],
        &["length of the section"],
    );
    bad_input(
        &folder,
        &["fourier", "d.csv", "--setup", "s.toml"],
        &["s.toml:2", "did you mean `length`"],
    );
    bad_input(
        &folder,
        &["simulate", "fourier", "--spacing", "200"],
        &["spacing"],
    );
}

#[test]
fn numbers_of_the_set_up_are_refused_where_they_stand() {
    let folder = Folder::with(&[("d.csv", &simulated(&[]))]);
    for (key, line, values) in [
        ("noise", 4, &["-1", "0", "nan", "inf"][..]),
        ("length", 2, &["-100", "0", "nan", "inf"]),
        ("spacing", 4, &["[-1]", "[0]", "[nan]", "[inf]"]),
        ("orders", 3, &["0", "-3"]),
    ] {
        for value in values {
            let stated = format!("{key} = {value}\n");
            let setup = match key {
                "length" => format!("[section]\n{stated}"),
                "orders" => format!("[section]\nlength = 100\n{stated}"),
                _ => format!("[section]\nlength = 100\n[probe]\n{stated}"),
            };
            folder.write("s.toml", &setup);
            bad_input(
                &folder,
                &["fourier", "d.csv", "--setup", "s.toml", "--out", "out"],
                &[&format!("s.toml:{line}:")],
            );
        }
    }
    bad_input(
        &folder,
        &["fourier", "d.csv", "--length=-100"],
        &["--length -100"],
    );
}

#[test]
fn messages_give_the_line_of_the_file() {
    // Rows from the end of the section to its start: the place in the sorted scan is not the line.
    let rows: String = (0..=100)
        .rev()
        .map(|i| {
            let x = if i == 8 { 8.4 } else { f64::from(i) };
            format!("34.1,{x},0.1,0.2,0.3\n")
        })
        .collect();
    let folder = Folder::with(&[("d.csv", &format!("# a comment\nspacing,x,m1,m2,m3\n{rows}"))]);
    let arguments = ["fourier", "d.csv", "--length", "100"];
    bad_input(&folder, &arguments, &["d.csv:95:", "x = 8.4 mm"]);
    folder.write("s.toml", "[section]\nlength = 100\n");
    let arguments = [
        "diagnose", "d.csv", "--setup", "s.toml", "--model", "fourier",
    ];
    bad_input(&folder, &arguments, &["d.csv:95:"]);
}
