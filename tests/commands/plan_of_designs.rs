//! `errsep plan` of several designs side by side.

use serde_json::Value;

use crate::command::{Folder, document, documented, run};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";

const PLAN: &str =
    "noise = 0.02\ntravel = 300.0\npositions = 31\nrepeats = 2\nboth_directions = true\n";

fn planned(plan: &str) -> Value {
    let folder = Folder::with(&[("p.toml", plan)]);
    let output = run(&folder, &["plan", "p.toml", "--format", "json"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

/// What is wanted counts whole: four channels know alpha_h as well, and in half the time.
#[test]
fn a_plan_says_which_design_determines_what_is_wanted() {
    let told = |wanted: &str| {
        let plan = format!(
            "{PLAN}wanted = {wanted}\n[[design]]\nname = \"four\"\nchannels = \"0/0,180/0,0/180,180/180\"\n\
             [[design]]\nname = \"eight\"\nchannels = \"{EIGHT}\"\n"
        );
        let folder = Folder::with(&[("p.toml", &plan)]);
        let output = run(&folder, &["plan", "p.toml"]);
        assert_eq!(output.status, 0, "{}", output.stderr);
        output.stdout.lines().next().unwrap().to_owned()
    };
    let both = told("[\"alpha_h\", \"alpha_v\"]");
    assert!(
        both.starts_with("B determines all that is wanted: alpha_h to "),
        "{both}"
    );
    let one = told("[\"alpha_h\"]");
    assert!(
        one.starts_with("A, B determine all that is wanted. A knows alpha_h best"),
        "{one}"
    );
}

#[test]
fn a_plan_compares_designs() {
    let designs = format!(
        "{PLAN}seconds_a_trace = 100.0\nseconds_a_turn = 10.0\nseconds_an_indicator = 1.0\nindicators = 2\n\
         [[design]]\nname = \"four\"\nchannels = \"0/0,180/0,0/180,180/180\"\n\
         [[design]]\nname = \"eight\"\nchannels = \"{EIGHT}\"\n\
         [[design]]\nname = \"one\"\nchannels = \"0/0,0/90,0/180,0/270\"\n"
    );
    let answer = planned(&designs);
    assert_eq!(answer["schema"], "errsep.plan/2");
    let [four, eight, one] = &answer["designs"].as_array().unwrap()[..] else {
        panic!("{answer}");
    };
    let std = |design: &Value, quantity: &str| {
        let wanted = design["wanted"].as_array().unwrap();
        let own = wanted.iter().find(|w| w["quantity"] == quantity).unwrap();
        own["std"].as_f64()
    };
    // σ/(2 √Σ(x − x̄)²) over two repeats in both directions, µm/mm: the slope of four channels.
    let spread: f64 = (0..31).map(|k| (10.0 * f64::from(k) - 150.0).powi(2)).sum();
    let alpha = 1e-3 * 0.02 / (2.0 * spread.sqrt() * 2.0);
    for (design, quantity) in [(four, "alpha_h"), (eight, "alpha_h"), (eight, "alpha_v")] {
        let own = std(design, quantity).unwrap();
        // The gauge of the forms weighs the two ends by half: 3 % of 31 positions.
        assert!(
            (own / alpha - 1.0).abs() < 0.03,
            "{quantity}: {own} {alpha}"
        );
    }
    for (design, quantity) in [
        (four, "alpha_v"),
        (one, "alpha_h"),
        (one, "M_h"),
        (one, "S"),
    ] {
        assert_eq!(std(design, quantity), None, "{quantity}");
    }
    assert_eq!(one["not_determined"][0]["combination"], "M_h against all S");
    assert!(
        one["not_determined"][0]["remedy"]
            .as_str()
            .unwrap()
            .contains("180°")
    );
    // By hand: passes × 100 s, turns × 10 s, indicators × 1 s; the eight with two indicators at once
    // go round twice.
    for (design, seconds) in [(four, 812.0), (eight, 1634.0), (one, 1631.0)] {
        assert_eq!(design["time"]["seconds"], seconds, "{}", design["name"]);
    }
    let seen = |design: &Value, effect: &str| {
        let effects = design["effects"].as_array().unwrap();
        let own = effects.iter().find(|e| e["effect"] == effect).unwrap();
        own["detectable"].as_f64()
    };
    for design in [four, eight] {
        assert!(seen(design, "zero-jump").unwrap() < 0.5);
        assert_eq!(seen(design, "gravity-sag"), None);
    }
    // One design alone is told without a list of others.
    let folder = Folder::with(&[(
        "p.toml",
        &format!("design = \"0/0,180/0,0/180,180/180\"\n{PLAN}"),
    )]);
    let output = run(&folder, &["plan", "p.toml"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
    assert!(
        output.stdout.contains("forms 3 of 3 (1 to spare)"),
        "{}",
        output.stdout
    );
    assert!(
        !output.stdout.contains("told apart by another"),
        "{}",
        output.stdout
    );
    let named = "[channels]\nN = { indicator = 0, spindle = 0 }\nF = { indicator = 180, spindle = 0 }\n\
                 M = { indicator = 0, spindle = 180 }\nG = { indicator = 180, spindle = 180 }\n";
    let named = planned(&format!("{PLAN}{named}"));
    let (own, other) = (
        std(&named["designs"][0], "alpha_h").unwrap(),
        std(four, "alpha_h").unwrap(),
    );
    // The same angles by other names; other waves are drawn for the channels' order: 1e-6.
    assert!((own / other - 1.0).abs() < 1e-6, "{own} {other}");
}

#[test]
fn what_cannot_be_planned_is_told() {
    let four = "design = \"0/0,180/0,0/180,180/180\"";
    let many = "[[design]]\nchannels = \"0/0,180/0,0/180,180/180\"\n".repeat(9);
    let cases: [(String, &[&str]); 8] = [
        (
            format!("design = \"0/0,x\"\n{PLAN}"),
            &["p.toml:1:", "`x` is no channel"],
        ),
        (format!("design = 4\n{PLAN}"), &["p.toml:1:", "[[design]]"]),
        (
            format!("{four}\nwanted = [\"alpha\"]\n{PLAN}"),
            &["p.toml:2:", "alpha_h"],
        ),
        (
            format!("{four}\nseconds_a_turn = -1.0\n{PLAN}"),
            &["p.toml:2:", "is no time"],
        ),
        (
            format!("{four}\nindicators = 0\n{PLAN}"),
            &["p.toml:2:", "1 or more"],
        ),
        (
            format!("{four}\nslope = 1\n{PLAN}"),
            &["p.toml:2:", "slopes"],
        ),
        (format!("{PLAN}{many}"), &["9 designs cannot be compared"]),
        (
            "design = \"0/0,0/180\"\nnoise = 0.1\ntravel = 100.0\npositions = 9\n".to_owned(),
            &["design 0/0,0/180", "leave nothing over", "both directions"],
        ),
    ];
    for (plan, told) in cases {
        let folder = Folder::with(&[("p.toml", &plan)]);
        let output = run(&folder, &["plan", "p.toml"]);
        assert_eq!(output.status, 2, "{plan}: {}", output.stdout);
        for part in told {
            assert!(
                output.stderr.contains(part),
                "{plan}, {part}: {}",
                output.stderr
            );
        }
    }
}

/// Minutes and standard uncertainties of a recipe are those of the plan that it ends with.
fn recipe_is_what_its_plan_says(page: &str) {
    let (page, plan) = page.split_once("\nThe plan:\n").unwrap();
    let answer = planned(&plan.replace("\n    ", "\n"));
    let designs = answer["designs"].as_array().unwrap();
    let row = |begin: &str| -> Vec<&str> {
        let line = page.lines().find(|line| line.starts_with(begin)).unwrap();
        let cells: Vec<&str> = line
            .trim_matches('|')
            .split('|')
            .skip(1)
            .map(str::trim)
            .collect();
        assert_eq!(cells.len(), designs.len(), "{line}");
        cells
    };
    for (cell, design) in row("| channels, time |").iter().zip(designs) {
        let minutes = (design["time"]["seconds"].as_f64().unwrap() / 60.0).round();
        let channels = design["channels"].as_array().unwrap().len();
        assert_eq!(*cell, format!("{channels}, {minutes} min"));
    }
    for (begin, quantity, factor, unit) in [
        ("| u(α_h) |", "alpha_h", 1e6, "µrad"),
        ("| u(α_v) |", "alpha_v", 1e6, "µrad"),
        ("| u(M_h), over the travel |", "M_h", 1.0, "µm"),
        ("| u(M_v) |", "M_v", 1.0, "µm"),
        ("| sides known |", "S", 1.0, "µm"),
    ] {
        if !page.lines().any(|line| line.starts_with(begin)) {
            continue;
        }
        for (cell, design) in row(begin).iter().zip(designs) {
            let wanted = design["wanted"].as_array().unwrap();
            let own = wanted.iter().find(|w| w["quantity"] == quantity).unwrap();
            let std = own["std"].as_f64();
            let printed = std.map(|std| format!("{:.3} {unit}", factor * std));
            match printed {
                Some(printed) => assert!(cell.contains(&printed), "{begin} {cell}: {printed}"),
                None => assert!(!cell.contains(unit), "{begin} {cell}"),
            }
        }
    }
}

#[test]
fn recipes_print_what_their_plans_say() {
    recipe_is_what_its_plan_says(&document("recipes/one-indicator-every-90.md"));
    recipe_is_what_its_plan_says(&document("recipes/two-planes-at-once.md"));
}

#[test]
fn every_key_of_a_plan_is_documented() {
    let designs = format!("{PLAN}[[design]]\nname = \"eight\"\nchannels = \"{EIGHT}\"\n");
    documented(&planned(&designs), "docs/json/diagnosis.md");
    documented(&planned(PLAN), "docs/json/diagnosis.md");
}
