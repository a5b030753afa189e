//! `errsep step-diagonal` and `errsep simulate step-diagonal` as people and programs use them.

mod determined;
mod known;

use crate::command::{Folder, run};
use serde_json::Value;

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    let out = run(folder, arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    serde_json::from_str(&out.stdout).unwrap()
}

const PLANE: [&str; 8] = [
    "simulate",
    "step-diagonal",
    "--diagonals",
    "face",
    "--steps",
    "4",
    "--noise",
    "0.1",
];

fn component<'a>(answer: &'a Value, name: &str) -> &'a Value {
    answer["components"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["name"] == name)
        .unwrap()
}
