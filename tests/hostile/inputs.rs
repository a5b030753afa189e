//! Inputs are read once, whatever they are: files, pipes, standard input, devices without end.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

use crate::command::{Folder, run};
use serde_json::Value;
use sha2::{Digest, Sha256};

const PROFILE: &str = "x,deviation\n0,-0.3\n100,0.9\n200,0.1\n300,-0.8\n400,0.4\n500,0.2\n";

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect()
}

fn hash_of(answer: &str) -> Value {
    let answer: Value = serde_json::from_str(answer).unwrap();
    answer["provenance"]["inputs"][0]["sha256"].clone()
}

#[test]
fn standard_input_is_read_like_a_file() {
    let folder = Folder::with(&[]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(["straightness", "-", "--format", "json"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(PROFILE.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let answer = String::from_utf8(output.stdout).unwrap();
    assert_eq!(hash_of(&answer), sha256(PROFILE.as_bytes()));
}

/// The diagnosis looks at the columns before it chooses a reader: a pipe has them only once.
#[test]
fn a_named_pipe_is_read_once() {
    let folder = Folder::with(&[]);
    let made = run(
        &folder,
        &[
            "simulate",
            "calibration-line",
            "--loads",
            "8",
            "--seed",
            "3",
        ],
    )
    .stdout;
    let pipe = folder.path().join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let data = made.clone();
    let writer = std::thread::spawn(move || fs::write(pipe, data).unwrap());
    let arguments = [
        "diagnose",
        "pipe",
        "--model",
        "calibration-line",
        "--format",
        "json",
    ];
    let by_model = run(&folder, &arguments);
    writer.join().unwrap();
    assert_eq!(by_model.status, 0, "{}", by_model.stderr);
    assert_eq!(hash_of(&by_model.stdout), sha256(made.as_bytes()));
    let (data, pipe) = (made.clone(), folder.path().join("pipe"));
    let writer = std::thread::spawn(move || fs::write(pipe, data).unwrap());
    let by_columns = run(&folder, &["diagnose", "pipe", "--format", "json"]);
    writer.join().unwrap();
    assert_eq!(by_columns.status, 0, "{}", by_columns.stderr);
    assert_eq!(hash_of(&by_columns.stdout), sha256(made.as_bytes()));
    let (data, pipe) = (made.clone(), folder.path().join("pipe"));
    let writer = std::thread::spawn(move || fs::write(pipe, data).unwrap());
    let as_text = run(&folder, &["diagnose", "pipe"]);
    writer.join().unwrap();
    assert_eq!(as_text.status, 0, "{}", as_text.stderr);
}

#[test]
fn a_setup_without_end_is_refused() {
    let folder = Folder::with(&[("p.toml", "")]);
    let output = run(&folder, &["plan", "/dev/zero"]);
    assert_eq!(output.status, 2);
    assert!(
        output.stderr.contains("longer than 16 MiB"),
        "{}",
        output.stderr
    );
    assert!(output.stderr.contains("help: "));
}

#[test]
fn a_setup_that_is_no_text_says_where() {
    let folder = Folder::with(&[]);
    fs::write(folder.path().join("p.toml"), b"noise = 1\n# caf\xe9\n").unwrap();
    let output = run(&folder, &["plan", "p.toml"]);
    assert_eq!(output.status, 2);
    assert!(
        output.stderr.contains("p.toml:2:6: byte 0xE9 is not text"),
        "{}",
        output.stderr
    );
}

/// An argument need not be text.
#[test]
fn a_file_name_that_is_no_text_is_a_file_name() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::with(&[]);
    let name = std::ffi::OsStr::from_bytes(b"p\xff\x1b[31m.csv");
    fs::write(folder.path().join(name), PROFILE).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_errsep"))
        .arg("straightness")
        .arg(name)
        .args(["--format", "json"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
