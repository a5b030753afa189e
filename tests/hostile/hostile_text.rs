//! Nothing that stands in a file, its name or an argument commands the terminal that shows it.

use crate::command::{Folder, Output, run};

/// ESC sequences, C1 controls, marks that turn the direction of writing.
const HOSTILE: &str = "\u{1b}[2J\u{1b}]0;t\u{7}\u{9b}31m\u{85}\u{202e}\u{2066}\u{200f}\u{7f}\u{8}";

fn is_safe(text: &str) -> bool {
    !text.chars().any(|c| {
        (c.is_control() && c != '\n')
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    })
}

fn safe(output: &Output, told: &str) {
    assert!(
        output.stderr.contains(told),
        "{told:?}: {:?}",
        output.stderr
    );
    assert!(is_safe(&output.stderr), "{:?}", output.stderr);
    assert!(is_safe(&output.stdout), "{:?}", output.stdout);
}

#[test]
fn messages() {
    let late = "x,deviation\n".to_owned() + &"1,2\n".repeat(30_000);
    let folder = Folder::with(&[
        ("names.csv", &format!("x,devi{}ation\n1,2\n", &HOSTILE[6..])),
        ("c1.csv", "x,deviation\n0,\u{9b}31m\u{202e}7\n1,2\n"),
        ("late.csv", &format!("{late}{HOSTILE},7\n")),
        (
            "key.toml",
            "noise = 0.1\n\"a\\u001b[31m\\nb\\u009b\\u202e\" = 1\n",
        ),
        ("quoted.toml", "noise = \"\u{9b}31m\u{202e}\"\n"),
    ]);
    safe(&run(&folder, &["straightness", "names.csv"]), "names.csv");
    safe(&run(&folder, &["straightness", "c1.csv"]), "c1.csv:2:3");
    safe(
        &run(&folder, &["straightness", "late.csv"]),
        "late.csv:30002:1",
    );
    safe(&run(&folder, &["plan", "key.toml"]), "key.toml:2:1");
    safe(&run(&folder, &["plan", "quoted.toml"]), "quoted.toml:1:9");
    for arguments in [
        &["straightness", HOSTILE][..],
        &["reversal", "a.csv", "--method", HOSTILE],
        &[HOSTILE],
        &["straightness", "c1.csv", "--out", HOSTILE, "--bad"],
        &["diagnose", "c1.csv", "--model", HOSTILE],
    ] {
        let output = run(&folder, arguments);
        assert_eq!(output.status, 2);
        safe(&output, "");
    }
}

#[test]
fn answers_on_the_terminal() {
    let points = format!(
        "point,x,y\n\"{}\",10,10\n2,20,10\n",
        &HOSTILE.replace(|c: char| c < ' ', "")
    );
    let machine = "chain = \"XYFZ\"\n[errors.EXX]\nvalue = 1.0\nstd = 0.1\n";
    let name = "p\u{202e}\u{9b}.csv";
    let folder = Folder::with(&[("m.toml", machine), (name, &points)]);
    for format in ["text", "json"] {
        let output = run(
            &folder,
            &["machine", "m.toml", "predict", name, "--format", format],
        );
        assert_eq!(output.status, 0, "{}", output.stderr);
        safe(&output, "");
        assert!(output.stdout.contains("31m"), "{}", output.stdout);
    }
}

#[test]
fn lines_of_any_length() {
    let wide = "x,deviation".to_owned() + &",a".repeat(40_000) + "\n";
    let key = format!("noise = 1\n\"{}\" = 1\n", "k".repeat(690_000));
    let columns = "[columns]\n".to_owned()
        + &(0..100_000)
            .map(|i| format!("c{i} = \"a:mm\"\n"))
            .collect::<String>();
    let inline = format!(
        "columns = {{ {} }}\n",
        columns[10..].trim_end().replace('\n', ", ")
    );
    let folder = Folder::with(&[
        ("wide.csv", &wide),
        (
            "far.csv",
            &format!("x,deviation\n{},b\n", " ".repeat(70_000)),
        ),
        ("key.toml", &key),
        ("columns.toml", &inline),
        ("data.csv", "x,1A\n0,1\n"),
    ]);
    for (arguments, told) in [
        (&["straightness", "wide.csv"][..], "wide.csv:1:"),
        (&["straightness", "far.csv"], "far.csv:2:"),
        (&["plan", "key.toml"], "key.toml:2:1"),
        (
            &["reversal", "data.csv", "--setup", "columns.toml"],
            "columns.toml:1:",
        ),
    ] {
        let output = run(&folder, arguments);
        assert_eq!(output.status, 2, "{}", output.stderr.len());
        safe(&output, told);
        assert!(
            output.stderr.chars().count() < 4000,
            "{} characters",
            output.stderr.len()
        );
    }
}
