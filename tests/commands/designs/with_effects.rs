//! A design that is diagnosed, and fitted with an effect.

use super::*;

/// Eight channels of a simulation with a jump of the bottom indicator by 0.6 µm in its third trace.
fn with_a_jump() -> Folder {
    let folder = simulated(
        EIGHT,
        &["--repeats", "2", "--positions", "40", "--noise", "0.05"],
    );
    let text = std::fs::read_to_string(folder.path().join("made/readings.csv")).unwrap();
    let mut lines = text.lines();
    let mut jumped = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let (x, reading): (f64, f64) = (fields[4].parse().unwrap(), fields[5].parse().unwrap());
        let after = fields[..3] == ["270", "180", "2"] && x > 100.0;
        let reading = if after { reading + 0.6 } else { reading };
        jumped += &format!("{},{reading}\n", fields[..5].join(","));
    }
    std::fs::write(folder.path().join("jump.csv"), jumped).unwrap();
    folder
}

#[test]
fn a_design_is_diagnosed_alone_and_beside_its_answer() {
    let folder = with_a_jump();
    let output = run(&folder, &["diagnose", "jump.csv", "--format", "json"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
    let alone: Value = serde_json::from_str(&output.stdout).unwrap();
    assert_eq!(alone["verdict"]["effects"][0], "zero-jump");
    assert_eq!(alone["candidates"][0]["variant"], "channel 270/180");
    assert_eq!(
        alone["fit_with"],
        "errsep reversal jump.csv --simultaneous --with zero-jump"
    );
    let beside = solved(&folder, &["jump.csv", "--simultaneous", "--diagnose"]);
    assert_eq!(beside["schema"], "errsep.reversal/2");
    assert_eq!(beside["diagnosis"]["verdict"], alone["verdict"]);
    let page = run(&folder, &["diagnose", "jump.csv", "--out", "told"]);
    assert_eq!(page.status, 0, "{}", page.stderr);
    let page = std::fs::read_to_string(folder.path().join("told/report.html")).unwrap();
    assert!(page.contains("270/180 before") && page.contains("zero-jump"));
}

#[test]
fn an_effect_joins_the_fit_of_a_design_and_leaves_its_readings() {
    let folder = with_a_jump();
    let arguments = [
        "jump.csv",
        "--simultaneous",
        "--with",
        "zero-jump",
        "--corrected",
        "clean.csv",
    ];
    let answer = solved(&folder, &arguments);
    let effect = &answer["effects"][0];
    assert_eq!(effect["effect"], "zero-jump");
    let jump = &effect["parameters"][0];
    let (value, std) = (
        jump["value"].as_f64().unwrap(),
        jump["std"].as_f64().unwrap(),
    );
    // k·u: one seed, five standard uncertainties.
    assert!((value - 0.6).abs() < 5.0 * std && std < 0.1, "{jump}");
    // The file without it: of each reading what the fit says, nothing elsewhere.
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let (before, after) = (read("jump.csv"), read("clean.csv"));
    assert!(after.starts_with("# readings of jump.csv less what zero-jump changes"));
    let mut changed = 0;
    for (old, new) in before.lines().skip(1).zip(after.lines().skip(2)) {
        let reading = |line: &str| line.rsplit(',').next().unwrap().parse::<f64>().unwrap();
        let change = reading(old) - reading(new);
        let fields: Vec<&str> = old.split(',').collect();
        let x: f64 = fields[4].parse().unwrap();
        if fields[..3] == ["270", "180", "2"] && x > 110.0 {
            changed += 1;
            // ε·κ: sums of numbers of a hundred, 1e-9.
            assert!((change - value).abs() < 1e-9, "{old}: {change}");
        } else if fields[..3] != ["270", "180", "2"] {
            assert!(change == 0.0, "{old}: {change}");
        }
    }
    assert!(changed > 20, "{changed}");
    let cleaned = run(&folder, &["diagnose", "clean.csv", "--format", "json"]);
    let cleaned: Value = serde_json::from_str(&cleaned.stdout).unwrap();
    assert_eq!(cleaned["verdict"]["kind"], "none", "{}", cleaned["verdict"]);
}

#[test]
fn what_a_design_cannot_have_is_told() {
    let folder = simulated(EIGHT, &[]);
    let fitted = "[artefact]\nthickness = 1.0\nfit_thickness = true\n";
    std::fs::write(folder.path().join("fitted.toml"), fitted).unwrap();
    std::fs::write(
        folder.path().join("single.csv"),
        "indicator,spindle,x,reading\n0,0,0,1\n0,0,10,2\n0,0,20,4\n0,0,30,3\n0,0,40,3\n\
         0,90,0,1\n0,90,10,2\n0,90,20,3\n0,90,30,2\n0,90,40,1\n",
    )
    .unwrap();
    let data = "made/readings.csv";
    let cases: [(&[&str], i32, &str); 5] = [
        (
            &["reversal", data, "--setup", "fitted.toml"],
            1,
            "would give the thickness only to ±",
        ),
        (
            &["reversal", data, "--simultaneous", "--with=taper"],
            1,
            "absorbs `taper`",
        ),
        (
            &["reversal", data, "--simultaneous", "--with=zero-jmp"],
            2,
            "did you mean `zero-jump`?",
        ),
        (
            &["diagnose", data, "--without=tapir"],
            2,
            "there is no effect `tapir`",
        ),
        (
            &["diagnose", "single.csv"],
            2,
            "leave nothing over from the fit",
        ),
    ];
    for (arguments, status, told) in cases {
        let output = run(&folder, arguments);
        assert_eq!(output.status, status, "{arguments:?}: {}", output.stderr);
        assert!(
            output.stderr.contains(told),
            "{arguments:?}: {}",
            output.stderr
        );
        assert!(output.stdout.is_empty(), "{arguments:?}: {}", output.stdout);
    }
    for design in ["0/0,0/360", "0/x", "0/nan", ""] {
        let output = run(&folder, &["simulate", "reversal", "--design", design]);
        assert_eq!(output.status, 2, "{design}: {}", output.stdout);
        assert!(output.stderr.contains("--design"), "{}", output.stderr);
    }
}
