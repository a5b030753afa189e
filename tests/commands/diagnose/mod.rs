//! `errsep diagnose` recognises the model, and `errsep simulate --effect` switches its effects on.

mod answered;
mod recognised;
mod refused;
mod simulated;

use crate::command::{Folder, run};
use serde_json::Value;

/// Simulates, diagnoses and gives the answer.
fn diagnosed(simulate: &[&str], setup: &str, options: &[&str]) -> Value {
    let folder = Folder::with(&[("s.toml", setup)]);
    let mut arguments = vec!["simulate"];
    arguments.extend(simulate);
    let made = run(&folder, &arguments);
    assert_eq!(made.status, 0, "{}", made.stderr);
    folder.write("d.csv", &made.stdout);
    let mut arguments = vec!["diagnose", "d.csv", "--setup", "s.toml", "--format", "json"];
    arguments.extend(options);
    let out = run(&folder, &arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

fn effects(answer: &Value) -> Vec<&str> {
    let named = answer["verdict"]["effects"].as_array().unwrap();
    named.iter().map(|e| e.as_str().unwrap()).collect()
}
