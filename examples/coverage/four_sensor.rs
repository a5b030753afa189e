//! Straightness, tilt and zero-adjustments of four sensors: the surface of the paper and surfaces whose
//! waves scatter evenly or fall with their order, both usual rules for λ, noise stated and not, repeats,
//! the minimum zone, spacings with a common multiple.

use std::f64::consts::TAU;

use errsep_models::four_sensor::simulate::{Disturbances, Example, Truth, simulate};
use errsep_models::four_sensor::{
    Choice, Geometry, Line, Outputs, Penalised, Separation, Separator, Settings,
};
use errsep_models::straightness::{ReferenceLine, straightness};
use errsep_models::uncertainty::DegreesOfFreedom;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

const QUANTITIES: [&str; 5] = ["S", "gamma", "f", "e2, e3", "straightness (zone)"];

/// What is measured in one group of rows.
struct Case {
    name: &'static str,
    spacing: [usize; 3],
    /// Power by which waves fall with their order; the surface of the paper where absent.
    power: Option<f64>,
    penalised: Penalised,
    noise: f64,
    stated: bool,
    repeats: u64,
}

const USUAL: Case = Case {
    name: "paper's surface, 0.1 µm",
    spacing: [1, 1, 5],
    power: None,
    penalised: Penalised::Profile,
    noise: 0.1,
    stated: false,
    repeats: 1,
};

