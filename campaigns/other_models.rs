//! Blind campaign for every model but the reversal: `cargo run --release -p errsep-campaigns --bin
//! other_models -- CASES SEED [MODEL] [nulls | sizes]`. Prints, as tables, for each effect, how often it was
//! named, how often its size was within two standard uncertainties (where no other sensor or channel is left open),
//! and what was said with the effect withheld; for each pair of effects whether both were named; and the
//! alarms with nothing there. `nulls`: the alarms only. `sizes`: how often an effect is seen in just the size that the
//! same readings without it are said to show with 80 % probability, and in the greatest by its shape.

#[path = "../tests/other_models/mod.rs"]
mod other_models;

use std::collections::BTreeMap;

use errsep::diagnosis::{Kind, Options};
use other_models::{MAKERS, Maker, judged, judged_pair, seen_from, told_of_put, within};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Sets of readings with nothing there for one case of an effect.
const NULLS: u64 = 40;

fn options(without: &[&str]) -> Options {
    Options {
        draws: 400,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    }
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual| given.get(k).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (cases, first): (u64, u64) = (number(0, 20), number(1, 1));
    let words = given.get(2..).unwrap_or_default();
    let known = |word: &str| {
        ["nulls", "sizes"].contains(&word) || MAKERS.iter().any(|maker| maker.model == word)
    };
    if let Some(word) = words.iter().find(|word| !known(word)) {
        eprintln!("{word} is neither a model nor `nulls` or `sizes`");
        std::process::exit(2);
    }
    let asked = |word: &str| words.iter().any(|w| w == word);
    let named: Vec<&Maker> = MAKERS.iter().filter(|m| asked(m.model)).collect();
    let makers = if named.is_empty() {
        MAKERS.iter().collect()
    } else {
        named
    };
    println!("{cases} cases an effect, seed {first}");
    for maker in makers {
        println!("\n### {}\n", maker.model);
        if asked("sizes") {
            smallest(maker, cases, first);
            continue;
        }
        if !asked("nulls") {
            let seen: Vec<(&str, f64)> = maker
                .effects
                .iter()
                .map(|effect| (*effect, seen_from(maker, effect, &options(&[]))))
                .collect();
            println!("Sizes 1.5 to 4 times what is seen with 80 %.\n");
            single(maker, &seen, cases, first);
            pairs(maker, &seen, cases, first);
        }
        let alarms = (0..NULLS * cases)
            .into_par_iter()
            .filter(|case| {
                // Draws of their own: the same in all cases would make one law, in error by the same, of all.
                let own = Options {
                    seed: first * 20_000 + case,
                    ..options(&[])
                };
                let diagnosis = maker.diagnosed(&[], first * 20_000 + case, &own);
                judged(&diagnosis, None) != "none, right"
            })
            .count();
        println!("\nNothing there: {alarms} alarms in {}.", NULLS * cases);
    }
}

/// What readings without an effect tell of its sizes, and whether it is seen in them.
struct Told {
    size: f64,
    seen: bool,
    at_least: bool,
    /// The greatest of the sizes by shape, where one that is plausible is told, and whether it is seen in that.
    greatest: Option<(f64, bool)>,
}

/// Each effect in the sizes that readings without it are said to show.
fn smallest(maker: &Maker, cases: u64, first: u64) {
    let told: Vec<Vec<Option<Told>>> = (0..cases)
        .into_par_iter()
        .map(|case| {
            let seed = first * 40_000 + case;
            let own = Options {
                seed,
                ..options(&[])
            };
            let bare = maker.diagnosed(&[], seed, &own);
            let seen = |effect: &str, size: f64| {
                let put = [(effect, size / told_of_put(maker.model, effect))];
                maker.diagnosed(&put, seed, &own).verdict.kind != Kind::None
            };
            let of = |effect: &&str| {
                let hidden = bare.hidden.iter().find(|h| h.effect == **effect)?;
                let size = hidden.detectable?;
                let greatest = hidden.by_shape.and_then(|shapes| shapes.to);
                Some(Told {
                    size,
                    seen: seen(effect, size),
                    at_least: hidden.at_least,
                    greatest: greatest.map(|size| (size, seen(effect, size))),
                })
            };
            maker.effects.iter().map(of).collect()
        })
        .collect();
    println!(
        "| effect | size told, median | told in | as the least | seen | greatest by shape, median | told in | seen |\n\
         |---|---|---|---|---|---|---|---|"
    );
    for (k, effect) in maker.effects.iter().enumerate() {
        let own: Vec<&Told> = told.iter().filter_map(|case| case[k].as_ref()).collect();
        let seen = own.iter().filter(|told| told.seen).count();
        let least = own.iter().filter(|told| told.at_least).count();
        let greatest: Vec<(f64, bool)> = own.iter().filter_map(|told| told.greatest).collect();
        println!(
            "| {effect} | {} | {} of {cases} | {least} | {seen} | {} | {} | {} |",
            median(own.iter().map(|told| told.size).collect()),
            own.len(),
            median(greatest.iter().map(|g| g.0).collect()),
            greatest.len(),
            greatest.iter().filter(|g| g.1).count()
        );
    }
}

