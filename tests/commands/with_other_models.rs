//! `--with` on the commands of the other models and on `errsep diagnose`: effects made here by other
//! formulas than the fit's join it, with their uncertainty.

use serde_json::Value;

use crate::command::{Folder, bad_input, documented, run};

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, &[arguments, &["--format", "json"]].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

/// Whether a parameter of the only effect lies within five standard uncertainties of the truth: one seed.
fn holds(answer: &Value, parameter: &str, truth: f64) {
    let all = answer["effects"][0]["parameters"].as_array().unwrap();
    let own = all.iter().find(|p| p["name"] == parameter);
    let own = own.unwrap_or_else(|| panic!("no {parameter}: {all:?}"));
    let (value, std) = (own["value"].as_f64().unwrap(), own["std"].as_f64().unwrap());
    assert!(
        std > 0.0 && (value - truth).abs() < 5.0 * std,
        "{parameter}: {value} ± {std}, truth {truth}"
    );
}

/// Three passes over an oval of half axes R ± `oval` µm, long at `first` degrees.
fn oval(oval: f64, first: f64) -> String {
    // Noise of ±0.2 µm without a random number: a sequence that fills the interval evenly.
    let mut text = "x,y,repeat\n".to_owned();
    let mut left = 0.5_f64;
    for repeat in 1..=3 {
        for k in 0..48 {
            left = (left + 0.618_033_988_75).fract();
            let at = f64::from(k) * std::f64::consts::TAU / 48.0;
            let towards = at - first.to_radians();
            let (long, short) = (20.0 + 1e-3 * oval, 20.0 - 1e-3 * oval);
            let radius = long * short / (short * towards.cos()).hypot(long * towards.sin())
                + 4e-4 * (left - 0.5);
            text += &format!(
                "{},{},{repeat}\n",
                5.0 + radius * at.cos(),
                radius * at.sin()
            );
        }
    }
    text
}

#[test]
fn an_oval_joins_the_circle() {
    let folder = Folder::with(&[("points.csv", &oval(0.8, 30.0))]);
    let answer = json(
        &folder,
        &["circle", "points.csv", "--with", "ovality", "--out", "out"],
    );
    assert_eq!(answer["schema"], "errsep.circle/1");
    holds(&answer, "amplitude", 0.8);
    holds(&answer, "first-maximum", 30.0);
    let with = &answer["with"];
    documented(with, "docs/json/fit-with.md");
    assert_eq!(with["effects"], answer["effects"]);
    let gap = |which: &str| with["gap"][which]["rms"].as_f64().unwrap();
    // The ellipse's root mean square is 0.8/√2 µm; what is left of it is noise: two of its hundredths.
    assert!(
        (gap("before") - 0.8 / 2f64.sqrt()).abs() < 0.05 && gap("after") < 0.05,
        "{with}"
    );
    let page = folder.read("out/report.html");
    assert!(page.contains("With the effects in the fit"));
    assert!(page.contains("Effects in the fit"));
    // The same by `errsep diagnose`.
    let alone = json(&folder, &["diagnose", "points.csv", "--with", "ovality"]);
    assert_eq!(alone["effects"], answer["effects"]);
}

#[test]
fn what_the_readings_do_not_determine_is_refused() {
    let folder = Folder::with(&[("points.csv", &oval(0.8, 30.0))]);
    for (with, status, expected) in [
        ("scale", 1, "absorbs `scale` whatever its size"),
        ("ovality,scale-mismatch", 1, "do not tell"),
        ("oval", 2, "did you mean `ovality`?"),
        ("ovality,ovality", 2, "given twice"),
    ] {
        let out = run(&folder, &["circle", "points.csv", "--with", with]);
        assert_eq!(out.status, status, "{with}: {}", out.stderr);
        assert!(out.stderr.contains(expected), "{with}: {}", out.stderr);
        assert!(out.stdout.is_empty());
    }
    bad_input(
        &folder,
        &[
            "diagnose",
            "points.csv",
            "--with",
            "ovality",
            "--without",
            "lobes",
        ],
        &["cannot be used with"],
    );
}

