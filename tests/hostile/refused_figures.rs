//! Figures that no measurement has are refused, with the option or the line that holds them.

use crate::command::{Folder, bad_input, run};

#[test]
fn a_standard_deviation_is_not_negative() {
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\nvalue = 1.0\nstd = 0.1\n";
    let folder = Folder::with(&[("m.toml", machine), ("p.csv", "point,x,y\n1,0,0\n")]);
    let kinds: [&[&str]; 7] = [
        &["calibration-line"],
        &["circle"],
        &["four-sensor"],
        &["fourier"],
        &["reversal", "--positions", "9"],
        &["step-diagonal"],
        &["machine", "m.toml", "--points", "p.csv"],
    ];
    for kind in kinds {
        for wrong in ["-1", "nan", "inf", "-1e-300"] {
            let option = format!("--noise={wrong}");
            let arguments = [&["simulate"], kind, &[&option]].concat();
            bad_input(
                &folder,
                &arguments,
                &["is no standard deviation", "help: give --noise"],
            );
        }
        let apart = [&["simulate"], kind, &["--noise", "-1"]].concat();
        bad_input(&folder, &apart, &["--noise -1 is no standard deviation"]);
        let arguments = [&["simulate"], kind, &["--noise=0"]].concat();
        assert_eq!(run(&folder, &arguments).status, 0, "{arguments:?}");
    }
    for option in ["--between=-1", "--within=nan"] {
        bad_input(
            &folder,
            &["simulate", "anova", option],
            &["is no standard deviation"],
        );
    }
    for forms in ["nan,1", "1,inf", "-1,1"] {
        let option = format!("--forms={forms}");
        bad_input(
            &folder,
            &["simulate", "reversal", &option],
            &["--forms", "root mean squares"],
        );
    }
}

#[test]
fn sizes_that_overflow_make_no_data() {
    let folder = Folder::with(&[]);
    for arguments in [
        &[
            "simulate",
            "reversal",
            "--positions",
            "9",
            "--alpha",
            "1e308",
        ][..],
        &[
            "simulate",
            "calibration-line",
            "--slope",
            "1e308",
            "--full-scale",
            "100",
        ],
        &[
            "simulate",
            "circle",
            "--radius",
            "1e308",
            "--centre-x",
            "1.7e308",
        ],
    ] {
        bad_input(&folder, arguments, &["help: "]);
    }
}

#[test]
fn huge_counts_are_refused_before_any_memory_is_taken() {
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\nvalue = 1.0\nstd = 0.1\n";
    let folder = Folder::with(&[("m.toml", machine)]);
    let commands: [&[&str]; 10] = [
        &["simulate", "anova", "--parts"],
        &["simulate", "calibration-line", "--loads"],
        &["simulate", "circle", "--points"],
        &["simulate", "four-sensor", "--points"],
        &["simulate", "fourier", "--samples"],
        &["simulate", "reversal", "--positions"],
        &["simulate", "reversal", "--positions", "9", "--spline"],
        &["simulate", "step-diagonal", "--steps"],
        &["simulate", "machine", "m.toml", "--stations"],
        &[
            "machine",
            "m.toml",
            "circularity",
            "--centre",
            "0,0",
            "--radius",
            "40",
            "--count",
        ],
    ];
    for command in commands {
        for count in ["100000000", "4294967296", "18446744073709551615"] {
            bad_input(&folder, &[command, &[count]].concat(), &["help: "]);
        }
    }
}

#[test]
fn a_plan_says_which_line_cannot_be() {
    let good = "noise = 0.02\ntravel = 300.0\npositions = 7\n";
    let folder = Folder::with(&[]);
    for (plan, told) in [
        (format!("{good}forms = [nan, 1.0]\n"), "p.toml:4:9"),
        (format!("{good}forms = [1.0, inf]\n"), "p.toml:4:9"),
        (format!("{good}forms = [-1.0, 1.0]\n"), "p.toml:4:9"),
        (format!("{good}tilts = [nan, 1.0, 2.0]\n"), "p.toml:4:9"),
        (format!("{good}tilts = [1e300, 1.0, 2.0]\n"), "p.toml:4:9"),
        (format!("{good}repeats = 0\n"), "p.toml:4:11"),
        (good.replace("0.02", "inf"), "p.toml:1:9"),
        (good.replace("0.02", "-1"), "p.toml:1:9"),
        (good.replace("300.0", "nan"), "p.toml:2:10"),
        (good.replace("= 7", "= 4"), "p.toml:3:13"),
        (good.replace("= 7", "= 9007199254740993"), "p.toml:3:13"),
    ] {
        folder.write("p.toml", &plan);
        bad_input(&folder, &["plan", "p.toml"], &[told, "help: "]);
    }
}

