//! Nothing but noise.

use std::time::Instant;

use rayon::prelude::*;

use super::{ended, prepared};
use crate::arguments::Arguments;
use crate::case::Order;
use crate::noise::Law;
use crate::product::ask;
use crate::table::{print, rate};

/// Runs the set and prints its table.
pub fn run(arguments: &Arguments) -> Result<(), String> {
    let start = Instant::now();
    let mut orders = Vec::new();
    for number in arguments.from..arguments.from + arguments.cases {
        for (name, law) in Law::ALL {
            orders.push((name, law, number));
        }
    }
    let answers: Result<Vec<_>, String> = orders
        .par_iter()
        .map(|(name, law, number)| Ok((*name, one(arguments, *law, *number)?)))
        .collect();
    let answers = answers?;
    let line = |name: &str, mine: &dyn Fn(&str) -> bool| {
        let mine: Vec<(f64, bool)> = answers
            .iter()
            .filter(|(law, _)| mine(law))
            .filter_map(|(_, said)| *said)
            .collect();
        let of = |holds: &dyn Fn(&(f64, bool)) -> bool| {
            rate(mine.iter().filter(|said| holds(said)).count(), mine.len())
        };
        let below = |level: f64| of(&|(p, _)| *p < level);
        let dependent = of(&|(_, dependent)| *dependent);
        vec![name.to_owned(), below(0.01), below(0.05), dependent]
    };
    let mut lines: Vec<Vec<String>> = Law::ALL
        .iter()
        .map(|(name, _)| line(name, &|law| law == *name))
        .collect();
    lines.push(line("all", &|_| true));
    println!("\n### Nothing put in");
    print(
        &[
            "noise",
            "alarms at 1 % (95 % limits)",
            "alarms at 5 % (95 % limits)",
            "said not to be independent noise, at 0.2 %",
        ],
        &lines,
    );
    let refused = answers.iter().filter(|(_, p)| p.is_none()).count();
    if refused > 0 {
        println!("\n{refused} refused");
    }
    ended(start, answers.len());
    Ok(())
}

/// The probability that the answer gives to as much with nothing there, and whether the noise is said to be dependent;
/// none where it is refused.
fn one(arguments: &Arguments, law: Law, number: u64) -> Result<Option<(f64, bool)>, String> {
    let order = Order {
        name: format!("null {} {number}", law.name()),
        seed: arguments.seed,
        sources: Vec::new(),
        law,
        design: arguments.design.1,
        count: arguments.count,
    };
    let case = prepared(arguments, &order)?;
    let said = ask(&case, &[], (arguments.severity, number));
    if let Ok(said) = &said
        && said.p_value < 0.01
    {
        println!(
            "--nulls --seed {} --from {number} --cases 1, {}: p {:.4}, {}",
            arguments.seed,
            law.name(),
            said.p_value,
            said.in_words()
        );
    }
    Ok(said.ok().map(|said| (said.p_value, said.dependent)))
}
