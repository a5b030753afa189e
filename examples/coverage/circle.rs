//! Centre and radius: full circles and arcs, noise stated and not.

use errsep_models::circle::{CircleSimulation, Point, orthogonal_fit, simulate};
use rayon::prelude::*;

use super::tally::{Row, Tally};

const NOISE_UM: f64 = 1.0;

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (points, arc_degrees) in [(8, 360.0), (36, 360.0), (36, 90.0)] {
        for noise in [None, Some(NOISE_UM)] {
            let what = CircleSimulation {
                centre: Point::new(3.0, -2.0),
                count: points,
                arc: f64::to_radians(arc_degrees),
                noise_um: NOISE_UM,
                ..CircleSimulation::default()
            };
            let truth = [what.centre.x, what.centre.y, what.radius];
            let tallies: Vec<[Tally; 3]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| {
                    let fit = orthogonal_fit(&simulate(&what, seed).ok()?, noise).ok()?;
                    let mut tallies = [Tally::default(); 3];
                    for (k, quantity) in fit.quantities().ok()?.iter().enumerate() {
                        tallies[k].add(
                            quantity.value - truth[k],
                            quantity.standard_uncertainty,
                            quantity.degrees_of_freedom.as_f64(),
                        );
                    }
                    Some(tallies)
                })
                .collect();
            for (k, name) in ["centre x", "centre y", "radius"].into_iter().enumerate() {
                rows.push(Row {
                    case: format!(
                        "{points} points over {arc_degrees}°, noise {}",
                        if noise.is_some() {
                            "stated"
                        } else {
                            "estimated"
                        }
                    ),
                    quantity: name.to_owned(),
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
