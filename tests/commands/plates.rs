//! Tables of plates as measuring machines print them, against the same readings one coordinate a row.

use serde_json::Value;

use crate::command::{Folder, bad_input, run};

pub const MACHINE: &str = "chain = \"FXYZ\"\n[part]\nalign = \"free\"\n";

/// A plate of 4 × 4 points, 60 mm apart: nominal and measured coordinates of one replicate, mm. Its axes are
/// 40 parts in a million too long along x and not square by 20 µrad, the noise is made by a rule.
fn plate(replicate: u32, turn: f64) -> Vec<(String, [f64; 2], [f64; 2])> {
    let mut points = Vec::new();
    for i in 0..4_u32 {
        for j in 0..4_u32 {
            let [x, y] = [60.0 * f64::from(i), 60.0 * f64::from(j)];
            let noise =
                |k: u32| f64::from((37 * i + 71 * j + 113 * replicate + 17 * k) % 11) * 1e-4 - 5e-4;
            let measured = [
                x * (1.0 + 40e-6) - y * (turn + 20e-6) + 0.02 + noise(1),
                y + x * turn - 0.013 + noise(2),
            ];
            points.push((format!("H{i}{j}"), [x, y], measured));
        }
    }
    points
}

/// One coordinate a row, as the documentation has it.
fn tidy(parts: &[(&str, f64)], left_out: &str) -> String {
    let mut text = "part,point,axis,replicate,value\n".to_owned();
    for (part, turn) in parts {
        for replicate in 1..=3 {
            for (point, nominal, measured) in plate(replicate, *turn) {
                for (k, axis) in ["x", "y"].iter().enumerate() {
                    if !(point == left_out && replicate == 2) {
                        // To the last digit that the tables print.
                        let deviation = (measured[k] * 1e5).round() / 1e5 - nominal[k];
                        text += &format!("{part},{point},{axis},{replicate},{}\n", deviation * 1e3);
                    }
                }
            }
        }
    }
    text
}

fn points() -> String {
    let rows = plate(1, 0.0).into_iter();
    let rows = rows.map(|(point, [x, y], _)| format!("{point},{x},{y},0\n"));
    format!("point,x,y,z\n{}", rows.collect::<String>())
}

/// With a preamble, columns under groups, apart by blanks, a row left out by a dash.
fn grouped(turn: f64, left_out: &str) -> String {
    let mut text = "ACME CMM 7.10.6    PROTOCOL\n\nDate: 2026-03-02   Operator: J. Doe\nUnits: mm   20.1 C\n\n\
                                      Nominal              Actual\nNo    X       Y        X          Y      Cycle\n"
        .to_owned();
    text += "------------------------------------------------\n";
    for replicate in 1..=3 {
        for (point, [x, y], [mx, my]) in plate(replicate, turn) {
            text += &if point == left_out && replicate == 2 {
                format!("{point}  {x:8.3} {y:8.3}   ---   ---   {replicate}\n")
            } else {
                format!("{point}  {x:8.3} {y:8.3} {mx:10.5} {my:10.5}  {replicate}\n")
            };
        }
        text += "\n";
    }
    text + "End of report\n"
}

/// One coordinate a row with semicolons and decimal commas, in inch, deviations that nobody reads.
fn by_row(turn: f64, left_out: &str) -> String {
    let inch = |mm: f64| format!("{:.11}", mm / 25.4).replace('.', ",");
    let mut text =
        "Messprotokoll\nTeil 4711\nfeature;axis;run;Soll (inch);Ist (inch);Tol;Abw\n".to_owned();
    for replicate in 1..=3 {
        for (point, nominal, measured) in plate(replicate, turn) {
            for (k, axis) in ["X", "Y"].iter().enumerate() {
                let found = if point == left_out && replicate == 2 {
                    String::new()
                } else {
                    inch((measured[k] * 1e5).round() / 1e5)
                };
                text += &format!(
                    "{point};{axis};{replicate};{};{found};0,1;0\n",
                    inch(nominal[k])
                );
            }
        }
    }
    text
}