fn median(mut sizes: Vec<f64>) -> String {
    sizes.sort_by(f64::total_cmp);
    let middle = sizes.get(sizes.len() / 2);
    middle.map_or("none".to_owned(), |size| format!("{size:.3e}"))
}

/// Each effect alone, with the whole catalogue and withheld.
fn single(maker: &Maker, seen: &[(&str, f64)], cases: u64, first: u64) {
    println!("| effect | seen from | put in | size within 2 u | the same, withheld |");
    println!("|---|---|---|---|---|");
    for (effect, smallest) in seen {
        let outcomes: Vec<(String, Option<bool>, String)> = (0..cases)
            .into_par_iter()
            .map(|case| {
                let mut random = ChaCha8Rng::seed_from_u64(first * 10_000 + case);
                let size = smallest * (1.5 + 2.5 * random.random::<f64>());
                let seed = random.random_range(2..1_000_000);
                let put = [(*effect, size)];
                let known = maker.diagnosed(&put, seed, &options(&[]));
                let withheld = maker.diagnosed(&put, seed, &options(&[effect]));
                let other = match judged(&withheld, Some(effect)) {
                    "another named" => withheld.verdict.effects.join(" + "),
                    word => word.to_owned(),
                };
                let said = judged(&known, Some(effect));
                let near = (said == "named alone")
                    .then(|| within(&known, effect, size))
                    .flatten();
                let said = match said {
                    "another named" | "with another" => {
                        format!("{said} ({})", known.verdict.effects.join(" + "))
                    }
                    word => word.to_owned(),
                };
                (said, near, other)
            })
            .collect();
        let sized = outcomes.iter().filter_map(|o| o.1).count();
        let near = outcomes.iter().filter(|o| o.1 == Some(true)).count();
        println!(
            "| {effect} | {smallest:.3e} | {} | {near} of {sized} | {} |",
            counted(outcomes.iter().map(|o| o.0.as_str())),
            counted(outcomes.iter().map(|o| o.2.as_str()))
        );
    }
}

/// Every two effects at once.
fn pairs(maker: &Maker, seen: &[(&str, f64)], cases: u64, first: u64) {
    let both: Vec<[(&str, f64); 2]> = seen
        .iter()
        .enumerate()
        .flat_map(|(k, a)| seen[k + 1..].iter().map(move |b| [*a, *b]))
        .collect();
    let trials: Vec<([(&str, f64); 2], u64)> = both
        .iter()
        .flat_map(|pair| (0..cases.div_ceil(4)).map(move |case| (*pair, case)))
        .collect();
    let outcomes: Vec<(&str, [&str; 2])> = trials
        .par_iter()
        .map(|(pair, case)| {
            let mut random = ChaCha8Rng::seed_from_u64(first * 30_000 + case);
            let put = pair.map(|(effect, smallest)| {
                (effect, smallest * (1.5 + 2.5 * random.random::<f64>()))
            });
            let seed = random.random_range(2..1_000_000);
            let diagnosis = maker.diagnosed(&put, seed, &options(&[]));
            let names = pair.map(|(effect, _)| effect);
            (judged_pair(&diagnosis, names), names)
        })
        .collect();
    println!(
        "\nTwo at once, {} cases: {}.",
        outcomes.len(),
        counted(outcomes.iter().map(|o| o.0))
    );
    let missed = outcomes.iter().filter(|o| o.0 == "another among them");
    let names: Vec<String> = missed.map(|o| o.1.join(" + ")).collect();
    if !names.is_empty() {
        println!(
            "Another among them: {}.",
            counted(names.iter().map(String::as_str))
        );
    }
}

fn counted<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for word in words {
        *counts.entry(word).or_default() += 1;
    }
    let parts: Vec<String> = counts
        .iter()
        .map(|(said, n)| format!("{said} {n}"))
        .collect();
    parts.join(", ")
}
