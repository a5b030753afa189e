//! Parts measured again and again: mean, components, a future reading, from parts that hardly differ to
//! parts that differ ten times as much as their measurement scatters.

use errsep_models::anova::{Group, Groups, Interval, analyse};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

/// Names and counts of the designs.
const DESIGNS: [(&str, &[usize]); 6] = [
    ("2 × 4", &[4, 4]),
    ("3 × 3", &[3, 3, 3]),
    ("5 × 2", &[2, 2, 2, 2, 2]),
    ("2, 5, 9", &[2, 5, 9]),
    ("1 2 3 4 5 2 3 6", &[1, 2, 3, 4, 5, 2, 3, 6]),
    ("1 1 1 1 2 2 2 10", &[1, 1, 1, 1, 2, 2, 2, 10]),
];
const RATIOS: [f64; 5] = [0.0, 0.3, 1.0, 3.0, 10.0];
const MEAN: f64 = 12.0;

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, counts) in DESIGNS {
        for ratio in RATIOS {
            let tallies: Vec<[Tally; 4]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| one(counts, ratio, seed))
                .collect();
            let quantities = ["mean", "future reading", "between parts", "one measurement"];
            for (k, quantity) in quantities.into_iter().enumerate() {
                rows.push(Row {
                    case: format!("{name}, σ_b/σ_w = {ratio}"),
                    quantity: quantity.to_owned(),
                    seeds: tallies.len() as u64,
                    tally: tallies
                        .iter()
                        .fold(Tally::default(), |sum, t| sum.and(t[k])),
                });
            }
        }
    }
    rows
}

/// One set of readings; `None` if it cannot be analysed, which the number of sets then shows.
fn one(counts: &[usize], ratio: f64, seed: u64) -> Option<[Tally; 4]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let groups = counts.iter().enumerate().map(|(part, count)| {
        let own = MEAN + ratio * normal();
        Group {
            name: part.to_string(),
            readings: (0..*count).map(|_| own + normal()).collect(),
        }
    });
    let groups = Groups::new(groups.collect()).ok()?;
    let next = MEAN + ratio * normal() + normal();
    let [narrow, wide] = [ONE_SIGMA, 0.95].map(|p| analyse(&groups, "um", p));
    let (narrow, wide) = (narrow.ok()?, wide.ok()?);
    let mut tallies = [Tally::default(); 4];
    let mut quantity = |k: usize, q: &errsep_models::uncertainty::Quantity, truth: f64| {
        tallies[k].add(
            q.value - truth,
            q.standard_uncertainty,
            q.degrees_of_freedom.as_f64(),
        );
    };
    quantity(0, &wide.mean, MEAN);
    quantity(1, &wide.future_reading.as_ref()?.result, next);
    let component = |i: &Interval, sigma: f64| (i.lower..=i.upper).contains(&(sigma * sigma));
    for (k, sigma) in [(2, ratio), (3, 1.0)] {
        let of = |found: &errsep_models::anova::OneWay| {
            let parts = found.components;
            let interval = if k == 2 { parts.between } else { parts.within };
            interval.map(|i| component(&i, sigma))
        };
        tallies[k].add_inside(of(&narrow)?, of(&wide)?);
    }
    Some(tallies)
}
