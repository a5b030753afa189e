//! `--columns`: the same readings under other names and in other units give the same answer.

use crate::command::{Folder, bad_input, run};
use serde_json::Value;

/// A column of the command's own table: its name there, its name in the other file, the unit that the map
/// tells, and how many of that unit its own unit is.
type Renamed = (&'static str, &'static str, &'static str, f64);

const MM_IN_INCH: (&str, f64) = (":inch", 1.0 / 25.4);
const UM_IN_INCH: (&str, f64) = (":inch", 1.0 / 25_400.0);
const UM_IN_MICROINCH: (&str, f64) = (":uinch", 1.0 / 0.0254);

const fn length(name: &'static str, other: &'static str, unit: (&'static str, f64)) -> Renamed {
    (name, other, unit.0, unit.1)
}

const fn text(name: &'static str, other: &'static str) -> Renamed {
    (name, other, "", 0.0)
}

/// The table with other names, units and a column that nobody reads.
fn renamed(table: &str, columns: &[Renamed]) -> String {
    let mut rows = table.lines().filter(|row| !row.starts_with('#'));
    let names: Vec<&str> = rows.next().unwrap().split(',').collect();
    let of: Vec<&Renamed> = names
        .iter()
        .map(|name| columns.iter().find(|c| c.0 == *name).unwrap())
        .collect();
    let heads: Vec<&str> = of.iter().map(|c| c.1).collect();
    let mut other = format!("operator,{}\n", heads.join(","));
    for row in rows {
        let fields = row
            .split(',')
            .zip(&of)
            .map(|(field, column)| match column.3 {
                0.0 => field.to_owned(),
                _ if field.is_empty() => String::new(),
                factor => (field.parse::<f64>().unwrap() * factor).to_string(),
            });
        other += &format!("someone,{}\n", fields.collect::<Vec<_>>().join(","));
    }
    other
}

fn map(table: &str, columns: &[Renamed]) -> String {
    let names: Vec<&str> = table
        .lines()
        .find(|row| !row.starts_with('#'))
        .unwrap()
        .split(',')
        .collect();
    let there = columns.iter().filter(|c| names.contains(&c.0));
    let entries: Vec<String> = there.map(|c| format!("{}={}{}", c.0, c.1, c.2)).collect();
    entries.join(",")
}

/// Every number of the answers agrees. Tolerance: rounding, a part in 1e6 of the number or of the greatest
/// of its array, since numbers in inch are rounded once more than those in mm.
fn alike(one: &Value, other: &Value, path: &str, greatest: f64) {
    match (one, other) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, value) in a {
                if !["provenance", "seconds", "setup", "truth"].contains(&key.as_str()) {
                    alike(value, &b[key], &format!("{path}.{key}"), 0.0);
                }
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{path}");
            let numbers = a.iter().filter_map(Value::as_f64);
            let greatest = numbers.map(f64::abs).fold(0.0, f64::max);
            for (a, b) in a.iter().zip(b) {
                alike(a, b, path, greatest);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            let allowed = 1e-6 * a.abs().max(greatest) + 1e-9;
            assert!((a - b).abs() <= allowed, "{path}: {a} and {b}");
        }
        _ => assert_eq!(one, other, "{path}"),
    }
}

fn same_answer(folder: &Folder, before: &[&str], table: &str, after: &[&str], columns: &[Renamed]) {
    let of = |options: &[&str]| -> Value {
        let all = [before, options, after, &["--format", "json"]].concat();
        let out = run(folder, &all);
        assert_eq!(out.status, 0, "{all:?}: {}", out.stderr);
        serde_json::from_str(&out.stdout).unwrap()
    };
    folder.write("own.csv", table);
    folder.write("other.csv", &renamed(table, columns));
    let one = of(&["own.csv"]);
    let other = of(&["other.csv", "--columns", &map(table, columns)]);
    alike(&one, &other, "", 0.0);
}

fn simulated(folder: &Folder, options: &[&str]) -> String {
    let made = run(folder, &[&["simulate"], options].concat());
    assert_eq!(made.status, 0, "{}", made.stderr);
    made.stdout
}

#[test]
fn circle_straightness_and_replicates() {
    let folder = Folder::with(&[]);
    let points = simulated(&folder, &["circle", "--repeats", "2"]);
    let columns = [
        length("x", "X coordinate", MM_IN_INCH),
        length("y", "Y coordinate", MM_IN_INCH),
        text("repeat", "pass"),
    ];
    same_answer(&folder, &["circle"], &points, &[], &columns);
    same_answer(
        &folder,
        &["circle"],
        &points,
        &["--with", "ovality"],
        &columns,
    );
    same_answer(
        &folder,
        &["diagnose"],
        &points,
        &["--model", "circle"],
        &columns,
    );

    let profile = "x,deviation\n0,0\n10,0.5\n20,0.25\n30,-0.75\n";
    let columns = [
        length("x", "station", MM_IN_INCH),
        length("deviation", "gauge", UM_IN_MICROINCH),
    ];
    same_answer(&folder, &["straightness"], profile, &[], &columns);

    let replicates = "part,value\n1,10.0\n1,10.1\n2,14.0\n2,14.1\n3,7.0\n3,7.1\n";
    let columns = [text("part", "piece"), length("value", "off", UM_IN_INCH)];
    same_answer(&folder, &["anova"], replicates, &[], &columns);
}

#[test]
fn positioning_and_step_diagonal() {
    let folder = Folder::with(&[]);
    let runs = simulated(&folder, &["positioning"]);
    let columns = [
        length("target", "nominal", MM_IN_INCH),
        length("position", "laser", MM_IN_INCH),
        text("run", "cycle"),
        text("direction", "way"),
        text("time", "clock"),
        text("temperature", "degC"),
    ];
    same_answer(&folder, &["positioning"], &runs, &[], &columns);
    let off = "target,run,direction,deviation\n0,1,forward,1\n0,1,backward,2\n10,1,forward,3\n10,1,backward,1\n\
               0,2,forward,1.5\n0,2,backward,2.5\n10,2,forward,2.5\n10,2,backward,1.5\n";
    let columns = [
        length("target", "nominal", MM_IN_INCH),
        length("deviation", "laser", UM_IN_MICROINCH),
        text("run", "cycle"),
        text("direction", "way"),
    ];
    same_answer(&folder, &["positioning"], off, &[], &columns);
    let diagonals = simulated(&folder, &["step-diagonal", "--steps", "3"]);
    let columns = [
        text("diagonal", "which"),
        text("sequence", "order"),
        text("target", "optics"),
        text("repeat", "n"),
        text("direction", "way"),
        length("x", "px", MM_IN_INCH),
        length("y", "py", MM_IN_INCH),
        length("z", "pz", MM_IN_INCH),
        length("reading", "laser", UM_IN_MICROINCH),
    ];
    same_answer(&folder, &["step-diagonal"], &diagonals, &[], &columns);
    same_answer(&folder, &["diagnose"], &diagonals, &[], &columns);
}

#[test]
fn four_sensors_and_two_probes() {
    let folder = Folder::with(&[]);
    simulated(
        &folder,
        &["four-sensor", "--positions", "19", "--out", "four"],
    );
    let sensors = folder.read("four/data.csv");
    let columns = [
        text("repeat", "pass"),
        length("x", "slide", MM_IN_INCH),
        length("m1", "a", UM_IN_MICROINCH),
        length("m2", "b", UM_IN_MICROINCH),
        length("m3", "c", UM_IN_MICROINCH),
        length("m4", "d", UM_IN_MICROINCH),
    ];
    let setup = ["--setup", "four/setup.toml"];
    same_answer(&folder, &["four-sensor"], &sensors, &setup, &columns);
    let scans = simulated(&folder, &["fourier", "--positions", "200"]);
    let columns = [
        text("repeat", "pass"),
        length("spacing", "apart", MM_IN_INCH),
        length("x", "slide", MM_IN_INCH),
        length("m1", "a", UM_IN_MICROINCH),
        length("m2", "b", UM_IN_MICROINCH),
        length("m3", "c", UM_IN_MICROINCH),
    ];
    same_answer(
        &folder,
        &["fourier"],
        &scans,
        &["--length", "100"],
        &columns,
    );
}

#[test]
fn parts_of_a_machine() {
    let mut plate = String::from("part,point,axis,replicate,value\n");
    let mut points = String::from("point,x,y,z\n");
    for k in 0..9 {
        let (x, y) = (f64::from(50 * (k % 3)), f64::from(50 * (k / 3)));
        points += &format!("P{k},{x},{y},0\n");
        for replicate in 1..=3 {
            // Fractional parts of multiples of two irrational numbers: no pattern that repeats.
            let noise = |root: f64| (root * f64::from(100 * replicate + k)).fract() - 0.5;
            plate += &format!(
                "plug,P{k},x,{replicate},{}\n",
                0.05 * x + noise(2f64.sqrt())
            );
            plate += &format!(
                "plug,P{k},y,{replicate},{}\n",
                0.02 * y + noise(3f64.sqrt())
            );
        }
    }
    let machine = "chain = \"FXYZ\"\n[part]\nalign = \"free\"\n";
    let folder = Folder::with(&[("points.csv", &points), ("cmm.toml", machine)]);
    let columns = [
        text("part", "piece"),
        text("point", "hole"),
        text("axis", "along"),
        text("replicate", "n"),
        length("value", "off", UM_IN_INCH),
    ];
    let parts = ["machine", "cmm.toml", "parts"];
    let at = ["--points", "points.csv"];
    same_answer(&folder, &parts, &plate, &at, &columns);
    let at = ["--setup", "cmm.toml", "--points", "points.csv"];
    same_answer(&folder, &["diagnose"], &plate, &at, &columns);
}

#[test]
fn a_calibration_line_has_units_of_its_own() {
    let folder = Folder::with(&[]);
    let line = simulated(&folder, &["calibration-line"]);
    let columns = [
        text("x", "load (kN)"),
        text("y", "signal (mm)"),
        text("set", "run"),
        text("time", "t"),
    ];
    same_answer(&folder, &["diagnose"], &line, &[], &columns);
}

#[test]
fn what_cannot_be_read_is_told() {
    let folder = Folder::with(&[("p.csv", "a,b\n0,1\n1,2\n")]);
    for (columns, told) in [
        ("x=a,y=c", ["column `c` is missing", "p.csv:1:1"]),
        ("x=a", ["no column is given for `y`", "add y=COLUMN"]),
        ("x=a,yy=b", ["no column holds `yy`", "did you mean `y`"]),
        (
            "x=a,y=a",
            ["column `a` is to be both `x` and `y`", "one role"],
        ),
        (
            "x=a:furlong,y=b",
            ["`furlong` is no unit of `x`", "units are"],
        ),
        (
            "x=a:s,y=b",
            ["`x` is not taken in other units", "convert it"],
        ),
    ] {
        bad_input(&folder, &["circle", "p.csv", "--columns", columns], &told);
    }
}
