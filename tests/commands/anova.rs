//! `errsep anova`: its answer, and every kind of wrong input with place and remedy.

use std::path::{Path, PathBuf};

use crate::command::{Folder, Output, bad_input, run};
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/nistir6868")
        .join(name)
}

fn errsep(args: &[&str]) -> Output {
    run(&Folder::with(&[]), args)
}

fn answer(args: &[&str]) -> Value {
    let output = errsep(args);
    assert_eq!(output.status, 0, "{}", output.stderr);
    serde_json::from_str(&output.stdout).unwrap()
}

fn near(found: &Value, expected: f64, tolerance: f64) {
    let number = found
        .as_f64()
        .unwrap_or_else(|| panic!("{found} is no number"));
    assert!(
        (number - expected).abs() <= tolerance,
        "{number} is not {expected}"
    );
}

#[test]
fn json_holds_the_documented_keys_and_the_report_s_figures() {
    let path = fixture("replicates.csv");
    let all = answer(&[
        "anova",
        path.to_str().unwrap(),
        "--recipe",
        "section-5.1",
        "--format",
        "json",
    ]);
    assert_eq!(all["schema"], "errsep.anova/1");
    let features = all["features"].as_array().unwrap();
    assert_eq!(features.len(), 15);
    for feature in features {
        let analysis = &feature["analysis"];
        for key in ["sum_of_squares", "degrees_of_freedom", "mean_square"] {
            assert!(analysis["between"][key].is_number() && analysis["within"][key].is_number());
        }
        for key in [
            "variance",
            "standard_deviation",
            "lower",
            "upper",
            "degrees",
        ] {
            assert!(analysis["components"]["between"][key].is_number(), "{key}");
            assert!(analysis["components"]["within"][key].is_number(), "{key}");
        }
        for key in ["label", "value", "std", "degrees_of_freedom", "unit"] {
            assert!(
                !analysis["mean"][key].is_null()
                    && !analysis["future_reading"]["result"][key].is_null()
            );
        }
        for quantity in [&analysis["mean"], &analysis["future_reading"]["result"]] {
            let number = |value: &Value| value.as_f64().unwrap();
            let expanded = &quantity["expanded"];
            let u = number(&expanded["expanded_uncertainty"]);
            let ratio = u / number(&quantity["std"]) / number(&expanded["coverage_factor"]);
            // Epsilons.
            assert!((ratio - 1.0).abs() < 1e-14 && expanded["coverage_probability"] == 0.95);
        }
        assert!(analysis["f"].is_number() && analysis["p_value"].is_number());
        assert!(analysis["groups"] == 21 && analysis["readings"] == 54);
        assert_eq!(feature["parts"].as_array().unwrap().len(), 21);
        let shares: f64 = analysis["future_reading"]["contributions"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c["share"].as_f64().unwrap())
            .sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }
    // Certified digits of Table C1; readings rounded to 0.001 move the mean square by 0.01.
    let first = &features[0];
    assert_eq!(first["keys"]["table"], "C1");
    near(&first["nistir6868"]["mean"], 2.729, 0.0006);
    near(&first["nistir6868"]["variance_between"], 640.886_701, 0.01);
    near(&first["nistir6868"]["variance_within"], 1.102_909, 3.2e-4);
    near(&first["nistir6868"]["future_manufacturing"], 25.91, 0.006);
    near(&first["analysis"]["effective_replicates"], 2.5444, 5e-5);
    assert_eq!(features[12]["unit"], "arcsec");
}

