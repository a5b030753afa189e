//! `errsep diagnose` recognises the model, and `errsep simulate --effect` switches its effects on.

use crate::command::{Folder, bad_input, documented, run};
use serde_json::Value;

/// Simulates, diagnoses and gives the answer.
fn diagnosed(simulate: &[&str], setup: &str, options: &[&str]) -> Value {
    let folder = Folder::with(&[("s.toml", setup)]);
    let mut arguments = vec!["simulate"];
    arguments.extend(simulate);
    let made = run(&folder, &arguments);
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write("d.csv", &made.stdout);
    let mut arguments = vec!["diagnose", "d.csv", "--setup", "s.toml", "--format", "json"];
    arguments.extend(options);
    let out = run(&folder, &arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn effects(answer: &Value) -> Vec<&str> {
    let named = answer["verdict"]["effects"].as_array().unwrap();
    named.iter().map(|e| e.as_str().unwrap()).collect()
}

#[test]
fn every_model_is_recognised_and_its_effect_named() {
    for (kind, setup, effect, model, name) in [
        (
            "calibration-line",
            "[line]\nnoise = 1e-3\n",
            "quadratic=0.05",
            "calibration line",
            "quadratic",
        ),
        (
            "circle",
            "[circle]\nnoise = 1.0\n",
            "lobes=6",
            "circle",
            "lobes",
        ),
        (
            "four-sensor",
            "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n",
            "gain=0.05",
            "four-sensor",
            "gain",
        ),
        (
            "fourier",
            "[section]\nlength = 100.0\n[probe]\nnoise = 2.0\n",
            "height-difference=30",
            "fourier",
            "height-difference",
        ),
        (
            "step-diagonal",
            "[test]\nnoise = 0.2\n",
            "mirror-misalignment=1e-4",
            "step-diagonal",
            "mirror-misalignment",
        ),
    ] {
        let mut arguments = vec![kind, "--effect", effect];
        if kind == "fourier" {
            arguments.extend(["--samples", "100"]);
        }
        let answer = diagnosed(&arguments, setup, &[]);
        assert_eq!(answer["model"], model);
        assert_eq!(
            effects(&answer),
            [name],
            "{kind}: {}",
            answer["verdict"]["statement"]
        );
        documented(&answer, "docs/json/diagnosis.md");
    }
}

#[test]
fn parts_need_the_machine_and_the_points() {
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.0, -0.02]\n";
    let points = "point,x,y\n1,10,10\n2,140,10\n3,140,130\n";
    let parts = "part,point,axis,replicate,value\n1,1,x,1,0.1\n";
    let folder = Folder::with(&[("m.toml", machine), ("p.csv", points), ("d.csv", parts)]);
    bad_input(&folder, &["diagnose", "d.csv"], &["--setup"]);
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--setup", "m.toml"],
        &["--points"],
    );
    let simulated = run(
        &folder,
        &[
            "simulate",
            "machine",
            "m.toml",
            "--points",
            "p.csv",
            "--effect",
            "squareness-change=3e-5",
            "--out",
            "made",
        ],
    );
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    let out = run(
        &folder,
        &[
            "diagnose",
            "made/parts.csv",
            "--setup",
            "m.toml",
            "--points",
            "p.csv",
            "--format",
            "json",
            "--out",
            "report",
        ],
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(
        effects(&answer),
        ["squareness-change"],
        "{}",
        answer["verdict"]["statement"]
    );
    // Rows of the maps are parts.
    assert!(folder.read("report/report.html").contains("part  21"));
}

#[test]
fn what_cannot_be_told_is_asked_for() {
    let folder = Folder::with(&[
        ("c.csv", "x,y\n1,0\n0,1\n-1,0\n0,-1\n0.7,0.7\n"),
        ("u.csv", "a,b\n1,2\n"),
    ]);
    bad_input(
        &folder,
        &["diagnose", "c.csv"],
        &["calibration-line and circle", "--model circle"],
    );
    bad_input(
        &folder,
        &["diagnose", "u.csv"],
        &["no model", "--model", "reversal"],
    );
    bad_input(
        &folder,
        &["diagnose", "c.csv", "--model", "square"],
        &["step-diagonal"],
    );
    for (kind, near) in [
        ("circle", "ovality"),
        ("calibration-line", "quadratic"),
        ("four-sensor", "sensor-position"),
        ("fourier", "probe-spacing"),
        ("step-diagonal", "dead-path"),
    ] {
        let misspelt = format!("{}x=1", &near[..near.len() - 1]);
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &misspelt],
            &["did you mean", near],
        );
        bad_input(
            &folder,
            &["simulate", kind, "--effect", near],
            &["NAME=VALUE"],
        );
        let wordy = format!("{near}=much");
        bad_input(
            &folder,
            &["simulate", kind, "--effect", &wordy],
            &["`much` is not a number"],
        );
    }
}