pub fn answer(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, &[arguments, &["--format", "json"]].concat());
    assert_eq!(out.status, 0, "{}", out.stderr);
    let mut answer: Value = serde_json::from_str(&out.stdout).unwrap();
    answer.as_object_mut().unwrap().remove("provenance");
    answer
}

/// Equal but for rounding: the tables are printed to 0.01 µm or finer.
#[track_caller]
fn alike(a: &Value, b: &Value, at: &str) {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            // Epsilons: differences of coordinates of 200 mm, µm, through a fit.
            assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()), "{at}: {a} and {b}");
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).for_each(|(a, b)| alike(a, b, at));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{at}");
            a.iter()
                .for_each(|(key, value)| alike(value, &b[key], &format!("{at}.{key}")));
        }
        _ => assert_eq!(a, b, "{at}"),
    }
}

#[test]
fn printed_tables_give_what_one_coordinate_a_row_gives() {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        ("points.csv", &points()),
        ("tidy.csv", &tidy(&[("plate", 3e-4)], "H21")),
        ("plate.txt", &grouped(3e-4, "H21")),
    ]);
    let parts = ["machine", "machine.toml", "parts"];
    let tidy = answer(
        &folder,
        &[&parts[..], &["tidy.csv", "--points", "points.csv"]].concat(),
    );
    assert_eq!(tidy["readings"], 2 * (3 * 16 - 1));
    let printed = answer(&folder, &[&parts[..], &["plate.txt"]].concat());
    alike(&tidy, &printed, "grouped");
    folder.write("plate.csv", &by_row(3e-4, "H21"));
    alike(
        &tidy,
        &answer(&folder, &[&parts[..], &["plate.csv"]].concat()),
        "by row",
    );
}

#[test]
fn several_plates_are_diagnosed_from_a_file_each() {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        ("points.csv", &points()),
        (
            "both.csv",
            &tidy(&[("first", 3e-4), ("second", -1e-4)], "H21"),
        ),
        ("first.txt", &grouped(3e-4, "H21")),
        ("second.csv", &by_row(-1e-4, "H21")),
    ]);
    let quick = ["--severity", "0", "--setup", "machine.toml"];
    let tidy = ["diagnose", "both.csv", "--points", "points.csv"];
    let tidy = answer(&folder, &[&tidy[..], &quick].concat());
    let printed = answer(
        &folder,
        &[&["diagnose", "first.txt", "second.csv"][..], &quick].concat(),
    );
    // The last digits that inches leave move probabilities of 10⁻³⁰⁰, and nothing that is said.
    for what in ["kind", "effects", "statement"] {
        assert_eq!(tidy["verdict"][what], printed["verdict"][what], "{what}");
    }
    let named = tidy["verdict"]["effects"].to_string();
    assert!(named.contains("squareness-change"), "{named}");
    let notes = printed["notes"].to_string();
    assert!(
        notes.contains("Part first") && notes.contains("Part second"),
        "{notes}"
    );
}

/// *Limit*: up to 0.02 rad it is told along which axis an error acts; beyond, a plate is refused with its turn.
#[test]
fn a_plate_that_lies_turned_by_too_much_is_refused() {
    let folder = Folder::with(&[("machine.toml", MACHINE), ("points.csv", &points())]);
    let asked = "diagnose plate.csv --setup machine.toml --points points.csv";
    let asked: Vec<&str> = asked.split(' ').collect();
    folder.write("plate.csv", &tidy(&[("plate", 0.019)], ""));
    let out = run(&folder, &asked);
    assert_eq!(out.status, 0, "{}", out.stderr);
    folder.write("plate.csv", &tidy(&[("plate", 0.025)], ""));
    let told = "part plate lies turned by 0.0250 rad against its nominal coordinates";
    bad_input(&folder, &asked, &[told, "beyond 0.02 rad"]);
}

