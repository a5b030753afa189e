//! Slope and intercept of a straight calibration line without effects, noise stated and not.

use errsep::diagnosis::{Options, diagnose};
use errsep_models::calibration_line::CalibrationLine;
use errsep_models::calibration_line::simulate::{CalibrationSimulation, simulate};
use rayon::prelude::*;

use super::tally::{Row, Tally};

const NOISE: f64 = 1e-3;

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (loads, sets) in [(10, 1), (10, 2), (20, 4)] {
        for noise in [None, Some(NOISE)] {
            let what = CalibrationSimulation {
                line: [0.5, 2e-3],
                full_scale: 1000.0,
                loads,
                sets,
                both_directions: false,
                noise: NOISE,
                disturbances: Vec::new(),
            };
            let tallies: Vec<[Tally; 2]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| {
                    let readings = simulate(&what, seed).ok()?;
                    let model = CalibrationLine::new(&readings, noise).ok()?;
                    let options = Options {
                        draws: 200,
                        ..Options::default()
                    };
                    let diagnosis = diagnose(&model, &options);
                    let freedom = diagnosis.noise.degrees_of_freedom;
                    let mut tallies = [Tally::default(); 2];
                    for bias in &diagnosis.bias {
                        let (k, truth) = match bias.quantity.as_str() {
                            "intercept" => (0, what.line[0]),
                            _ => (1, what.line[1]),
                        };
                        tallies[k].add(
                            bias.before - truth,
                            bias.std,
                            freedom.unwrap_or(f64::INFINITY),
                        );
                    }
                    Some(tallies)
                })
                .collect();
            for (k, name) in ["intercept", "slope"].into_iter().enumerate() {
                rows.push(Row {
                    case: format!(
                        "{loads} loads, {sets} sets, noise {}",
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
