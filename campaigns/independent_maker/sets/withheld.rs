//! One effect a case, which the catalogue has not.

use std::time::Instant;

use rayon::prelude::*;

use super::{APART, LAWS, ended, known, namable, prepared};
use crate::arguments::Arguments;
use crate::case::{Case, Order};
use crate::physics::Source;
use crate::product::{Said, ask};
use crate::seen::Seen;
use crate::table::{print, rate};

/// How an answer without the true effect's name stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Withheld {
    /// `unknown`.
    Unknown,
    /// What the readings cannot tell from the truth.
    Alias,
    /// Another.
    Another,
    /// Another by a strong name.
    Strong,
    /// `none`.
    Nothing,
    /// Readings that are not taken.
    Refused,
}

const NAMES: [(Withheld, &str); 6] = [
    (Withheld::Unknown, "`unknown`"),
    (Withheld::Alias, "what these readings cannot tell from it"),
    (Withheld::Another, "another is blamed"),
    (Withheld::Strong, "another is blamed, strong"),
    (Withheld::Nothing, "`none`"),
    (Withheld::Refused, "refused"),
];

/// Runs the set and prints its tables.
pub fn run(arguments: &Arguments) -> Result<(), String> {
    let start = Instant::now();
    let known = known()?;
    let namable: Vec<&Source> = namable(&known)
        .into_iter()
        .filter(|s| {
            arguments
                .only
                .as_ref()
                .is_none_or(|(name, _)| s.name == name)
        })
        .collect();
    if namable.is_empty() {
        return Err("the catalogue has no such effect".to_owned());
    }
    let numbers: Vec<u64> = (arguments.from..arguments.from + arguments.cases).collect();
    let outcomes: Result<Vec<_>, String> = numbers
        .par_iter()
        .map(|k| one(arguments, &namable, *k))
        .collect();
    let outcomes = outcomes?;
    let count = |which: Withheld, source: Option<&str>| {
        let mine = |o: &&(&str, Withheld)| o.1 == which && source.is_none_or(|name| o.0 == name);
        outcomes.iter().filter(mine).count()
    };
    println!("\n### The effect withheld from the catalogue");
    let mut lines: Vec<Vec<String>> = NAMES
        .iter()
        .map(|(which, name)| {
            vec![
                (*name).to_owned(),
                rate(count(*which, None), outcomes.len()),
            ]
        })
        .collect();
    let right = count(Withheld::Unknown, None) + count(Withheld::Alias, None);
    lines.insert(0, vec!["right".to_owned(), rate(right, outcomes.len())]);
    print(&["what", "measured (95 % limits)"], &lines);
    let rows: Vec<Vec<String>> = namable
        .iter()
        .map(|source| {
            let mut line = vec![source.name.to_owned()];
            line.extend(
                NAMES
                    .iter()
                    .map(|(which, _)| count(*which, Some(source.name)).to_string()),
            );
            line
        })
        .collect();
    let mut head = vec!["withheld"];
    head.extend(NAMES.iter().map(|(_, name)| *name));
    print(&head, &rows);
    ended(start, outcomes.len());
    Ok(())
}

fn one(
    arguments: &Arguments,
    namable: &[&'static Source],
    number: u64,
) -> Result<(&'static str, Withheld), String> {
    let sources = namable.len() as u64;
    let source = namable[(number % sources) as usize];
    let round = number / sources;
    let which = (round % source.realisations as u64) as usize;
    let law = LAWS[((number + round) % LAWS.len() as u64) as usize];
    let order = Order {
        name: format!("withheld {number}"),
        seed: arguments.seed,
        sources: vec![(source, which)],
        law,
        design: arguments.design.1,
        count: arguments.count,
    };
    let case = prepared(arguments, &order)?;
    let said = ask(&case, &[source.name], (arguments.severity, number));
    let (outcome, apart) = match &said {
        Err(_) => (Withheld::Refused, None),
        Ok(said) if said.kind == "unknown" => (Withheld::Unknown, None),
        Ok(said) if said.kind == "none" => (Withheld::Nothing, None),
        Ok(said) => {
            let (outcome, apart) = blamed(&case, source.name, said, number)?;
            (outcome, Some(apart))
        }
    };
    if outcome != Withheld::Unknown {
        let truth = &case.truths[0];
        println!(
            "--withheld --seed {} --from {number} --cases 1{}: {}/{which} ({}), {}, shows {:.2} noise: {}{}",
            arguments.seed,
            arguments
                .only
                .as_ref()
                .map_or(String::new(), |(name, _)| format!(" --only {name}")),
            source.name,
            truth.what,
            law.name(),
            truth.visible / case.noise.sigma,
            said.map_or_else(|what| what, |said| said.in_words()),
            apart.map_or(String::new(), |sd| format!(", {sd:.1} sd apart")),
        );
    }
    Ok((source.name, outcome))
}

/// How an answer stands that names others. What is named cannot be told from the withheld effect where the whole
/// catalogue puts it into one group with that, or where what the effect changes and what is named, at its best size,
/// are less than [`APART`] standard deviations apart in what shows beside the noise.
fn blamed(case: &Case, effect: &str, said: &Said, number: u64) -> Result<(Withheld, f64), String> {
    let seen = Seen::new(&case.schedule, &case.noise);
    let apart = seen.map_or(f64::INFINITY, |s| s.beside(&case.change, &said.change));
    let whole = ask(case, &[], (0, number))?;
    let own = |group: &Vec<String>| group.iter().any(|name| name == effect);
    let aliases = whole.causes().into_iter().find(own).unwrap_or_default();
    let told = |group: &[String]| group.iter().all(|name| !aliases.contains(name));
    let outcome = if apart < APART || !said.causes().iter().any(|group| told(group)) {
        Withheld::Alias
    } else if said.is_strong(told) {
        Withheld::Strong
    } else {
        Withheld::Another
    };
    Ok((outcome, apart))
}
