//! Reversals in which every effect is made several ways, from a few lines of physics that share
//! nothing with the catalogue: mounts that drift each by its own amount, one curved indicator, a
//! zero that stays where it jumped, a stylus whose play is followed from before the first reading.
#![allow(dead_code, reason = "test and campaign each use their part")]

mod world;

use std::f64::consts::TAU;

use errsep_models::reversal::{Channel, Observations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use world::{Now, World};

/// The ways in which each effect is made.
pub const REALISATIONS: &[(&str, usize)] = &[
    ("thermal-drift", 5),
    ("indicator-nonlinearity", 5),
    ("zero-jump", 4),
    ("cyclic-error", 6),
    ("local-contamination", 7),
    ("hysteresis", 4),
    ("lateral-backlash", 7),
    ("ambient-cycle", 4),
    ("stick-slip", 6),
    ("sticking-plunger", 4),
    ("off-crest", 5),
    ("taper", 1),
    ("gain-mismatch", 2),
    ("axis-backlash", 3),
    ("reversal-shift", 2),
];

/// Those in which the surfaces are rough at the spacing of the positions.
const ROUGH: [(&str, usize); 2] = [("axis-backlash", 2), ("reversal-shift", 1)];

/// What an effect makes of a reading: a closure with its own memory.
pub type Shown = Box<dyn FnMut(&World, &Now) -> f64>;

/// A way in which an effect comes about, at a size; its own circumstances by the seed.
pub fn made(effect: &str, way: usize, size: f64, seed: u64) -> Option<Shown> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0xbeef);
    let mut uniform = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let plain = |w: &World, n: &Now| w.plain(n);
    Some(match (effect, way) {
        // Two mounts warm up: each moves by its own amount.
        ("thermal-drift", _) => {
            let ratio = [1.13, -0.33, 0.0, 0.6, 0.15][way];
            let tau = [
                uniform(0.1, 1.0),
                uniform(0.1, 1.0),
                30.0,
                uniform(0.1, 0.4),
                0.06,
            ][way];
            let slower = if way == 3 { 2.5 } else { 1.0 };
            let near = uniform(0.0, 1.0) < 0.5;
            Box::new(move |w, n| {
                let first = (n.indicator == 0) == near;
                let warm = |tau: f64| -(-n.time / tau).exp_m1() / -(-1.0 / tau).exp_m1();
                // A light body and a heavy one that move the mount against each other.
                let warm = |tau: f64| match way {
                    4 => 1.2 * warm(tau) - 0.8 * warm(0.9),
                    _ => warm(tau),
                };
                plain(w, n)
                    + size
                        * if first {
                            warm(tau)
                        } else {
                            ratio * warm(slower * tau)
                        }
            })
        }
        ("indicator-nonlinearity", _) => {
            let near = uniform(0.0, 1.0) < 0.5;
            Box::new(move |w, n| {
                let seen = plain(w, n);
                let own = (n.indicator == 0) == near;
                let bend = match way {
                    0 if own => 1e-2 * seen * seen,
                    1 if own => 1e-3 * seen.powi(3),
                    2 => 1e-2 * seen * seen * if own { 1.0 } else { -0.4 },
                    4 if own => 1e-2 * seen * seen + 1.5e-3 * seen.powi(3),
                    // A lever turning about its pin: reading = r sin, arc against chord.
                    3 if own => 1.5e-3 * (500.0 * (seen / 50.0).sin() - 10.0 * seen),
                    _ => 0.0,
                };
                seen + size * bend
            })
        }
        ("zero-jump", _) => {
            let (when, near) = (uniform(0.08, 0.92), uniform(0.0, 1.0) < 0.5);
            let spindle = if uniform(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
            Box::new(move |w, n| {
                let own = (n.indicator == 0) == near
                    && match way {
                        0 => n.time > when,
                        // Between two traces.
                        1 => n.time > (16.0 * when).floor().max(1.0) / 16.0,
                        // Set to zero anew in the other spindle position.
                        2 => n.time > when && n.spindle == spindle,
                        _ => n.time > 0.3 + 0.4 * when && n.spindle < 0.0,
                    };
                plain(w, n) + if own { size } else { 0.0 }
            })
        }
        ("cyclic-error", _) => {
            let near = uniform(0.0, 1.0) < 0.5;
            // 2.5 to 4 readings a period.
            let (few, fast) = (uniform(4.0, 16.0), uniform(0.25, 0.4));
            let (phase, other) = (uniform(0.0, TAU), uniform(0.0, TAU));
            Box::new(move |w, n| {
                let seen = plain(w, n);
                let own = (n.indicator == 0) == near;
                let cycles = if way == 1 {
                    fast * w.positions as f64
                } else {
                    few
                };
                let turn = TAU * cycles / w.span;
                seen + size
                    * match way {
                        0 | 1 if own => (turn * seen + phase).sin(),
                        2 => (turn * seen + if own { phase } else { other }).sin(),
                        // Of the drive in the cables of one indicator, its phase set anew.
                        5 if own => {
                            let begins = if n.spindle > 0.0 { phase } else { other };
                            (TAU * cycles * 0.5 * n.part + begins).sin()
                        }
                        // Of the drive, in one spindle position.
                        3 if n.spindle > 0.0 => (TAU * cycles * 0.5 * n.part + phase).sin(),
                        4 if own => {
                            0.7 * (turn * seen + phase).sin() + 0.1 * (3.0 * turn * seen).sin()
                        }
                        _ => 0.0,
                    }
            })
        }
        ("local-contamination", _) => {
            let (at, wide) = (uniform(-0.7, 0.7), uniform(0.03, 0.09));
            let channel = Channel::ALL[(uniform(0.0, 4.0) as usize).min(3)];
            let repeat = 1 + (uniform(0.0, 4.0) as u32).min(3);
            Box::new(move |w, n| {
                let away = ((n.part - at) / wide).abs();
                let section = match way {
                    0 | 3 => (-0.5 * away * away).exp(),
                    // A film with rounded edges.
                    1 => 1.0 / (1.0 + (12.0 * (away - 1.0)).exp()),
                    // A scratch: it goes down.
                    2 => -(1.0 - 0.5 * away).max(0.0),
                    _ => (1.0 - away * 0.5).max(0.0),
                };
                let met = match way {
                    0..3 => true,
                    // It came after the third pass forward, and stays.
                    5 => n.repeat > 3 || n.repeat == 3 && n.direction < 0.0,
                    // It came in that pass, while the stylus stood on its place.
                    6 => {
                        n.repeat > 3
                            || n.repeat == 3 && (n.direction < 0.0 || n.part > at + 0.2 * wide)
                    }
                    _ => n.repeat == repeat,
                };
                let there = n.channel() == channel && met;
                plain(w, n) + if there { size * section } else { 0.0 }
            })
        }
        // The pointer is followed through the whole test, from a run-in of the slide.
        ("hysteresis", _) => {
            let near = uniform(0.0, 1.0) < 0.5;
            let mut pointer = [f64::NAN; 2];
            let mut before = [0.0; 2];
            Box::new(move |w, n| {
                let seen = plain(w, n);
                let own = (n.indicator == 0) == near;
                let half = 0.5
                    * size
                    * match way {
                        1 | 3 => f64::from(u8::from(own)),
                        2 if !own => 0.5,
                        _ => 1.0,
                    };
                let k = n.indicator;
                if pointer[k].is_nan() || n.spindle != before[k] {
                    // Set up anew: it comes from half a micrometre off, on one side or the other.
                    pointer[k] = seen + if way == 3 { half } else { -half };
                }
                before[k] = n.spindle;
                pointer[k] = pointer[k].clamp(seen - half, seen + half);
                pointer[k]
            })
        }
        ("lateral-backlash", _) => {
            let yaw = [0.0, 0.5, -1.0, 0.0, 0.3, 0.0, 0.0][way];
            let level = [1.0, 1.0, 0.3, -1.0, 0.4, 1.0, 0.0][way];
            let (bend, phase) = (uniform(2.0, 5.0), uniform(0.0, TAU));
            let way_to_lean = uniform(0.1, 0.3);
            Box::new(move |w, n| {
                let own = match way {
                    // Both lines have forms of their own.
                    4 => (bend * n.part + phase).sin(),
                    // Lines that wind about each other.
                    6 => (4.0 * std::f64::consts::PI * n.part).cos(),
                    // The slide leans over after it has turned round.
                    5 => -2.0 * (-(1.0 + n.direction * n.part) / way_to_lean).exp(),
                    _ => 0.0,
                };
                let lines = level + yaw * n.part + own;
                plain(w, n) + 0.5 * size * n.towards() * n.direction * lines
            })
        }
        ("ambient-cycle", _) => {
            let cycles = [uniform(1.2, 3.0), uniform(3.0, 7.0), uniform(2.0, 9.0), 2.2][way];
            let (phase, lag) = (uniform(0.0, TAU), uniform(-1.0, 1.0));
            Box::new(move |w, n| {
                let turn = TAU * cycles * n.time + phase;
                let swing = match (way, n.indicator) {
                    (0, _) => turn.sin(),
                    (1, 0) => turn.sin(),
                    (1, _) => 0.4 * (turn + lag).sin(),
                    (2, _) => n.towards() * turn.sin(),
                    (_, 0) => turn.sin(),
                    _ => 0.0,
                };
                plain(w, n) + size * swing
            })
        }
        // The slide sticks until its drive has wound up by a step, then slips after it.
        ("stick-slip", _) => {
            let pitch = [
                uniform(0.03, 0.08),
                uniform(0.08, 0.2),
                0.05,
                0.12,
                0.15,
                0.14,
            ][way];
            // Half or whole slips at mid travel would add up to a constant lag in both directions.
            let begin = [0.25, 0.75, 0.18, 0.33, 0.0, 0.0][way] - 0.5 / pitch;
            let anew: Vec<f64> = (0..16).map(|_| uniform(0.0, 1.0)).collect();
            Box::new(move |w, n| {
                let run = 0.5 * (1.0 + n.direction * n.part);
                let turned = usize::from(n.direction < 0.0) + 2 * usize::from(n.spindle < 0.0);
                let begins = anew[4 * (n.repeat as usize - 1) + turned];
                if way == 4 {
                    // It sticks at one side, and leans away from it until it slips.
                    let leans = (run / pitch + begins).rem_euclid(1.0);
                    return plain(w, n) - size * n.towards() * n.direction * leans;
                }
                // The drive stands anywhere when a pass begins.
                let stands = if way == 5 { begins } else { begin };
                let wound = (run / pitch + stands).rem_euclid(1.0);
                let at = n.x - n.direction * 100.0 * size * wound;
                w.seen(n, at, at)
            })
        }
        // The plunger holds on until it is off by the size, and goes all the way: at a stop, or on the way to it.
        ("sticking-plunger", _) => {
            let near = uniform(0.0, 1.0) < 0.5;
            let mut pointer = [f64::NAN; 2];
            let mut before = [(0.0, 0.0); 2];
            let mut holds: Vec<f64> = (0..4096).map(|_| uniform(0.85, 1.15)).collect();
            Box::new(move |w, n| {
                let seen = plain(w, n);
                let k = n.indicator;
                let hold = size
                    * match way {
                        2 if k == 1 => 0.6,
                        0 | 1 | 3 if (k == 0) != near => 0.0,
                        _ => 1.0,
                    };
                let (spindle, last) = before[k];
                before[k] = (n.spindle, n.x);
                if pointer[k].is_nan() || n.spindle != spindle {
                    pointer[k] = seen - 0.7 * hold;
                    return pointer[k];
                }
                let steps = if way == 0 { 1 } else { 40 };
                for step in 1..=steps {
                    let x = last + (n.x - last) * f64::from(step) / f64::from(steps);
                    let seen = w.seen(n, x, x);
                    // Friction differs from time to time.
                    let part = if way == 3 {
                        holds.last().copied()
                    } else {
                        None
                    };
                    if (seen - pointer[k]).abs() >= hold * part.unwrap_or(1.0) {
                        pointer[k] = seen;
                        holds.pop();
                    }
                }
                pointer[k]
            })
        }
        // The stylus leaves the crest sideways as slide and bar are askew: what it loses is a circle's.
        ("off-crest", _) => {
            let slide = [0.3, 0.5, -0.4, 0.6, 0.5][way];
            let bar = [0.5, 0.3, 0.4, -0.3, 0.6][way];
            // The indicators stand beside the crest at mid travel too.
            let beside = [[0.0, 0.0], [0.8, -0.3]][usize::from(way == 4)];
            Box::new(move |w, n| {
                let sideways = beside[n.indicator] + n.part * (slide + n.spindle * bar);
                // mm, over a radius of 20 mm.
                let lost = 20.0 - (400.0 - sideways * sideways).sqrt();
                plain(w, n) - size * 1e3 * lost
            })
        }
        ("taper", _) => Box::new(move |w, n| plain(w, n) + size * n.part),
        ("gain-mismatch", _) => Box::new(move |w, n| {
            let seen = plain(w, n);
            let middle = w.seen(n, 0.5 * w.travel, 0.5 * w.travel);
            let own = if way == 0 {
                n.indicator == 0
            } else {
                n.indicator == 1
            };
            seen + if own {
                0.1 * size * (seen - middle)
            } else {
                0.0
            }
        }),
        ("axis-backlash", _) => Box::new(move |w, n| {
            // A screw that is worn at one end loses more there.
            let worn = if way == 1 { 1.0 + 0.7 * n.part } else { 1.0 };
            // A stop that takes up what is lost when it goes back.
            let taken_up = way == 2 && n.direction < 0.0;
            let lost = if taken_up { 0.0 } else { 50.0 * size };
            let at = n.x - lost * worn * n.direction;
            w.seen(n, at, at)
        }),
        ("reversal-shift", _) => Box::new(move |w, n| {
            w.seen(
                n,
                n.x,
                n.x - if n.spindle > 0.0 { 0.0 } else { 50.0 * size },
            )
        }),
        _ => return None,
    })
}

