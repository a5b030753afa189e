//! Tables that are read in many pieces at once: the same readings, and the same messages, as row by row.

use std::fmt::Write;
use std::path::Path;

use errsep::io::reversal::{ReversalData, read};
use errsep::io::source::{Read256, begin_record, digest_of};
use errsep::io::{ColumnMap, Message, TableReader};
use sha2::{Digest, Sha256};

/// How a table may be written.
#[derive(Clone, Copy)]
struct Style {
    mark: &'static str,
    end: &'static str,
    delimiter: char,
    decimal: &'static str,
    quotes: bool,
}

const STYLES: [Style; 6] = [
    Style {
        mark: "",
        end: "\n",
        delimiter: ',',
        decimal: ".",
        quotes: false,
    },
    Style {
        mark: "\u{feff}",
        end: "\r\n",
        delimiter: ',',
        decimal: ".",
        quotes: false,
    },
    Style {
        mark: "",
        end: "\r\n",
        delimiter: ';',
        decimal: ",",
        quotes: false,
    },
    Style {
        mark: "",
        end: "\r",
        delimiter: '\t',
        decimal: ".",
        quotes: false,
    },
    Style {
        mark: "",
        end: "\n",
        delimiter: ';',
        decimal: ",",
        quotes: true,
    },
    Style {
        mark: "",
        end: "\n",
        delimiter: ',',
        decimal: ".",
        quotes: true,
    },
];

/// Rows that take some dozen pieces; whole numbers in the first ones.
const ROWS: usize = 60_000;

/// Value of a row: whole, so that no decimal mark is decided, up to `whole`.
fn value(row: usize, whole: usize) -> f64 {
    let k = row as f64;
    if row < whole {
        k
    } else {
        (1e6 * (0.37 * k).sin()).round() / 1e4
    }
}

fn written(style: Style, whole: usize, spoil: &[(usize, &str)]) -> String {
    let Style {
        mark,
        end,
        delimiter: d,
        decimal,
        quotes,
    } = style;
    let mut text = format!("{mark}channel{d}x{d}reading{end}# a comment{end}");
    for row in 0..ROWS {
        let number = value(row, whole).to_string().replace('.', decimal);
        let number = match spoil.iter().find(|s| s.0 == row) {
            Some((_, other)) => (*other).to_owned(),
            None if quotes && row % 7 == 3 => format!("\"{number}\""),
            None => number,
        };
        if row % 1000 == 10 {
            text += end;
        }
        let blank = if quotes { "" } else { " " };
        let channel = ["1A", "1B"][row % 2];
        write!(text, "{channel}{d}{row}{d}{blank}{number}{end}").unwrap();
    }
    text
}

/// The line in which a row stands: the first line, the comment, and a blank line every thousand rows.
fn line(row: usize) -> usize {
    3 + row + (row + 1000 - 10) / 1000
}

fn with_file<T>(text: &str, then: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.csv");
    std::fs::write(&path, text).unwrap();
    then(&path)
}

fn readings(text: &str) -> Result<ReversalData, Message> {
    with_file(text, |path| read(path, &ColumnMap::default()))
}

#[test]
fn every_dialect_is_read_the_same_in_pieces() {
    for (k, style) in STYLES.into_iter().enumerate() {
        let whole = if k % 2 == 0 { 0 } else { 25_000 };
        let data = readings(&written(style, whole, &[])).unwrap();
        let found = &data.observations.readings;
        assert_eq!(found.len(), ROWS, "style {k}");
        for (row, reading) in found.iter().enumerate() {
            // The very numbers that were written.
            assert_eq!(reading.x, row as f64, "style {k}");
            assert_eq!(reading.value, value(row, whole), "style {k}, row {row}");
            assert_eq!(reading.channel.name(), ["1A", "1B"][row % 2]);
        }
        let first = data.first_reading("1B").unwrap();
        assert_eq!((first.line, first.column), (line(1), 6), "style {k}");
    }
}

