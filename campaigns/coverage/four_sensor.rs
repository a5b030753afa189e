//! Straightness, tilt and zero-adjustments of four sensors: the surface of the paper and surfaces whose
//! waves scatter evenly or fall with their order, both usual rules for λ, noise stated and not, repeats,
//! the minimum zone, spacings with a common multiple.

use std::f64::consts::TAU;

use errsep_models::four_sensor::simulate::{Disturbances, Example, Truth, simulate};
use errsep_models::four_sensor::{
    Along, Choice, Geometry, Line, Outputs, Penalised, Separation, Separator, Settings,
};
use errsep_models::straightness::{ReferenceLine, straightness};
use errsep_models::uncertainty::DegreesOfFreedom;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{ONE_SIGMA, Row, Tally};

const QUANTITIES: [&str; 4] = ["S", "gamma", "f", "e2, e3"];

/// What is measured in one group of rows.
struct Case {
    name: &'static str,
    spacing: [usize; 3],
    /// Power by which waves fall with their order; the surface of the paper where absent.
    power: Option<f64>,
    penalised: Penalised,
    noise: f64,
    /// Share of its variance that goes on along the slide, and over how many steps.
    goes_on: Option<(f64, f64)>,
    stated: bool,
    repeats: u64,
    slide: Slide,
}

/// The slide that is measured.
#[derive(Debug, Clone, Copy)]
enum Slide {
    /// That of the paper, straight to about 40 µm.
    Paper,
    /// The same shape, straight to so many µm as it is stated, with the surface's parabola taken away.
    Scaled(f64),
    /// Five waves, straight to so many µm as they are stated.
    Waves(f64),
}

const USUAL: Case = Case {
    name: "paper's surface, 0.1 µm",
    spacing: [1, 1, 5],
    power: None,
    penalised: Penalised::Profile,
    noise: 0.1,
    goes_on: None,
    stated: false,
    repeats: 1,
    slide: Slide::Paper,
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
    Case {
        name: "paper's surface, 0.1 µm, half of the variance over 4 readings",
        goes_on: Some((0.5, 4.0)),
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.1 µm, four fifths over 8 readings",
        goes_on: Some((0.8, 8.0)),
        ..USUAL
    },
    Case {
        name: "waves ∝ 1/order, 0.1 µm, penalty on the curvature, half of the variance over 4 readings",
        power: Some(1.0),
        penalised: Penalised::Curvature,
        goes_on: Some((0.5, 4.0)),
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
            let tallies: Vec<[Tally; 4]> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| profiles(&Measured::new(case, choice, seed)?))
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
    rows.extend(zone_rows(seeds));
    rows
}

/// Surfaces and noises at which slides of every size are measured.
const ZONE_CASES: &[Case] = &[
    USUAL,
    Case {
        name: "paper's surface, 0.3 µm",
        noise: 0.3,
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
        name: "spacings 5, 5, 5 steps, even waves",
        power: Some(0.0),
        spacing: [5, 5, 5],
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.1 µm, half of the variance over 4 readings",
        goes_on: Some((0.5, 4.0)),
        ..USUAL
    },
    Case {
        name: "paper's surface, 0.1 µm, four fifths over 8 readings",
        goes_on: Some((0.8, 8.0)),
        ..USUAL
    },
];

/// The minimum zone of slides from straight to tens of µm.
fn zone_rows(seeds: u64) -> Vec<Row> {
    let slides = [
        ("slide straight", Slide::Scaled(0.0)),
        ("slide of 0.3 µm", Slide::Scaled(0.3)),
        ("slide of 1 µm", Slide::Scaled(1.0)),
        ("slide of 3 µm", Slide::Scaled(3.0)),
        ("slide of 10 µm", Slide::Scaled(10.0)),
        ("paper's slide", Slide::Paper),
        ("slide of five waves, 1 µm", Slide::Waves(1.0)),
        ("slide of five waves, 3 µm", Slide::Waves(3.0)),
    ];
    let mut rows = Vec::new();
    for (case, choice, rule) in ZONE_CASES
        .iter()
        .map(|case| (case, Choice::LCurve, "L-curve"))
        .chain([(&USUAL, Choice::Likelihood, "likelihood")])
    {
        for (name, slide) in slides {
            let case = Case { slide, ..*case };
            let tallies: Vec<Tally> = (0..seeds)
                .into_par_iter()
                .filter_map(|seed| zone(&Measured::new(&case, choice, seed)?))
                .collect();
            rows.push(Row {
                case: format!("{name}, {}, {rule}", case.name),
                quantity: "straightness (zone)".to_owned(),
                seeds: tallies.len() as u64,
                tally: tallies.into_iter().fold(Tally::default(), Tally::and),
            });
        }
    }
    rows
}

