//! What `--out` replaces, removes, keeps and refuses.

use std::fs;
use std::path::Path;

use crate::command::{Folder, Output, run};
use serde_json::Value;
use sha2::{Digest, Sha256};

const PROFILE: &str = "x,deviation\n0,-0.3\n100,0.9\n200,0.1\n300,-0.8\n400,0.4\n500,0.2\n";

fn names(folder: &Folder, place: &str) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder.path().join(place))
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn done(folder: &Folder, arguments: &[&str]) -> Output {
    let output = run(folder, arguments);
    assert_eq!(output.status, 0, "{arguments:?}: {}", output.stderr);
    output
}

fn refused(folder: &Folder, arguments: &[&str], told: &[&str]) {
    let output = run(folder, arguments);
    assert_eq!(output.status, 2, "{arguments:?}: {}", output.stdout);
    for words in told.iter().chain(&["help: ", "--force"]) {
        assert!(
            output.stderr.contains(words),
            "{words:?} is not in: {}",
            output.stderr
        );
    }
    assert!(output.stdout.is_empty());
}

#[test]
fn a_command_does_not_write_over_its_own_input() {
    let folder = Folder::with(&[]);
    let make = ["simulate", "reversal", "--positions", "9", "--out", "d"];
    done(&folder, &make);
    let before = folder.read("d/readings.csv");
    let solve = ["reversal", "d/readings.csv", "--out", "d"];
    refused(
        &folder,
        &solve,
        &["d/readings.csv", "is an input of this run"],
    );
    assert_eq!(folder.read("d/readings.csv"), before);
    assert_eq!(
        names(&folder, "d"),
        ["readings.csv", "report.html", "result.json", "setup.toml"]
    );
    // Asked to, it replaces the report and still keeps what it has read.
    done(&folder, &[&solve[..], &["--force"]].concat());
    assert_eq!(folder.read("d/readings.csv"), before);
    assert!(folder.read("d/result.json").contains("errsep.reversal/1"));
}

#[test]
fn what_somebody_else_wrote_is_replaced_only_by_force() {
    for foreign in ["result.json", "report.html", "readings.csv"] {
        let folder = Folder::with(&[]);
        fs::create_dir(folder.path().join("d")).unwrap();
        folder.write(&format!("d/{foreign}"), "mine");
        let make = ["simulate", "reversal", "--positions", "9", "--out", "d"];
        refused(&folder, &make, &[foreign, "was not written by errsep"]);
        assert_eq!(folder.read(&format!("d/{foreign}")), "mine");
        assert_eq!(names(&folder, "d"), [foreign]);
        done(&folder, &[&make[..], &["--force"]].concat());
        assert_ne!(folder.read(&format!("d/{foreign}")), "mine");
        // Now it is a report, and is replaced without asking.
        done(&folder, &make);
    }
}

#[test]
fn a_file_changed_since_it_was_written_is_somebody_elses() {
    let folder = Folder::with(&[]);
    let make = ["simulate", "reversal", "--positions", "9", "--out", "d"];
    done(&folder, &make);
    folder.write("d/readings.csv", "corrected by hand");
    refused(
        &folder,
        &make,
        &["d/readings.csv", "was changed since errsep wrote it"],
    );
    assert_eq!(folder.read("d/readings.csv"), "corrected by hand");
}

#[test]
fn nothing_of_an_old_report_stays_beside_a_new_one() {
    let folder = Folder::with(&[("p.csv", PROFILE)]);
    done(
        &folder,
        &["simulate", "reversal", "--positions", "9", "--out", "d"],
    );
    folder.write("d/notes.txt", "mine");
    assert!(folder.path().join("d/readings.csv").exists());
    done(&folder, &["straightness", "p.csv", "--out", "d"]);
    let result: Value = serde_json::from_str(&folder.read("d/result.json")).unwrap();
    let mut expected = vec!["notes.txt".to_owned(), "result.json".to_owned()];
    for file in result["provenance"]["files"].as_array().unwrap() {
        let name = file["file"].as_str().unwrap();
        let bytes = fs::read(folder.path().join("d").join(name)).unwrap();
        let digest: String = Sha256::digest(&bytes)
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        assert_eq!(file["sha256"], digest.as_str(), "{name}");
        expected.push(name.to_owned());
    }
    expected.sort();
    assert_eq!(names(&folder, "d"), expected);
    assert_eq!(folder.read("d/notes.txt"), "mine");
    assert_eq!(names(&folder, "."), ["d", "p.csv"]);
}

