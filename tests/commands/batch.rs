//! `errsep batch`: rows as the commands answer, resumed after any stop, shared by several runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// A folder with a list of campaigns: profiles that each have a straightness of their own, now and then a
/// reversal, and one whose data is missing.
struct Bench {
    folder: tempfile::TempDir,
    count: usize,
}

impl Bench {
    fn new(count: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let readings = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reversal");
        for name in ["readings.csv", "setup.toml"] {
            fs::copy(readings.join(name), folder.path().join(name)).unwrap();
        }
        let mut list = "id,command,data,setup,options\n".to_owned();
        for k in 0..count {
            match k % 10 {
                3 => list += &format!("c{k},reversal,readings.csv,setup.toml,--simultaneous\n"),
                7 => list += &format!("c{k},straightness,nowhere.csv,,\n"),
                _ => {
                    let profile = format!("x,deviation\n0,0\n100,0.{}\n200,{k}\n", k % 7 + 1);
                    fs::write(folder.path().join(format!("p{k}.csv")), profile).unwrap();
                    list += &format!("c{k},straightness,p{k}.csv,,\n");
                }
            }
        }
        fs::write(folder.path().join("campaigns.csv"), list).unwrap();
        Self { folder, count }
    }

    fn command(&self, out: &str, more: &[&str]) -> Command {
        let mut command = Command::new(cargo_bin("errsep"));
        command
            .current_dir(self.folder.path())
            .args(["batch", "campaigns.csv", "--out", out])
            .args(more);
        command
    }

    fn run(&self, out: &str, more: &[&str]) -> Output {
        let output = self.command(out, more).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        output
    }

    /// The part files of a folder, by name.
    fn parts(&self, out: &str) -> Vec<(PathBuf, String)> {
        let entries = fs::read_dir(self.folder.path().join(out)).unwrap();
        let mut parts: Vec<_> = entries
            .map(|entry| entry.unwrap().path())
            .filter(|path| {
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                name.starts_with("part-")
            })
            .map(|path| {
                let name = PathBuf::from(path.file_name().unwrap());
                (name, fs::read_to_string(path).unwrap())
            })
            .collect();
        parts.sort();
        parts
    }