/// One data set: made, averaged, separated.
struct Measured {
    truth: Waves,
    outputs: Outputs,
    settings: Settings,
    separator: Separator,
    found: Separation,
    along: Option<Along>,
    degrees: DegreesOfFreedom,
}

impl Measured {
    fn new(case: &Case, choice: Choice, seed: u64) -> Option<Self> {
        let reach: usize = case.spacing.iter().sum();
        let geometry = Geometry::new(5.0, case.spacing, 69 - reach).ok()?;
        let truth = Waves::new(&geometry, case, seed)?;
        let mut mean = vec![[0.0; 4]; geometry.output_count()];
        for repeat in 0..case.repeats {
            let of_repeat = seed * case.repeats + repeat;
            let (share, length) = case.goes_on.unwrap_or((0.0, 1.0));
            let noise = Disturbances::noise(case.noise * (1.0 - share).sqrt());
            let outputs = simulate(&geometry, &truth, &noise, of_repeat).ok()?;
            let mut going_on = going_on(case.noise * share.sqrt(), length, of_repeat);
            for (sum, reading) in mean
                .as_flattened_mut()
                .iter_mut()
                .zip(outputs.readings().as_flattened())
            {
                *sum += (reading + going_on()) / case.repeats as f64;
            }
        }
        let outputs = Outputs::new(geometry, 0.0, mean).ok()?;
        let of_mean = case.noise / (case.repeats as f64).sqrt();
        let settings = Settings {
            choice,
            noise: case.stated.then_some(of_mean),
            ..Settings::default()
        };
        let separator = Separator::new(&geometry, case.penalised, Line::EndPoints).ok()?;
        let mut found = separator.separate(&outputs, &settings).ok()?;
        let along = if case.stated || case.repeats > 1 {
            None
        } else {
            let found = &mut found;
            (separator.count_correlation(&outputs, &settings, found)).ok()?
        };
        let of_excess = found.excess.map(|excess| excess.degrees);
        let degrees = of_excess
            .or(found.degrees_of_freedom)
            .unwrap_or(DegreesOfFreedom::Infinite);
        Some(Self {
            truth,
            outputs,
            settings,
            separator,
            found,
            along,
            degrees,
        })
    }
}

/// Noise of four sensors in turn, each of which keeps a part of its own from step to step.
fn going_on(size: f64, length: f64, seed: u64) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(0x676f_6573 + seed);
    let kept = (-1.0 / length).exp();
    let (mut state, mut next) = ([None::<f64>; 4], 0);
    move || {
        let new: f64 = StandardNormal.sample(&mut random);
        let own = state[next].map_or(new, |last| kept * last + (1.0 - kept * kept).sqrt() * new);
        state[next] = Some(own);
        next = (next + 1) % 4;
        size * own
    }
}

/// The values along the slide and the surface against what is true.
fn profiles(measured: &Measured) -> Option<[Tally; 4]> {
    let Separation {
        straightness: of_s,
        tilt: of_tilt,
        surface: of_f,
        zero_adjustment,
        zero_adjustment_std,
        ..
    } = &measured.found;
    let (s, tilt, surface, zero) = measured.truth.stated(measured.outputs.geometry());
    let mut tallies = [Tally::default(); 4];
    let mut add = |k: usize, value: f64, truth: f64, std: f64| {
        // The ends of the surface are zero by definition.
        if std > 0.0 {
            tallies[k].add(value - truth, std, measured.degrees.as_f64());
        }
    };
    for n in 0..s.len() {
        add(0, of_s.values[n], s[n], of_s.std[n]);
        add(1, of_tilt.values[n], tilt[n], of_tilt.std[n]);
    }
    for n in 1..surface.len() - 1 {
        add(2, of_f.values[n], surface[n], of_f.std[n]);
    }
    for i in [1, 2] {
        add(3, zero_adjustment[i], zero[i], zero_adjustment_std[i]);
    }
    Some(tallies)
}

