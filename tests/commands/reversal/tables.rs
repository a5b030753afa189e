//! Tables in every dialect, layout and unit, and long ones.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use super::{json, readings, run, wide};

fn tidy() -> String {
    let mut text = String::from("reading,x,channel\n");
    for (x, values) in readings().into_iter().rev() {
        for (channel, value) in ["1A", "1B", "2A", "2B"].into_iter().zip(values) {
            text += &format!("{value},{x},{channel}\n\n");
        }
    }
    text
}

#[test]
fn every_dialect_and_layout_is_the_same_data() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("plain.csv"), wide(",", "\n", ".", "")).unwrap();
    let plain = json(folder.path(), &["reversal", "plain.csv"]);
    for (name, text, said) in [
        (
            "semicolon",
            wide(";", "\n", ".", ""),
            "LF line ends, fields separated by semicolon, decimal point; one column",
        ),
        (
            "german",
            wide(";", "\r\n", ",", "\u{feff}"),
            "UTF-8 with byte-order mark, CRLF line ends, fields separated by semicolon, decimal comma",
        ),
        (
            "tab",
            wide("\t", "\r\n", ".", ""),
            "CRLF line ends, fields separated by tab, decimal point",
        ),
        (
            "tab_comma",
            wide("\t", "\n", ",", ""),
            "fields separated by tab, decimal comma",
        ),
        ("old_mac", wide(",", "\r", ".", ""), "CR line ends"),
        ("tidy", tidy(), "decimal point; one row a reading"),
        (
            "capitals",
            tidy().replace("reading,x,channel", "Reading,X,Channel"),
            "decimal point; one row a reading",
        ),
        (
            "minus_signs",
            tidy().replace('-', "\u{2212}"),
            "decimal point; one row a reading",
        ),
        (
            "empty_rows",
            wide(",", "\n", ".", "") + ",,,,\n,, ,,\n",
            "fields separated by comma, decimal point",
        ),
    ] {
        fs::write(folder.path().join("other.csv"), text).unwrap();
        let other = json(folder.path(), &["reversal", "other.csv"]);
        assert!(
            other["input"].as_str().unwrap().contains(said),
            "{name}: {}",
            other["input"]
        );
        // The same numbers in another order of rows: exactly the same result.
        for key in ["tilts", "forms", "closure", "contrasts"] {
            assert_eq!(other[key], plain[key], "{name} {key}");
        }
        let (_, text, _) = run(folder.path(), &["reversal", "other.csv"]);
        assert!(text.contains(said), "{name}: not said");
    }
}

#[test]
fn renamed_columns_in_other_units_are_the_same_data() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("data.csv"), wide(",", "\n", ".", "")).unwrap();
    let plain = json(folder.path(), &["reversal", "data.csv"]);
    let mut text = String::from("note,z_m,near0,far0,far180,near180\n");
    for (x, v) in readings() {
        text += &format!(
            "a,{},{},{},{},{}\n",
            x / 1e3,
            v[0] / 1e3,
            v[1] / 1e3,
            v[2] / 1e3,
            v[3] / 1e3
        );
    }
    fs::write(folder.path().join("odd.csv"), text).unwrap();
    let names = [
        ("x", "z_m:m"),
        ("1A", "near0:mm"),
        ("1B", "far0:mm"),
        ("2A", "far180:mm"),
        ("2B", "near180:mm"),
    ];
    let option = names
        .map(|(role, column)| format!("{role}={column}"))
        .join(",");
    let setup = names
        .map(|(role, column)| format!("{role} = \"{column}\"\n"))
        .concat();
    fs::write(
        folder.path().join("setup.toml"),
        format!("[columns]\n{setup}"),
    )
    .unwrap();
    for args in [["--columns", option.as_str()], ["--setup", "setup.toml"]] {
        let odd = json(
            folder.path(),
            &[&["reversal", "odd.csv"], &args[..]].concat(),
        );
        for tilt in ["alpha", "beta", "gamma"] {
            let value = |r: &Value| r["tilts"][tilt]["value"].as_f64().unwrap();
            // Epsilons: readings up to 6 µm over 100 mm, divided and multiplied by powers of ten.
            assert!((value(&odd) - value(&plain)).abs() < 1e-15);
        }
        assert!(
            odd["input"]
                .as_str()
                .unwrap()
                .ends_with("columns not read: note")
        );
    }
}

/// A million rows; ten million by `cargo run --release -p errsep-campaigns --bin many_rows`.
#[test]
fn a_million_rows() {
    use std::io::Write;
    let rows = 1_000_000_u32;
    let mut file = tempfile::NamedTempFile::new().unwrap();
    {
        let mut out = std::io::BufWriter::new(&mut file);
        writeln!(out, "channel,x,reading").unwrap();
        for k in 0..rows {
            let channel = ["1A", "1B", "2A", "2B"][(k % 4) as usize];
            writeln!(out, "{channel},{},{}", f64::from(k / 4) / 1e3, k % 7).unwrap();
        }
        out.flush().unwrap();
    }
    let data = errsep::io::reversal::read(file.path(), &Default::default()).unwrap();
    assert_eq!(data.observations.readings.len(), rows as usize);
    let last = data.observations.readings.last().unwrap();
    assert_eq!(
        (last.channel.name(), last.x, last.value),
        ("2B", 249.999, f64::from((rows - 1) % 7))
    );
}