/// The working directory and folders with folders in them are written file by file.
#[test]
fn folders_that_cannot_be_exchanged_take_a_report_too() {
    let folder = Folder::with(&[("p.csv", PROFILE)]);
    fs::create_dir(folder.path().join("below")).unwrap();
    folder.write("below/mine", "kept");
    for _ in 0..2 {
        done(&folder, &["straightness", "p.csv", "--out", "."]);
        assert_eq!(folder.read("below/mine"), "kept");
        assert_eq!(folder.read("p.csv"), PROFILE);
    }
    let there = names(&folder, ".");
    assert!(there.contains(&"report.html".to_owned()), "{there:?}");
    assert!(!there.iter().any(|n| n.starts_with(".errsep")), "{there:?}");
}

#[test]
fn a_run_that_fails_leaves_no_folder_above_either() {
    let folder = Folder::with(&[("bad.csv", "x,deviation\n0,a\n")]);
    let output = run(&folder, &["straightness", "bad.csv", "--out", "a/b/c"]);
    assert_eq!(output.status, 2);
    assert_eq!(names(&folder, "."), ["bad.csv"]);
}

#[test]
fn a_folder_in_the_place_of_a_file_leaves_nothing_behind() {
    let folder = Folder::with(&[("p.csv", PROFILE)]);
    fs::create_dir_all(folder.path().join("d/result.json")).unwrap();
    for force in [&[][..], &["--force"]] {
        let output = run(
            &folder,
            &[&["straightness", "p.csv", "--out", "d"], force].concat(),
        );
        assert_eq!(output.status, 2);
        assert!(
            output.stderr.contains("result.json: is a folder"),
            "{}",
            output.stderr
        );
        assert_eq!(names(&folder, "d"), ["result.json"]);
    }
}

#[cfg(unix)]
#[test]
fn a_linked_folder_stays_linked_and_keeps_its_permissions() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::with(&[("p.csv", PROFILE)]);
    let real = folder.path().join("real");
    fs::create_dir(&real).unwrap();
    fs::set_permissions(&real, fs::Permissions::from_mode(0o750)).unwrap();
    symlink("real", folder.path().join("link")).unwrap();
    for _ in 0..2 {
        done(&folder, &["straightness", "p.csv", "--out", "link"]);
    }
    assert!(folder.path().join("link").is_symlink());
    assert!(real.join("result.json").is_file());
    let mode = fs::metadata(&real).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o750);
    // A link that leads nowhere is no place for a report.
    symlink("nowhere", folder.path().join("broken")).unwrap();
    let output = run(&folder, &["straightness", "p.csv", "--out", "broken"]);
    assert_eq!(output.status, 2, "{}", output.stdout);
}

/// What a killed run left goes with the next one; what a run at work holds does not.
#[cfg(unix)]
#[test]
fn a_later_run_sweeps_what_a_killed_one_left() {
    let folder = Folder::with(&[("p.csv", PROFILE)]);
    let left = folder.path().join(".errsep-4194000-0");
    let not_ours = folder.path().join(".errsep-notes");
    for path in [&left, &not_ours] {
        fs::create_dir(path).unwrap();
        fs::write(path.join("report.html"), "half").unwrap();
    }
    let at_work = fs::File::open(folder.path()).unwrap();
    at_work.lock().unwrap();
    let output = run(&folder, &["straightness", "absent.csv", "--out", "d"]);
    assert_eq!(output.status, 2);
    assert!(left.exists(), "another run holds it");
    drop(at_work);
    done(&folder, &["straightness", "p.csv", "--out", "d"]);
    assert!(!left.exists());
    assert!(Path::new(&not_ours).join("report.html").exists());
}
