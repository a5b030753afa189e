//! Writes, reads and solves a table of many rows, and says what time and memory that took:
//! `cargo run --release -p errsep-campaigns --bin many_rows [ROWS]` (ten million without a number).

use std::error::Error;
use std::io::{BufWriter, Write};
use std::time::Instant;

use errsep::io::ColumnMap;
use errsep::io::reversal::read;
use errsep_models::reversal::staged::{Options, solve};

fn main() -> Result<(), Box<dyn Error>> {
    let rows = match std::env::args().nth(1) {
        Some(text) => text.parse::<u32>()?,
        None => 10_000_000,
    };
    let mut file = tempfile::NamedTempFile::new()?;
    {
        let mut out = BufWriter::new(&mut file);
        writeln!(out, "channel,x,reading")?;
        for k in 0..rows {
            let channel = ["1A", "1B", "2A", "2B"][(k % 4) as usize];
            let x = f64::from(k / 4) * 1e-4;
            writeln!(
                out,
                "{channel},{x:.4},{:.4}",
                (x / 40.0).sin() + f64::from(k % 7) / 100.0
            )?;
        }
        out.flush()?;
    }
    let size = file.as_file().metadata()?.len();
    let begin = Instant::now();
    let data = read(file.path(), &ColumnMap::default())?;
    println!(
        "{rows} rows, {} MB: read in {:.2} s, peak memory {}",
        size / 1_000_000,
        begin.elapsed().as_secs_f64(),
        peak()
    );
    let begin = Instant::now();
    let solution = solve(&data.observations, &Options::default())?;
    println!(
        "solved in stages on {} positions in {:.2} s, peak memory {}",
        solution.x.len(),
        begin.elapsed().as_secs_f64(),
        peak()
    );
    Ok(())
}

/// The greatest memory so far, where the system tells it.
fn peak() -> String {
    std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|s| {
            let line = s.lines().find(|l| l.starts_with("VmHWM:"))?;
            Some(line.trim_start_matches("VmHWM:").trim().to_owned())
        })
        .unwrap_or_else(|| "not told by this system".to_owned())
}
