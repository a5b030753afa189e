//! Every kind of wrong input to `errsep reversal`: one good file, then one thing wrong at a time. Each
//! is told with file, line, column and remedy, exit status 2, and nothing written.

use std::fs;
use std::path::Path;
use std::process::Output;

use tempfile::TempDir;

const GOOD: &str = "\
# one good file
channel,repeat,direction,time,x,reading
1A,1,forward,0,0,0.1
1A,1,forward,1,10,0.2
1A,1,forward,2,20,0.4
2B,1,forward,3,0,0.1
2B,1,forward,4,10,0.3
2B,1,forward,5,20,0.3
";

const SETUP: &str = "\
[artefact]
thickness = 42.0

[indicator]
noise = 0.02

[model]
convention = \"seed\"
";

fn errsep(folder: &Path, args: &[&str]) -> Output {
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_errsep"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// Runs on these files; a run with bad input must say all of `told` and leave no trace.
fn refused(data: &[u8], setup: Option<&str>, options: &[&str], told: &[&str]) {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), data).unwrap();
    let mut args = vec!["reversal", "data.csv", "--out", "out"];
    if let Some(setup) = setup {
        fs::write(folder.path().join("setup.toml"), setup).unwrap();
        args.extend(["--setup", "setup.toml"]);
    }
    args.extend(options);
    let before = names(folder.path());
    let output = errsep(folder.path(), &args);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told:?}: {message}");
    assert!(output.stdout.is_empty(), "{told:?}");
    for words in told {
        assert!(message.contains(words), "{words:?} is not in:\n{message}");
    }
    assert!(message.contains("help: "), "no remedy in:\n{message}");
    assert_eq!(names(folder.path()), before, "{told:?}");
}

fn names(folder: &Path) -> Vec<String> {
    let mut names = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect::<Vec<_>>();
    names.sort();
    names
}

/// The good file with one thing wrong.
fn with(good: &str, wrong: &str) -> Vec<u8> {
    assert!(GOOD.contains(good));
    GOOD.replacen(good, wrong, 1).into_bytes()
}

#[test]
fn the_good_file_is_good() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), GOOD).unwrap();
    fs::write(folder.path().join("setup.toml"), SETUP).unwrap();
    let output = errsep(
        folder.path(),
        &[
            "reversal",
            "data.csv",
            "--setup",
            "setup.toml",
            "--out",
            "out",
        ],
    );
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let written = names(&folder.path().join("out"));
    assert_eq!(written, ["profiles.csv", "report.html", "result.json"]);
}

#[test]
fn wrong_columns() {
    for (good, wrong, told) in [
        (
            "x,reading",
            "x,readng",
            [
                "data.csv:2:33: unknown column `readng`",
                "did you mean `reading`?",
            ],
        ),
        (
            ",x,",
            ",position,",
            [
                "data.csv:2:31: unknown column `position`",
                "remove it; columns may be channel",
            ],
        ),
        (
            "channel,",
            "x,",
            [
                "data.csv:2:25: column `x` is named twice",
                "keep one of the two",
            ],
        ),
        (
            "channel,",
            ",",
            ["data.csv:2:1: column 1 has no name", "name every column"],
        ),
        (
            "# one good file\nchannel,repeat,direction,time,x,reading\n",
            "",
            [
                "data.csv:1:1: the first line holds numbers",
                "names the columns",
            ],
        ),
        (
            "x,reading",
            "x,1A",
            [
                "data.csv:2:33: column 1A beside `channel` or `reading`",
                "not both",
            ],
        ),
    ] {
        refused(&with(good, wrong), None, &[], &told);
    }
    // A column that is not there at all.
    let tidy = "channel,x\n1A,0\n";
    refused(
        tidy.as_bytes(),
        None,
        &[],
        &[
            "data.csv:1:1: column `reading` is missing",
            "the file has channel or x",
        ],
    );
    let numbers = "1,2,3\n4,5,6\n";
    refused(
        numbers.as_bytes(),
        None,
        &[],
        &[
            "data.csv:1:1: the first line holds numbers",
            "names the columns",
        ],
    );
}

