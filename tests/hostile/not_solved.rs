//! Good data that do not answer the question: exit status 1, the reason, and nothing written.

use std::fs;

use assert_cmd::Command;

/// Runs the program on one file and checks that it ends with status 1, says why, and leaves the
/// output folder alone.
#[track_caller]
fn unanswered(command: &str, data: &str, setup: Option<&str>, options: &[&str], told: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("data.csv");
    fs::write(&file, data).unwrap();
    let mut run = Command::cargo_bin("errsep").unwrap();
    run.arg(command)
        .arg(&file)
        .args(options)
        .arg("--out")
        .arg(folder.path().join("out"));
    if let Some(text) = setup {
        let setup = folder.path().join("setup.toml");
        fs::write(&setup, text).unwrap();
        run.arg("--setup").arg(setup);
    }
    let output = run.output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty());
    for words in told {
        assert!(message.contains(words), "{words} in\n{message}");
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn an_arc_that_is_as_straight_as_it_is_noisy() {
    unanswered(
        "circle",
        "x,y\n0,0\n1,1\n2,0\n3,1\n4,0\n5,1\n",
        None,
        &[],
        &["straight line fits", "measure a longer arc"],
    );
}

#[test]
fn a_thickness_that_leaves_no_trace() {
    let mut data = "channel,x,reading\n".to_owned();
    for channel in ["1A", "1B", "2A", "2B"] {
        for i in 0..40 {
            data += &format!("{channel},{},0.0{}\n", 10 * i, i * i % 7);
        }
    }
    unanswered(
        "reversal",
        &data,
        Some("[artefact]\nthickness = 40\nfit_thickness = true\n"),
        &["--simultaneous"],
        &["thickness only to", "leave fit_thickness out"],
    );
}
