//! What is run: one effect, two, one withheld, none.

pub mod nulls;
pub mod pairs;
pub mod single;
pub mod withheld;

use std::time::Instant;

use crate::arguments::Arguments;
use crate::case::{Case, Order, made};
use crate::dump::dump;
use crate::noise::Law;
use crate::physics::{SOURCES, Source};
use crate::product::catalogue;

/// Laws of noise of cases with effects, in turn.
pub const LAWS: [Law; 4] = [
    Law::White,
    Law::Correlated,
    Law::HeavyTails,
    Law::RoughForms,
];

/// Standard deviations between two effects from which on they count as told apart: twice the 99 %
/// quantile of the normal law.
pub const APART: f64 = 4.65;

/// Makes a case and writes it where that is asked for.
pub fn prepared(arguments: &Arguments, order: &Order) -> Result<Case, String> {
    let case = made(order);
    if let Some(folder) = &arguments.dump {
        dump(
            folder,
            &format!("{} seed {}", order.name, order.seed),
            &case,
        )?;
    }
    Ok(case)
}

/// Names of the effects that the product knows today.
pub fn known() -> Result<Vec<String>, String> {
    let any = Order {
        name: "catalogue".to_owned(),
        seed: 0,
        sources: Vec::new(),
        law: Law::White,
        design: crate::design::Design::Shared,
        count: crate::design::Count::default(),
    };
    catalogue(&made(&any).observations)
}

/// The sources that the product knows and four channels show.
pub fn namable(known: &[String]) -> Vec<&'static Source> {
    SOURCES
        .iter()
        .filter(|s| !s.absorbed && known.iter().any(|name| name == s.name))
        .collect()
}

/// How long a set took and how.
pub fn ended(start: Instant, cases: usize) {
    println!("\n{cases} cases in {:.0} s", start.elapsed().as_secs_f64());
}
