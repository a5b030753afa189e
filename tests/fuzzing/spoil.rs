//! What is done to a good input.

use std::collections::BTreeMap;

use proptest::prelude::*;
use proptest::sample::{Index, select};

/// Texts that stand where a number or a name is meant.
const TEXTS: &[&str] = &[
    "",
    " ",
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-200",
    "-0",
    "0",
    "-1",
    "1",
    "2",
    "1e9",
    "1e15",
    "1e155",
    "4294967296",
    "18446744073709551615",
    "9223372036854775808",
    "1,5",
    "1.5.2",
    "0x10",
    "٣",
    "½",
    "true",
    "\"",
    "'",
    "#",
    "é\u{202e}",
    "\u{1b}[31m",
    "\u{9b}",
    "=1+1",
    "../x",
    "a",
    "1A",
    "x",
    "XYZ",
    "backward",
];

/// Values of a set-up.
const VALUES: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "0",
    "-1",
    "1",
    "1e308",
    "1e-300",
    "1e155",
    "5e-324",
    "65536",
    "100000",
    "4294967295",
    "9223372036854775807",
    "\"x\"",
    "\"\"",
    "[]",
    "[1]",
    "[nan, nan, nan]",
    "[0, 0, 0]",
    "[1e300, 1e-300, 1]",
    "{}",
    "{ a = 1 }",
    "true",
    "1979-05-27",
    "[[]]",
    "\"rigid\"",
    "\"none\"",
    "\"\\u001b[31m\"",
];

/// Options with a value; a command that does not know one says so.
const OPTIONS: &[&str] = &[
    "--seed",
    "--noise",
    "--confidence",
    "--length",
    "--window",
    "--rpm",
    "--angle",
    "--trials",
    "--radius",
    "--count",
    "--centre",
    "--plane",
    "--between",
    "--method",
    "--without",
    "--columns",
    "--effect",
    "--points",
    "--positions",
    "--parts",
    "--replicates",
    "--steps",
    "--stations",
    "--samples",
    "--loads",
    "--sets",
    "--repeats",
    "--spline",
    "--arc",
    "--outliers",
    "--lobe",
    "--spacing",
    "--interval",
    "--thickness",
    "--alpha",
    "--forms",
    "--false-alarm",
];

