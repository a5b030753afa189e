//! Two effects of different kinds a case.

use std::time::Instant;

use rayon::prelude::*;

use super::{APART, LAWS, ended, known, namable, prepared};
use crate::arguments::Arguments;
use crate::case::{Case, Order};
use crate::chance::Chance;
use crate::judge::{BOTH, Both, both};
use crate::physics::Source;
use crate::product::{apart, ask};
use crate::seen::Seen;
use crate::table::{print, rate};

/// Runs the set and prints its table.
pub fn run(arguments: &Arguments) -> Result<(), String> {
    let start = Instant::now();
    let known = known()?;
    let namable = namable(&known);
    let numbers: Vec<u64> = (arguments.from..arguments.from + arguments.cases).collect();
    let outcomes: Result<Vec<(Both, Option<bool>)>, String> = numbers
        .par_iter()
        .map(|k| one(arguments, &namable, *k))
        .collect();
    let outcomes = outcomes?;
    let mut lines: Vec<Vec<String>> = BOTH
        .iter()
        .map(|(outcome, name)| {
            let count = outcomes.iter().filter(|o| o.0 == *outcome).count();
            vec![(*name).to_owned(), rate(count, outcomes.len())]
        })
        .collect();
    let separable: Vec<Both> = (outcomes.iter())
        .filter(|(_, separable)| *separable == Some(true))
        .map(|(outcome, _)| *outcome)
        .collect();
    if arguments.certificate {
        let count = separable.iter().filter(|o| **o == Both::Exactly).count();
        lines.push(vec![
            "exactly both, of those that the certificate tells apart".to_owned(),
            rate(count, separable.len()),
        ]);
    }
    println!("\n### Two effects at once");
    print(&["what", "measured (95 % limits)"], &lines);
    ended(start, outcomes.len());
    Ok(())
}

/// The answer to a pair, and whether the certificate tells its effects apart, where that is asked.
fn one(
    arguments: &Arguments,
    namable: &[&'static Source],
    number: u64,
) -> Result<(Both, Option<bool>), String> {
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
        count: arguments.count,
    };
    let case = prepared(arguments, &order)?;
    let said = ask(&case, &[], (arguments.severity, number));
    let outcome = both(&said, [first.name, second.name]);
    let apart = arguments.certificate.then(|| least_apart(&case));
    if outcome != Both::Exactly {
        let shows: Vec<String> = case
            .truths
            .iter()
            .zip(which)
            .map(|(t, k)| format!("{}/{k} {:.2}", t.name, t.visible / case.noise.sigma))
            .collect();
        println!(
            "--pairs --seed {} --from {number} --cases 1: {}, {}{}: {}",
            arguments.seed,
            shows.join(" + "),
            law.name(),
            apart.map_or_else(String::new, |apart| format!(", {apart:.1} sd apart")),
            said.map_or_else(|what| what, |said| said.in_words())
        );
    }
    Ok((outcome, apart.map(|apart| apart >= APART)))
}

/// How far each effect of a case, as far as it shows beside the other, is from the effect most like it: the lesser,
/// in standard deviations.
fn least_apart(case: &Case) -> f64 {
    let Some(seen) = Seen::new(&case.schedule, &case.noise) else {
        return 0.0;
    };
    let [first, second] = [0, 1].map(|k| &case.truths[k].change);
    let beside = [seen.beside(first, second), seen.beside(second, first)];
    let apart = apart(case, &beside).into_iter();
    apart
        .map(|sd| sd.unwrap_or(0.0))
        .fold(f64::INFINITY, f64::min)
}
