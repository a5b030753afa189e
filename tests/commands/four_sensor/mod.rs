//! `errsep four-sensor` and `errsep simulate four-sensor` as a user runs them.

mod missing;
mod separated;
mod told;

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/four_sensor")
        .join(name)
}

fn errsep(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(args)
        .output()
        .expect("the program starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

fn simulated(folder: &Path, options: &[&str], setup: &str) -> (PathBuf, PathBuf) {
    let (data, toml) = (folder.join("data.csv"), folder.join("setup.toml"));
    let mut args = vec!["simulate", "four-sensor"];
    args.extend(options);
    std::fs::write(&data, errsep(&args).stdout).expect("written");
    std::fs::write(&toml, setup).expect("written");
    (data, toml)
}

fn answered(data: &Path, setup: &Path) -> Value {
    let out = errsep(&[
        "four-sensor",
        text(data),
        "--setup",
        text(setup),
        "--format",
        "json",
    ]);
    assert_eq!(
        out.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    serde_json::from_slice(&out.stdout).expect("JSON and nothing else")
}
