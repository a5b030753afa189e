//! What a named effect is worth, on the models but the reversal: `cargo run --release --example
//! severity_campaign -- CASES SEED MODEL`. For each effect at four times the size that is seen with 80 %:
//! how often it is named alone, and strong; with it withheld at 1.5 to 4 times: how often another is
//! named, and strong. Then how often score stage and whole diagnosis agree on rivals.

#[path = "../tests/other_models/mod.rs"]
mod other_models;

use errsep::diagnosis::{Agreement, Confidence, Diagnosis, Options, agreement};
use other_models::{MAKERS, Maker, calibration_line_made, fourier_made, judged, seen_from};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Rivals of each family that are named in both ways, for one measurement.
const EACH: usize = 8;

fn options(without: &[&str]) -> Options {
    Options {
        draws: 400,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        severity: 256,
        ..Options::default()
    }
}

fn strong(diagnosis: &Diagnosis) -> bool {
    let all = &diagnosis.verdict.severity;
    !all.is_empty() && all.iter().all(|s| s.confidence == Confidence::Strong)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: u64| {
        let given = arguments.get(k).and_then(|a| a.parse().ok());
        given.unwrap_or(usual)
    };
    let (cases, first) = (number(0, 8), number(1, 1));
    println!("{cases} cases an effect, seed {first}");
    let chosen = |maker: &&Maker| arguments.get(2).is_none_or(|name| name == maker.model);
    for maker in MAKERS.iter().filter(chosen) {
        table(maker, cases, first);
        agreed(maker, cases, first);
    }
}

fn table(maker: &Maker, cases: u64, first: u64) {
    println!("\n### {}\n", maker.model);
    println!(
        "| effect | at four times: alone | of them strong | withheld: another named | of them strong |"
    );
    println!("|---|---|---|---|---|");
    for effect in maker.effects {
        let smallest = seen_from(
            maker,
            effect,
            &Options {
                severity: 0,
                ..options(&[])
            },
        );
        let outcomes: Vec<[bool; 4]> = (0..cases)
            .into_par_iter()
            .map(|case| {
                let mut random = ChaCha8Rng::seed_from_u64(first * 10_000 + case);
                let size = smallest * (1.5 + 2.5 * random.random::<f64>());
                let seed = random.random_range(2..1_000_000);
                let known = (maker.diagnosed)(&[(effect, 4.0 * smallest)], seed, &options(&[]));
                let hidden = (maker.diagnosed)(&[(effect, size)], seed, &options(&[effect]));
                let right = judged(&known, Some(effect)) == "named alone";
                let wrong = judged(&hidden, Some(effect)) == "another named";
                [
                    right,
                    right && strong(&known),
                    wrong,
                    wrong && strong(&hidden),
                ]
            })
            .collect();
        let of = |k: usize| outcomes.iter().filter(|o| o[k]).count();
        println!(
            "| {effect} | {} of {cases} | {} | {} of {cases} | {} |",
            of(0),
            of(1),
            of(2),
            of(3)
        );
    }
}

/// Score stage and whole diagnoses, on rivals of names near the limit of detection and well above.
fn agreed(maker: &Maker, cases: u64, first: u64) {
    let mut sum = Agreement::default();
    for effect in maker.effects {
        let plain = Options {
            severity: 0,
            ..options(&[])
        };
        let smallest = seen_from(maker, effect, &plain);
        for case in 0..cases.div_ceil(4) {
            let put = [(*effect, smallest * if case % 2 == 0 { 1.5 } else { 4.0 })];
            let seed = first * 40_000 + case;
            let own = match maker.model {
                "calibration-line" => {
                    agreement(&calibration_line_made(&put, seed, 1.0), &plain, EACH)
                }
                "fourier" => agreement(&fourier_made(&put, seed, 1.0), &plain, EACH),
                _ => return,
            };
            sum.cases += own.cases;
            sum.scored += own.scored;
            sum.whole += own.whole;
            sum.both += own.both;
        }
    }
    println!(
        "\nRivals named alike: {} by the score stage, {} by whole diagnoses, {} by both, of {}.",
        sum.scored, sum.whole, sum.both, sum.cases
    );
}
