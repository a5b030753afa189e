//! Each effect made several ways, from physics that the catalogue does not share, and diagnosed
//! blind; or nothing, or the effect withheld.
//!
//! cargo run --release -p errsep-campaigns --bin realisations -- --seeds 3 --first 1 [--only zero-jump] [--withheld | --null]
//! One line a case: effect, way, seed, what was said, seconds.

use std::time::Instant;

use errsep::diagnosis::{Options, diagnose};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use rayon::prelude::*;

#[path = "../tests/realisations/mod.rs"]
mod realisations;

use realisations::{REALISATIONS, measured, nothing};

const POSITIONS: usize = 150;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str| -> Option<&str> {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).map(String::as_str)
    };
    let number = |name: &str, fallback: u64| {
        option(name)
            .and_then(|v| v.parse().ok())
            .unwrap_or(fallback)
    };
    let has = |name: &str| arguments.iter().any(|a| a == name);
    let (seeds, first) = (number("--seeds", 2), number("--first", 1));
    let only = option("--only").unwrap_or("");
    let mut jobs: Vec<(&str, usize, u64)> = Vec::new();
    for seed in first..first + seeds {
        if has("--null") {
            jobs.push(("none", 0, seed));
            continue;
        }
        for (effect, ways) in REALISATIONS {
            let wanted = only.is_empty() || only.split(',').any(|o| o == *effect);
            jobs.extend(
                (0..if wanted { *ways } else { 0 })
                    .map(|way| (*effect, way, 100 * seed + way as u64)),
            );
        }
    }
    let lines: Vec<(String, String)> = jobs
        .par_iter()
        .filter_map(|&(effect, way, seed)| {
            // Visible 0.7 to 3 times the noise.
            let visible = 0.7 * (3.0f64 / 0.7).powf(((seed * 37) % 100) as f64 / 100.0);
            let readings = if effect == "none" {
                nothing(seed, POSITIONS)
            } else {
                measured(effect, way, visible, seed, POSITIONS)?
            };
            let model = Linearised::new(&readings, Assumptions::default()).ok()?;
            let start = Instant::now();
            let without = if has("--withheld") { vec![effect.to_owned()] } else { Vec::new() };
            let told = diagnose(&model, &Options { seed, without, ..Options::default() });
            let verdict = &told.verdict;
            let seconds = start.elapsed().as_secs_f64();
            let right = if verdict.effects == [effect] && verdict.indistinguishable.is_empty() {
                "alone"
            } else if verdict.indistinguishable.iter().flatten().any(|e| e == effect) {
                "group"
            } else if verdict.effects.is_empty() {
                if verdict.partial.is_empty() && verdict.shape.is_none() { "none" } else { "unknown" }
            } else {
                "other"
            };
            let line = format!(
                "{effect:24} {way} {seed:5} {visible:4.2} {right:8} {seconds:5.1} s  {:?} {:?} {:?} {}",
                verdict.effects, verdict.indistinguishable, verdict.partial,
                told.candidates.first().map_or(String::new(), |c| format!("{:?} {:?}", c.variant, c.parameters.iter().map(|p| format!("{} {:.3}±{:.3}", p.name, p.value, p.std)).collect::<Vec<_>>())),
            );
            println!("{line}");
            Some((effect.to_owned(), right.to_owned()))
        })
        .collect();
    let mut table: std::collections::BTreeMap<(String, String), usize> =
        std::collections::BTreeMap::new();
    for key in lines {
        *table.entry(key).or_default() += 1;
    }
    for ((effect, right), count) in table {
        println!("= {effect:24} {right:8} {count}");
    }
}