/// The cases; all with 69 points of surface.
const CASES: &[Case] = &[
    USUAL,
    Case {
        name: "paper's surface, 0.1 µm stated",
        stated: true,
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.3 µm",
        noise: 0.3,
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.3 µm, average of 20",
        noise: 0.3,
        repeats: 20,
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.3 µm, penalty on the profile from its ends",
        noise: 0.3,
        penalised: Penalised::ProfileFromEnds,
        ..USUAL
    },
    Case {
        name: "even waves, 0.1 µm",
        power: Some(0.0),
        ..USUAL
    },
    Case {
        name: "waves ∝ order^−½, 0.1 µm",
        power: Some(0.5),
        ..USUAL
    },
    Case {
        name: "waves ∝ order^−½, 0.3 µm",
        power: Some(0.5),
        noise: 0.3,
        ..USUAL
    },
    Case {
        name: "waves ∝ 1/order, 0.1 µm",
        power: Some(1.0),
        ..USUAL
    },
    Case {
        name: "waves ∝ 1/order, 0.1 µm, penalty on the curvature",
        power: Some(1.0),
        penalised: Penalised::Curvature,
        ..USUAL
    },
    Case {
        name: "spacings 5, 5, 5 steps, even waves",
        power: Some(0.0),
        spacing: [5, 5, 5],
        ..USUAL
    },
    Case {
        name: "spacings 5, 5, 5 steps, paper's surface",
        spacing: [5, 5, 5],
        ..USUAL
    },
];

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for case in CASES {
        for (rule, choice) in [
            ("L-curve", Choice::LCurve),
            ("likelihood", Choice::Likelihood),
        ] {
            let tallies: Vec<[Tally; 5]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| one(case, choice, seed))
                .collect();
            for (k, quantity) in QUANTITIES.into_iter().enumerate() {
                rows.push(Row {
                    case: format!("{}, {rule}", case.name),
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

/// One data set: made, averaged, separated, compared.
fn one(case: &Case, choice: Choice, seed: u64) -> Option<[Tally; 5]> {
    let reach: usize = case.spacing.iter().sum();
    let geometry = Geometry::new(5.0, case.spacing, 69 - reach).ok()?;
    let truth = Waves::new(&geometry, case.power, seed);
    let mut mean = vec![[0.0; 4]; geometry.output_count()];
    for repeat in 0..case.repeats {
        let of_repeat = seed * case.repeats + repeat;
        let outputs = simulate(
            &geometry,
            &truth,
            &Disturbances::noise(case.noise),
            of_repeat,
        )
        .ok()?;
        for (sum, reading) in mean
            .as_flattened_mut()
            .iter_mut()
            .zip(outputs.readings().as_flattened())
        {
            *sum += reading / case.repeats as f64;
        }
    }
    let outputs = Outputs::new(geometry, 0.0, mean).ok()?;
    let settings = Settings {
        choice,
        noise: case
            .stated
            .then(|| case.noise / (case.repeats as f64).sqrt()),
        ..Settings::default()
    };
    let separator = Separator::new(&geometry, case.penalised, Line::EndPoints).ok()?;
    let found = separator.separate(&outputs, &settings).ok()?;
    let zone = separator
        .straightness_error(&outputs, &settings, &found)
        .ok()?;
    let degrees = found
        .degrees_of_freedom
        .unwrap_or(DegreesOfFreedom::Infinite);
    let (s, tilt, surface, zero) = truth.stated(&geometry);
    let mut tallies = [Tally::default(); 5];
    let mut add = |k: usize, value: f64, truth: f64, std: f64| {
        // The ends of the surface are zero by definition.
        if std > 0.0 {
            tallies[k].add(value - truth, std, degrees.as_f64());
        }
    };
    let Separation {
        straightness: of_s,
        tilt: of_tilt,
        surface: of_f,
        ..
    } = &found;
    for n in 0..s.len() {
        add(0, of_s.values[n], s[n], of_s.std[n]);
        add(1, of_tilt.values[n], tilt[n], of_tilt.std[n]);
    }
    for n in 1..surface.len() - 1 {
        add(2, of_f.values[n], surface[n], of_f.std[n]);
    }
    for i in [1, 2] {
        add(
            3,
            found.zero_adjustment[i],
            zero[i],
            found.zero_adjustment_std[i],
        );
    }
    let truth = straightness(&outputs.slide_positions(), &s, ReferenceLine::MinimumZone)
        .ok()?
        .error();
    // The distance from the interval's middle against its half width.
    let half = |probability: f64| -> Option<(f64, f64)> {
        let (low, high) = zone.interval(probability, degrees).ok()?;
        Some((truth - f64::midpoint(low, high), 0.5 * (high - low)))
    };
    let (off_68, half_68) = half(ONE_SIGMA)?;
    let (off_95, half_95) = half(0.95)?;
    // Counted about the middle of the 95 % interval; the other is moved by as much.
    tallies[4].add_intervals(
        off_95,
        zone.std,
        half_68 - (off_68.abs() - off_95.abs()),
        half_95,
    );
    Some(tallies)
}

/// The slide and zero-adjustments of the paper's example over a surface of random waves.
struct Waves {
    base: Example,
    /// Order, amplitude, phase; the example's own surface where there are none.
    waves: Vec<(f64, f64, f64)>,
}

impl Waves {
    fn new(geometry: &Geometry, power: Option<f64>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let waves = power.map_or(Vec::new(), |power| {
            (1..geometry.point_count() / 2)
                .map(|k| {
                    (
                        k as f64,
                        5.0 * normal() / (k as f64).powf(power),
                        10.0 * normal(),
                    )
                })
                .collect()
        });
        Self {
            base: Example::of(geometry),
            waves,
        }
    }

    /// S, γ, f and e as they are stated: no parabola in the surface, which is counted from its end
    /// points, and e4 = 0.
    fn stated(&self, geometry: &Geometry) -> (Vec<f64>, Vec<f64>, Vec<f64>, [f64; 4]) {
        let at = |n: usize| n as f64 * geometry.step();
        let points = geometry.point_count();
        let raw: Vec<f64> = (0..points).map(|n| self.surface(at(n))).collect();
        // The second orthogonal polynomial over equal steps.
        let centre = 0.5 * (points - 1) as f64;
        let spread = ((points * points - 1) as f64) / 12.0;
        let bow = |n: usize| (n as f64 - centre).powi(2) - spread;
        let norm: f64 = (0..points).map(|n| bow(n).powi(2)).sum();
        let share: f64 = (0..points).map(|n| bow(n) * raw[n]).sum();
        let c = share / norm / geometry.step().powi(2);
        let bare = |n: usize| raw[n] - c * at(n).powi(2);
        let (a, b) = (bare(0), (bare(points - 1) - bare(0)) / at(points - 1));
        let places = geometry.positions();
        let zero = self.zero_adjustment();
        let bent: [f64; 4] = std::array::from_fn(|i| zero[i] + c * places[i].powi(2));
        let level = bent[3] / places[3];
        let positions: Vec<f64> = (0..geometry.output_count()).map(at).collect();
        (
            positions
                .iter()
                .map(|x| self.straightness(*x) + a + b * x + c * x * x)
                .collect(),
            positions
                .iter()
                .map(|x| self.tilt(*x) + (b + 2.0 * c * x + level) / 1e3)
                .collect(),
            (0..points).map(|n| bare(n) - a - b * at(n)).collect(),
            std::array::from_fn(|i| bent[i] - level * places[i]),
        )
    }
}

impl Truth for Waves {
    fn surface(&self, x: f64) -> f64 {
        if self.waves.is_empty() {
            return self.base.surface(x);
        }
        // Not quite a whole number of periods: the ends do not meet.
        let turn = 0.93 * TAU * x / self.base.surface_length;
        self.waves
            .iter()
            .map(|(k, size, phase)| size * (k * turn + phase).cos())
            .sum()
    }

    fn straightness(&self, x: f64) -> f64 {
        self.base.straightness(x)
    }

    fn tilt(&self, x: f64) -> f64 {
        self.base.tilt(x)
    }

    fn zero_adjustment(&self) -> [f64; 4] {
        self.base.zero_adjustment()
    }
}
