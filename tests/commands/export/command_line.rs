//! The command: which results it takes, what it writes beside, what it replaces.

use std::collections::BTreeMap;

use crate::command::{Folder, bad_input, run};
use serde_json::Value;

const MACHINE: &str = "\
chain = \"XYFZ\"
[errors.EXX]
polynomial = [0.1, 0.02]
[errors.EYX]
table = { positions = [0, 100, 200], values = [0, 1.5, 3.0] }
[errors.C0Y]
readings = [-3.4e-5, -3.1e-5, -3.6e-5]
";

fn with_results() -> Folder {
    let folder = Folder::with(&[
        ("machine.toml", MACHINE),
        ("points.csv", "point,x,y\na,10,10\nb,90,15\n"),
        (
            "profile.csv",
            "x,deviation\n0,-0.31\n50,0.2\n100,0.93\n150,0.4\n200,0.11\n",
        ),
        ("circle.csv", "x,y\n0,0\n1,0\n0,1\n1.1,1\n"),
    ]);
    for (name, arguments) in [
        ("positions.csv", "simulate positioning --targets 6"),
        (
            "steps.csv",
            "simulate step-diagonal --steps 2 --target retro-reflector",
        ),
        ("traces.csv", "simulate reversal --positions 11"),
    ] {
        let out = run(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(out.status, 0, "{}", out.stderr);
        folder.write(name, &out.stdout);
    }
    for (name, arguments) in [
        ("positioning.json", "positioning positions.csv"),
        ("straightness.json", "straightness profile.csv"),
        ("reversal.json", "reversal traces.csv"),
        ("circle.json", "circle circle.csv"),
        ("steps.json", "step-diagonal steps.csv"),
        ("machine.json", "machine machine.toml predict points.csv"),
    ] {
        let arguments = format!("{arguments} --format json");
        let out = run(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(out.status, 0, "{arguments}: {}", out.stderr);
        folder.write(name, &out.stdout);
    }
    folder
}

fn done(folder: &Folder, arguments: &str) -> String {
    let words: Vec<&str> = arguments.split(' ').collect();
    let out = run(folder, &words);
    assert_eq!(out.status, 0, "{arguments}: {}", out.stderr);
    out.stdout
}

#[test]
fn results_become_files() {
    let folder = with_results();
    for (arguments, inside) in [
        ("linuxcnc positioning.json --out a", "0.000000 "),
        (
            "isg-leadscrew positioning.json --axis 3 --out b",
            "kopf.log_achs_nr 3",
        ),
        (
            "siemens-eec positioning.json --axis X --out c",
            "$AA_ENC_COMP[0,5,X1]=",
        ),
        (
            "siemens-cec straightness.json --axis X:Z --out d",
            "$AN_CEC[0,4]=",
        ),
        (
            "siemens-cec reversal.json --axis Z1:X1 --out e",
            "$AN_CEC[0,10]=",
        ),
        (
            "isg-volumetric steps.json --out f",
            "X EXX EYX EZX EAX EBX ECX\n0.0000000 ",
        ),
        (
            "etalon machine.json --out g",
            "[EYX]\nGridpoints = {\n0.0000000 0.0000000\n100.0000000 0.0015000\n",
        ),
        (
            "etalon machine.toml --out h",
            "[C0Y]\nVALUE = -0.0000336667\n",
        ),
        (
            "csv steps.json --out i",
            "error,axis,position_mm,value,unit",
        ),
        ("klipper steps.json --out j", "SET_SKEW XY="),
        (
            "marlin machine.json --out k",
            "M852 I0.000033667 J0.000000000 K0.000000000",
        ),
        (
            "reprapfirmware machine.toml --out l",
            "M556 S100 X-0.0033667",
        ),
        (
            "marlin-backlash positioning.json --axis X --out p",
            "M425 X0.0",
        ),
        (
            "reprapfirmware-backlash positioning.json --axis X --out q",
            "M425 X0.0",
        ),
    ] {
        let told = done(&folder, &format!("export {arguments}"));
        let name = &arguments[arguments.len() - 1..];
        let text = folder.read(name);
        assert!(text.contains(inside), "{arguments}: {text}");
        let about: Value =
            serde_json::from_str(&folder.read(&format!("{name}.about.json"))).unwrap();
        crate::command::documented(&about, "docs/json/export.md");
        assert_eq!(about["schema"], "errsep.export/1");
        for part in [about["sign"].as_str(), about["verify"].as_str()] {
            assert!(
                part.is_some_and(|p| !p.is_empty() && told.contains(p)),
                "{about}"
            );
        }
        assert_eq!(about["result"]["sha256"].as_str().unwrap().len(), 64);
    }
    // A result of machine holds the same errors as its file.
    assert_eq!(folder.read("g"), folder.read("h"));
    let about: Value = serde_json::from_str(&folder.read("g.about.json")).unwrap();
    assert_eq!(
        about["moves"],
        "X table-carrying, Y table-carrying, Z tool-carrying"
    );
    assert_eq!(about["not_exported"][0]["name"], "EZX");
    let json = done(
        &folder,
        "export linuxcnc positioning.json --out m --format json",
    );
    let json: Value = serde_json::from_str(&json).unwrap();
    crate::command::documented(&json, "docs/json/export.md");
    assert_eq!(json["format"], "linuxcnc");
    assert_eq!(
        json["provenance"]["inputs"][0]["sha256"],
        json["result"]["sha256"]
    );
}

/// The list as the controller reads it: a key and its value a line, `#` a comment, no key twice.
fn controllers_list(text: &str) -> BTreeMap<String, String> {
    let mut list = BTreeMap::new();
    for line in text.lines().map(|l| l.split('#').next().unwrap().trim()) {
        if let Some((key, value)) = line.split_once(char::is_whitespace) {
            let before = list.insert(key.to_owned(), value.trim().to_owned());
            assert!(before.is_none(), "{key} twice");
        } else {
            assert!(line.is_empty(), "{line} has no value");
        }
    }
    list
}

/// The list names the file, its format, the axes and, of a machine whose chain is known, the chain from the
/// workpiece to the tool with the number of axes that carry the workpiece.
#[test]
fn the_list_of_isg_finds_its_file() {
    let folder = with_results();
    for (source, file, chain) in [
        ("machine.toml", "x.csv", Some(("XYZ", "2"))),
        ("machine.json", "y.csv", Some(("XYZ", "2"))),
        ("steps.json", "z.csv", None),
    ] {
        let told = done(
            &folder,
            &format!("export isg-volumetric {source} --out {file}"),
        );
        let list = controllers_list(&folder.read(&format!("{file}.lis")));
        let of = |key: &str| list.get(key).map(String::as_str);
        assert_eq!(of("file[0]"), Some(file));
        assert!(folder.path().join(of("file[0]").unwrap()).is_file());
        assert_eq!(of("file_format[0]"), Some("ISG_CSV"));
        assert_eq!(["X", "Y", "Z"].map(of), [Some("1"), Some("2"), Some("3")]);
        assert_eq!(of("chain").zip(of("workpiece_axes")), chain, "{source}");
        assert_eq!(list.len(), if chain.is_some() { 7 } else { 5 }, "{list:?}");
        assert!(told.contains(&format!("{file}.lis")), "{told}");
        let about: Value =
            serde_json::from_str(&folder.read(&format!("{file}.about.json"))).unwrap();
        assert_eq!(about["list"], format!("{file}.lis"));
    }
    // What is there already stays, and nothing else is written.
    folder.write("w.csv.lis", "mine");
    let arguments = "export isg-volumetric machine.toml --out w.csv";
    let words: Vec<&str> = arguments.split(' ').collect();
    bad_input(&folder, &words, &["w.csv.lis", "exists already"]);
    assert_eq!(folder.read("w.csv.lis"), "mine");
    assert!(
        !folder.path().join("w.csv").exists() && !folder.path().join("w.csv.about.json").exists()
    );
    bad_input(
        &folder,
        &["export", "isg-volumetric", "machine.toml", "--out", "a b"],
        &["white space"],
    );
}

#[test]
fn a_result_of_the_wrong_kind_names_what_takes_it() {
    let folder = with_results();
    for (arguments, expected) in [
        (
            "linuxcnc straightness.json",
            &[
                "linuxcnc takes a result of errsep positioning; this is errsep.straightness/1",
                "is taken by siemens-cec or dcc",
            ][..],
        ),
        (
            "klipper positioning.json",
            &[
                "is taken by linuxcnc, isg-leadscrew, siemens-eec, marlin-backlash, \
               reprapfirmware-backlash or dcc",
            ],
        ),
        (
            "siemens-cec steps.json",
            &["is taken by isg-volumetric, etalon, csv, klipper, marlin, reprapfirmware or dcc"],
        ),
        (
            "linuxcnc circle.json",
            &[
                "linuxcnc takes a result of errsep positioning",
                "errsep.circle/1 is taken by dcc",
            ],
        ),
        (
            "linuxcnc anova.json",
            &[
                "no format takes a result errsep.anova/1",
                "dcc takes a result of errsep reversal",
            ],
        ),
        ("linuxcnc machine.toml", &["this is a machine"]),
        ("dcc machine.toml", &["dcc takes", "this is a machine"]),
        ("dcc circle.json", &["needs --admin", "admin.toml"]),
        (
            "linuxcnc positioning.json --admin a.toml",
            &["no use for --admin"],
        ),
        (
            "lixuncnc positioning.json",
            &["no format `lixuncnc`", "did you mean `linuxcnc`"],
        ),
        ("linuxcnc nothing.json", &["nothing.json", "cannot be read"]),
        ("linuxcnc broken.json", &["broken.json", "no JSON"]),
        (
            "etalon profile.csv",
            &["profile.csv", "no JSON", "a machine as .toml"],
        ),
        ("linuxcnc other.json", &["no result of errsep"]),
        (
            "siemens-cec formless.json --axis X:Z",
            &["errsep.reversal/1 lacks what a controller needs"],
        ),
        (
            "dcc numberless.json",
            &["errsep.machine/1 lacks the numbers that a certificate states"],
        ),
        ("linuxcnc empty.json", &["lacks what a controller needs"]),
        ("siemens-cec straightness.json", &["--axis X:Z"]),
        (
            "siemens-cec straightness.json --axis X:X",
            &["across itself"],
        ),
        ("siemens-eec positioning.json --step 30", &["do not end"]),
        ("linuxcnc positioning.json --reference NaN", &["not finite"]),
        (
            "linuxcnc positioning.json --travel X=5:1",
            &["AXIS=FROM:TO"],
        ),
        ("marlin steps.json --points 5", &["no use for --points"]),
    ] {
        folder.write("broken.json", "{\"schema\":");
        folder.write("other.json", "{\"a\": 1}");
        let formless = r#"{"schema": "errsep.reversal/1", "tilts": {}, "forms": {"x": [0, 1], "M": null, "S_A": [1, 2]}}"#;
        folder.write("formless.json", formless);
        let numberless =
            r#"{"schema": "errsep.machine/1", "action": "parts", "chain": "XYFZ", "errors": []}"#;
        folder.write("numberless.json", numberless);
        folder.write("anova.json", "{\"schema\": \"errsep.anova/1\"}");
        folder.write("empty.json", "{\"schema\": \"errsep.positioning/1\"}");
        let words = format!("export {arguments} --out out");
        bad_input(&folder, &words.split(' ').collect::<Vec<_>>(), expected);
        assert!(
            !folder.path().join("out.about.json").exists(),
            "{arguments}"
        );
    }
}

#[test]
fn nothing_is_replaced_unless_that_is_asked_for() {
    let folder = with_results();
    let export = "export linuxcnc positioning.json --out x.comp";
    folder.write("x.comp", "mine");
    let words: Vec<&str> = export.split(' ').collect();
    bad_input(&folder, &words, &["x.comp", "exists already"]);
    assert_eq!(folder.read("x.comp"), "mine");
    assert!(!folder.path().join("x.comp.about.json").exists());
    done(&folder, &format!("{export} --force"));
    assert!(folder.read("x.comp").starts_with("0.000000 "));
    // The side file alone is in the way, too.
    std::fs::remove_file(folder.path().join("x.comp")).unwrap();
    bad_input(&folder, &words, &["x.comp.about.json", "exists already"]);
    assert!(!folder.path().join("x.comp").exists());
    // The result itself is never replaced, by whatever name.
    let own = [
        "export",
        "linuxcnc",
        "positioning.json",
        "--out",
        "./positioning.json",
        "--force",
    ];
    bad_input(&folder, &own, &["is the result that is to be exported"]);
    bad_input(
        &folder,
        &[
            "export",
            "linuxcnc",
            "positioning.json",
            "--out",
            ".",
            "--force",
        ],
        &["no file"],
    );
    bad_input(
        &folder,
        &[
            "export",
            "linuxcnc",
            "positioning.json",
            "--out",
            "no/x.comp",
        ],
        &["cannot be written"],
    );
    let left: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|n| n.starts_with('.'))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// The judge of `examples/linuxcnc/prove` on readings with and without compensation; the controller itself
/// runs where it is asked for.
#[cfg(unix)]
#[test]
fn the_proof_on_the_controller_can_fail() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/linuxcnc");
    let python = |arguments: &[&str]| {
        std::process::Command::new("python3")
            .args(arguments)
            .output()
    };
    let Ok(version) = python(&["--version"]) else {
        println!("skipped: python3 is not there");
        return;
    };
    assert!(version.status.success());
    let shell = std::process::Command::new("bash")
        .arg("-n")
        .arg(root.join("prove"))
        .status();
    assert!(shell.is_ok_and(|s| s.success()));
    // Five readings a target with a known noise; what is left afterwards is their mean with the other sign.
    let noises = [0.4, -0.9, 0.3, 0.8, -0.1];
    let (mut before, mut after) = (String::new(), String::new());
    for i in 0..11 {
        for direction in ["forward", "backward"] {
            let target = f64::from(30 * i);
            let error = 0.003 * f64::from(i);
            let own = |run: i32| {
                let shift = [0.0, 0.45, -0.45][(i % 3) as usize];
                (noises[((run + i) % 5) as usize] + shift) * 1e-3
            };
            let mean = (0..5).map(own).sum::<f64>() / 5.0;
            for run in 0..5 {
                let read = target + error + own(run);
                before += &format!("{target},{run},{direction},{read},{error}\n");
                after += &format!("{target},{run},{direction},{},{}\n", target - mean, -mean);
            }
        }
    }
    let header = "target,run,direction,position,error\n";
    let folder = Folder::with(&[
        ("before.csv", &(header.to_owned() + &before)),
        ("after.csv", &(header.to_owned() + &after)),
    ]);
    let judge = root.join("judge.py");
    let judged = |second: &str| {
        let path = |name: &str| folder.path().join(name).display().to_string();
        python(&[
            &judge.display().to_string(),
            &path("before.csv"),
            &path(second),
        ])
        .unwrap()
    };
    let good = judged("after.csv");
    let told = String::from_utf8_lossy(&good.stdout).into_owned();
    assert!(
        good.status.success() && told.contains("what is left is the noise"),
        "{told}"
    );
    let bad = judged("before.csv");
    assert_eq!(
        bad.status.code(),
        Some(1),
        "{}",
        String::from_utf8_lossy(&bad.stdout)
    );

    if std::env::var_os("ERRSEP_LINUXCNC").is_none() {
        println!("skipped: the controller itself (set ERRSEP_LINUXCNC=1)");
        return;
    }
    let whole = std::process::Command::new(root.join("prove"))
        .env("ERRSEP", env!("CARGO_BIN_EXE_errsep"))
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&whole.stdout).into_owned();
    assert!(
        whole.status.success() && told.contains("what is left is the noise"),
        "{told}"
    );
}
