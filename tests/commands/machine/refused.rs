//! Machines, points and features that cannot be used are told with their place and what to do.

use super::*;

/// A machine file, or points, must be refused with all of these words, a place and a remedy.
fn refused(machine: &str, points: &str, options: &[&str], told: &[&str]) {
    let folder = TempDir::new().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let (machine, points) = (file("machine.toml", machine), file("points.csv", points));
    let out = folder.path().join("out");
    let mut args = vec!["machine", &machine];
    let action = if options.is_empty() {
        &["predict"][..]
    } else {
        options
    };
    args.extend(action.iter().map(|word| {
        if *word == "POINTS" {
            points.as_str()
        } else {
            *word
        }
    }));
    if options.is_empty() {
        args.push(&points);
    }
    args.extend(["--out", out.to_str().unwrap()]);
    let output = errsep(&args);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told:?}: {message}");
    assert!(output.stdout.is_empty() && !out.exists(), "{told:?}");
    for words in told {
        assert!(message.contains(words), "{words:?} is not in:\n{message}");
    }
    assert!(message.contains("help: "), "no remedy in:\n{message}");
}

const POINTS: &str = "point,x,y\na,0,0\nb,100,0\nc,100,50\n";

#[test]
fn one_thing_wrong_with_the_machine() {
    let bad = |machine: &str, told: &[&str]| refused(machine, POINTS, &[], told);
    bad("", &["chain"]);
    bad("chain = \"XYZ\"\n", &["machine.toml:1:9", "no frame F"]);
    bad(
        "chain = \"FXYZ\"\nchian = 1\n",
        &["machine.toml:2", "did you mean `chain`"],
    );
    bad("chain = \"FXYZ\"\nsense = \"both\"\n", &["machine.toml:2"]);
    bad(
        "chain = \"FXYZ\"\ntool_offset = [0, 0, inf]\n",
        &["machine.toml:2", "finite"],
    );
    let entry = |text: &str| format!("chain = \"FXYZ\"\n[errors.EXX]\n{text}\n");
    bad(
        "chain = \"FXYZ\"\n[errors.EXW]\nvalue = 1\n",
        &["`EXW` is none of the 21", "did you mean `EX"],
    );
    bad(&entry(""), &["machine.toml:2", "exactly one of"]);
    bad(&entry("value = 1\npolynomial = [1]"), &["exactly one of"]);
    bad(&entry("value = nan"), &["machine.toml:2", "finite"]);
    bad(&entry("value = \"one\""), &["machine.toml:3"]);
    bad(&entry("vaule = 1"), &["did you mean `value`"]);
    bad(&entry("value = 1\nstd = -1"), &["not negative"]);
    bad(
        &entry("value = 1\nstd = 1\ndegrees_of_freedom = 0"),
        &["degrees of freedom are 0"],
    );
    bad(
        &entry("table = { positions = [0, 0], values = [1, 1] }"),
        &["must ascend"],
    );
    bad(
        &entry("table = { positions = [0, 50], values = [1, 1] }"),
        &["extend the table"],
    );
    bad(
        &entry("readings = [1, 2]"),
        &["bare readings do not say where"],
    );
    bad(&entry("degree = 1"), &["--components"]);
    bad(&entry("degree = 99"), &["degree 99"]);
    bad(
        &entry(
            "value = 1\nregression = { residual_std = 1, observations = 2, mean_position = 0, sum_of_squares = 1 }",
        ),
        &["at least three readings"],
    );
    let angle = |text: &str| format!("chain = \"FXYZ\"\n[errors.C0Y]\n{text}\n");
    bad(&angle("polynomial = [0, 1]"), &["error of location"]);
    bad(&angle("readings = [1e-5]"), &["1 of at least 2 readings"]);
}

#[test]
fn one_thing_wrong_with_the_points_or_the_feature() {
    let good = "chain = \"FXYZ\"\n[errors.EXX]\nvalue = 1\nstd = 1\n";
    let bad = |points: &str, told: &[&str]| refused(good, points, &[], told);
    bad("", &["empty"]);
    bad("point,x,y\n", &["no row of data"]);
    bad("point,x\na,1\n", &["column `y` is missing"]);
    bad("point,x,y\na,1,b\n", &["points.csv:2:5", "not a number"]);
    bad("point,x,y\na,1,inf\n", &["points.csv:2:5", "finite"]);
    bad(
        "point,x,y\na,1,2\na,3,4\n",
        &["points.csv:3", "given twice"],
    );
    bad("point,x,y\n,1,2\n", &["points.csv:2", "no name"]);
    let feature = |options: &[&str], told: &[&str]| refused(good, POINTS, options, told);
    feature(
        &["length", "POINTS", "--between", "ab"],
        &["does not name two points"],
    );
    feature(&["length", "POINTS", "--between", "a:d"], &["no point `d`"]);
    feature(&["length", "POINTS", "--between", "a:a"], &["coincide"]);
    feature(
        &["squareness", "POINTS", "--first", "a,b", "--second", "a,b"],
        &["row along Y"],
    );
    feature(
        &["predict", "POINTS", "--confidence", "0"],
        &["--confidence 0"],
    );
    feature(
        &["circularity", "--centre", "0,0", "--radius", "-1"],
        &["radius must be positive"],
    );
    feature(
        &["circularity", "--centre", "0,0", "--radius", "0"],
        &["radius must be positive"],
    );
    feature(
        &[
            "circularity",
            "--centre",
            "0,0",
            "--radius",
            "1",
            "--trials",
            "1",
        ],
        &["--trials"],
    );
    feature(
        &[
            "length",
            "POINTS",
            "--between",
            "a:b",
            "--trials",
            "99999999999",
        ],
        &["memory"],
    );
}
