//! Runs the program in a folder of its own.
#![allow(dead_code, reason = "each test file uses its part")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// A folder that goes when the test ends.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// With these files.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, content) in files {
            folder.write(name, content);
        }
        folder
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: &str) {
        std::fs::write(self.0.path().join(name), content).unwrap();
    }

    /// Reads a file.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).unwrap()
    }
}

/// What the program said.
pub struct Output {
    /// Exit status.
    pub status: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Runs `errsep` with these arguments in the folder.
pub fn run(folder: &Folder, arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(arguments)
        .current_dir(folder.0.path())
        .output()
        .unwrap();
    Output {
        status: output.status.code().unwrap(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// The program refuses with status 2, names everything expected, prints nothing and writes nothing.
pub fn bad_input(folder: &Folder, arguments: &[&str], expected: &[&str]) {
    let out = run(folder, arguments);
    assert_eq!(out.status, 2, "{arguments:?}: {}", out.stderr);
    for part in expected {
        assert!(
            out.stderr.contains(part),
            "{arguments:?} lacks \"{part}\": {}",
            out.stderr
        );
    }
    assert!(out.stdout.is_empty(), "{arguments:?}: {}", out.stdout);
    assert!(
        !folder.0.path().join("out").exists(),
        "{arguments:?} left a folder"
    );
}

/// A page of the documentation.
pub fn document(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(root.join("docs").join(name)).unwrap()
}

/// Every key of the answer stands in the document, in backquotes or within a dotted path.
pub fn documented(answer: &Value, document: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join(document)).unwrap();
    let schema = answer["schema"].as_str().unwrap();
    assert!(text.contains(schema), "{document} lacks {schema}");
    let mut keys = Vec::new();
    collect(answer, &mut keys);
    for key in keys {
        let found = [
            format!("`{key}`"),
            format!("`{key}[]"),
            format!(".{key}`"),
            format!(".{key}."),
        ]
        .iter()
        .any(|k| text.contains(k));
        assert!(
            found || text.contains(&format!("`{key}.")) || text.contains(&format!("\"{key}\"")),
            "{document} does not explain `{key}`"
        );
    }
}

fn collect(value: &Value, keys: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (key, inner) in object {
                if !keys.contains(key) {
                    keys.push(key.clone());
                }
                // What stands in it is the same of every answer.
                if key != "provenance" {
                    collect(inner, keys);
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|v| collect(v, keys)),
        _ => {}
    }
}

/// A file of the measured data, or a line that says it was skipped.
pub fn data(name: &str) -> Option<String> {
    let folder = std::env::var_os("ERRSEP_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = folder.join(name);
    if path.is_file() {
        Some(path.display().to_string())
    } else {
        println!("skipped: {name} is not there (set ERRSEP_DATA)");
        None
    }
}