#[test]
fn wrong_fields() {
    for (good, wrong, told) in [
        (
            "2,20,0.4",
            "2,20,abc",
            [
                "data.csv:5:19: reading \"abc\" is not a number",
                "such as 1.25",
            ],
        ),
        (
            "2,20,0.4",
            "2,20,NaN",
            [
                "data.csv:5:19: reading is \"NaN\", not a finite number",
                "remove the row",
            ],
        ),
        (
            "2,20,0.4",
            "2,20,1e999",
            ["data.csv:5:19: reading is \"1e999\"", "remove the row"],
        ),
        (
            "2,20,0.4",
            "2,20,",
            ["data.csv:5:19: reading is missing", "remove the row"],
        ),
        (
            "2,20,0.4",
            "2,inf,0.4",
            ["data.csv:5:16: x is \"inf\"", "remove the row"],
        ),
        (
            "2,20,0.4",
            "2,20,0.4 µm",
            [
                "data.csv:5:19: reading \"0.4 µm\" is not a number",
                "without unit",
            ],
        ),
        (
            "2,20,0.4",
            "2,20",
            ["data.csv:5:16: the row has 5 fields", "one field a column"],
        ),
        (
            "2,20,0.4",
            "2,20,0.4,7",
            [
                "data.csv:5:23: the row has 7 fields",
                "decimals with a point",
            ],
        ),
        (
            "1A,1,forward,2",
            "3A,1,forward,2",
            ["data.csv:5:1: unknown channel `3A`", "1A, 1B, 2A or 2B"],
        ),
        (
            "1A,1,forward,2",
            "1a,1,forward,2",
            ["data.csv:5:1: unknown channel `1a`", "write `1A`"],
        ),
        (
            "1A,1,forward,2",
            ",1,forward,2",
            ["data.csv:5:1: channel is missing", "1A, 1B, 2A or 2B"],
        ),
        (
            "1A,1,forward,2",
            "1A,0,forward,2",
            [
                "data.csv:5:4: repeat \"0\" is not a whole number from 1",
                "1, 2, 3",
            ],
        ),
        (
            "1A,1,forward,2",
            "1A,1,up,2",
            ["data.csv:5:6: unknown direction `up`", "forward"],
        ),
        (
            "1A,1,forward,2",
            "1A,1,forward,now",
            [
                "data.csv:5:14: time \"now\" is not a number",
                "such as 1.25",
            ],
        ),
        (
            "1A,1,forward,2",
            "1A,1,\"forward,2",
            [
                "data.csv:5:6: a quote is opened and not closed",
                "close the quote",
            ],
        ),
    ] {
        refused(&with(good, wrong), None, &[], &told);
    }
}

#[test]
fn duplicate_rows() {
    let twice = with("1A,1,forward,2,20,0.4\n", "1A,1,forward,1,10,0.2\n");
    refused(
        &twice,
        None,
        &[],
        &[
            "data.csv:5:1: channel 1A at x = 10 mm was read in line 4 already",
            "column `repeat`",
        ],
    );
}

#[test]
fn files_that_are_no_tables() {
    refused(
        b"",
        None,
        &[],
        &["data.csv:1:1: the file is empty", "names the columns"],
    );
    refused(
        b"# only a comment\n\n",
        None,
        &[],
        &["data.csv:1:1: the file is empty"],
    );
    refused(
        b"channel,x,reading\n",
        None,
        &[],
        &[
            "data.csv:1:1: the file names columns but has no row",
            "add the data",
        ],
    );
    refused(
        b"\x7fELF\x02\x01\x00\x00",
        None,
        &[],
        &[
            "data.csv:1:1: the file is not text: byte 5 is 0x02",
            "plain text",
        ],
    );
    refused(
        b"\xff\xfec\0h\0",
        None,
        &[],
        &["data.csv:1:1: the file is UTF-16", "UTF-8"],
    );
    refused(
        &with("0.4", "0.4\0"),
        None,
        &[],
        &["data.csv:1:1: the file is not text", "plain text"],
    );
    refused(
        b"channel,x,reading\n1A,0,\xe9\n",
        None,
        &[],
        &["data.csv:1:1: the file is not text", "plain text"],
    );
    let mut late = GOOD.as_bytes().to_vec();
    for i in 0..20_000 {
        late.extend(format!("1B,1,forward,{i},{i},0\n").bytes());
    }
    let lines = late.iter().filter(|&&b| b == b'\n').count();
    late.extend(b"1B,1,forward,1,\xff,0\n");
    let place = format!(
        "data.csv:{}:1: byte 16 of the line (0xFF) is not text",
        lines + 1
    );
    refused(&late, None, &[], &[&place, "plain text"]);
}

#[test]
fn readings_that_determine_nothing() {
    let wide = "x,1A,1B\n0,1,\n1,2,\n2,4,\n";
    refused(
        wide.as_bytes(),
        None,
        &[],
        &[
            "data.csv:1:6: channel 1B has a column but no reading",
            "remove it",
        ],
    );
    let one_place = "x,1A,repeat\n5,1,1\n5,2,2\n5,4,3\n";
    refused(
        one_place.as_bytes(),
        None,
        &[],
        &[
            "data.csv:2:3: channel 1A has readings at 1 different positions",
            "three or more",
        ],
    );
    let few = "x,1A,2B\n0,1,1\n1,2,1\n";
    refused(
        few.as_bytes(),
        None,
        &[],
        &[
            "data.csv:2:3: channel 1A has readings at 2 different positions",
            "three or more",
        ],
    );
    let steep = "x,1A\n0,0\n1,1100\n2,2200\n";
    for options in [&[][..], &["--simultaneous"]] {
        refused(
            steep.as_bytes(),
            None,
            options,
            &[
                "data.csv:2:3: the readings of channel 1A climb at 47.7 degrees",
                "--columns",
            ],
        );
    }
    let apart = "x,1A,2B\n0,1,\n1,2,\n2,3,\n7,,1\n8,,1\n9,,1\n";
    refused(
        apart.as_bytes(),
        None,
        &[],
        &[
            "data.csv: the traces have 0 positions in common",
            "same stretch",
        ],
    );
}

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
                "did you mean `seed`?",
            ],
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
            "\"thick\"",
            ["setup.toml:2:13: invalid type: string", "--help"],
        ),
        (
            "0.02",
            "0.0",
            ["setup.toml:5:9: a noise of 0 um cannot be", "leave it out"],
        ),
        ("= 0.02", "", ["setup.toml:5:", "--help"]),
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
            &["reversal", "data.csv", "--columns", "y=q"],
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
