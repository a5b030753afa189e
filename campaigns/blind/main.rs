//! Blind campaign on the reversal: a maker draws machines, artefacts, noise and effects and seals the
//! answers by their digest; the solver sees readings only and its report is sealed too; then the
//! judge opens both and counts.
//!
//! cargo run --release -p errsep-campaigns --bin blind -- --set single --cases 40 --seed 1 --out outcomes.jsonl
//! cargo run --release -p errsep-campaigns --bin blind -- --judge outcomes.jsonl --page docs/validation/diagnosis.md
//!
//! Sets: single, withheld (the effect is taken out of the catalogue), pairs, small (sizes about the
//! smallest that can be seen), null.

mod judge;
mod maker;
mod outcome;

use std::io::Write;
use std::time::Instant;

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::Observations;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use rayon::prelude::*;

use maker::{Made, Noise, make, seal, size};
use outcome::{Outcome, Sized};

/// The effects that a reversal can show.
const SHOWN: [&str; 11] = [
    "axis-backlash",
    "cyclic-error",
    "gain-mismatch",
    "hysteresis",
    "indicator-nonlinearity",
    "local-contamination",
    "reversal-shift",
    "taper",
    "thermal-drift",
    "thickness-shift",
    "zero-jump",
];

/// Cases between two writings of the outcome file.
const CHUNK: usize = 8;

/// One case to be made.
struct Job {
    names: Vec<&'static str>,
    case: u64,
    noise: Noise,
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str| -> Option<&str> {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).map(String::as_str)
    };
    let number = |name: &str, fallback: u64| -> u64 {
        option(name)
            .and_then(|v| v.parse().ok())
            .unwrap_or(fallback)
    };
    if let Some(files) = option("--judge") {
        let text = judge::judged(files.split(','))?;
        return match option("--page") {
            Some(page) => judge::write_into(page, &text),
            None => std::io::stdout().write_all(text.as_bytes()),
        };
    }
    let set = option("--set").unwrap_or("single");
    let jobs = jobs(
        set,
        number("--cases", 4),
        number("--seed", 1),
        option("--only").unwrap_or(""),
    );
    let start = Instant::now();
    let mut file = match option("--out") {
        Some(path) => Some(
            std::fs::OpenOptions::new()
                .create(true)
                .append(true)
                .open(path)?,
        ),
        None => None,
    };
    for chunk in jobs.chunks(CHUNK) {
        let outcomes: Vec<Outcome> = chunk.par_iter().filter_map(|job| tried(set, job)).collect();
        for outcome in &outcomes {
            let line = serde_json::to_string(outcome)?;
            match &mut file {
                Some(file) => writeln!(file, "{line}")?,
                None => println!("{line}"),
            }
        }
        if let Some(file) = &mut file {
            file.flush()?;
        }
    }
    eprintln!(
        "{} cases in {:.1} s",
        jobs.len(),
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn jobs(set: &str, cases: u64, seed: u64, only: &str) -> Vec<Job> {
    let combinations: Vec<Vec<&'static str>> = match set {
        "null" => vec![Vec::new()],
        "pairs" => SHOWN
            .iter()
            .enumerate()
            .flat_map(|(k, a)| SHOWN[k + 1..].iter().map(move |b| vec![*a, *b]))
            .collect(),
        _ => SHOWN.iter().map(|n| vec![*n]).collect(),
    };
    let wanted = |c: &[&str]| {
        set == "null" || only.is_empty() || c.iter().any(|n| only.split(',').any(|o| o == *n))
    };
    let laws: &[Noise] = match set {
        "null" if only.is_empty() => &[Noise::White, Noise::Correlated, Noise::Tails],
        "null" if only == Noise::Correlated.name() => &[Noise::Correlated],
        "null" if only == Noise::Tails.name() => &[Noise::Tails],
        _ => &[Noise::White],
    };
    let mut jobs = Vec::new();
    for k in 0..cases {
        for (c, names) in combinations
            .iter()
            .enumerate()
            .filter(|(_, names)| wanted(names))
        {
            for (l, law) in laws.iter().enumerate() {
                let turned = set != "null" && k % 2 == 1;
                jobs.push(Job {
                    names: names.clone(),
                    case: seed * 10_000_000 + l as u64 * 1_000_000 + c as u64 * 10_000 + k,
                    noise: if turned { Noise::Correlated } else { *law },
                });
            }
        }
    }
    jobs
}

