//! Where model and readings disagree, and where they do not: by the misfit, by repeats, by the closure.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use super::{json, run, simulated};

#[test]
fn a_misfit_is_told_and_the_diagnosis_named() {
    let folder = TempDir::new().unwrap();
    for (seed, repeats) in [("1", "1"), ("2", "1"), ("3", "3")] {
        simulated(
            folder.path(),
            &[
                "--effect",
                "taper=5e-6",
                "--seed",
                seed,
                "--repeats",
                repeats,
            ],
        );
        let args = ["reversal", "data.csv", "--simultaneous"];
        let answer = json(folder.path(), &args);
        let alpha = &answer["tilts"]["alpha"];
        let (value, std) = (
            alpha["value"].as_f64().unwrap(),
            alpha["std"].as_f64().unwrap(),
        );
        // k·u: α is 40 µrad, and the misfit leaves it alone.
        assert!((value - 40e-6).abs() < 2.0 * std && std < 1e-6, "{alpha}");
        assert_eq!(answer["agreement"]["disagree"], true);
        // 5 µrad over 300 mm: 1.5 µm/√12.
        let missed = answer["agreement"]["missed"]["value"].as_f64().unwrap();
        assert!((0.3..0.6).contains(&missed), "{missed}");
        let (_, text, _) = run(folder.path(), &args);
        for said in ["model and readings disagree", "errsep diagnose data.csv"] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(text.contains("errsep diagnose data.csv"), "{text}");
    }
    simulated(folder.path(), &["--seed", "5"]);
    let (_, text, _) = run(folder.path(), &["reversal", "data.csv", "--simultaneous"]);
    assert!(!text.contains("diagnose"), "{text}");
    // With one repeat it is said what is assumed, and what it would be otherwise.
    assert!(text.contains("repeats would tell"), "{text}");
}

/// Whole traces that moved between their repeats are no noise of a reading: the answer says so and names
/// the diagnosis; they disagree with the model where they moved in more than height. Independent noise raises no alarm,
/// whatever the channels' own noise.
#[test]
fn traces_that_moved_between_repeats_are_told() {
    let folder = TempDir::new().unwrap();
    let methods = [
        &["reversal", "data.csv"][..],
        &["reversal", "data.csv", "--simultaneous"],
    ];
    let both = ["--repeats", "3", "--both-directions"];
    simulated(
        folder.path(),
        &[&both[..], &["--effect", "zero-jump=0.4"]].concat(),
    );
    for args in methods {
        let (_, text, _) = run(folder.path(), args);
        for said in ["differ in height", "errsep diagnose data.csv"] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
    }
    simulated(folder.path(), &both);
    drift(&folder.path().join("data.csv"), 0.01);
    for args in methods {
        let (_, text, _) = run(folder.path(), args);
        for said in ["model and readings disagree", "errsep diagnose data.csv"] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
        assert_eq!(json(folder.path(), args)["agreement"]["disagree"], true);
    }
    for (seed, repeats) in [("1", "2"), ("2", "2"), ("3", "3"), ("4", "5"), ("5", "3")] {
        simulated(folder.path(), &["--seed", seed, "--repeats", repeats]);
        for args in methods {
            let (_, text, _) = run(folder.path(), args);
            assert!(!text.contains("disagree"), "{seed}: {text}");
        }
    }
}

/// Tilts the second repeat of all channels by so many µm/mm.
fn drift(file: &Path, slope: f64) {
    let text = fs::read_to_string(file).unwrap();
    let tilted = text.lines().map(|line| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let [_, repeat, .., x, reading] = &mut fields[..]
            && repeat == "2"
        {
            let by = slope * x.parse::<f64>().unwrap();
            *reading = (reading.parse::<f64>().unwrap() + by).to_string();
        }
        fields.join(",") + "\n"
    });
    let tilted: String = tilted.collect();
    fs::write(file, tilted).unwrap();
}

/// By chance the closure of a few positions is half as large again as the noise explains: no alarm.
#[test]
fn a_closure_of_few_positions_raises_no_alarm() {
    let folder = TempDir::new().unwrap();
    for seed in 1..=40 {
        let seed = seed.to_string();
        let few = ["--positions", "7", "--repeats", "3", "--seed", &seed];
        let (_, data, _) = run(
            folder.path(),
            &[&["simulate", "reversal"][..], &few].concat(),
        );
        fs::write(folder.path().join("data.csv"), data).unwrap();
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(
            !text.contains("disagree") && !text.contains("explains"),
            "{seed}: {text}"
        );
    }
}

/// *Simulated truth*: forms with detail of a few positions are followed where the readings tell it, and no alarm is raised.
/// With knots no finer than three positions a cell each of these was told to disagree.
#[test]
fn detail_of_a_few_positions_raises_no_alarm() {
    let folder = TempDir::new().unwrap();
    for (positions, seed) in [
        ("36", "1"),
        ("41", "2"),
        ("41", "3"),
        ("61", "45"),
        ("61", "56"),
    ] {
        let grid = ["--positions", positions, "--seed", seed];
        let passes = ["--repeats", "3", "--both-directions"];
        let (_, data, _) = run(
            folder.path(),
            &[&["simulate", "reversal"][..], &grid, &passes].concat(),
        );
        fs::write(folder.path().join("data.csv"), data).unwrap();
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv", "--simultaneous"]);
        assert!(
            !text.contains("disagree") && text.contains("neighbouring residuals are not"),
            "{positions} positions, seed {seed}: {text}"
        );
    }
}

/// Without repeats the closure is told from the noise by neighbouring readings, which bound it.
#[test]
fn a_jump_without_repeats_is_told_by_the_closure() {
    let folder = TempDir::new().unwrap();
    simulated(folder.path(), &["--effect", "zero-jump=2"]);
    let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
    for said in ["model and readings disagree", "errsep diagnose data.csv"] {
        assert!(text.contains(said), "{said:?} is not in:\n{text}");
    }
    for seed in ["1", "2", "3", "4", "5"] {
        simulated(folder.path(), &["--seed", seed]);
        let (_, text, _) = run(folder.path(), &["reversal", "data.csv"]);
        assert!(!text.contains("disagree"), "{seed}: {text}");
    }
}
