//! Blind campaign for every model but the reversal: `cargo run --release --example
//! other_models_campaign -- CASES SEED`. Prints, as tables, for each effect, how often it was named, and what
//! was said with the effect withheld and with nothing there.

#[path = "../tests/other_models/mod.rs"]
mod other_models;

use std::collections::BTreeMap;

use errsep::diagnosis::Options;
use other_models::{MAKERS, judged, seen_from};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

fn main() {
    let mut arguments = std::env::args()
        .skip(1)
        .filter_map(|a| a.parse::<u64>().ok());
    let (cases, first) = (
        arguments.next().unwrap_or(20),
        arguments.next().unwrap_or(1),
    );
    println!("{cases} cases an effect, seed {first}; sizes 1.5 to 4 times what is seen with 80 %");
    for maker in MAKERS {
        let options = |without: &[&str]| Options {
            draws: 400,
            without: without.iter().map(|s| (*s).to_owned()).collect(),
            ..Options::default()
        };
        println!("\n### {}\n", maker.model);
        println!("| effect | seen from | put in | the same, withheld |\n|---|---|---|---|");
        for effect in maker.effects {
            let smallest = seen_from(&maker, effect, &options(&[]));
            let outcomes: Vec<[String; 2]> = (0..cases)
                .into_par_iter()
                .map(|case| {
                    let mut random = ChaCha8Rng::seed_from_u64(first * 10_000 + case);
                    let size = smallest * (1.5 + 2.5 * random.random::<f64>());
                    let seed = random.random_range(2..1_000_000);
                    let put = Some((*effect, size));
                    let known = (maker.diagnosed)(put, seed, &options(&[]));
                    let withheld = (maker.diagnosed)(put, seed, &options(&[effect]));
                    let said = judged(&known, Some(effect));
                    let other = match judged(&withheld, Some(effect)) {
                        "another named" => withheld.verdict.effects.join(" + "),
                        word => word.to_owned(),
                    };
                    let said = match said {
                        "another named" | "with another" => {
                            format!("{said} ({})", known.verdict.effects.join(" + "))
                        }
                        word => word.to_owned(),
                    };
                    [said, other]
                })
                .collect();
            let count = |which: usize| {
                let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
                for outcome in &outcomes {
                    *counts.entry(outcome[which].as_str()).or_default() += 1;
                }
                let parts: Vec<String> = counts
                    .iter()
                    .map(|(said, n)| format!("{said} {n}"))
                    .collect();
                parts.join(", ")
            };
            println!(
                "| {effect} | {smallest:.3e} | {} | {} |",
                count(0),
                count(1)
            );
        }
        let alarms = (0..10 * cases)
            .into_par_iter()
            .filter(|case| {
                let diagnosis = (maker.diagnosed)(None, first * 20_000 + case, &options(&[]));
                judged(&diagnosis, None) != "none, right"
            })
            .count();
        println!("\nNothing there: {alarms} alarms in {}.", 10 * cases);
    }
}
