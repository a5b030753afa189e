//! Runs a case and says what is wrong with how it ended.

use std::fs;
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::good::Case;

/// A run that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(20);

/// Memory of a run, KiB.
const MEMORY: u32 = 2 << 20;

/// The exit status, or what is wrong.
pub fn run(case: &Case) -> Result<usize, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    for (name, bytes) in &case.files {
        fs::write(folder.path().join(name), bytes).map_err(|e| e.to_string())?;
    }
    let output = |name: &str| fs::File::create(folder.path().join(name)).map(Stdio::from);
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        let limited = format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"");
        shell.args(["-c", &limited, env!("CARGO_BIN_EXE_errsep")]);
        shell
    } else {
        Command::new(env!("CARGO_BIN_EXE_errsep"))
    };
    let mut child = command
        .args(&case.arguments)
        .current_dir(folder.path())
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(output("stdout").map_err(|e| e.to_string())?)
        .stderr(output("stderr").map_err(|e| e.to_string())?)
        .spawn()
        .map_err(|e| e.to_string())?;
    let began = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            break status;
        }
        if began.elapsed() > LONGEST {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("hangs for more than {LONGEST:?}"));
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let read = |name: &str| {
        let mut bytes = Vec::new();
        let file = fs::File::open(folder.path().join(name)).map_err(|e| e.to_string())?;
        let mut head = file.take(64 << 20);
        head.read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        Ok::<_, String>(String::from_utf8_lossy(&bytes).into_owned())
    };
    let (stdout, stderr) = (read("stdout")?, read("stderr")?);
    let code = status.code().ok_or_else(|| format!("{status}: {stderr}"))?;
    judged(code, &stdout, &stderr, case.as_json)
}

fn judged(code: i32, stdout: &str, stderr: &str, as_json: bool) -> Result<usize, String> {
    let ending = usize::try_from(code).map_err(|e| e.to_string())?;
    if ending > 2 || stderr.contains("panicked") {
        return Err(format!("exit status {code}: {stderr}"));
    }
    let hidden = |c: char| c.is_control() && c != '\n';
    if stderr.contains(hidden) || stdout.contains(hidden) {
        return Err(format!("control characters: {stderr:?}"));
    }
    match ending {
        0 if as_json => {
            let answer = serde_json::from_str::<serde_json::Value>(stdout);
            answer.map_err(|e| format!("no JSON ({e}): {stdout}"))?;
        }
        0 if stdout.trim().is_empty() => return Err("an empty answer".to_owned()),
        1 if stdout.is_empty() && stderr.trim().is_empty() => {
            return Err("no answer and not a word".to_owned());
        }
        2 if !stdout.is_empty() => return Err(format!("refused, with an answer: {stdout}")),
        2 if stderr.trim().is_empty() => return Err("refused without a word".to_owned()),
        _ => {}
    }
    Ok(ending)
}