/// What a simulation is made from, by its kind.
#[test]
fn every_key_of_a_truth_is_documented() {
    let folder = Folder::with(&[(
        "m.toml",
        "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.1]\n",
    )]);
    let page = crate::command::document("json/simulate.md");
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

/// What a plan says holds in itself: nothing is seen, told apart or imitated at a size that is not
/// plausible, more repeats show smaller sizes, and no unit is left in the programs' spelling.
#[test]
fn a_plan_names_only_sizes_and_rivals_that_are_plausible() {
    let plan = "noise = 0.02\ntravel = 300.0\npositions = 61\nrepeats = 2\n";
    let folder = Folder::with(&[("p.toml", plan)]);
    let out = run(&folder, &["plan", "p.toml", "--format", "json"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let answer: Value = serde_json::from_str(&out.stdout).unwrap();
    let of = |name: &str| {
        let effects = answer["effects"].as_array().unwrap();
        effects.iter().find(|e| e["effect"] == name).unwrap()
    };
    // At tilts of 50 µrad a thickness shows only at metres; lost motion not at all one way.
    assert!(of("thickness-shift")["detectable"].is_null());
    assert!(of("axis-backlash")["detectable"].is_null());
    assert!(of("taper")["detectable"].as_f64().unwrap() < 1e-6);
    for effect in answer["effects"].as_array().unwrap() {
        assert_ne!(effect["confused_with"], "thickness-shift", "{effect}");
        let (seen, told) = (
            effect["detectable"].as_f64(),
            effect["identifiable"].as_f64(),
        );
        assert!(told.is_none() || told >= seen, "{effect}");
    }
    let extra = answer["extra_measurements"].as_array().unwrap();
    let repeats = extra
        .iter()
        .find(|e| e["measure"] == "take twice the repeats")
        .unwrap();
    // Noise averages: √2, but for thresholds that hang on the number of draws.
    let gain = repeats["gain"].as_f64().unwrap();
    assert!((gain / 2f64.sqrt() - 1.0).abs() < 0.15, "{gain}");
    let text = run(&folder, &["plan", "p.toml"]).stdout;
    // Wide chips pass for form, narrow ones do not: their sizes differ.
    assert!(
        text.contains("local-contamination: in some shapes from "),
        "{text}"
    );
    assert!(!text.contains(" um") && !text.contains("urad"), "{text}");
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

/// What an option asks for in vain is said, and a channel that is missing is told.
#[test]
fn options_in_vain_are_refused_and_missing_channels_told() {
    let mut readings = "channel,repeat,x,reading\n".to_owned();
    for channel in ["1A", "1B", "2A"] {
        for repeat in 1..=2 {
            for k in 0..20 {
                let wave = (f64::from(k * 7 + repeat * 3) * 1.7).sin();
                readings += &format!("{channel},{repeat},{},{}\n", 10 * k, 5.0 + 0.02 * wave);
            }
        }
    }
    let own = "[[effect]]\nname = \"\"\nformula = \"x\"\n";
    let never = "[[effect]]\nname = \"nothing\"\nformula = \"0 * x\"\n";
    let folder = Folder::with(&[("d.csv", &readings), ("e.toml", own), ("n.toml", never)]);
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--prove", "0"],
        &["--prove"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--points", "p.csv"],
        &["--points"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--effects", "e.toml"],
        &["no name"],
    );
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--effects", "n.toml"],
        &["changes no reading"],
    );
    let out = run(&folder, &["diagnose", "d.csv"]);
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        out.stdout.contains("only 1A, 1B, 2A are there"),
        "{}",
        out.stdout
    );
}

/// A line with sets is no circle.
#[test]
fn a_calibration_with_sets_is_recognised() {
    let answer = diagnosed(&["calibration-line"], "# nothing stated\n", &[]);
    assert_eq!(answer["model"], "calibration line");
}

/// Slopes, uncertainties and weights that are no numbers are refused, and so is a proof without end.
#[test]
fn what_is_no_number_is_refused() {
    let folder = Folder::with(&[]);
    let made = run(&folder, &["simulate", "step-diagonal"]);
    folder.write("d.csv", &made.stdout);
    let steps = [
        "diagnose",
        "d.csv",
        "--model",
        "step-diagonal",
        "--setup",
        "s.toml",
    ];
    for (slope, std, what) in [
        ("nan", "0.001", "slope is NaN"),
        ("inf", "0.001", "slope is inf"),
        ("0.004", "-1.0", "uncertainty of a measured slope is -1"),
        ("0.004", "0.0", "uncertainty of a measured slope is 0"),
        ("0.004", "nan", "uncertainty of a measured slope is NaN"),
    ] {
        let setup = format!("[[measured]]\naxis = \"X\"\nslope = {slope}\nstd = {std}\n");
        folder.write("s.toml", &setup);
        bad_input(&folder, &steps, &["s.toml", what]);
    }
    let made = run(&folder, &["simulate", "reversal", "--positions", "13"]);
    folder.write("r.csv", &made.stdout);
    for (weights, what) in [
        ("{ 1A = nan }", "gives the channel `1A` the weight NaN"),
        ("{ 1A = 1.0, 2B = inf }", "`2B`"),
        ("{ 1A = 0.0 }", "changes no reading"),
        ("{ 1A = 1e300 }", "no finite number"),
    ] {
        let effect = format!(
            "[[effect]]\nname = \"own\"\nformula = \"1e30 * x^2 * 1e10\"\nchannels = {weights}\n"
        );
        folder.write("e.toml", &effect);
        bad_input(
            &folder,
            &["diagnose", "r.csv", "--effects", "e.toml"],
            &["e.toml", what],
        );
    }
    let endless = ["diagnose", "r.csv", "--prove", "18446744073709551615"];
    bad_input(&folder, &endless, &["--prove", "at most"]);
}

/// A reading of 1e308 is refused whatever the model: its square is no number.
#[test]
fn readings_beyond_reach_are_refused() {
    let sensors = "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n";
    let section = "[section]\nlength = 100.0\n";
    for (model, setup, column) in [
        ("reversal", "", 5),
        ("calibration-line", "", 1),
        ("circle", "", 0),
        ("four-sensor", sensors, 2),
        ("fourier", section, 3),
        ("step-diagonal", "", 7),
    ] {
        let folder = Folder::with(&[("s.toml", setup)]);
        let made = run(&folder, &["simulate", model]);
        let lines = made.stdout.lines().enumerate();
        let spoilt: Vec<String> = lines
            .map(|(k, line)| {
                let mut fields: Vec<&str> = line.split(',').collect();
                if k == 9 && fields.len() > column {
                    fields[column] = "1e308";
                }
                fields.join(",")
            })
            .collect();
        folder.write("d.csv", &spoilt.join("\n"));
        let arguments = ["diagnose", "d.csv", "--model", model, "--setup", "s.toml"];
        let told = match model {
            "fourier" => "are not numbers that a probe can give",
            _ => "1e308",
        };
        bad_input(&folder, &arguments, &["d.csv", told]);
    }
}
