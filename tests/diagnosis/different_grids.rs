//! Channels that are read on grids of their own, on forms as rough as their spacing: what a form is between the
//! positions of each is no gap.

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE: f64 = 0.05;
/// Travel, mm, and readings of a trace.
const TRAVEL: f64 = 200.0;
const COUNT: usize = 90;

/// A surface: a smooth part and a texture of independent heights every millimetre, straight between them.
struct Surface {
    smooth: fn(f64) -> f64,
    heights: Vec<f64>,
}

impl Surface {
    fn new(smooth: fn(f64) -> f64, texture: f64, random: &mut ChaCha8Rng) -> Self {
        let normal = Normal::new(0.0, texture).unwrap();
        let heights = (0..260).map(|_| normal.sample(random)).collect();
        Self { smooth, heights }
    }

    fn at(&self, x: f64) -> f64 {
        let place = x + 20.0;
        let (k, part) = (place.floor() as usize, place.fract());
        (self.smooth)(x) + self.heights[k] * (1.0 - part) + self.heights[k + 1] * part
    }
}

/// What is done to the readings.
#[derive(Clone, Copy)]
enum Put {
    Nothing,
    /// Both mounts grow, µm at last, with a time constant of a quarter of the measurement.
    Drift(f64),
}

/// Four channels, three repeats in both directions, every channel on its own grid; readings by the first-order
/// equation.
fn measured(texture: f64, smooth: [fn(f64) -> f64; 3], put: Put, seed: u64) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE).unwrap();
    let [slide, side_a, side_b] = smooth.map(|form| Surface::new(form, texture, &mut random));
    let mut readings = Vec::new();
    let mut clock = 0.0;
    let whole = (12 * COUNT) as f64;
    let pairs = [
        (1.0, [Channel::C1A, Channel::C1B]),
        (-1.0, [Channel::C2B, Channel::C2A]),
    ];
    for (position, (spindle, pair)) in pairs.into_iter().enumerate() {
        for repeat in 1..=3 {
            for direction in [Direction::Forward, Direction::Backward] {
                for step in 0..COUNT {
                    clock += 1.0;
                    for (which, channel) in pair.into_iter().enumerate() {
                        let grid = 2 * position + which;
                        let begin = [0.0, 1.3, 2.9, 0.7][grid];
                        let span = TRAVEL * [0.95, 0.93, 0.96, 0.94][grid];
                        let along = match direction {
                            Direction::Forward => step,
                            Direction::Backward => COUNT - 1 - step,
                        };
                        let x = begin + span * along as f64 / (COUNT - 1) as f64;
                        let i = channel.indicator_sign();
                        let side = if channel.is_side_a() {
                            &side_a
                        } else {
                            &side_b
                        };
                        let slope = i * 60e-6 - spindle * 20e-6 + i * spindle * 90e-6;
                        let grown = match put {
                            Put::Nothing => 0.0,
                            Put::Drift(most) => most * (1.0 - (-4.0 * clock / whole).exp()),
                        };
                        readings.push(Reading {
                            channel,
                            repeat,
                            direction,
                            time: Some(clock),
                            x,
                            value: 1e3 * slope * x
                                + i * slide.at(x)
                                + side.at(x)
                                + 2.0 * i
                                + grown
                                + noise.sample(&mut random),
                        });
                    }
                }
            }
        }
    }
    Observations { readings }
}

fn diagnosed(observations: &Observations) -> Diagnosis {
    let model = Linearised::new(observations, Assumptions::default()).unwrap();
    let options = Options {
        draws: 400,
        ..Options::default()
    };
    diagnose(&model, &options)
}

/// Forms without a straight line over the travel.
const SMOOTH: [fn(f64) -> f64; 3] = [
    |x| 0.8 * ((x - 90.0) / 30.0).tanh(),
    |x| 0.5 * (-((x - 70.0) / 25.0).powi(2)).exp(),
    |x| -0.5 * (-((x - 70.0) / 25.0).powi(2)).exp(),
];

/// Textures of one to two standard deviations of a reading.
#[test]
fn what_forms_are_between_the_positions_is_no_gap() {
    let alarms: Vec<String> = (0..8)
        .filter_map(|seed| {
            let texture = NOISE * (1.0 + 0.14 * seed as f64);
            let diagnosis = diagnosed(&measured(texture, SMOOTH, Put::Nothing, 60 + seed));
            let verdict = diagnosis.verdict;
            (verdict.kind != Kind::None).then_some(verdict.statement)
        })
        .collect();
    // Verdict: at a level of 1 % two of eight are in alarm in 0.3 % of such sets.
    assert!(alarms.len() < 2, "{alarms:#?}");
}

/// Beside the same texture what goes by time is named, as repeats at the same places show it.
#[test]
fn what_differs_in_time_is_named_beside_it() {
    let diagnosis = diagnosed(&measured(0.08, SMOOTH, Put::Drift(0.4), 71));
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.effects, ["thermal-drift"], "{}", verdict.statement);
}

/// An edge of twenty standard deviations over a few positions is a form, though knots that are chosen for bands leave
/// it for a part.
#[test]
fn an_edge_is_a_form() {
    // An edge has a straight line, which in one surface alone would be a cone: the other has its mirror.
    let smooth: [fn(f64) -> f64; 3] = [
        |x| 1.0 * ((x - 110.0) / 2.0).tanh(),
        |x| 0.6 * ((x - 60.0) / 1.8).tanh(),
        |x| -0.6 * ((x - 60.0) / 1.8).tanh(),
    ];
    let diagnosis = diagnosed(&measured(0.0, smooth, Put::Nothing, 72));
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.kind, Kind::None, "{}", verdict.statement);
}

/// Where traces begin and end elsewhere, a form that is high and steep there has no straight line to a part of that:
/// it is no cone. One surface is Legendre's polynomial of the fourth degree over what all traces have, of 3 µm.
#[test]
fn a_line_that_hangs_on_the_ends_is_no_taper() {
    let steep = |x: f64| {
        let t = (x - 95.1) / 92.2;
        3.0 * (35.0 * t.powi(4) - 30.0 * t * t + 3.0) / 8.0
    };
    let smooth: [fn(f64) -> f64; 3] = [SMOOTH[0], steep, |_| 0.0];
    let diagnosis = diagnosed(&measured(0.0, smooth, Put::Nothing, 73));
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.kind, Kind::None, "{}", verdict.statement);
}