#[test]
fn what_is_wrong_with_a_table_is_told_where() {
    let table = |rows: &str| format!("Report 7\n\nPoint  X nom  Y nom  X act  Y act\n{rows}");
    let folder = Folder::with(&[("machine.toml", MACHINE), ("points.csv", &points())]);
    for (rows, told) in [
        (
            "A 0 0 0.01 0.0.2\n",
            &["plate.txt:4:12", "\"0.0.2\" is not a number"][..],
        ),
        (
            "A 0 0 0.01\n",
            &[
                "plate.txt:4:7",
                "the row has 4 fields",
                "- for what was not measured",
            ],
        ),
        (
            "A 0 0 0.01 0.02\nB x 0 0 0\n",
            &["plate.txt:5:3", "\"x\" is not a number"],
        ),
        ("A 0\n", &["plate.txt:4:3", "the row has 2 fields"]),
        (
            "A 0 0 0.01 0.02\nB 0 0 0.01 0.02 7 8\n",
            &["plate.txt:5:17", "one field a column"],
        ),
        (
            "A 0 0 0.01 0.02\nA 0 0 0.01 0.02\n",
            &[
                "plate.txt:5:1",
                "X of point A is measured twice",
                "replicate",
            ],
        ),
        (
            "A 0 0 0.01 0.02\nA 1 0 - 0.02\n",
            &["plate.txt:5:1", "nominal X = 1 mm here and 0 mm in line 4"],
        ),
        (
            "A 0 0 0.01 0,02\n",
            &["plate.txt:4:12", "mixes decimal marks"],
        ),
        (
            "A 0 0 - -\n",
            &["plate.txt", "nothing in the table was measured"],
        ),
    ] {
        folder.write("plate.txt", &table(rows));
        bad_input(
            &folder,
            &["machine", "machine.toml", "parts", "plate.txt"],
            told,
        );
    }
    folder.write("plate.txt", &table("A 0 0 0.01 0.02\nB 9 0 9.01 0.02\n"));
    folder.write("other.txt", &table("A 1 0 1.01 0.02\n"));
    let parts = ["machine", "machine.toml", "parts", "plate.txt"];
    bad_input(
        &folder,
        &[&parts[..], &["plate.txt"]].concat(),
        &["part plate stands in a file before"],
    );
    bad_input(
        &folder,
        &[&parts[..], &["other.txt"]].concat(),
        &["other.txt", "another nominal position"],
    );
    bad_input(
        &folder,
        &[&parts[..], &["--points", "points.csv"]].concat(),
        &["leave --points out"],
    );
    folder.write("tidy.csv", &tidy(&[("plate", 0.0)], ""));
    bad_input(
        &folder,
        &["machine", "machine.toml", "parts", "tidy.csv"],
        &["tidy.csv", "--points"],
    );
    bad_input(
        &folder,
        &["machine", "machine.toml", "parts", "nowhere.txt"],
        &["nowhere.txt", "cannot be read"],
    );
    let out = run(&folder, &["diagnose", "plate.txt"]);
    assert!(
        out.status == 2 && out.stderr.contains("--setup MODEL.toml"),
        "{}",
        out.stderr
    );
    folder.write("a.csv", "x,y\n0,0\n1,1\n");
    bad_input(
        &folder,
        &["diagnose", "a.csv", "a.csv", "--model", "circle"],
        &["belong to parts, not to circle"],
    );
}

#[test]
fn names_of_several_words_and_rows_that_end_early_are_understood() {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        (
            "plate.txt",
            "Point  X nom  Y nom  X act  Y act\nmm\nHole 1  0 0  0.010 0.020\nHole 2  60 0 - -\nHole 7  0 60\nHole 3  60 60  60.01 59.99\n",
        ),
    ]);
    let found = answer(&folder, &["machine", "machine.toml", "parts", "plate.txt"]);
    let points = found["points"].as_array().unwrap();
    let names: Vec<&str> = points
        .iter()
        .map(|p| p["point"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["Hole 1", "Hole 1", "Hole 3", "Hole 3"]);
    let residual = points[3]["mean_residual"].as_f64().unwrap();
    assert!((residual + 10.0).abs() < 1e-9, "{residual}");
}
