//! The structured fit of a simulated reversal, timed, and the readings for other solvers: what
//! `benches/peers/reversal.sh` puts beside them.
//!
//! `cargo run --release -p errsep-campaigns --bin peer_reversal -- <readings a channel> <file> [cells]`
//!
//! The file (little-endian doubles): number of readings a channel, cells, first and last break (mm),
//! thickness (mm), then the start: three tilts (rad) and four offsets (µm); then for each channel 1A,
//! 1B, 2A, 2B its positions (mm) and its readings (µm). The line printed: least seconds of five runs,
//! least seconds of all processors together, memory beyond the data in the first run (MB), ½ Σ r²
//! (µm²), passes over all readings, tilts (rad); once for equal noise, once for noise estimated by
//! channel.

use std::io::{BufWriter, Write};
use std::time::Instant;

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{
    self, ChannelReadings, Knots, Noise, Options, Thickness, Unknowns, fit,
};
use errsep_models::reversal::{Channel, Convention, Observations};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LENGTH: f64 = 300.0;
const THICKNESS: f64 = 42.0;
const TIMES: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = "usage: peer_reversal <readings a channel> <file, or - for none> [cells]";
    let n: usize = arguments.next().ok_or(usage)?.parse()?;
    let file = arguments.next().ok_or(usage)?;
    let cells: usize = arguments.next().map_or(Ok(61), |text| text.parse())?;

    let basis = CubicBSpline::uniform(0.0, LENGTH, cells)?;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut plan = Plan::even(0.0, LENGTH, n, 0.02);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (120e-6, -80e-6, 900e-6);
    plan.thickness_mm = THICKNESS;
    let (observations, _) = simulate(&plan, &[])?;
    if file != "-" {
        write(&observations, n, cells, &file)?;
    }

    for (name, noise) in [("equal", Noise::Equal), ("by-channel", Noise::Estimated)] {
        let options = Options {
            thickness: Thickness::Known(THICKNESS),
            noise,
            knots: Knots::At(basis.breaks().to_vec()),
            ..Options::default()
        };
        let (mut wall, mut processor) = (f64::INFINITY, f64::INFINITY);
        let mut memory = String::new();
        let mut rest = String::new();
        for time in 0..TIMES {
            let before = memory_peak_from_here();
            let (began, used) = (Instant::now(), processor_seconds());
            let solution = fit(&observations, &options)?;
            wall = wall.min(began.elapsed().as_secs_f64());
            processor = processor.min(processor_seconds() - used);
            // Later runs find the memory of the first still at hand.
            if time == 0 {
                memory = match (before, status("VmHWM:")) {
                    (Some(before), Some(peak)) => format!("{:.1}", (peak - before) / 1024.0),
                    _ => "-".to_owned(),
                };
            }
            let cost = 0.5 * solution.residuals.iter().map(|r| r * r).sum::<f64>();
            let tilts: Vec<String> = solution
                .tilts()
                .iter()
                .map(|tilt| format!("{:.13e}", tilt.angle.value))
                .collect();
            rest = format!(
                "{cost:.16e} {} {}",
                solution.convergence.iterations(),
                tilts.join(" ")
            );
        }
        println!("{name} {wall:.5} {processor:.5} {memory} {rest}");
    }
    Ok(())
}

fn write(
    observations: &Observations,
    n: usize,
    cells: usize,
    file: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let channels = ChannelReadings::sort(observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, false, cells + 3);
    let lines = simultaneous::lines(&channels)?;
    let tilts = simultaneous::tilts(&unknowns, &lines);
    let mut out = BufWriter::new(std::fs::File::create(file)?);
    let head = [n as f64, cells as f64, 0.0, LENGTH, THICKNESS];
    let offsets = lines.iter().map(|line| line.1);
    for value in head.into_iter().chain(tilts).chain(offsets) {
        out.write_all(&value.to_le_bytes())?;
    }
    for channel in &channels {
        for value in channel.x.iter().chain(&channel.value) {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    out.flush()?;
    Ok(())
}

/// What all threads have run so far, where the system tells it (Linux), s.
fn processor_seconds() -> f64 {
    let of_thread = |entry: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(entry.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    1e-9 * threads.flatten().filter_map(of_thread).sum::<f64>()
}

/// Resets the peak of resident memory where the system allows it; the memory in use now, kB.
fn memory_peak_from_here() -> Option<f64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    status("VmRSS:")
}

/// A line of the process's status, kB.
fn status(name: &str) -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}
