//! Slopes and forms of designs of 8, 12 and 16 channels: exact geometry of waves that no spline is.
//!
//! [`bound`]: white noise, stated or not. With the noise stated u is the root of the Cramér–Rao bound, and
//! "rms of error/u" the error in its units. [`laws`]: white, correlated and shifted noise in 8 channels,
//! one repeat and four, and a channel that is noisier than the others.

use errsep_models::noise::Law;
use errsep_models::reversal::designs::simulate::{DesignPlan, DesignTruth, simulate};
use errsep_models::reversal::designs::{
    Design, DesignChannel, DesignObservations, DesignOptions, SLOPES, fit,
};
use errsep_models::reversal::simultaneous::{Knots, Noise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::tally::{Row, Tally};

const THICKNESS_MM: f64 = 40.0;
const NOISE_UM: f64 = 0.1;
const LENGTH_MM: f64 = 300.0;
/// Over which the correlated part of the noise is, mm.
const CORRELATED_MM: f64 = 15.0;
const CELLS: usize = 16;

const QUARTERS: &[f64] = &[0.0, 90.0, 180.0, 270.0];
const HALVES: &[f64] = &[0.0, 180.0];

/// What is measured.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// Indicators and positions of the spindle, degrees.
    indicators: &'static [f64],
    spindle: &'static [f64],
    positions: usize,
    repeats: u32,
    /// Standard deviations of the white and the correlated part and of the shift, µm.
    noise: [f64; 3],
    /// The first channel's noise against that of the others.
    first: f64,
    stated: bool,
    /// Whether the knots of each form are chosen from the data.
    chosen: bool,
}

const EIGHT: Case = Case {
    name: "8 channels: four indicators, 0°/180°",
    indicators: QUARTERS,
    spindle: HALVES,
    positions: 61,
    repeats: 1,
    noise: [NOISE_UM, 0.0, 0.0],
    first: 1.0,
    stated: false,
    chosen: false,
};

const BOUND: [Case; 3] = [
    EIGHT,
    Case {
        name: "12 channels: near, far, top, every 90°",
        indicators: &[0.0, 180.0, 90.0],
        spindle: QUARTERS,
        ..EIGHT
    },
    Case {
        name: "16 channels: four indicators, every 90°",
        spindle: QUARTERS,
        ..EIGHT
    },
];

const LAWS: [Case; 9] = [
    Case {
        name: "4 repeats, white",
        repeats: 4,
        ..EIGHT
    },
    Case {
        name: "4 repeats, white and correlated",
        repeats: 4,
        noise: [NOISE_UM, NOISE_UM, 0.0],
        ..EIGHT
    },
    Case {
        name: "4 repeats, white and shifts",
        repeats: 4,
        noise: [NOISE_UM, 0.0, NOISE_UM],
        ..EIGHT
    },
    Case {
        name: "4 repeats, white, one channel 10 times as noisy",
        repeats: 4,
        first: 10.0,
        ..EIGHT
    },
    Case {
        name: "4 repeats, each zeroed anew by 3 µm",
        repeats: 4,
        noise: [NOISE_UM, 0.0, 3.0],
        chosen: true,
        ..EIGHT
    },
    Case {
        name: "1 repeat, white",
        ..EIGHT
    },
    Case {
        name: "1 repeat, white, one channel 10 times as noisy",
        positions: 151,
        first: 10.0,
        ..EIGHT
    },
    Case {
        name: "1 repeat, white and correlated (assumed white)",
        noise: [NOISE_UM, NOISE_UM, 0.0],
        ..EIGHT
    },
    Case {
        name: "1 repeat, white and shifts (assumed white)",
        noise: [NOISE_UM, 0.0, NOISE_UM],
        ..EIGHT
    },
];

/// The table of 8, 12 and 16 channels, each quantity and, of a name that begins with "all", together.
pub fn bound(seeds: u64) -> Vec<Row> {
    let cases = BOUND
        .into_iter()
        .flat_map(|case| [true, false].map(|stated| Case { stated, ..case }));
    let chosen = BOUND.into_iter().map(|case| Case {
        chosen: true,
        ..case
    });
    cases
        .chain(chosen)
        .flat_map(|case| case.rows(seeds))
        .collect()
}

/// The table of the laws of noise.
pub fn laws(seeds: u64) -> Vec<Row> {
    LAWS.iter().flat_map(|case| case.rows(seeds)).collect()
}

/// Slopes one by one, forms of the slide, sides.
const KINDS: usize = SLOPES.len() + 2;

