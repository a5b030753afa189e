//! Wrong set-ups, arguments and folders: told with place and remedy, exit status 2, and nothing written.

use std::fs;

use crate::refusal::{GOOD, SETUP, errsep, names, refused, with};
use tempfile::TempDir;

#[test]
fn wrong_setups() {
    let setup = |good: &str, wrong: &str| {
        assert!(SETUP.contains(good));
        SETUP.replacen(good, wrong, 1)
    };
    for (good, wrong, told) in [
        (
            "noise",
            "noize",
            [
                "setup.toml:5:1: unknown key `noize`",
                "did you mean `noise`?",
            ],
        ),
        (
            "[artefact]",
            "[artifact]",
            [
                "setup.toml:1:2: unknown key `artifact`",
                "did you mean `artefact`?",
            ],
        ),
        (
            "\"seed\"",
            "\"sead\"",
            [
                "setup.toml:8:14: unknown value `sead`",
                "did you mean `seed`? Write seed, rigid or untapered",
            ],
        ),
        (
            "\"seed\"",
            "\"rigit\"",
            [
                "setup.toml:8:14: unknown value `rigit`",
                "did you mean `rigid`? Write rigid, seed or untapered",
            ],
        ),
        (
            "\"seed\"",
            "\"ISO 230-1\"",
            ["setup.toml:8:14: unknown value `ISO 230-1`", "help: write "],
        ),
        (
            "42.0",
            "-3.0",
            [
                "setup.toml:2:13: a thickness of -3 mm cannot be",
                "diameter",
            ],
        ),
        (
            "42.0",
            "nan",
            [
                "setup.toml:2:13: a thickness of NaN mm cannot be",
                "diameter",
            ],
        ),
        (
            "42.0",
            "1e200",
            [
                "setup.toml:2:13: a thickness of 1e200 mm cannot be",
                "diameter",
            ],
        ),
        (
            "42.0",
            "\"thick\"",
            [
                "setup.toml:2:13: string \"thick\" where a number belongs",
                "write a number",
            ],
        ),
        (
            "[artefact]",
            "thickness = 42\n[artefact]",
            [
                "setup.toml:1:1: unknown key `thickness`",
                "put it under [artefact]",
            ],
        ),
        (
            "0.02",
            "0.0",
            ["setup.toml:5:9: a noise of 0 um cannot be", "leave it out"],
        ),
        ("= 0.02", "", ["setup.toml:5:", "help: "]),
        (
            "[model]",
            "[columns]\n1A = \"a:furlong\"\n[model]",
            ["setup.toml:8:1: `furlong` is no unit of `1A`", "units are"],
        ),
    ] {
        refused(GOOD.as_bytes(), Some(&setup(good, wrong)), &[], &told);
    }
}

#[test]
fn wrong_arguments() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), GOOD).unwrap();
    for (args, told) in [
        (
            &["reversal", "absent.csv"][..],
            "absent.csv: the file cannot be read",
        ),
        (&["reversal", "."], ".: the file cannot be read"),
        (
            &["reversal", "data.csv", "--setup", "absent.toml"],
            "absent.toml: the set-up cannot be read",
        ),
        (
            &["reversal", "data.csv", "--method", "magic"],
            "possible values: shear, rotation, auto",
        ),
        (
            &["reversal", "data.csv", "--columns", "y=x"],
            "no column holds `y`",
        ),
        (
            &["reversal", "data.csv", "--columns", "x=position"],
            "column `position` is missing",
        ),
        (&["reversal"], "DATA.csv"),
        (&["reversl", "data.csv"], "reversal"),
    ] {
        let output = errsep(folder.path(), args);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.contains(told), "{told:?} is not in:\n{message}");
        assert!(output.stdout.is_empty());
    }
}

/// Even root may not make a folder below a file: that stands for every folder without permission.
#[test]
fn no_permission_on_the_output_folder() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), GOOD).unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (out, told) in [
        ("file/below", "file/below: nothing can be written here"),
        ("file", "file: is a file, not a folder"),
        ("/proc/errsep", "/proc/errsep: nothing can be written here"),
    ] {
        let before = names(folder.path());
        let output = errsep(folder.path(), &["reversal", "data.csv", "--out", out]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(told), "{told:?} is not in:\n{message}");
        assert!(message.contains("help: give --out a folder that you may write to"));
        assert!(output.stdout.is_empty());
        assert_eq!(names(folder.path()), before);
    }
}

#[test]
fn json_is_alone_on_standard_output_and_absent_on_failure() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), with("0.4", "x")).unwrap();
    let output = errsep(folder.path(), &["reversal", "data.csv", "--format", "json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty() && !output.stderr.is_empty());
}
