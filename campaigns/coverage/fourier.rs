//! Profile, straightness, orders and the steps at the joints: noise stated and estimated, joint not
//! compensated, from its readings and fitted, one spacing and three, with and without repeats.

use std::f64::consts::TAU;

use errsep_models::fourier::{
    Combination, Compensation, FourierSimulation, FourierTruth, Section, Separation, separate,
    simulate, straightness,
};
use errsep_models::uncertainty::coverage_factor;
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

const NOISE_UM: f64 = 2.0;
const SECTION: Section = Section {
    length: 100.0,
    orders: 30,
};
const QUANTITIES: [&str; 6] = [
    "profile",
    "straightness",
    "real parts",
    "imaginary parts",
    "order 1",
    "step at the joint",
];

pub fn rows(seeds: u64) -> Vec<Row> {
    let three = [48.5, 34.1, 78.6];
    let mut rows = Vec::new();
    for samples in [200, 1000, 4000] {
        for compensation in [
            Compensation::None,
            Compensation::Chord,
            Compensation::Fitted,
        ] {
            for noise in [None, Some(NOISE_UM)] {
                for combination in [Combination::LeastSquares, Combination::Hybrid] {
                    if combination == Combination::LeastSquares || samples == 200 {
                        let what = simulated(samples, &three, 1, compensation);
                        rows.extend(case(&what, compensation, combination, noise, seeds));
                    }
                }
            }
        }
    }
    for (spacings, repeats) in [(&three[1..2], 1), (&three[1..2], 3), (&three[..], 3)] {
        let what = simulated(200, spacings, repeats, Compensation::Fitted);
        let (fitted, all) = (Compensation::Fitted, Combination::LeastSquares);
        rows.extend(case(&what, fitted, all, None, seeds));
    }
    rows
}

/// Where the joint is not compensated there is nothing to compensate.
fn simulated(
    samples: usize,
    spacings: &[f64],
    repeats: u32,
    compensation: Compensation,
) -> FourierSimulation {
    let level = compensation == Compensation::None;
    FourierSimulation {
        samples,
        spacings: spacings.to_vec(),
        repeats,
        slope: if level { 0.0 } else { 0.2 },
        height_difference: if level { 0.0 } else { 20.0 },
        noise: NOISE_UM,
        ..FourierSimulation::default()
    }
}

fn case(
    what: &FourierSimulation,
    compensation: Compensation,
    combination: Combination,
    noise: Option<f64>,
    seeds: u64,
) -> Vec<Row> {
    let tallies: Vec<[Tally; 6]> = (0..seeds)
        .into_par_iter()
        .filter_map(|seed| {
            let (scans, truth) = simulate(what, seed).ok()?;
            let s = separate(&scans, SECTION, compensation, combination, noise).ok()?;
            compare(what, &s, &truth)
        })
        .collect();
    let name = format!(
        "{} readings, {} spacing{}, {} repeat{}, joint {}, {}, noise {}",
        what.samples,
        what.spacings.len(),
        if what.spacings.len() == 1 { "" } else { "s" },
        what.repeats,
        if what.repeats == 1 { "" } else { "s" },
        match compensation {
            Compensation::None => "none",
            Compensation::Chord => "chord",
            Compensation::Level => "level",
            Compensation::Fitted => "fitted",
        },
        match combination {
            Combination::Hybrid => "hybrid",
            Combination::LeastSquares => "least squares",
        },
        if noise.is_some() {
            "stated"
        } else {
            "estimated"
        }
    );
    (0..QUANTITIES.len())
        .map(|k| Row {
            case: name.clone(),
            quantity: QUANTITIES[k].to_owned(),
            seeds: tallies.len() as u64,
            tally: tallies
                .iter()
                .fold(Tally::default(), |sum, t| sum.and(t[k])),
        })
        .collect()
}

/// The truth is the workpiece without the line from its start to its end, its coefficients sums over
/// the grid; for the straightness the workpiece itself.
fn compare(what: &FourierSimulation, s: &Separation, truth: &FourierTruth) -> Option<[Tally; 6]> {
    let narrow = coverage_factor(ONE_SIGMA, s.degrees_of_freedom).ok()?;
    let wide = coverage_factor(0.95, s.degrees_of_freedom).ok()?;
    let mut tallies = [Tally::default(); 6];
    let mut add = |quantity: usize, error: f64, std: f64| {
        tallies[quantity].add_intervals(error, std, narrow * std, wide * std);
    };
    let rise = TAU * what.slope;
    let n = truth.x.len() as f64;
    let mut f: Vec<f64> = truth
        .x
        .iter()
        .zip(&truth.workpiece)
        .map(|(x, w)| w - rise * x / what.length)
        .collect();
    let mean = f.iter().sum::<f64>() / n;
    f.iter_mut().for_each(|v| *v -= mean);
    let straight = straightness(&truth.x, &truth.workpiece);
    for k in (0..f.len()).step_by(f.len() / 50) {
        add(0, s.workpiece[k] - f[k], s.workpiece_std[k]);
        add(1, s.straightness[k] - straight[k], s.straightness_std[k]);
    }
    for o in &s.orders {
        let sum = |of: fn(f64) -> f64| {
            f.iter()
                .zip(&truth.x)
                .map(|(v, x)| v * of(TAU * o.order as f64 * x / what.length))
                .sum::<f64>()
                / n
        };
        let real = o.coefficient.re - sum(f64::cos);
        let imaginary = o.coefficient.im + sum(f64::sin);
        add(2, real, o.real_std);
        add(3, imaginary, o.imaginary_std);
        if o.order == 1 {
            add(4, real, o.real_std);
            add(4, imaginary, o.imaginary_std);
        }
    }
    for step in &s.steps {
        add(5, step.value - what.height_difference - rise, step.std);
    }
    Some(tallies)
}
