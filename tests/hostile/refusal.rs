//! One good file and set-up, and a run that must refuse what is made of them.
#![allow(dead_code, reason = "each test file uses its part")]

use std::fs;
use std::path::Path;
use std::process::Output;

use tempfile::TempDir;

pub const GOOD: &str = "\
# one good file
channel,repeat,direction,time,x,reading
1A,1,forward,0,0,0.1
1A,1,forward,1,10,0.2
1A,1,forward,2,20,0.4
2B,1,forward,3,0,0.1
2B,1,forward,4,10,0.3
2B,1,forward,5,20,0.3
";

pub const SETUP: &str = "\
[artefact]
thickness = 42.0

[indicator]
noise = 0.02

[model]
convention = \"seed\"
";

pub fn errsep(folder: &Path, args: &[&str]) -> Output {
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_errsep"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// Runs on these files; a run with bad input must say all of `told` and leave no trace.
pub fn refused(data: &[u8], setup: Option<&str>, options: &[&str], told: &[&str]) {
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

pub fn names(folder: &Path) -> Vec<String> {
    let mut names = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect::<Vec<_>>();
    names.sort();
    names
}

/// The good file with one thing wrong.
pub fn with(good: &str, wrong: &str) -> Vec<u8> {
    assert!(GOOD.contains(good));
    GOOD.replacen(good, wrong, 1).into_bytes()
}
