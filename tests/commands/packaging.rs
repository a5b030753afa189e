//! What other package managers are told is what the manifest says. The comparisons are of equality.

use std::fs;
use std::path::Path;

#[test]
fn versions_are_those_of_the_manifest() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging");
    let told = |file: &str, before: &str, after: &str| {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        let (_, rest) = text.split_once(before).unwrap();
        rest.split_once(after).unwrap().0.to_owned()
    };
    let version = told("conda/recipe.yaml", "version: \"", "\"");
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    let rust = told("Dockerfile", "FROM rust:", "-");
    assert_eq!(rust, env!("CARGO_PKG_RUST_VERSION"));
}
