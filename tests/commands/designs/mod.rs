//! `errsep reversal` on designs of any angles, and `errsep simulate reversal --design`.

use serde_json::Value;

use crate::command::{Folder, Output, run};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";

fn simulated(design: &str, more: &[&str]) -> Folder {
    let folder = Folder::with(&[]);
    let arguments = [
        "simulate", "reversal", "--design", design, "--out", "made", "--seed", "3",
    ];
    let made = run(&folder, &[&arguments[..], more].concat());
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder
}

fn solved(folder: &Folder, arguments: &[&str]) -> Value {
    let output = run(
        folder,
        &[&["reversal"], arguments, &["--format", "json"]].concat(),
    );
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

fn keys(value: &Value) -> Vec<&str> {
    value
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect()
}

#[test]
fn eight_channels_in_both_planes() {
    let more = [
        "--alpha",
        "60",
        "--alpha-v",
        "-35",
        "--gamma",
        "150",
        "--gamma-2",
        "-80",
        "--cone",
        "20",
        "--thickness",
        "40",
    ];
    let folder = simulated(EIGHT, &more);
    let answer = solved(
        &folder,
        &["made/readings.csv", "--setup", "made/setup.toml"],
    );
    assert_eq!(answer["schema"], "errsep.reversal/2");
    assert_eq!(answer["method"], "simultaneous");
    for (name, urad) in [
        ("alpha_h", 60.0),
        ("alpha_v", -35.0),
        ("gamma_1", 150.0),
        ("gamma_2", -80.0),
        ("cone", 20.0),
        ("kappa_c", 0.0),
    ] {
        let tilt = &answer["tilts"][name];
        let (value, std) = (
            tilt["value"].as_f64().unwrap(),
            tilt["std"].as_f64().unwrap(),
        );
        // k·u: one seed, four standard uncertainties.
        assert!((value - 1e-6 * urad).abs() < 4.0 * std, "{name}: {tilt}");
        assert_eq!(tilt["unit"], "rad");
    }
    assert_eq!(answer["tilts"]["kappa_s"], Value::Null);
    assert_eq!(answer["eccentricity"], Value::Null);
    assert_eq!(answer["design"][2]["channel"], "90/0");
    assert_eq!(answer["design"][3]["side"], 270.0);
    assert_eq!(keys(&answer["forms"]["S"]), ["0", "90", "180", "270"]);
    let count = answer["forms"]["x"].as_array().unwrap().len();
    assert_eq!(count, 301);
    for form in [&answer["forms"]["M_v"], &answer["forms"]["S_std"]["270"]] {
        assert_eq!(form.as_array().unwrap().len(), count);
    }
    let closures: Vec<&str> = answer["closure"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["combination"].as_str().unwrap())
        .collect();
    assert_eq!(
        closures,
        [
            "(1A + 1B - 2B - 2A)/4",
            "(90/0 + 270/0 - 90/180 - 270/180)/4"
        ]
    );
    assert_eq!(answer["convergence"]["converged"], true);
}

#[test]
fn what_is_not_determined_is_null_with_words() {
    let folder = simulated("0/0,0/180,90/0,90/180", &[]);
    let answer = solved(&folder, &["made/readings.csv"]);
    for name in ["alpha_h", "alpha_v", "cone", "kappa_c"] {
        assert_eq!(answer["tilts"][name], Value::Null, "{name}");
    }
    assert_eq!(answer["forms"]["M_h"], Value::Null);
    assert_eq!(answer["forms"]["S"]["90"], Value::Null);
    let open: Vec<&str> = answer["not_determined"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n["combination"].as_str().unwrap())
        .collect();
    assert_eq!(
        open[..3],
        [
            "M_h against S_0 + S_180",
            "M_v against S_90 + S_270",
            "alpha_h + alpha_v against cone"
        ]
    );
    let remedy = &answer["not_determined"][0]["remedy"];
    assert_eq!(
        remedy,
        "add a trace with an indicator at 180° and the spindle at 0°"
    );
    let names: Vec<&str> = answer["form_combinations"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["M_h + S_0", "M_v + S_90", "M_h + S_180", "M_v + S_270"]
    );
    let text = run(&folder, &["reversal", "made/readings.csv"]).stdout;
    assert!(text.contains("sides seen once only"), "{text}");
}

/// Name, angles, position and reading.
type Row = (&'static str, &'static str, u32, f64);

/// The four channels by their angles, or by other names with these angles, are the four channels.
#[test]
fn the_four_by_their_angles_keep_their_answer() {
    let rows: Vec<Row> = [
        ("1A", "0,0"),
        ("1B", "180,0"),
        ("2A", "180,180"),
        ("2B", "0,180"),
    ]
    .into_iter()
    .flat_map(|(name, angles)| {
        (0..9).map(move |k| (name, angles, 10 * k, f64::from((k * 37) % 11) / 10.0))
    })
    .collect();
    let table = |header: &str, of: &dyn Fn(&Row) -> String| {
        let lines: Vec<String> = rows
            .iter()
            .map(|r| format!("{},{},{}", of(r), r.2, r.3))
            .collect();
        format!("{header},x,reading\n{}\n", lines.join("\n"))
    };
    let folder = Folder::with(&[
        ("names.csv", &table("channel", &|r| r.0.to_owned())),
        (
            "angles.csv",
            &table("indicator,spindle", &|r| r.1.to_owned()),
        ),
    ]);
    let by_name = solved(&folder, &["names.csv"]);
    let by_angle = solved(&folder, &["angles.csv"]);
    assert_eq!(by_name["schema"], "errsep.reversal/1");
    for key in ["schema", "tilts", "forms", "closure"] {
        assert_eq!(by_name[key], by_angle[key], "{key}");
    }
}

#[test]
fn zeros_that_are_kept_give_the_eccentricity() {
    let folder = simulated("0/0,0/90,0/180,0/270", &["--kept", "12,-7,3"]);
    let answer = solved(
        &folder,
        &["made/readings.csv", "--setup", "made/setup.toml"],
    );
    for (name, um) in [("e_1", 12.0), ("e_2", -7.0), ("o", 3.0)] {
        let own = &answer["eccentricity"][name];
        let (value, std) = (own["value"].as_f64().unwrap(), own["std"].as_f64().unwrap());
        // k·u: one seed, four standard uncertainties.
        assert!((value - um).abs() < 4.0 * std, "{name}: {own}");
    }
}

#[test]
fn the_report_draws_the_design() {
    let folder = simulated(EIGHT, &[]);
    let output = run(
        &folder,
        &["reversal", "made/readings.csv", "--out", "report"],
    );
    assert_eq!(output.status, 0, "{}", output.stderr);
    let page = folder.read("report/report.html");
    for part in [
        "spindle at 180°",
        "Form of the slide in both planes",
        "90/180",
        "Closures",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        folder
            .read("report/profiles.csv")
            .starts_with("x_mm,M_h_um,M_h_std_um,M_v_um")
    );
}

const GOOD: &str = "indicator,spindle,x,reading
0,0,0,1
0,0,10,2
0,0,20,1
0,0,30,2
0,90,0,1
0,90,10,2
0,90,20,3
0,90,30,2
";

fn refused(data: &str, setup: &str) -> Output {
    let folder = Folder::with(&[("d.csv", data), ("s.toml", setup)]);
    run(&folder, &["reversal", "d.csv", "--setup", "s.toml"])
}

/// Each bad input is told with its place and what to do.
#[test]
fn bad_input_is_told() {
    let named = GOOD
        .replace("indicator,spindle", "channel")
        .replace("0,90,", "4D,")
        .replace("0,0,", "1A,");
    let angles =
        "[channels]\n1A = { indicator = 0, spindle = 0 }\n4D = { indicator = 270, spindle = 90 }\n";
    let cases: [(&str, String, String, &[&str]); 11] = [
        (
            "NaN",
            GOOD.replace("0,90,10,2", "0,90,10,nan"),
            String::new(),
            &["d.csv:7:", "nan"],
        ),
        (
            "no angle",
            GOOD.replace("0,90,0,1", ",90,0,1"),
            String::new(),
            &["d.csv:6:1", "empty"],
        ),
        (
            "a text for an angle",
            GOOD.replace("0,90,0,1", "0,top,0,1"),
            String::new(),
            &["d.csv:6:3", "top"],
        ),
        (
            "no column of the spindle",
            GOOD.replace("indicator,spindle", "indicator,spindel"),
            String::new(),
            &["d.csv:1:", "spindel", "spindle"],
        ),
        (
            "names beside angles",
            GOOD.replace("indicator,spindle,x", "indicator,channel,x"),
            String::new(),
            &["d.csv:1:1", "`channel` stands beside the angles"],
        ),
        (
            "a channel without angles",
            named.replace("4D", "4E"),
            angles.to_owned(),
            &["d.csv:6:1", "channel `4E` has no angles", "4D"],
        ),
        (
            "the same angles twice",
            named.clone(),
            angles.replace("270, spindle = 90", "360, spindle = 0.3"),
            &["s.toml:3:", "1A and 4D have the same angles"],
        ),
        (
            "half the angles",
            named.clone(),
            angles.replace(", spindle = 90", ""),
            &["s.toml:3:", "spindle"],
        ),
        (
            "an angle that is none",
            named.clone(),
            angles.replace("spindle = 90", "spindle = nan"),
            &["s.toml:3:", "no angle"],
        ),
        (
            "a reading twice",
            format!("{GOOD}0,90,30,5\n"),
            String::new(),
            &["d.csv:10", "line 9 already", "repeat"],
        ),
        (
            "one position",
            GOOD.replace("0,90,10,", "0,90,0,1\n#")
                .replace("0,90,20,", "#")
                .replace("0,90,30,", "#")
                .replace("0,90,0,1\n0,90,0,1", "0,90,0,1"),
            String::new(),
            &["d.csv:6:", "a slope needs two positions"],
        ),
    ];
    for (name, data, setup, told) in cases {
        let output = refused(&data, &setup);
        assert_eq!(
            output.status, 2,
            "{name}: {}{}",
            output.stdout, output.stderr
        );
        assert!(output.stdout.is_empty(), "{name}: {}", output.stdout);
        for part in told {
            assert!(
                output.stderr.contains(part),
                "{name}, {part}: {}",
                output.stderr
            );
        }
    }
}

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
