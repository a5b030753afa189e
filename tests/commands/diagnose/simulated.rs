//! What `errsep simulate` makes of effects: which there are, which sizes they may have, what is told of the truth.

use serde_json::Value;

use crate::command::{Folder, bad_input, document, run};

/// What a simulation is made from, by its kind.
#[test]
fn every_key_of_a_truth_is_documented() {
    let folder = Folder::with(&[(
        "m.toml",
        "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.1]\n",
    )]);
    let page = document("json/simulate.md");
    let crest = "--design 0/0,180/0,0/180,180/180 --thickness 40 --tip-radius 3 --off-crest 0.1";
    for (kind, row, more) in [
        ("anova", "| `anova` |", ""),
        ("calibration-line", "| `calibration-line` |", ""),
        ("circle", "| `circle` |", ""),
        ("four-sensor", "| `four-sensor` |", ""),
        ("fourier", "| `fourier` |", ""),
        ("positioning", "| `positioning` |", ""),
        ("reversal", "| `reversal` |", ""),
        ("reversal", "| `reversal` with `--design` |", crest),
        ("step-diagonal", "| `step-diagonal` |", ""),
        ("turning-bar", "| `turning-bar` |", ""),
    ] {
        let given = format!("simulate {kind} {more} --format json");
        let out = run(&folder, &given.split_whitespace().collect::<Vec<_>>());
        assert_eq!(out.status, 0, "{given}: {}", out.stderr);
        let answer: Value = serde_json::from_str(&out.stdout).unwrap();
        let line = page.lines().find(|line| line.starts_with(row));
        let line = line.unwrap_or_else(|| panic!("no row of {row}"));
        for key in answer["truth"].as_object().unwrap().keys() {
            assert!(line.contains(&format!("`{key}`")), "{row} lacks `{key}`");
        }
    }
}

/// A size that the effect's own parameter in the catalogue cannot have is refused with value, unit and bounds.
#[test]
fn a_size_that_cannot_be_is_not_simulated() {
    let folder = Folder::with(&[(
        "m.toml",
        "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.1]\n",
    )]);
    let design = ["--design", "0/0,180/0,0/180,180/180"];
    let machine = ["m.toml", "--from", "0", "--to", "100"];
    for (kind, more, effect, told) in [
        (
            "reversal",
            &[][..],
            "taper=5",
            ["half-angle", "5 rad", "-0.1 to 0.1 rad"],
        ),
        (
            "reversal",
            &design,
            "taper=-0.2",
            ["half-angle", "-0.2 rad", "-0.1 to 0.1 rad"],
        ),
        (
            "reversal",
            &[],
            "hysteresis=-1",
            ["width", "-1 um", "0 to 50 um"],
        ),
        (
            "reversal",
            &design,
            "common-gain=2",
            ["gain", "cannot be 2", "-0.5 to 0.5"],
        ),
        (
            "machine",
            &machine,
            "thermal-expansion=1",
            ["scale", "cannot be 1", "-0.001 to 0.001"],
        ),
        (
            "circle",
            &[],
            "squareness=1",
            ["angle", "1 rad", "-0.01 to 0.01 rad"],
        ),
        (
            "calibration-line",
            &[],
            "cubic=1e7",
            ["at-full-scale", "10000000 y", "-1000000 to 1000000 y"],
        ),
        ("four-sensor", &[], "lag=-1", ["way", "-1 mm", "0 to 10 mm"]),
        (
            "fourier",
            &[],
            "yaw=5",
            ["angle", "5 rad", "-0.01 to 0.01 rad"],
        ),
        (
            "step-diagonal",
            &[],
            "angular-error=2",
            ["at-end-of-travel", "2 rad", "-0.001 to 0.001 rad"],
        ),
    ] {
        let arguments = [&["simulate", kind][..], more, &["--effect", effect]].concat();
        bad_input(&folder, &arguments, &told);
    }
    for (more, effect) in [
        (&[][..], "taper=0.1"),
        (&design, "hysteresis=50"),
        (&design, "taper=1e-5"),
    ] {
        let arguments = [&["simulate", "reversal"][..], more, &["--effect", effect]].concat();
        let out = run(&folder, &arguments);
        assert_eq!(out.status, 0, "{effect}: {}", out.stderr);
    }
}

/// What is made, and what the diagnosis alone knows.
#[test]
fn effects_of_a_simulated_reversal_are_told() {
    let folder = Folder::with(&[]);
    let help = run(&folder, &["simulate", "reversal", "--help"]).stdout;
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, told) = help.split_once("Effects: ").unwrap();
    let (four, rest) = told.split_once(". With --design also ").unwrap();
    let (design, _) = rest.split_once(". Examples").unwrap();
    let made = |name: &str, more: &[&str]| {
        let effect = format!("{name}=1e-4");
        let of = [
            "simulate",
            "reversal",
            "--positions",
            "9",
            "--effect",
            &effect,
        ];
        run(&folder, &[&of[..], more].concat())
    };
    let four_as_design = ["--design", "0/0,180/0,180/180,0/180", "--thickness", "40"];
    for name in four.split(", ") {
        assert_eq!(made(name, &[]).status, 0, "{name}");
    }
    for name in design.split(", ") {
        let out = made(name, &[]);
        assert_eq!(out.status, 2, "{name}");
        assert!(out.stderr.contains("with --design alone"), "{}", out.stderr);
        if name != "oval-cone" {
            let out = made(name, &four_as_design);
            assert_eq!(out.status, 0, "{name}: {}", out.stderr);
        }
    }
    for more in [&[][..], &four_as_design] {
        let out = made("sticking-plunger", more);
        assert_eq!(out.status, 2);
        assert!(
            out.stderr
                .contains("effect of errsep diagnose that this simulation does not make"),
            "{}",
            out.stderr
        );
        let out = made("tapir", more);
        assert!(
            out.stderr.contains("did you mean `taper`?"),
            "{}",
            out.stderr
        );
    }
}
