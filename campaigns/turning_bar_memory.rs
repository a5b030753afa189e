//! Time and peak memory of all fits of a long run of a turning bar: `cargo run --release -p errsep-campaigns --bin
//! turning_bar_memory -- READINGS TURNS [FORM_CELLS TURN_CELLS]`; without cells they are chosen.

use std::time::Instant;

use errsep_models::reversal::turning_bar::simulate::{TurningPlan, simulate};
use errsep_models::reversal::turning_bar::{Plan, Run, Survey, analyse};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<usize> = std::env::args()
        .skip(1)
        .map(|word| word.parse())
        .collect::<Result<_, _>>()?;
    let [readings, turns, cells @ ..] = given.as_slice() else {
        return Err("READINGS TURNS [FORM_CELLS TURN_CELLS]".into());
    };
    let made = TurningPlan {
        readings: *readings,
        turns: *turns as f64,
        stray_rad: 1.0,
        ..TurningPlan::default()
    };
    let run = Run::new(&simulate(&made).0)?;
    let before = peak_mb();
    let begun = Instant::now();
    let survey = Survey::new(&run, 0.0, 1.0, None)?;
    let plan = Plan {
        form_cells: cells.first().copied(),
        turn_cells: cells.get(1).copied(),
        ..Plan::default()
    };
    let found = analyse(&run, &survey, &plan)?;
    println!(
        "{readings} readings, {turns} turns: {:.1} s, peak memory {} MB ({} MB before the fits); steady {:.4} µm RMS, unsteady {:.4}",
        begun.elapsed().as_secs_f64(),
        words(peak_mb()),
        words(before),
        found.steady.fit.rms(),
        found.unsteady.map_or(f64::NAN, |rival| rival.fit.rms()),
    );
    Ok(())
}

/// Most memory held so far, MB, where the system tells it.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    let kb: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kb / 1024.0)
}

fn words(mb: Option<f64>) -> String {
    mb.map_or("unknown".to_owned(), |mb| format!("{mb:.0}"))
}
