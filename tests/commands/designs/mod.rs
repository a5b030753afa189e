//! `errsep reversal` on designs of any angles, and `errsep simulate reversal --design`.

mod refused;
mod with_effects;

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