/// The zone of the true slide against its interval.
fn zone(measured: &Measured) -> Option<Tally> {
    let zone = measured
        .separator
        .straightness_error(
            &measured.outputs,
            &measured.settings,
            &measured.found,
            measured.degrees,
            measured.along.as_ref(),
        )
        .ok()?;
    let positions = measured.outputs.slide_positions();
    let (s, ..) = measured.truth.stated(measured.outputs.geometry());
    let truth = straightness(&positions, &s, ReferenceLine::MinimumZone)
        .ok()?
        .error();
    // A straight slide is one whose zone is rounding.
    let truth = if truth < 1e-9 { 0.0 } else { truth };
    let inside = |probability: f64| -> Option<bool> {
        let (low, high) = zone.interval(probability).ok()?;
        Some(low <= truth && truth <= high)
    };
    let mut tally = Tally::default();
    tally.add_inside(inside(ONE_SIGMA)?, inside(0.95)?);
    Some(tally)
}

/// The slide and zero-adjustments of the paper's example over a surface of random waves.
struct Waves {
    base: Example,
    /// Order, amplitude, phase; the example's own surface where there are none.
    waves: Vec<(f64, f64, f64)>,
    slide: Slide,
    /// The zone of the slide's shape before it is scaled, µm.
    zone: f64,
    /// The surface's second-degree part, µm/mm², which a scaled slide gives back.
    parabola: f64,
}

impl Waves {
    fn new(geometry: &Geometry, case: &Case, seed: u64) -> Option<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let waves = case.power.map_or(Vec::new(), |power| {
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
        let mut truth = Self {
            base: Example::of(geometry),
            waves,
            slide: case.slide,
            zone: 1.0,
            parabola: 0.0,
        };
        let at = |n: usize| n as f64 * geometry.step();
        let x: Vec<f64> = (0..geometry.output_count()).map(at).collect();
        let shape: Vec<f64> = x.iter().map(|x| truth.shape(*x)).collect();
        truth.zone = straightness(&x, &shape, ReferenceLine::MinimumZone)
            .ok()?
            .error();
        truth.parabola = truth.surface_parabola(geometry);
        Some(truth)
    }

    /// The slide before it is scaled, µm.
    fn shape(&self, x: f64) -> f64 {
        match self.slide {
            Slide::Paper | Slide::Scaled(_) => self.base.straightness(x),
            Slide::Waves(_) => (5.0 * TAU * x / self.base.travel + 0.3).sin(),
        }
    }

    /// The coefficient of x² in the surface, µm/mm², by the second orthogonal polynomial over equal steps.
    fn surface_parabola(&self, geometry: &Geometry) -> f64 {
        let points = geometry.point_count();
        let centre = 0.5 * (points - 1) as f64;
        let spread = ((points * points - 1) as f64) / 12.0;
        let bow = |n: usize| (n as f64 - centre).powi(2) - spread;
        let norm: f64 = (0..points).map(|n| bow(n).powi(2)).sum();
        let share: f64 = (0..points)
            .map(|n| bow(n) * self.surface(n as f64 * geometry.step()))
            .sum();
        share / norm / geometry.step().powi(2)
    }

    /// S, γ, f and e as they are stated: no parabola in the surface, which is counted from its end
    /// points, and e4 = 0.
    fn stated(&self, geometry: &Geometry) -> (Vec<f64>, Vec<f64>, Vec<f64>, [f64; 4]) {
        let at = |n: usize| n as f64 * geometry.step();
        let points = geometry.point_count();
        let raw: Vec<f64> = (0..points).map(|n| self.surface(at(n))).collect();
        let c = self.surface_parabola(geometry);
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
        match self.slide {
            Slide::Paper => self.base.straightness(x),
            Slide::Scaled(size) | Slide::Waves(size) => {
                size / self.zone * self.shape(x) - self.parabola * x * x
            }
        }
    }

    fn tilt(&self, x: f64) -> f64 {
        self.base.tilt(x)
    }

    fn zero_adjustment(&self) -> [f64; 4] {
        self.base.zero_adjustment()
    }
}