#[test]
fn the_first_wrong_row_is_told_of_with_line_and_column() {
    for (k, style) in STYLES.into_iter().enumerate() {
        for wrong in [
            [7, 59_000],
            [23_456, 24_000],
            [41_000, 41_001],
            [59_998, 59_999],
        ] {
            let spoil = wrong.map(|row| (row, "none"));
            let why = readings(&written(style, 0, &spoil)).unwrap_err();
            let place = why.place().unwrap();
            assert_eq!(place.line, line(wrong[0]), "style {k}: {why}");
            let column = format!("1A,{},", wrong[0]).len() + 1;
            assert_eq!(place.column, column, "style {k}: {why}");
            assert!(why.what().contains("\"none\" is not a number"), "{why}");
        }
    }
}

#[test]
fn a_mixed_decimal_mark_is_found_wherever_the_pieces_end() {
    let style = STYLES[2];
    for (whole, other) in [
        (0, 45_000),
        (30_000, 30_005),
        (59_990, 59_999),
        (30_000, 59_999),
    ] {
        let why = readings(&written(style, whole, &[(other, "1.5")])).unwrap_err();
        assert!(why.what().contains("mixes decimal marks"), "{why}");
        assert_eq!(why.place().unwrap().line, line(other), "{why}");
    }
    // The mark of the first number with a fraction holds, though most have another.
    let why = readings(&written(style, 50_000, &[(40_000, "1.5")])).unwrap_err();
    let place = why.place().unwrap();
    assert!(
        why.what().contains("mixes decimal marks") && place.line >= line(50_000),
        "{why}"
    );
    assert!(place.line < line(50_020), "{why}");
}

#[test]
fn readings_given_twice_are_found_in_other_pieces() {
    let style = STYLES[0];
    let mut text = written(style, 0, &[]);
    text += "1B,101,5\n";
    let why = readings(&text).unwrap_err();
    assert_eq!(why.place().unwrap().line, line(ROWS - 1) + 1, "{why}");
    assert!(why.what().contains(&format!("line {}", line(101))), "{why}");
}

#[test]
fn rows_one_by_one_are_those_gathered() {
    for style in STYLES {
        let text = written(style, 1000, &[]);
        let data = readings(&text).unwrap();
        with_file(&text, |path| {
            let mut table = TableReader::open(path).unwrap();
            let (x, reading) = (table.column("x").unwrap(), table.column("reading").unwrap());
            let mut rows = 0;
            while let Some(row) = table.next_row().unwrap() {
                let own = &data.observations.readings[rows];
                assert_eq!(row.number(&x).unwrap(), own.x);
                assert_eq!(row.number(&reading).unwrap(), own.value);
                assert_eq!(row.line(), line(rows));
                rows += 1;
            }
            assert_eq!(rows, ROWS);
            assert_eq!(table.dialect(), data.dialect);
        });
    }
}

#[test]
fn the_digest_is_that_of_all_pieces() {
    let text = written(STYLES[0], 0, &[]);
    let expected = Sha256::digest(text.as_bytes());
    let expected: String = expected.iter().map(|b| format!("{b:02x}")).collect();
    with_file(&text, |path| {
        begin_record(true);
        read(path, &ColumnMap::default()).unwrap();
        assert_eq!(digest_of(path), Read256::Digest(expected));
    });
}

#[test]
fn a_line_without_end_and_a_line_too_long_are_told_of() {
    let text = written(STYLES[0], 0, &[]);
    let data = readings(text.trim_end()).unwrap();
    assert_eq!(data.observations.readings.len(), ROWS);
    let long = format!("{text}1A,{},1\n1A,70001,2\n", "7".repeat(1 << 20));
    let why = readings(&long).unwrap_err();
    assert!(why.what().contains("longer than 1 MiB"), "{why}");
    assert_eq!(why.place().unwrap().line, line(ROWS - 1) + 1);
    let open = format!("{text}1A,70000,\"1\n");
    let why = readings(&open).unwrap_err();
    assert!(why.what().contains("a quote is opened"), "{why}");
    assert_eq!(why.place().unwrap().line, line(ROWS - 1) + 1);
}
