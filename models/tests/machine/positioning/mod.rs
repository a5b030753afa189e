//! Positioning tests: figures, their uncertainties, drift, readings that are missing.

mod drift;
mod figures;
mod intervals;
mod missing;

use errsep_models::positioning::{
    Direction, Figure, Influences, PositioningSimulation, Reading, analyse, simulate,
};

pub fn reading(target: f64, run: u32, direction: Direction, deviation: f64) -> Reading {
    Reading {
        target,
        run,
        direction,
        deviation,
        time: None,
    }
}

/// Three targets, two runs: means and standard deviations by hand.
pub fn small() -> Vec<Reading> {
    use Direction::{Backward, Forward};
    let root = std::f64::consts::FRAC_1_SQRT_2;
    // Half a difference d of two readings is a standard deviation of d/√2.
    [
        (0.0, Forward, 1.0, 0.5),
        (10.0, Forward, 4.0, 1.0),
        (20.0, Forward, -2.0, 0.25),
        (0.0, Backward, 2.0, 0.5),
        (10.0, Backward, 1.0, 0.5),
        (20.0, Backward, -1.0, 1.5),
    ]
    .into_iter()
    .flat_map(|(target, direction, mean, std)| {
        [(1, root * std), (2, -root * std)]
            .map(|(run, off)| reading(target, run, direction, mean + off))
    })
    .collect()
}
pub fn expanded(readings: &[Reading], influences: &Influences, figure: Figure) -> f64 {
    let found = analyse(readings, influences, 7).unwrap();
    found.uncertainty(figure).unwrap().unwrap()
}

/// Steep enough that first and last target are the extremes whatever the noise.
pub fn steep(runs: u32, noise: f64) -> Vec<Reading> {
    let what = PositioningSimulation {
        targets: 6,
        runs,
        gain: 1000.0,
        periodic: 0.0,
        noise,
        ..PositioningSimulation::default()
    };
    simulate(&what, 5).unwrap()
}
