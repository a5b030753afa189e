//! The diagnosis of traces whose positions differ: jittered, shifted, thinned, of different spacing,
//! of unequal length, and very long ones.

use crate::scene;
use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised, NotDiagnosable};
use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
use errsep_models::reversal::simultaneous::{self, Knots};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE: f64 = 0.03;

/// Positions of one trace.
type Positions = fn(trace: usize, random: &mut ChaCha8Rng) -> Vec<f64>;

fn jittered(_: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let jitter = |k: i32, r: &mut ChaCha8Rng| 4.0 * f64::from(k) + 0.4 * (r.random::<f64>() - 0.5);
    (0..60).map(|k| jitter(k, random)).collect()
}

fn shifted(_: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let shift = 4.0 * random.random::<f64>();
    (0..60).map(|k| 4.0 * f64::from(k) + shift).collect()
}

fn thinned(_: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let all = (0..70).map(|k| 3.4 * f64::from(k));
    all.filter(|_| random.random::<f64>() > 0.15).collect()
}

fn without_sevenths(_: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let first = random.random_range(0..7);
    let all = (0..70).filter(|k| k % 7 != first);
    all.map(|k| 3.4 * f64::from(k)).collect()
}

fn different(trace: usize, _: &mut ChaCha8Rng) -> Vec<f64> {
    let count = 60 + 7 * (trace % 4) as i32;
    (0..count)
        .map(|k| 238.0 * f64::from(k) / f64::from(count - 1))
        .collect()
}

fn long(_: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut x: Vec<f64> = (0..3000).map(|_| 240.0 * random.random::<f64>()).collect();
    x.sort_by(f64::total_cmp);
    x
}

const DESIGNS: [(&str, Positions); 5] = [
    ("jittered", jittered),
    ("shifted", shifted),
    ("thinned", thinned),
    ("different", different),
    ("long", long),
];

/// What is in the readings beside the model.
#[derive(Clone, Copy)]
enum Put {
    Nothing,
    /// Angle of each surface to their middle, rad.
    Taper(f64),
    /// Step, µm, of channel 2B in the middle of its third trace.
    Jump(f64),
}