/// Readings with one way of an effect whose visible part is `visible` times the noise, or none.
pub fn measured(
    effect: &str,
    way: usize,
    visible: f64,
    seed: u64,
    positions: usize,
) -> Option<Observations> {
    together(&[(effect, way, visible)], seed, positions)
}

/// Readings with several effects, what each changes added to what the others do; visible parts as in [`measured`].
pub fn together(
    effects: &[(&str, usize, f64)],
    seed: u64,
    positions: usize,
) -> Option<Observations> {
    // An indicator with periods goes on where its stylus goes on: its span is wide.
    let tilt = if effects.iter().any(|e| e.0 == "cyclic-error") {
        1.5e-4
    } else {
        1.5e-5
    };
    let mut world = World::random(positions, seed, tilt);
    if effects
        .iter()
        .any(|(effect, way, _)| ROUGH.contains(&(effect, *way)))
    {
        world = world.roughened(seed);
    }
    let bare = world.run(|w, n| w.plain(n));
    let mut readings = bare.clone();
    for (effect, way, visible) in effects.iter().filter(|e| e.2 > 0.0) {
        let shown = sized(&mut world, &bare, (effect, *way, *visible), seed)?;
        let changed = shown.readings.iter().zip(&bare.readings);
        for (reading, (with, without)) in readings.readings.iter_mut().zip(changed) {
            reading.value += with.value - without.value;
        }
    }
    world.noise(seed + 77, &mut readings);
    Some(readings)
}

/// Readings without noise with one effect, of such a size that its visible part is so many times the noise.
fn sized(
    world: &mut World,
    bare: &Observations,
    (effect, way, visible): (&str, usize, f64),
    seed: u64,
) -> Option<Observations> {
    let target = visible * world.sigma();
    let mut size = 0.02;
    let mut readings = bare.clone();
    for _ in 0..25 {
        let mut shown = made(effect, way, size, seed)?;
        readings = world.run(&mut shown);
        let left = world.unabsorbed(bare, &readings);
        if (left / target - 1.0).abs() < 0.05 {
            break;
        }
        size *= (target / left).clamp(0.2, 5.0);
    }
    let left = world.unabsorbed(bare, &readings);
    ((left / target - 1.0).abs() <= 0.1).then_some(readings)
}

/// Only noise.
pub fn nothing(seed: u64, positions: usize) -> Observations {
    measured("", 0, 0.0, seed, positions).unwrap_or(Observations {
        readings: Vec::new(),
    })
}
