//! Certificates against the schemas, where these are at hand.

use std::process::Command;

use super::{RESULTS, certified};

/// One certificate of each kind of result against the schemas, where they are at hand.
#[test]
fn certificates_are_valid() {
    let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/dcc/validate.sh");
    if std::env::var_os("ERRSEP_DCC_SCHEMA").is_none() {
        println!("skipped: ERRSEP_DCC_SCHEMA names no folder with the schemas");
        return;
    }
    let folder = certified();
    let validated = |names: &[String]| {
        let files = names.iter().map(|name| folder.path().join(name));
        let out = Command::new(&script).args(files).output().unwrap();
        let told = String::from_utf8_lossy(&out.stdout).into_owned();
        print!("{told}");
        (out.status.success(), told)
    };
    let names: Vec<String> = RESULTS
        .iter()
        .map(|(name, _)| format!("{name}.xml"))
        .collect();
    let (valid, told) = validated(&names);
    assert!(valid, "{told}");
    if told.starts_with("skipped") {
        return;
    }
    // The validation can fail.
    folder.write(
        "bad.xml",
        &folder
            .read("circle.xml")
            .replacen("si:coverageFactor>", "si:factor>", 2),
    );
    let (valid, told) = validated(&["bad.xml".to_owned()]);
    assert!(!valid && told.contains("not valid"), "{told}");
}