#[test]
fn the_folder_holds_report_result_and_tables() {
    let folder = Folder::with(&[]);
    let path = fixture("replicates.csv");
    let output = run(&folder, &["anova", path.to_str().unwrap(), "--out", "out"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
    // The budget of a future reading, the largest share first, with its expanded uncertainty.
    let budget = output.stdout.find("a future reading").unwrap();
    let shown = &output.stdout[budget..];
    assert!(
        shown.find("between groups").unwrap() < shown.find("within a group").unwrap(),
        "{shown}"
    );
    assert!(shown.contains("U = ") && shown.contains("(k = "), "{shown}");
    let page = folder.read("out/report.html");
    assert!(
        page.contains("<svg")
            && page.contains("between parts")
            && !page.contains("http://www.w3.org/1999")
    );
    let result: Value = serde_json::from_str(&folder.read("out/result.json")).unwrap();
    assert_eq!(result["schema"], "errsep.anova/1");
    assert_eq!(folder.read("out/components.csv").lines().count(), 16);
    assert_eq!(folder.read("out/parts.csv").lines().count(), 1 + 15 * 21);
}

#[test]
fn simulated_components_are_found() {
    let options = [
        "simulate",
        "anova",
        "--parts",
        "400",
        "--between",
        "2",
        "--within",
        "0.5",
        "--replicates-of-first-four",
        "5",
    ];
    let output = errsep(&options);
    assert_eq!(output.status, 0, "{}", output.stderr);
    let folder = Folder::with(&[("replicates.csv", &output.stdout)]);
    let output = run(&folder, &["anova", "replicates.csv", "--format", "json"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
    let found: Value = serde_json::from_str(&output.stdout).unwrap();
    let analysis = &found["features"][0]["analysis"];
    // k·u: 400 parts give their standard deviation to 3.5 %, 412 repeats theirs to as much.
    near(
        &analysis["components"]["between"]["standard_deviation"],
        2.0,
        3.0 * 0.07,
    );
    near(
        &analysis["components"]["within"]["standard_deviation"],
        0.5,
        3.0 * 0.018,
    );
    assert_eq!(analysis["readings"], 812);
}

#[test]
fn one_reading_a_part_is_not_identifiable() {
    let folder = Folder::with(&[("data.csv", "part,value\n1,0.5\n2,0.7\n3,0.1\n")]);
    let output = run(&folder, &["anova", "data.csv", "--format", "json"]);
    assert_eq!(output.status, 1, "{}", output.stderr);
    let answer: Value = serde_json::from_str(&output.stdout).unwrap();
    let analysis = &answer["features"][0]["analysis"];
    assert!(analysis["components"]["between"].is_null() && analysis["f"].is_null());
    near(&analysis["mean"]["value"], 13.0 / 30.0, 1e-15);
}

/// A file must be refused with all of these words, a place and a remedy.
fn refused(data: &str, options: &[&str], told: &[&str]) {
    let folder = Folder::with(&[("data.csv", data)]);
    let args = [&["anova", "data.csv", "--out", "out"], options].concat();
    bad_input(&folder, &args, &[told, &["help: "]].concat());
}

#[test]
fn one_thing_wrong_at_a_time() {
    refused("", &[], &["empty"]);
    refused("part,value\n", &[], &["no row of data"]);
    refused(
        "part,valu\n1,2\n",
        &[],
        &["unknown column `valu`", "did you mean `value`"],
    );
    refused("part,replicate\n1,2\n", &[], &["column `value` is missing"]);
    refused(
        "part,value\n1,two\n",
        &[],
        &["data.csv:2:3", "not a number"],
    );
    refused(
        "part,value\n1,NaN\n",
        &[],
        &["data.csv:2:3", "not a finite number"],
    );
    refused("part,value\n1,\n", &[], &["data.csv:2", "value is missing"]);
    refused("part,value\n,1\n", &[], &["data.csv:2", "part is missing"]);
    refused("part,value\n1,2,3\n", &[], &["data.csv:2"]);
    refused(
        "part,replicate,value\n1,1,2\n1,1,3\n",
        &[],
        &["data.csv:3", "stands on line 2"],
    );
    refused(
        "part,replicate,value\n1,0,2\n",
        &[],
        &["data.csv:2", "whole number from 1"],
    );
    refused(
        "part,unit,value\n1,um,2\n1,mm,3\n",
        &[],
        &["data.csv:3", "this one is in mm"],
    );
    refused("part,value\n1,2\n", &[], &["one reading only"]);
    refused("part,value\n1,1e200\n1,-1e200\n", &[], &["larger unit"]);
    refused(
        "part,value\n1,2\n1,3\n",
        &["--confidence", "1.5"],
        &["--confidence 1.5"],
    );
    refused(
        "part,value\n1,2\n1,3\n",
        &["--recipe", "section-5.1"],
        &["at least two groups"],
    );
    refused("part,value\n\u{0}\n", &[], &["not text"]);
}

/// Equal readings are no knowledge of a scatter of zero.
#[test]
fn equal_readings_tell_no_scatter() {
    for (data, said) in [
        ("part,value\nA,1\nA,1\nB,1\nB,1\n", "all readings are equal"),
        (
            "part,value\nA,1\nA,1\nB,2\nB,2\n",
            "the readings of each part are equal",
        ),
    ] {
        let folder = Folder::with(&[("data.csv", data)]);
        let output = run(&folder, &["anova", "data.csv", "--out", "out"]);
        assert_eq!(output.status, 0, "{}", output.stderr);
        let page = folder.read("out/report.html");
        for text in [&output.stdout, &page] {
            assert!(text.contains(said), "{said:?} is not in:\n{text}");
        }
        assert!(page.contains("summary caution"));
        assert!(
            !output.stdout.contains("± 0 µm, U = 0"),
            "{}",
            output.stdout
        );
        let answer: Value = serde_json::from_str(&folder.read("out/result.json")).unwrap();
        assert!(answer["features"][0]["remarks"].to_string().contains(said));
    }
    let folder = Folder::with(&[("data.csv", "part,value\nA,1\nA,1.1\nB,1\nB,1\n")]);
    let answer = run(&folder, &["anova", "data.csv", "--format", "json"]).stdout;
    let answer: Value = serde_json::from_str(&answer).unwrap();
    assert_eq!(answer["features"][0]["remarks"], serde_json::json!([]));
}