fn tried(set: &str, job: &Job) -> Option<Outcome> {
    let sizes = if set == "small" {
        (0.02, 0.2)
    } else {
        (0.7, 3.0)
    };
    let made = make(&job.names, job.case, sizes, job.noise)?;
    let withheld: &[&str] = if set == "withheld" {
        &made.effects
    } else {
        &[]
    };
    let start = Instant::now();
    let diagnosis = solve(&made.observations, withheld, job.case)?;
    let seconds = start.elapsed().as_secs_f64();
    let report = seal(&format!("{:?} {:?}", diagnosis.verdict, diagnosis.gap));
    let mut outcome = opened(set, job, &made, &diagnosis, seconds, report);
    if !withheld.is_empty() && outcome.kind == "effect" {
        let whole = solve(&made.observations, &[], job.case)?.verdict;
        let alike = |group: &Vec<String>| {
            let same = |names: &[String]| names.iter().all(|name| group.contains(name));
            same(&outcome.truth) && same(&outcome.said)
        };
        outcome.alias = whole.indistinguishable.iter().any(alike);
    }
    Some(outcome)
}

/// The solver: it sees readings only.
fn solve(observations: &Observations, without: &[&str], seed: u64) -> Option<Diagnosis> {
    let model = Linearised::new(observations, Assumptions::default()).ok()?;
    let options = Options {
        seed,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    };
    Some(diagnose(&model, &options))
}

/// Answer and report side by side.
fn opened(
    set: &str,
    job: &Job,
    made: &Made,
    diagnosis: &Diagnosis,
    seconds: f64,
    report: String,
) -> Outcome {
    assert_eq!(
        made.seal,
        seal(&format!("{:?} {}", made.truth, made.gap)),
        "the seal is broken"
    );
    let verdict = &diagnosis.verdict;
    let mut said = verdict.effects.clone();
    said.sort();
    let sizes = made
        .effects
        .iter()
        .zip(&made.truth)
        .filter_map(|(name, injection)| {
            let candidate = diagnosis.candidates.iter().find(|c| c.effect == *name)?;
            let parameter = candidate.parameters.first()?;
            let hidden = diagnosis.hidden.iter().find(|h| h.effect == *name);
            Some(Sized {
                effect: (*name).to_owned(),
                truth: size(injection),
                value: parameter.value,
                std: parameter.std,
                detectable: hidden.and_then(|h| h.detectable),
            })
        });
    let held = diagnosis.gap.held_out;
    Outcome {
        set: set.to_owned(),
        noise: job.noise.name().to_owned(),
        case: job.case,
        truth: made.effects.iter().map(|s| (*s).to_owned()).collect(),
        kind: match verdict.kind {
            Kind::None => "none",
            Kind::Effect => "effect",
            Kind::Unknown => "unknown",
        }
        .to_owned(),
        said,
        groups: verdict.indistinguishable.clone(),
        partial: verdict.partial.clone(),
        p_value: verdict.p_value,
        adequacy: verdict.adequacy,
        alias: false,
        apart: diagnosis.detail.apart.clone(),
        gap_true: made.gap,
        gap: diagnosis.gap.before.rms,
        held_after: held.map(|h| h.after),
        held_floor: held.map(|h| h.floor),
        sizes: sizes.collect(),
        seconds,
        seal: made.seal.clone(),
        report,
    }
}