/// One change.
#[derive(Debug, Clone)]
pub enum Spoil {
    /// A field of a table, or a value of a set-up.
    Field(Index, Index, Index, &'static str, &'static str),
    /// All fields of a column.
    Column(Index, Index, &'static str),
    /// The numbers of a column times one figure plus another.
    Scale(Index, Index, f64, f64),
    /// Rows are left out: of every so many.
    Thin(Index, usize, usize),
    /// Few rows are left.
    Few(Index, usize),
    /// A row or line taken out, doubled or moved.
    Line(Index, Index, Index, u8),
    /// A byte.
    Byte(Index, Index, u8, u8),
    /// The end is missing.
    Cut(Index, Index),
    /// One character in place of another throughout.
    Throughout(Index, u8, &'static str),
    /// An option with a value.
    Option(&'static str, &'static str),
    /// The value of an option that is there.
    Value(Index, &'static str),
}

/// Any of the changes.
pub fn any_spoil() -> impl Strategy<Value = Spoil> {
    let i = any::<Index>;
    let factor = select(vec![
        1e-300, 1e-150, 1e-12, 0.0, -1.0, 1e-3, 1e6, 1e12, 1e150, 1e300,
    ]);
    let shift = select(vec![0.0, 0.0, 1e3, 1e9, 1e15]);
    prop_oneof![
        4 => (i(), i(), i(), select(TEXTS), select(VALUES))
            .prop_map(|(f, r, c, t, v)| Spoil::Field(f, r, c, t, v)),
        1 => (i(), i(), select(TEXTS)).prop_map(|(f, c, t)| Spoil::Column(f, c, t)),
        4 => (i(), i(), factor, shift).prop_map(|(f, c, a, b)| Spoil::Scale(f, c, a, b)),
        2 => (i(), 2..9_usize, 0..9_usize).prop_map(|(f, n, k)| Spoil::Thin(f, n, k)),
        2 => (i(), 0..6_usize).prop_map(|(f, n)| Spoil::Few(f, n)),
        2 => (i(), i(), i(), 0..3_u8).prop_map(|(f, a, b, h)| Spoil::Line(f, a, b, h)),
        2 => (i(), i(), any::<u8>(), 0..3_u8).prop_map(|(f, a, b, h)| Spoil::Byte(f, a, b, h)),
        1 => (i(), i()).prop_map(|(f, a)| Spoil::Cut(f, a)),
        1 => (i(), select(b",.\n-1".to_vec()), select(vec![";", "\t", " ", "\r", ",,", "\r\n", ""]))
            .prop_map(|(f, a, b)| Spoil::Throughout(f, a, b)),
        2 => (select(OPTIONS), select(TEXTS)).prop_map(|(o, v)| Spoil::Option(o, v)),
        2 => (i(), select(TEXTS)).prop_map(|(a, v)| Spoil::Value(a, v)),
    ]
}

/// Carries out a change.
pub fn apply(
    spoil: &Spoil,
    arguments: &mut Vec<String>,
    files: &mut BTreeMap<&'static str, Vec<u8>>,
) {
    match spoil {
        Spoil::Option(option, value) => {
            arguments.extend([(*option).to_owned(), (*value).to_owned()]);
        }
        Spoil::Value(which, value) => {
            let after_option = |i: &usize| arguments[*i - 1].starts_with("--");
            let values: Vec<usize> = (1..arguments.len()).filter(after_option).collect();
            if !values.is_empty() {
                arguments[*which.get(&values)] = (*value).to_owned();
            }
        }
        Spoil::Field(file, ..)
        | Spoil::Column(file, ..)
        | Spoil::Scale(file, ..)
        | Spoil::Thin(file, ..)
        | Spoil::Few(file, ..)
        | Spoil::Line(file, ..)
        | Spoil::Byte(file, ..)
        | Spoil::Cut(file, ..)
        | Spoil::Throughout(file, ..) => {
            let names: Vec<&'static str> = files.keys().copied().collect();
            if names.is_empty() {
                return;
            }
            let name = *file.get(&names);
            if let Some(bytes) = files.get_mut(name) {
                *bytes = spoilt(spoil, bytes, name.ends_with(".toml"));
            }
        }
    }
}

fn spoilt(spoil: &Spoil, bytes: &[u8], is_setup: bool) -> Vec<u8> {
    let mut raw = bytes.to_vec();
    match spoil {
        Spoil::Byte(_, at, byte, how) if !raw.is_empty() => {
            let at = at.index(raw.len());
            match how {
                0 => raw[at] = *byte,
                1 => raw.insert(at, *byte),
                _ => drop(raw.remove(at)),
            }
            return raw;
        }
        Spoil::Cut(_, at) if !raw.is_empty() => {
            raw.truncate(at.index(raw.len()));
            return raw;
        }
        Spoil::Throughout(_, byte, text) => {
            let parts: Vec<&[u8]> = raw.split(|b| b == byte).collect();
            return parts.join(text.as_bytes());
        }
        _ => {}
    }
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let head = lines.iter().position(|l| !l.starts_with('#')).unwrap_or(0);
    if lines.len() < head + 2 {
        return raw;
    }
    let columns = lines[head].split(',').count();
    match spoil {
        Spoil::Field(_, row, column, text, value) => {
            let row = row.index(lines.len());
            if is_setup {
                if let Some((key, _)) = lines[row].split_once('=') {
                    lines[row] = format!("{key}= {value}");
                }
            } else {
                let column = column.index(columns);
                field(&mut lines[row], column, |_| (*text).to_owned());
            }
        }
        Spoil::Column(_, column, text) => {
            let column = column.index(columns);
            let rows = lines.iter_mut().skip(head + 1);
            rows.for_each(|line| field(line, column, |_| (*text).to_owned()));
        }
        Spoil::Scale(_, column, factor, shift) => {
            let column = column.index(columns);
            for line in lines.iter_mut().skip(head + 1) {
                field(line, column, |old| match old.parse::<f64>() {
                    Ok(number) => (number * factor + shift).to_string(),
                    Err(_) => old.to_owned(),
                });
            }
        }
        Spoil::Thin(_, every, which) => {
            let mut row = 0;
            lines.retain(|_| {
                row += 1;
                row <= head + 1 || row % every != which % every
            });
        }
        Spoil::Few(_, rows) => lines.truncate(head + 1 + rows),
        Spoil::Line(_, a, b, how) => {
            let (a, b) = (a.index(lines.len()), b.index(lines.len()));
            match how {
                0 => drop(lines.remove(a)),
                1 => lines.insert(b, lines[a].clone()),
                _ => lines.swap(a, b),
            }
        }
        _ => {}
    }
    (lines.join("\n") + "\n").into_bytes()
}

fn field(line: &mut String, column: usize, new: impl Fn(&str) -> String) {
    let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
    if let Some(field) = fields.get_mut(column) {
        *field = new(field);
    }
    *line = fields.join(",");
}
