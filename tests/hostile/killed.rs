//! Runs that are ended at any moment: the old report is whole or the new one is, and nothing is left.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

const KILLS: usize = 200;

/// Two profiles of different length: which report a folder holds is seen from its table.
fn profile(points: usize) -> String {
    let row = |i: usize| format!("{i},{}\n", (i * i % 7) as f64 / 10.0);
    "x,deviation\n".to_owned() + &(0..points).map(row).collect::<String>()
}

fn start(folder: &Path, input: &str, out: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_errsep"))
        .args(["straightness", input, "--out", out])
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// The report is whole: every file that it names, as it was written, and no other but `notes.txt`.
/// The input it was made from.
fn whole(report: &Path) -> String {
    let bytes = fs::read(report.join("result.json")).unwrap();
    let result: Value = serde_json::from_slice(&bytes).unwrap();
    let mut expected = vec!["result.json".to_owned()];
    for file in result["provenance"]["files"].as_array().unwrap() {
        let name = file["file"].as_str().unwrap();
        let digest: String = Sha256::digest(fs::read(report.join(name)).unwrap())
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        assert_eq!(file["sha256"], digest.as_str(), "{name}");
        expected.push(name.to_owned());
    }
    if report.join("notes.txt").exists() {
        expected.push("notes.txt".to_owned());
    }
    expected.sort();
    assert_eq!(names(report), expected);
    result["provenance"]["inputs"][0]["file"]
        .as_str()
        .unwrap()
        .to_owned()
}

/// How long a run takes undisturbed.
fn duration(folder: &Path) -> Duration {
    let run = || {
        let began = Instant::now();
        assert!(start(folder, "a.csv", "old").wait().unwrap().success());
        began.elapsed()
    };
    run().min(run())
}

fn scene() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("a.csv"), profile(40)).unwrap();
    fs::write(folder.path().join("b.csv"), profile(60)).unwrap();
    folder
}

/// Waits until the run is over, a time is up, or it has begun to put its folder in place.
fn wait(child: &mut Child, folder: &Path, until: Instant, for_the_folder: bool) {
    while Instant::now() < until && child.try_wait().unwrap().is_none() {
        if for_the_folder && names(folder).iter().any(|n| n.starts_with(".errsep")) {
            return;
        }
        std::thread::yield_now();
    }
}

/// Half of the kills come at any time, half when the folder aside is there: that is the one moment at
/// which anything can be left, and the next run removes it.
#[test]
fn sigkill_leaves_the_old_report_or_the_new_one() {
    let scene = scene();
    let folder = scene.path();
    let time = duration(folder);
    fs::write(folder.join("old/notes.txt"), "mine").unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut aimed = 0;
    for kill in 0..KILLS {
        let input = ["a.csv", "b.csv"][kill % 2];
        let mut child = start(folder, input, "old");
        let aim = kill % 4 < 2;
        let until = Instant::now()
            + if aim {
                20 * time
            } else {
                time.mul_f64(random.random_range(0.0..1.3))
            };
        wait(&mut child, folder, until, aim);
        let _ = child.kill();
        child.wait().unwrap();
        whole(&folder.join("old"));
        assert_eq!(
            fs::read_to_string(folder.join("old/notes.txt")).unwrap(),
            "mine"
        );
        aimed += usize::from(names(folder).iter().any(|n| n.starts_with(".errsep")));
    }
    println!("{aimed} of {KILLS} kills left a folder aside for the next run");
    assert!(start(folder, "b.csv", "old").wait().unwrap().success());
    assert_eq!(whole(&folder.join("old")), "b.csv");
    assert_eq!(names(folder), ["a.csv", "b.csv", "old"]);
}

/// A folder that was not there, below others that were not there.
#[test]
fn sigkill_leaves_no_part_of_a_new_folder() {
    let scene = scene();
    let folder = scene.path();
    let mut time = duration(folder);
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut made = 0;
    for kill in 0..KILLS {
        let mut child = start(folder, "b.csv", "new/below/it");
        let aim = kill % 4 < 2;
        let until = Instant::now()
            + if aim {
                20 * time
            } else {
                time.mul_f64(random.random_range(0.0..1.3))
            };
        wait(&mut child, folder, until, aim);
        let _ = child.kill();
        child.wait().unwrap();
        // As many come too early as too late, however busy the machine is.
        let late = folder.join("new").exists();
        time = time.mul_f64(if late { 0.95 } else { 1.05 });
        if late {
            assert_eq!(whole(&folder.join("new/below/it")), "b.csv");
            fs::remove_dir_all(folder.join("new")).unwrap();
            made += 1;
        }
    }
    println!("{made} of {KILLS} kills came too late");
    assert!(
        start(folder, "b.csv", "new/below/it")
            .wait()
            .unwrap()
            .success()
    );
    assert_eq!(names(folder), ["a.csv", "b.csv", "new", "old"]);
}

/// Ctrl-C and a request to end wait for the folder: nothing is left, without a later run.
#[test]
fn sigint_and_sigterm_leave_nothing() {
    let scene = scene();
    let folder = scene.path();
    let time = duration(folder);
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for kill in 0..KILLS {
        let mut child = start(folder, "b.csv", "old");
        let until = Instant::now() + time.mul_f64(random.random_range(0.0..1.3));
        wait(&mut child, folder, until, kill % 2 == 0);
        let signal = ["-INT", "-TERM"][kill / 2 % 2];
        let id = child.id().to_string();
        let _ = Command::new("kill")
            .args([signal, &id])
            .stderr(Stdio::null())
            .status();
        child.wait().unwrap();
        whole(&folder.join("old"));
        assert_eq!(names(folder), ["a.csv", "b.csv", "old"], "kill {kill}");
    }
}