/// Readings by the first-order equation, steep enough that a jitter of 0.2 mm moves them by several
/// times their noise.
fn campaign(design: Positions, put: Put, seed: u64) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE).unwrap();
    let (alpha, beta, gamma) = (310e-6, -120e-6, 450e-6);
    let mut readings = Vec::new();
    let mut clock = 0.0;
    let mut trace = 0;
    for (spindle, pair) in [
        (1.0, [Channel::C1A, Channel::C1B]),
        (-1.0, [Channel::C2B, Channel::C2A]),
    ] {
        for repeat in 1..=3 {
            for direction in [Direction::Forward, Direction::Backward] {
                let began = clock;
                for channel in pair {
                    let mut x = design(trace, &mut random);
                    trace += 1;
                    if direction == Direction::Backward {
                        x.reverse();
                    }
                    clock = began;
                    for x in x {
                        clock += 1.0;
                        let i = channel.indicator_sign();
                        let on_a = channel.is_side_a();
                        let m = 0.9 * ((x - 130.0) / 35.0f64).tanh() + 0.3 * (x / 19.0f64).sin();
                        // The surfaces have nothing in common: a straight line in that would be a
                        // taper.
                        let side = if on_a { 1.0 } else { -1.0 };
                        let s = side * 0.5 * (-((x - 70.0) / 25.0f64).powi(2)).exp();
                        let slope = i * alpha + spindle * beta + i * spindle * gamma;
                        let mut value = 1e3 * slope * x + i * m + s + 2.0 * i;
                        match put {
                            Put::Nothing => {}
                            Put::Taper(angle) => value += 1e3 * angle * x,
                            Put::Jump(step) => {
                                let after = match (repeat, direction) {
                                    (1, _) => false,
                                    (2, Direction::Forward) => x > 100.0,
                                    _ => true,
                                };
                                if channel == Channel::C2B && after {
                                    value += step;
                                }
                            }
                        }
                        readings.push(Reading {
                            channel,
                            repeat,
                            direction,
                            time: Some(clock),
                            x,
                            value: value + noise.sample(&mut random),
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
        draws: 200,
        ..Options::default()
    };
    diagnose(&model, &options)
}

#[test]
fn nothing_is_named_where_nothing_is_there() {
    for (name, design) in DESIGNS {
        let diagnosis = diagnosed(&campaign(design, Put::Nothing, 11));
        // Verdict: wrong in one of a hundred seeds by its own level.
        assert_eq!(
            diagnosis.verdict.kind,
            Kind::None,
            "{name}: {}",
            diagnosis.verdict.statement
        );
    }
}

#[test]
fn a_taper_and_a_jump_are_named_on_any_positions() {
    for (name, design) in DESIGNS {
        let size = if name == "long" { 1e-6 } else { 4e-6 };
        let diagnosis = diagnosed(&campaign(design, Put::Taper(size), 12));
        // Along slopes of 1 µm/mm a gain that differs, or curved indicators, do nearly the same: a
        // group that holds it is right.
        let verdict = &diagnosis.verdict;
        let alone = verdict.effects == ["taper"];
        let group = verdict
            .indistinguishable
            .iter()
            .any(|group| group.iter().any(|e| e == "taper"));
        assert!(
            verdict.effects.len() == 1 && (alone || group),
            "{name}: {}",
            verdict.statement
        );
        let taper = diagnosis.candidates.iter().find(|c| c.effect == "taper");
        let found = &taper.unwrap().parameters[0];
        // Statistical: four standard uncertainties of one seed.
        assert!(
            (found.value.abs() - size).abs() < 4.0 * found.std,
            "{name}: {} ± {}",
            found.value,
            found.std
        );
        let jump = if name == "long" { 0.02 } else { 0.1 };
        let diagnosis = diagnosed(&campaign(design, Put::Jump(jump), 13));
        assert_eq!(
            diagnosis.verdict.effects,
            ["zero-jump"],
            "{name}: {}",
            diagnosis.verdict.statement
        );
    }
}

/// *Exact*: where single readings are lacking, all places stay, also where the last cell of the fit's forms is long. (Without
/// its last place a form that bends there has another line, and a cone that is none.)
#[test]
fn a_reading_that_is_left_out_costs_no_place() {
    let readings = campaign(without_sevenths, Put::Nothing, 17);
    let lacking = 70 * 24 - readings.readings.len();
    let places = |model: &Linearised| {
        let filled = model.gathered.as_ref().unwrap().filled();
        (model.positions().len(), model.left_out, filled)
    };
    let model = Linearised::new(&readings, Assumptions::default()).unwrap();
    assert_eq!(places(&model), (70, 0, lacking));

    let mut breaks: Vec<f64> = (0..45).map(|k| 5.14 * f64::from(k)).collect();
    breaks.push(3.4 * 69.0);
    let options = simultaneous::Options {
        knots: Knots::At(breaks),
        ..simultaneous::Options::default()
    };
    let fit = simultaneous::fit(&readings, &options).unwrap();
    let model = Linearised::of_fit(&readings, &fit, Assumptions::default()).unwrap();
    assert_eq!(places(&model), (70, 0, lacking));
}

/// A noise that is stated is that of one reading, and gathered readings have less: a cone that shows only
/// in the means of a hundred readings is named.
#[test]
fn stated_noise_is_that_of_one_reading() {
    let readings = campaign(long, Put::Taper(2e-8), 15);
    let stated = Assumptions {
        noise: Some(NOISE),
        ..Assumptions::default()
    };
    let model = Linearised::new(&readings, stated).unwrap();
    let each = model.gathered.as_ref().unwrap().readings_per_cell;
    assert!(each > 10.0, "{each}");
    let diagnosis = diagnose(&model, &Options::default());
    // Rounding of the square root.
    assert!((diagnosis.noise.white * each.sqrt() / NOISE - 1.0).abs() < 1e-12);
    assert!((diagnosis.gap.readings_in_each - each).abs() < f64::EPSILON);
    let of_what = diagnosis.gap.of_what();
    assert!(of_what.starts_with("a mean of "), "{of_what}");
    assert!(
        diagnosis
            .verdict
            .causes()
            .iter()
            .any(|group| group.contains(&"taper")),
        "{}",
        diagnosis.verdict.statement
    );
}

/// A trace that covers a corner of the travel only is left out where others of its channel remain;
/// where none does, the message says so.
#[test]
fn traces_without_a_common_stretch_are_told() {
    let mut short = campaign(jittered, Put::Nothing, 14);
    let all = short.readings.len();
    short
        .readings
        .retain(|r| r.channel != Channel::C1A || r.repeat != 2 || r.x < 20.0);
    let model = Linearised::new(&short, Assumptions::default()).unwrap();
    let used = model.gathered.as_ref().unwrap();
    assert!(used.cells > 50, "{}", used.cells);
    assert!(model.left_out < all / 20, "{} left out", model.left_out);

    let mut apart = campaign(jittered, Put::Nothing, 14);
    apart
        .readings
        .retain(|r| (r.channel == Channel::C1A) == (r.x < 100.0));
    assert!(matches!(
        Linearised::new(&apart, Assumptions::default()),
        Err(NotDiagnosable::RangesDiffer | NotDiagnosable::NoFit(_))
    ));
}

/// Where a reading is taken: channel, repeat, direction and position, mm.
type Place = (Channel, u32, Direction, f64);

/// Readings on one grid, so many repeats of each channel in both directions; `put`: what is read at a place, µm, from
/// what the channel would read at a position.
fn on_one_grid(
    repeats: &[(Channel, u32)],
    put: impl Fn(Place, &dyn Fn(f64) -> f64) -> f64,
) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(16);
    let noise = Normal::new(0.0, 0.01).unwrap();
    let (alpha, beta, gamma) = (31e-6, -12e-6, 45e-6);
    let mut readings = Vec::new();
    for &(channel, repeats) in repeats {
        let (i, spindle) = (channel.indicator_sign(), channel.spindle_sign());
        let side = if channel.is_side_a() { 1.0 } else { -1.0 };
        let read = |x: f64| {
            let m = 0.9 * ((x - 130.0) / 35.0f64).tanh() + 0.3 * (x / 19.0f64).sin();
            let s = side * 0.5 * (-((x - 70.0) / 25.0f64).powi(2)).exp();
            let slope = i * alpha + spindle * beta + i * spindle * gamma;
            1e3 * slope * x + i * m + s + 2.0 * i
        };
        for repeat in 1..=repeats {
            for direction in [Direction::Forward, Direction::Backward] {
                for x in (0..60).map(|k| 4.0 * f64::from(k)) {
                    let value = put((channel, repeat, direction, x), &read);
                    readings.push(Reading {
                        channel,
                        repeat,
                        direction,
                        time: None,
                        x,
                        value: value + noise.sample(&mut random),
                    });
                }
            }
        }
    }
    Observations { readings }
}

/// A channel with fewer repeats than another costs no name: how smooth the forms are is asked of repeats that all
/// channels have. Cycles along the reading are seen wrongly by forms that are taken for smoother than they are.
#[test]
fn channels_may_have_unequal_repeats() {
    let repeats = [
        (Channel::C1A, 2),
        (Channel::C1B, 3),
        (Channel::C2A, 3),
        (Channel::C2B, 2),
    ];
    let observations = on_one_grid(&repeats, |(channel, _, _, x), read| {
        let value = read(x);
        let cycles = channel.indicator_sign() > 0.0;
        value + f64::from(u8::from(cycles)) * 0.15 * (value / 0.5).cos()
    });
    let diagnosis = diagnosed(&observations);
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.effects, ["cyclic-error"], "{}", verdict.statement);
    let cycles = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == "cyclic-error");
    let found = &cycles.unwrap().parameters[0];
    // Statistical: four standard uncertainties of one seed.
    assert!(
        (found.value - 0.15).abs() < 4.0 * found.std,
        "{} ± {}",
        found.value,
        found.std
    );
}

/// Three channels show what differs between repeats and directions, on the side too that one channel alone has seen: a play
/// of the slide, and a chip that came between two repeats.
#[test]
fn three_channels_show_what_differs() {
    let three = [Channel::C1A, Channel::C1B, Channel::C2B].map(|c| (c, 4));
    let play = |(_, _, direction, x): Place, read: &dyn Fn(f64) -> f64| match direction {
        Direction::Forward => read(x + 0.5),
        Direction::Backward => read(x - 0.5),
    };
    let chip = |(channel, repeat, _, x): Place, read: &dyn Fn(f64) -> f64| {
        let there = channel == Channel::C1A && repeat > 2;
        let bump = 0.12 * (-0.5 * ((x - 28.0) / 13.0f64).powi(2)).exp();
        read(x) + f64::from(u8::from(there)) * bump
    };
    for (observations, name, size) in [
        (on_one_grid(&three, play), "axis-backlash", 1.0),
        (on_one_grid(&three, chip), "local-contamination", 0.12),
    ] {
        let diagnosis = diagnosed(&observations);
        let verdict = &diagnosis.verdict;
        assert_eq!(verdict.effects, [name], "{}", verdict.statement);
        // Limit: neither changes a reading by more than 0.12 µm.
        assert!(diagnosis.gap.before.rms < 0.12, "{}", verdict.statement);
        let own = diagnosis.candidates.iter().find(|c| c.effect == name);
        let found = &own.unwrap().parameters[0];
        // Statistical: four standard uncertainties of one seed.
        assert!(
            (found.value.abs() - size).abs() < 4.0 * found.std,
            "{name}: {} ± {}",
            found.value,
            found.std
        );
    }
}

/// *Simulated truth*, of one seed: positions that are gathered into cells for want of speed make no cone of the forms. Where the
/// line was that of the cells' centres this was a `taper` of 0.06 µrad.
#[test]
fn gathered_positions_make_no_cone() {
    let noise = SceneNoise {
        white: 0.02,
        ..SceneNoise::default()
    };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let readings = Scene::random(301, 4, 3e-5, 2.0, noise, &mut random).measured(5);
    let model = Linearised::new(&readings, Assumptions::default()).unwrap();
    assert!(model.gathered.is_some());
    let verdict = scene::diagnosed(&readings, &[]).verdict;
    assert_eq!(verdict.kind, Kind::None, "{}", verdict.statement);
}