    fn rows(&self, out: &str) -> Vec<Value> {
        let parts = self.parts(out);
        let lines = parts.iter().flat_map(|(_, text)| text.lines());
        lines
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    fn ids(&self) -> Vec<String> {
        (0..self.count).map(|k| format!("c{k}")).collect()
    }
}

fn ids(rows: &[Value]) -> Vec<String> {
    let id = |row: &Value| row["id"].as_str().unwrap().to_owned();
    rows.iter().map(id).collect()
}

fn told(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn rows_hold_what_the_commands_answer() {
    let bench = Bench::new(20);
    let output = bench.run("out", &[]);
    assert!(told(&output).starts_with("20 campaigns: 20 worked out now, 0 done before; 2 failed"));
    let rows = bench.rows("out");
    assert_eq!(ids(&rows), bench.ids());
    for (row, arguments) in [
        (&rows[0], &["straightness", "p0.csv"][..]),
        (
            &rows[3],
            &[
                "reversal",
                "readings.csv",
                "--setup",
                "setup.toml",
                "--simultaneous",
            ],
        ),
    ] {
        assert_eq!(row["schema"], "errsep.batch/1");
        assert_eq!((&row["status"], &row["exit"]), (&"done".into(), &0.into()));
        assert!(row["message"].is_null());
        let alone = Command::new(cargo_bin("errsep"))
            .current_dir(bench.folder.path())
            .args(arguments)
            .args(["--format", "json"])
            .output()
            .unwrap();
        let mut alone: Value = serde_json::from_slice(&alone.stdout).unwrap();
        let object = alone.as_object_mut().unwrap();
        object.remove("provenance");
        if let Some(convergence) = object.get_mut("convergence") {
            convergence.as_object_mut().unwrap().remove("seconds");
        }
        // Exact: the same calculation, whatever the number of threads.
        assert_eq!(row["result"], alone);
    }
    let failed = &rows[7];
    assert_eq!(
        (&failed["status"], &failed["exit"]),
        (&"failed".into(), &2.into())
    );
    assert!(failed["message"].as_str().unwrap().contains("nowhere.csv"));
    assert!(failed["result"].is_null());
    let page = fs::read_to_string(bench.folder.path().join("out/index.html")).unwrap();
    assert!(page.contains("20 campaigns, 2 of them without an answer") && page.contains("c17"));
}

#[test]
fn readings_of_designs_are_campaigns_too() {
    let folder = tempfile::tempdir().unwrap();
    let errsep = |words: &[&str]| {
        let output = Command::new(cargo_bin("errsep"))
            .current_dir(folder.path())
            .args(words)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let design = "0/0,90/0,180/0,270/0,0/90,90/90,180/90,270/90,0/180,90/180,180/180,270/180";
    let simulate = [
        "simulate",
        "reversal",
        "--positions",
        "41",
        "--design",
        design,
    ];
    let made = errsep(&simulate);
    let header = made.lines().find(|line| !line.starts_with('#'));
    assert!(
        header.is_some_and(|h| h.contains("indicator") && h.contains("spindle")),
        "{header:?}"
    );
    fs::write(folder.path().join("both-planes.csv"), made).unwrap();
    let list = "id,command,data\nd1,reversal,both-planes.csv\n";
    fs::write(folder.path().join("campaigns.csv"), list).unwrap();
    errsep(&["batch", "campaigns.csv", "--out", "answers"]);
    let row = fs::read_to_string(folder.path().join("answers/part-1-00001.ndjson")).unwrap();
    let row: Value = serde_json::from_str(&row).unwrap();
    assert_eq!(
        (&row["status"], &row["result"]["schema"]),
        (&"done".into(), &"errsep.reversal/2".into())
    );
    let mut own: Value = serde_json::from_str(&errsep(&[
        "reversal",
        "both-planes.csv",
        "--format",
        "json",
    ]))
    .unwrap();
    own.as_object_mut().unwrap().remove("provenance");
    own["convergence"]
        .as_object_mut()
        .unwrap()
        .remove("seconds");
    assert_eq!(row["result"], own);
}

#[test]
fn what_is_done_is_skipped_until_something_changes() {
    let bench = Bench::new(20);
    bench.run("out", &[]);
    let before = bench.parts("out");
    let place = bench.folder.path().join("out").join(&before[0].0);
    let written = fs::metadata(&place).unwrap().modified().unwrap();
    let again = bench.run("out", &[]);
    // What is complete is not even written again.
    assert_eq!(fs::metadata(&place).unwrap().modified().unwrap(), written);
    assert!(told(&again).starts_with("20 campaigns: 0 worked out now, 20 done before; 2 failed"));
    let verified = bench.run("out", &["--verify"]);
    assert!(told(&verified).starts_with("20 campaigns: 0 worked out now"));
    assert_eq!(bench.parts("out"), before);

    fs::write(
        bench.folder.path().join("p4.csv"),
        "x,deviation\n0,0\n1,5\n2,0\n",
    )
    .unwrap();
    let profile = "x,deviation\n0,0\n1,9\n2,0\n";
    fs::write(bench.folder.path().join("nowhere.csv"), profile).unwrap();
    let changed = bench.run("out", &[]);
    // The file that was missing makes another key too.
    assert!(
        told(&changed).starts_with("20 campaigns: 3 worked out now, 17 done before; none failed")
    );
    let after = bench.rows("out");
    assert_eq!(ids(&after), bench.ids());
    let least_squares = &after[4]["result"]["reference_lines"][2]["error"]["value"];
    assert_eq!(least_squares.as_f64(), Some(5.0));
}

#[test]
fn what_failed_is_tried_again_when_asked_for() {
    let bench = Bench::new(10);
    bench.run("out", &[]);
    let retried = bench.run("out", &["--retry-failed"]);
    assert!(told(&retried).starts_with("10 campaigns: 1 worked out now, 9 done before; 1 failed"));
}

#[test]
fn shards_share_the_list() {
    let bench = Bench::new(23);
    bench.run("whole", &[]);
    for shard in ["1/3", "2/3", "3/3"] {
        bench.run("shared", &["--shard", shard, "--quiet"]);
    }
    let mut shared = bench.rows("shared");
    let place = |row: &Value| row["id"].as_str().unwrap()[1..].parse::<usize>().unwrap();
    shared.sort_by_key(place);
    assert_eq!(shared, bench.rows("whole"));
    let first = &bench.parts("shared")[0].1;
    let own: Vec<Value> = first
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    assert_eq!(ids(&own)[..3], ["c0", "c3", "c6"]);
}

#[test]
fn a_list_that_became_shorter_leaves_no_rows_behind() {
    let bench = Bench::new(210);
    bench.run("out", &["--quiet"]);
    assert_eq!(bench.parts("out").len(), 2);
    let list = bench.folder.path().join("campaigns.csv");
    let text = fs::read_to_string(&list).unwrap();
    let shorter: Vec<&str> = text.lines().take(151).collect();
    fs::write(&list, shorter.join("\n") + "\n").unwrap();
    let output = bench.run("out", &[]);
    assert!(told(&output).starts_with("150 campaigns: 0 worked out now, 150 done before"));
    assert_eq!(ids(&bench.rows("out")), bench.ids()[..150]);
}

#[test]
fn answers_that_were_shared_out_otherwise_are_not_mixed() {
    let bench = Bench::new(10);
    bench.run("out", &["--shard", "1/2"]);
    let before = bench.parts("out");
    for other in [&[][..], &["--shard", "1/3"], &["--shard", "12/12"]] {
        let output = bench.command("out", other).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("shared out otherwise"), "{message}");
    }
    assert_eq!(bench.parts("out"), before);
}

/// A file that an option names lies beside the list, wherever the run was started, and its content counts.
#[test]
fn files_of_options_belong_to_the_campaign() {
    let bench = Bench::new(1);
    let list = bench.folder.path().join("campaigns.csv");
    let rows = "id,command,data,options\na,reversal,readings.csv,--setup=setup.toml\n";
    fs::write(&list, rows).unwrap();
    let run = || {
        let output = Command::new(cargo_bin("errsep"))
            .args(["batch", list.to_str().unwrap(), "--out"])
            .arg(bench.folder.path().join("out"))
            .output()
            .unwrap();
        told(&output)
    };
    assert!(run().starts_with("1 campaign: 1 worked out now, 0 done before; none failed"));
    assert!(run().starts_with("1 campaign: 0 worked out now, 1 done before"));
    let setup = bench.folder.path().join("setup.toml");
    let text = fs::read_to_string(&setup).unwrap();
    fs::write(&setup, text + "# a word more\n").unwrap();
    assert!(run().starts_with("1 campaign: 1 worked out now, 0 done before; none failed"));
}

/// Killed at random moments and run again it ends complete, with the bytes of a run that was not killed.
#[cfg(unix)]
#[test]
fn kills_lose_and_double_nothing() {
    let bench = Bench::new(450);
    bench.run("whole", &["--jobs", "2"]);
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut kills = 0;
    for _ in 0..20 {
        let mut child = bench.command("killed", &["--quiet"]).spawn().unwrap();
        let wait = 10.0 * 40f64.powf(random.random::<f64>());
        std::thread::sleep(Duration::from_secs_f64(1e-3 * wait));
        if child.try_wait().unwrap().is_none() {
            kills += 1;
        }
        let _ = child.kill();
        child.wait().unwrap();
    }
    assert!(kills > 0, "no run was killed");
    bench.run("killed", &[]);
    assert_eq!(bench.parts("killed"), bench.parts("whole"));
    let left = fs::read_dir(bench.folder.path().join("killed")).unwrap();
    let left: Vec<String> = left
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(".journal") || name.ends_with(".new"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_wrong_list_is_told_where() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.csv");
    for (text, expected) in [
        ("id,command\na,circle\na,circle\n", "list.csv:3:1"),
        ("id,command\na,circel\n", "did you mean `circle`?"),
        (
            "id,command,options\na,circle,--out x\n",
            "`--out` is not for a campaign",
        ),
        (
            "id,command,options\na,circle,'x\n",
            "a quote that does not end",
        ),
        ("id,comand\na,circle\n", "unknown column `comand`"),
        (
            "id,command,data\na,circle,-\n",
            "standard input cannot be shared",
        ),
        ("id\na\n", "column `command` is missing"),
        ("id,command\n", "has no row of data"),
    ] {
        fs::write(&list, text).unwrap();
        let output = Command::new(cargo_bin("errsep"))
            .current_dir(folder.path())
            .args(["batch", "list.csv", "--out", "out"])
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn parquet_stands_beside_each_part_or_it_is_told_how_to_get_it() {
    let bench = Bench::new(10);
    let output = bench.command("p", &["--parquet"]).output().unwrap();
    if !cfg!(feature = "parquet") {
        assert_eq!(output.status.code(), Some(2));
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(told.contains("--features parquet"), "{told}");
        assert!(!bench.folder.path().join("p").exists());
        return;
    }
    assert!(output.status.success(), "{output:?}");
    let place = bench.folder.path().join("p/part-1-00001.parquet");
    let first = fs::read(&place).unwrap();
    assert!(first.starts_with(b"PAR1") && first.ends_with(b"PAR1"));
    // Lost, it is made anew of the rows; of other rows it does not stay.
    fs::remove_file(&place).unwrap();
    let output = bench.run("p", &["--parquet"]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("0 worked out now"), "{told}");
    assert_eq!(fs::read(&place).unwrap(), first);
    fs::write(
        bench.folder.path().join("p0.csv"),
        "x,deviation\n0,0\n1,5\n2,0\n",
    )
    .unwrap();
    bench.run("p", &[]);
    assert!(!place.exists());
}
