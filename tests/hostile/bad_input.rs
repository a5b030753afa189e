//! Every kind of wrong data to `errsep reversal`: one good file, then one thing wrong at a time. Each
//! is told with file, line, column and remedy, exit status 2, and nothing written.

use std::fs;

use crate::refusal::{GOOD, SETUP, errsep, names, refused, with};
use tempfile::TempDir;

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
                "such as x=position",
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
    // Lines before the one that names the columns.
    let preamble = [b"Instrument: XY\nDate: today\n", GOOD.as_bytes()].concat();
    refused(
        &preamble,
        None,
        &[],
        &[
            "data.csv:1:1: unknown column `Instrument: XY`",
            "before the one that names the columns, remove them or begin them with #",
        ],
    );
    refused(
        &with("x,reading", "x,X"),
        None,
        &[],
        &["data.csv:2:33: column `x` is named twice", "rename one"],
    );
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
            "3A,1,forward,2",
            [
                "data.csv:5:1: unknown channel `3A`",
                "write 1A, 1B, 2A or 2B",
            ],
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
            "1A,1,forward,08:00:02",
            [
                "data.csv:5:14: time \"08:00:02\" is not a number",
                "seconds since the first reading",
            ],
        ),
        (
            "1A,1,forward,2",
            "1A,1,forward,2026-11-29T08:00:02",
            ["data.csv:5:14: time", "seconds since the first reading"],
        ),
        (
            "2,20,0.4",
            "2,20,1e308",
            [
                "data.csv:5:19: a reading of 1e308 cannot be worked with",
                "remove the row",
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
            "data.csv:1:5: the file is not text: this byte is 0x02",
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
        &["data.csv:5:22: the file is not text", "plain text"],
    );
    refused(
        b"channel,x,reading (\xb5m)\n1A,0,1\n",
        None,
        &[],
        &[
            "data.csv:1:20: the file is not text",
            "save the file as UTF-8",
        ],
    );
    refused(
        b"channel,x,reading\n1A,0,\xe9\n",
        None,
        &[],
        &[
            "data.csv:2:6: the file is not text",
            "save the file as UTF-8",
        ],
    );
    let mut late = GOOD.as_bytes().to_vec();
    for i in 0..20_000 {
        late.extend(format!("1B,1,forward,{i},{i},0\n").bytes());
    }
    let lines = late.iter().filter(|&&b| b == b'\n').count();
    late.extend(b"1B,1,forward,1,\xff,0\n");
    let place = format!("data.csv:{}:16: this byte (0xFF) is not text", lines + 1);
    refused(&late, None, &[], &[&place, "as UTF-8"]);
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
