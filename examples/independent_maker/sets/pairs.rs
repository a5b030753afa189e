//! Two effects of different kinds a case.

use std::time::Instant;

use rayon::prelude::*;

use super::{LAWS, ended, known, namable, prepared};
use crate::arguments::Arguments;
use crate::case::Order;
use crate::chance::Chance;
use crate::judge::{BOTH, Both, both};
use crate::physics::Source;
use crate::product::ask;
use crate::table::{print, rate};

/// Runs the set and prints its table.
pub fn run(arguments: &Arguments) -> Result<(), String> {
    let start = Instant::now();
    let known = known()?;
    let namable = namable(&known);
    let numbers: Vec<u64> = (arguments.from..arguments.from + arguments.cases).collect();
    let outcomes: Result<Vec<Both>, String> = numbers
        .par_iter()
        .map(|k| one(arguments, &namable, *k))
        .collect();
    let outcomes = outcomes?;
    let lines: Vec<Vec<String>> = BOTH
        .iter()
        .map(|(outcome, name)| {
            let count = outcomes.iter().filter(|o| *o == outcome).count();
            vec![(*name).to_owned(), rate(count, outcomes.len())]
        })
        .collect();
    println!("\n### Two effects at once");
    print(&["what", "measured (95 % limits)"], &lines);
    ended(start, outcomes.len());
    Ok(())
}

fn one(arguments: &Arguments, namable: &[&'static Source], number: u64) -> Result<Both, String> {
    let name = format!("pair {number}");
    let mut chance = Chance::of(&format!("{name} draw"), arguments.seed);
    let first = namable[chance.pick(namable.len())];
    let others: Vec<&&Source> = namable
        .iter()
        .filter(|s| s.family != first.family)
        .collect();
    let second = others[chance.pick(others.len())];
    let which = [
        chance.pick(first.realisations),
        chance.pick(second.realisations),
    ];
    let law = LAWS[(number % LAWS.len() as u64) as usize];
    let order = Order {
        name,
        seed: arguments.seed,
        sources: vec![(first, which[0]), (*second, which[1])],
        law,
        design: arguments.design.1,
    };
    let case = prepared(arguments, &order)?;
    let said = ask(&case, &[], (arguments.severity, number));
    let outcome = both(&said, [first.name, second.name]);
    if outcome != Both::Exactly {
        let shows: Vec<String> = case
            .truths
            .iter()
            .zip(which)
            .map(|(t, k)| format!("{}/{k} {:.2}", t.name, t.visible / case.noise.sigma))
            .collect();
        println!(
            "--pairs --seed {} --from {number} --cases 1: {}, {}: {}",
            arguments.seed,
            shows.join(" + "),
            law.name(),
            said.map_or_else(|what| what, |said| said.in_words())
        );
    }
    Ok(outcome)
}
