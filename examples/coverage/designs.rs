//! Slopes and forms of designs of 8, 12 and 16 channels: exact geometry of waves that no spline is, white
//! noise, stated or not. With the noise stated u is the root of the Cramér–Rao bound, and "rms of error/u"
//! the error in its units.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{Design, DesignChannel, DesignOptions, SLOPES, fit};
use errsep_models::reversal::simultaneous::Knots;
use rayon::prelude::*;

use super::tally::{Row, Tally};

const THICKNESS_MM: f64 = 40.0;
const NOISE_UM: f64 = 0.1;
const CELLS: usize = 16;

const QUARTERS: [f64; 4] = [0.0, 90.0, 180.0, 270.0];

/// Name, indicators, positions of the spindle.
const DESIGNS: [(&str, &[f64], &[f64]); 3] = [
    (
        "8 channels: four indicators, 0°/180°",
        &QUARTERS,
        &[0.0, 180.0],
    ),
    (
        "12 channels: near, far, top, every 90°",
        &[0.0, 180.0, 90.0],
        &QUARTERS,
    ),
    (
        "16 channels: four indicators, every 90°",
        &QUARTERS,
        &QUARTERS,
    ),
];

/// The table.
pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, indicators, positions) in DESIGNS {
        let pairs = indicators
            .iter()
            .flat_map(|i| positions.iter().map(move |p| (*i, *p)));
        let channels: Vec<DesignChannel> = pairs
            .filter_map(|(i, p)| DesignChannel::at(i, p).ok())
            .collect();
        let Ok(design) = Design::new(channels) else {
            continue;
        };
        for stated in [true, false] {
            let tallies = (0..seeds)
                .into_par_iter()
                .map(|seed| one(&design, seed, stated))
                .reduce(
                    || vec![Tally::default(); SLOPES.len() + 2],
                    |a, b| a.into_iter().zip(b).map(|(a, b)| a.and(b)).collect(),
                );
            let quantities = SLOPES
                .iter()
                .copied()
                .chain(["forms of the slide", "sides"]);
            let case = format!("{name}{}", if stated { ", noise stated" } else { "" });
            for (quantity, tally) in quantities.zip(tallies).filter(|(_, t)| t.any()) {
                rows.push(Row {
                    case: case.clone(),
                    quantity: quantity.to_owned(),
                    seeds,
                    tally,
                });
            }
        }
    }
    rows
}

/// One data set: the slopes, then the forms of the slide and of the sides in five places.
fn one(design: &Design, seed: u64, stated: bool) -> Vec<Tally> {
    let mut tallies = vec![Tally::default(); SLOPES.len() + 2];
    let plan = DesignPlan {
        design: design.clone(),
        slopes_rad: [2e-4, -1.5e-4, 3e-4, 1e-4, 1e-4, 2e-5, 0.0],
        kept_um: None,
        thickness_mm: THICKNESS_MM,
        length_mm: 300.0,
        positions: 61,
        repeats: 1,
        noise_um: NOISE_UM,
        forms_um: [1.0, 1.0],
        seed,
    };
    let options = DesignOptions {
        thickness_mm: THICKNESS_MM,
        noise_um: stated.then_some(NOISE_UM),
        knots: Knots::Cells(CELLS),
        ..DesignOptions::default()
    };
    let Ok((observations, truth)) = simulate(&plan) else {
        return tallies;
    };
    let Ok(found) = fit(&observations, &options) else {
        return tallies;
    };
    let freedom = found.freedom();
    for (k, name) in SLOPES.iter().enumerate() {
        if let Some(value) = found.slope(name) {
            tallies[k].add(value.value - truth.slopes_rad[k], value.std, freedom);
        }
    }
    let x = [0.0, 35.0, 110.0, 190.0, 300.0];
    for form in found.forms(&x) {
        let (own, place) = match (form.name.as_str(), form.side) {
            ("M_h", _) => (&truth.slide[0], 0),
            ("M_v", _) => (&truth.slide[1], 0),
            (_, Some(side)) => {
                let at = design.sides().iter().position(|s| *s == side);
                (&truth.sides[at.unwrap_or(0)], 1)
            }
            _ => continue,
        };
        for ((x, value), std) in x.iter().zip(&form.values).zip(&form.std) {
            tallies[SLOPES.len() + place].add(value - own.at(*x), *std, freedom);
        }
    }
    tallies
}
