//! How often the printed intervals hold the truth, for every uncertainty that a command prints.
//!
//! `cargo run --release -p errsep-campaigns --bin coverage [--seeds N] [ROOM ...]`
//!
//! Without a room all are run. A room is one model; it draws data with known truth (each case says from
//! what), solves them as the command does and counts how often the truth lies within the intervals of
//! nominally 68.27 % and 95 %. The tables stand in `docs/validation/coverage.md`.

mod anova;
mod calibration_line;
mod circle;
mod designs;
mod diagnosis;
mod four_sensor;
mod fourier;
mod joined;
mod machine;
mod moments;
mod positioning;
mod reversal;
mod staged;
mod step_diagonal;
mod tally;
mod turning_bar;
mod with;

use std::process::ExitCode;

use tally::Row;

/// The name of a room, how many seeds a case it takes by default, and what it measures.
type Room = (&'static str, u64, fn(u64) -> Vec<Row>);

/// One line a model.
const ROOMS: &[Room] = &[
    ("reversal", 2000, reversal::rows),
    ("designs", 4000, designs::bound),
    ("designs-noise", 400, designs::laws),
    ("turning-bar", 200, turning_bar::rows),
    ("with", 200, with::rows),
    ("joined", 400, joined::rows),
    ("staged", 2000, staged::rows),
    ("circle", 2000, circle::rows),
    ("four-sensor", 400, four_sensor::rows),
    ("fourier", 2000, fourier::rows),
    ("step-diagonal", 2000, step_diagonal::rows),
    ("machine", 2000, machine::rows),
    ("positioning", 2000, positioning::rows),
    ("anova", 2000, anova::rows),
    ("calibration-line", 2000, calibration_line::rows),
    ("diagnosis", 60, diagnosis::rows),
    ("moments", 400, moments::rows),
];

fn main() -> ExitCode {
    let mut seeds = None;
    let mut wanted = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--seeds" {
            seeds = arguments.next().and_then(|n| n.parse().ok());
            if seeds.is_none() {
                eprintln!("--seeds takes a whole number");
                return ExitCode::from(2);
            }
        } else if ROOMS.iter().any(|(name, ..)| *name == argument) {
            wanted.push(argument);
        } else {
            let names: Vec<&str> = ROOMS.iter().map(|(name, ..)| *name).collect();
            eprintln!(
                "no room is called {argument}; there are: {}",
                names.join(", ")
            );
            return ExitCode::from(2);
        }
    }
    for (name, default, measure) in ROOMS {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            println!("\n## {name}\n");
            tally::print(&measure(seeds.unwrap_or(*default)));
        }
    }
    ExitCode::SUCCESS
}