#[test]
fn a_speed_that_no_sample_shows_is_no_endless_search() {
    let run = (0..600).map(|i| {
        let time = f64::from(i) * 0.01;
        format!(
            "{time:.2},{:.3},{:.4}\n",
            5.0 * time,
            10.0 * (15.7 * time).sin()
        )
    });
    let data = "time,x,reading\n".to_owned() + &run.collect::<String>();
    let folder = Folder::with(&[("run.csv", &data)]);
    for rpm in ["1e8", "1e300", "0.1"] {
        bad_input(
            &folder,
            &["traces", "run.csv", "--rpm", rpm],
            &["turns a minute", "help: give --rpm as about the speed"],
        );
    }
    let output = crate::command::run(&folder, &["traces", "run.csv", "--rpm", "150"]);
    assert_eq!(output.status, 0, "{}", output.stderr);
}

#[test]
fn what_a_machine_cannot_answer_points_at_its_entry() {
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\nvalue = 1.0\n\n[errors.ECX]\n\
                   table = { positions = [0, 100], values = [0, 1e-5] }\n";
    let folder = Folder::with(&[("m.toml", machine), ("p.csv", "point,x,y\n1,500,0\n")]);
    bad_input(
        &folder,
        &["machine", "m.toml", "predict", "p.csv"],
        &["m.toml:5:", "ECX is tabulated from 0 to 100 mm", "500 mm"],
    );
}

#[test]
fn an_effect_that_cannot_be_points_at_its_lines() {
    let effects = "[[effect]]\nname = \"coolant\"\nsignature = [[0.0, 0.0], [10.0, 1.0]]\n\n\
                   [[effect]]\nname = \"bad\"\nsignature = [[0.0, 0.0], [0.0, 1.0]]\n";
    let folder = Folder::with(&[("e.toml", effects)]);
    let data = run(&folder, &["simulate", "calibration-line", "--loads", "8"]).stdout;
    folder.write("d.csv", &data);
    bad_input(
        &folder,
        &["diagnose", "d.csv", "--effects", "e.toml"],
        &["e.toml:5:", "`bad` needs two or more growing positions"],
    );
}

#[test]
fn a_fault_of_the_setup_has_a_remedy_of_its_own() {
    let folder = Folder::with(&[]);
    for (text, told) in [
        (
            "noise = \"a\"\ntravel = 1.0\npositions = 9\n",
            "help: write a number",
        ),
        ("travel = 1.0\npositions = 9\n", "help: add `noise = …`"),
        ("noise = 1.0\nnoise = 2.0\n", "help: keep one of the two"),
        ("noise 1.0\n", "help: write TOML"),
        (
            "noise = 1.0\ntravel = 1.0\npositions = 9.5\n",
            "help: write a whole number",
        ),
    ] {
        folder.write("p.toml", text);
        bad_input(&folder, &["plan", "p.toml"], &[told, "p.toml:"]);
    }
}

/// A machine whose prediction overflows when it is squared is refused before it is diagnosed: the
/// probabilities ended the program, or it had no end.
#[test]
fn a_prediction_out_of_reach_is_not_diagnosed() {
    let mut parts = "part,point,axis,replicate,value\n".to_owned();
    for part in 1..4 {
        for point in 1..4 {
            for axis in ["x", "y"] {
                for replicate in 1..3 {
                    let value = 0.3 * f64::from(part * point + replicate);
                    parts += &format!("{part},{point},{axis},{replicate},{value}\n");
                }
            }
        }
    }
    let points = "point,x,y,z\n1,10,10,0\n2,28,10,0\n3,60,30,5\n";
    for huge in ["-1e308", "1e200"] {
        let machine = format!(
            "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.1, -0.02]\nstd = 1.0\n[errors.EYX]\nvalue = {huge}\nstd = 1.2\n"
        );
        let files = [
            ("m.toml", machine.as_str()),
            ("parts.csv", parts.as_str()),
            ("p.csv", points),
        ];
        let folder = Folder::with(&files);
        bad_input(
            &folder,
            &[
                "diagnose",
                "parts.csv",
                "--setup",
                "m.toml",
                "--points",
                "p.csv",
            ],
            &["parts.csv", "less what the model makes of it", "help: "],
        );
    }
}

/// Deviations that are rounding of far greater coordinates are no noise of 1e-154.
#[test]
fn a_circle_of_great_coordinates_has_no_less_noise_than_their_rounding() {
    let far = 9_223_372_036_854_775_807_i64;
    let mut points = format!("x,y\n31,{far}\n{far},48\n");
    for k in 0..12 {
        let angle = f64::from(k) * 0.5;
        points += &format!("{},{}\n", 50.0 * angle.cos(), 50.0 * angle.sin());
    }
    let folder = Folder::with(&[("p.csv", &points)]);
    let told = run(&folder, &["diagnose", "p.csv", "--model", "circle"]);
    assert!([0, 1].contains(&told.status), "{}", told.stderr);
    assert!(
        !told.stdout.contains("NaN") && !told.stdout.contains("10⁻¹⁵⁴"),
        "{}",
        told.stdout
    );
}