/// A sensor whose gain is off by 0.3 %: the outputs of an exact simulation, multiplied here.
#[test]
fn a_gain_joins_the_four_sensors() {
    let folder = Folder::with(&[]);
    let made = run(
        &folder,
        &[
            "simulate",
            "four-sensor",
            "--repeats",
            "4",
            "--noise",
            "0.05",
            "--out",
            "s",
        ],
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    let text = folder.read("s/data.csv");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let mut spoilt = lines.next().unwrap().to_owned() + "\n";
    for line in lines {
        let mut fields: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        fields[2] *= 1.003;
        let fields: Vec<String> = fields.iter().map(f64::to_string).collect();
        spoilt += &(fields.join(",") + "\n");
    }
    folder.write("data.csv", &spoilt);
    let answer = json(
        &folder,
        &[
            "four-sensor",
            "data.csv",
            "--setup",
            "s/setup.toml",
            "--with",
            "gain",
        ],
    );
    // Which sensor it is may stay open: all that fit as well are told.
    let told = &answer["effects"][0];
    let others = told["elsewhere"].as_array().into_iter().flatten();
    let mut all = std::iter::once(told).chain(others);
    let own = all.find(|e| e["variant"] == "sensor 2");
    let own = own.unwrap_or_else(|| panic!("{told}"));
    holds(&serde_json::json!({"effects": [own]}), "gain", 0.003);
}

/// A drift of 4 µm over the whole test.
#[test]
fn a_drift_joins_the_step_diagonal_test() {
    let folder = Folder::with(&[]);
    let arguments = [
        "simulate",
        "step-diagonal",
        "--repeats",
        "3",
        "--rotation",
        "0",
    ];
    let made = run(
        &folder,
        &[&arguments[..], &["--effect", "drift=4", "--out", "s"]].concat(),
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    let arguments = ["step-diagonal", "s/readings.csv", "--with", "drift"];
    let answer = json(&folder, &[&arguments[..], &["--out", "out"]].concat());
    holds(&answer, "drift", 4.0);
    // Residuals of both fits, each in a file of its own.
    assert!(folder.read("out/residuals.csv").lines().count() > 100);
    let columns = folder.read("out/with_residuals.csv");
    assert!(columns.contains("before_um,after_um"), "{columns:.200}");
    let quantities = answer["with"]["quantities"].as_array().unwrap();
    let about = |name: &str| quantities.iter().any(|q| q["quantity"] == name);
    assert!(about("EXY"), "{quantities:?}");
}

/// A drift of which nothing is seen: its time constant is open, and with it the size.
#[test]
fn a_size_that_goes_with_an_open_shape_has_the_interval_of_all_shapes() {
    let folder = Folder::with(&[]);
    // 2 µm within a tenth of the test: most of it goes by before the second run.
    for seed in ["1", "12", "19", "22"] {
        let effect = ["--effect", "drift=2", "--seed", seed, "--out", seed];
        let runs = [
            "--sequence",
            "XYZ",
            "--sequence",
            "YZX",
            "--sequence",
            "ZXY",
        ];
        let usual = [
            "simulate",
            "step-diagonal",
            "--repeats",
            "4",
            "--rotation",
            "0",
        ];
        let made = run(&folder, &[&usual[..], &runs, &effect].concat());
        assert_eq!(made.status, 0, "{}", made.stderr);
        let data = format!("{seed}/readings.csv");
        let answer = json(&folder, &["step-diagonal", &data, "--with", "drift"]);
        holds(&answer, "drift", 2.0);
        // By the covariance at the best shape alone three of these are off by more than 5 u.
        let own = &answer["effects"][0]["parameters"];
        assert!(own[0]["std"].as_f64().unwrap() > 0.7, "{own}");
    }
}

/// The slide's yaw turns both probes: a wave of 20 µrad, told by its root mean square.
#[test]
fn a_yaw_joins_the_fourier_scans_of_one_file() {
    let folder = Folder::with(&[]);
    let arguments = [
        "simulate",
        "fourier",
        "--positions",
        "200",
        "--repeats",
        "4",
    ];
    let made = run(
        &folder,
        &[&arguments[..], &["--effect", "yaw=2e-5", "--out", "s"]].concat(),
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
    let scans = [
        "fourier",
        "s/scans.csv",
        "--setup",
        "s/setup.toml",
        "--with",
        "yaw",
    ];
    let answer = json(&folder, &scans);
    holds(&answer, "angle-rms", 2e-5 / 2f64.sqrt());
    folder.write("again.csv", &folder.read("s/scans.csv"));
    let two = [
        "fourier",
        "s/scans.csv",
        "again.csv",
        "--length",
        "100",
        "--with",
        "yaw",
    ];
    bad_input(&folder, &two, &["--with takes the scans of one file"]);
}

/// In first order an effect would stand beside the geometry, not in it.
#[test]
fn effects_join_a_reversal_by_its_own_command() {
    let folder = Folder::with(&[]);
    let made = run(&folder, &["simulate", "reversal", "--positions", "9"]);
    folder.write("r.csv", &made.stdout);
    let arguments = ["diagnose", "r.csv", "--with", "taper"];
    bad_input(&folder, &arguments, &["errsep reversal r.csv"]);
}

/// The examples with `--with` that the help gives, as they stand there, on files of these names.
#[test]
fn examples_of_the_help_run() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/");
    let folder = Folder::with(&[]);
    for (name, fixture) in [
        ("data.csv", "reversal/readings.csv"),
        ("parts.csv", "nistir6868/drilled_holes.csv"),
        ("points.csv", "nistir6868/holes.csv"),
        ("machine.toml", "nistir6868/machine.toml"),
    ] {
        std::fs::copy(format!("{root}{fixture}"), folder.path().join(name)).unwrap();
    }
    for command in ["reversal", "diagnose"] {
        let help = run(&folder, &[command, "--help"]).stdout;
        let examples = help.lines().filter(|line| line.contains(" --with "));
        let examples: Vec<&str> = examples.filter_map(|l| l.split("errsep ").nth(1)).collect();
        assert_eq!(examples.len(), 1, "{help}");
        let words: Vec<&str> = examples[0].split_whitespace().collect();
        let out = run(&folder, &words);
        assert_eq!(out.status, 0, "{words:?}: {}", out.stderr);
    }
}