impl Case {
    fn rows(&self, seeds: u64) -> Vec<Row> {
        let pairs = self
            .indicators
            .iter()
            .flat_map(|i| self.spindle.iter().map(move |p| (*i, *p)));
        let channels: Vec<DesignChannel> = pairs
            .filter_map(|(i, p)| DesignChannel::at(i, p).ok())
            .collect();
        let Ok(design) = Design::new(channels) else {
            return Vec::new();
        };
        let tallies = (0..seeds)
            .into_par_iter()
            .map(|seed| self.one(&design, seed).unwrap_or_default())
            .reduce(
                || [Tally::default(); KINDS],
                |mut a, b| {
                    for (a, b) in a.iter_mut().zip(b) {
                        *a = a.and(b);
                    }
                    a
                },
            );
        let all = |of: &[Tally]| of.iter().fold(Tally::default(), |sum, own| sum.and(*own));
        let together = [
            ("all slopes", all(&tallies[..SLOPES.len()])),
            ("all forms", all(&tallies[SLOPES.len()..])),
        ];
        let names = SLOPES
            .iter()
            .copied()
            .chain(["forms of the slide", "sides"]);
        let stated = match (self.stated, self.chosen) {
            (true, _) => ", noise stated",
            (_, true) => ", knots chosen",
            _ => "",
        };
        names
            .zip(tallies)
            .chain(together)
            .filter(|(_, tally)| tally.any())
            .map(|(quantity, tally)| Row {
                case: format!("{}{stated}", self.name),
                quantity: quantity.to_owned(),
                seeds,
                tally,
            })
            .collect()
    }

    /// One data set: the slopes, then the forms of the slide and of the sides in five places.
    fn one(&self, design: &Design, seed: u64) -> Option<[Tally; KINDS]> {
        let (observations, truth) = self.data(design, seed)?;
        let options = DesignOptions {
            thickness_mm: THICKNESS_MM,
            noise: if self.stated {
                Noise::Declared(NOISE_UM)
            } else {
                Noise::Estimated
            },
            knots: match self.chosen {
                true => Knots::Chosen,
                false => Knots::Cells(CELLS),
            },
            ..DesignOptions::default()
        };
        let found = fit(&observations, &options).ok()?;
        let mut tallies = [Tally::default(); KINDS];
        for slope in found.slopes().iter().filter(|s| s.alone) {
            let k = SLOPES.iter().position(|name| *name == slope.name)?;
            let (own, freedom) = (slope.value, slope.degrees_of_freedom);
            tallies[k].add(own.value - truth.slopes_rad[k], own.std, freedom);
        }
        let x = [0.0, 35.0, 110.0, 190.0, LENGTH_MM];
        for form in found.forms(&x) {
            let (own, place) = match (form.name.as_str(), form.side) {
                ("M_h", _) => (&truth.slide[0], 0),
                ("M_v", _) => (&truth.slide[1], 0),
                (_, Some(side)) => {
                    let at = design.sides().iter().position(|s| *s == side)?;
                    (&truth.sides[at], 1)
                }
                _ => continue,
            };
            for ((x, value), std) in x.iter().zip(&form.values).zip(&form.std) {
                let error = value - own.at(*x);
                tallies[SLOPES.len() + place].add(error, *std, form.degrees_of_freedom);
            }
        }
        Some(tallies)
    }

    /// Readings of the exact geometry, noise of the law on top.
    fn data(&self, design: &Design, seed: u64) -> Option<(DesignObservations, DesignTruth)> {
        let [white, correlated, shift] = self.noise;
        let plain = correlated == 0.0 && shift == 0.0 && self.first == 1.0;
        let plan = DesignPlan {
            slopes_rad: [2e-4, -1.5e-4, 3e-4, 1e-4, 1e-4, 2e-5, 0.0],
            thickness_mm: THICKNESS_MM,
            length_mm: LENGTH_MM,
            positions: self.positions,
            repeats: self.repeats,
            noise_um: if plain { white } else { 0.0 },
            forms_um: [1.0, 1.0],
            seed,
            ..DesignPlan::of(design.clone())
        };
        let (mut observations, truth) = simulate(&plan).ok()?;
        if plain {
            return Some((observations, truth));
        }
        let law = Law {
            white: white * white,
            correlated: correlated * correlated,
            length: CORRELATED_MM,
            shift: shift * shift,
            drift: 0.0,
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x6e6f_6973);
        let traces = observations
            .readings
            .chunk_by_mut(|a, b| (a.channel, a.repeat) == (b.channel, b.repeat));
        for trace in traces {
            let x: Vec<f64> = trace.iter().map(|r| r.x).collect();
            let mut noise = vec![0.0; x.len()];
            law.draw(&x, &mut random, &mut noise);
            for (reading, own) in trace.iter_mut().zip(noise) {
                let factor = if reading.channel == 0 {
                    self.first
                } else {
                    1.0
                };
                reading.value += factor * own;
            }
        }
        Some((observations, truth))
    }
}
