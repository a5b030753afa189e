//! Reversals in which every effect is made several ways, from a few lines of physics that share
//! nothing with the catalogue: mounts that drift each by its own amount, one curved indicator, a
//! zero that stays where it jumped, a stylus whose play is followed from before the first reading.
#![allow(dead_code, reason = "test and campaign each use their part")]

use std::f64::consts::TAU;

use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The ways in which each effect is made.
pub const REALISATIONS: &[(&str, usize)] = &[
    ("thermal-drift", 4),
    ("indicator-nonlinearity", 5),
    ("zero-jump", 4),
    ("cyclic-error", 5),
    ("local-contamination", 5),
    ("hysteresis", 4),
    ("lateral-backlash", 6),
    ("ambient-cycle", 4),
    ("stick-slip", 4),
    ("off-crest", 5),
    ("taper", 1),
    ("gain-mismatch", 2),
    ("axis-backlash", 2),
    ("reversal-shift", 1),
];

/// One reading in the making.
#[derive(Clone, Copy)]
pub struct Now {
    /// 0 near, 1 far indicator.
    pub indicator: usize,
    /// ±1: spindle position.
    pub spindle: f64,
    /// ±1: direction of travel.
    pub direction: f64,
    pub repeat: u32,
    /// Position, and part of the travel, −1 to 1.
    pub x: f64,
    pub part: f64,
    /// Time as a part of the whole test, 0 to 1.
    pub time: f64,
}

impl Now {
    fn channel(&self) -> Channel {
        match (self.indicator, self.spindle > 0.0) {
            (0, true) => Channel::C1A,
            (_, true) => Channel::C1B,
            (0, false) => Channel::C2B,
            (_, false) => Channel::C2A,
        }
    }

    /// +1 near, −1 far.
    fn towards(&self) -> f64 {
        if self.indicator == 0 { 1.0 } else { -1.0 }
    }
}

/// Machine, artefact and plan.
pub struct World {
    positions: usize,
    repeats: u32,
    travel: f64,
    tilts: [f64; 3],
    zeros: [f64; 4],
    forms: [Vec<[f64; 3]>; 3],
    /// Straight lines of the forms, taken off them.
    lines: [f64; 3],
    /// Span of the readings about their middles, µm.
    span: f64,
    /// Spindle positions alternate with the repeats.
    alternating: bool,
    pub white: f64,
    pub correlated: f64,
}

impl World {
    pub fn random(positions: usize, seed: u64, tilt: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let travel = uniform(150.0, 400.0);
        let mut form = || -> Vec<[f64; 3]> {
            // Bent arcs and rounded steps.
            (0..6)
                .map(|_| [uniform(-2.0, 2.0), uniform(-0.9, 0.9), uniform(0.08, 0.5)])
                .collect()
        };
        let forms = [form(), form(), form()];
        let white = uniform(0.03, 0.08);
        let mut world = Self {
            positions,
            repeats: 4,
            travel,
            tilts: [0; 3].map(|_| tilt * uniform(-1.5, 1.5)),
            zeros: [0; 4].map(|_| uniform(-6.0, 6.0)),
            forms,
            lines: [0.0; 3],
            span: 1.0,
            alternating: seed.is_multiple_of(2),
            white,
            correlated: if seed % 4 < 2 { 0.0 } else { 0.7 * white },
        };
        let at = |k: usize| 2.0 * k as f64 / (positions - 1) as f64 - 1.0;
        let square: f64 = (0..positions).map(|k| at(k) * at(k)).sum();
        world.lines = [0, 1, 2].map(|which| {
            let along = (0..positions).map(|k| world.form(which, at(k)) * at(k));
            along.sum::<f64>() / square
        });
        world.span = world.reading_span();
        world
    }

    fn form(&self, which: usize, part: f64) -> f64 {
        let steps = self.forms[which].iter();
        steps
            .map(|[h, at, w]| 0.7 * h * ((part - at) / w).tanh())
            .sum()
    }

    /// What the stylus sees, µm, with the slide at one place and the artefact's surface at another.
    pub fn seen(&self, now: &Now, slide: f64, surface: f64) -> f64 {
        let part = |x: f64| 2.0 * x / self.travel - 1.0;
        let channel = now.channel();
        let side = 1 + usize::from(!matches!(channel, Channel::C1A | Channel::C2A));
        let [alpha, beta, gamma] = self.tilts;
        let tilt = now.towards() * alpha + now.spindle * beta + now.towards() * now.spindle * gamma;
        now.towards() * (self.form(0, part(slide)) - self.lines[0] * part(slide))
            + self.form(side, part(surface))
            - self.lines[side] * part(surface)
            + 0.5e3 * tilt * self.travel * part(slide)
            + self.zeros[channel.index()]
    }

    /// The same with nothing amiss.
    fn plain(&self, now: &Now) -> f64 {
        self.seen(now, now.x, now.x)
    }

    /// The readings with something done to each, in the order in which they are taken.
    fn run(&self, mut shown: impl FnMut(&Self, &Now) -> f64) -> Observations {
        let mut passes: Vec<(f64, u32, f64)> = Vec::new();
        for spindle in [1.0, -1.0] {
            for repeat in 1..=self.repeats {
                passes.extend([(spindle, repeat, 1.0), (spindle, repeat, -1.0)]);
            }
        }
        if self.alternating {
            passes.sort_by_key(|p| p.1);
        }
        let (n, count) = (self.positions, passes.len());
        let mut readings = Vec::new();
        for (pass, (spindle, repeat, direction)) in passes.into_iter().enumerate() {
            for step in 0..n {
                let k = if direction > 0.0 { step } else { n - 1 - step };
                let part = 2.0 * k as f64 / (n - 1) as f64 - 1.0;
                for indicator in 0..2 {
                    // A tenth of a trace passes while the slide turns round.
                    let time = (pass as f64 + 0.9 * step as f64 / n as f64) / count as f64;
                    let now = Now {
                        indicator,
                        spindle,
                        direction,
                        repeat,
                        x: 0.5 * self.travel * (part + 1.0),
                        part,
                        time,
                    };
                    readings.push(Reading {
                        channel: now.channel(),
                        repeat,
                        direction: if direction > 0.0 {
                            Direction::Forward
                        } else {
                            Direction::Backward
                        },
                        time: Some(2400.0 * time),
                        x: now.x,
                        value: shown(self, &now),
                    });
                }
            }
        }
        Observations { readings }
    }

    fn noise(&self, seed: u64, readings: &mut Observations) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut last = [0.0; 4];
        let keep = (-(self.travel / self.positions as f64) / 6.0).exp();
        for reading in &mut readings.readings {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let walk = &mut last[reading.channel.index()];
            *walk = keep * *walk + (1.0 - keep * keep).sqrt() * normal();
            reading.value += self.white * normal() + self.correlated * *walk;
        }
    }

    /// Standard deviation of one reading, µm.
    pub fn sigma(&self) -> f64 {
        self.white.hypot(self.correlated)
    }
}

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
            let ratio = [1.13, -0.33, 0.0, 0.6][way];
            let tau = [
                uniform(0.1, 1.0),
                uniform(0.1, 1.0),
                30.0,
                uniform(0.1, 0.4),
            ][way];
            let slower = if way == 3 { 2.5 } else { 1.0 };
            let near = uniform(0.0, 1.0) < 0.5;
            Box::new(move |w, n| {
                let first = (n.indicator == 0) == near;
                let warm = |tau: f64| -(-n.time / tau).exp_m1() / -(-1.0 / tau).exp_m1();
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
                let there = n.channel() == channel && (way < 3 || n.repeat == repeat);
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
            let yaw = [0.0, 0.5, -1.0, 0.0, 0.3, 0.0][way];
            let level = [1.0, 1.0, 0.3, -1.0, 0.4, 1.0][way];
            let (bend, phase) = (uniform(2.0, 5.0), uniform(0.0, TAU));
            let way_to_lean = uniform(0.1, 0.3);
            Box::new(move |w, n| {
                let own = match way {
                    // Both lines have forms of their own.
                    4 => (bend * n.part + phase).sin(),
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
            let pitch = [uniform(0.03, 0.08), uniform(0.08, 0.2), 0.05, 0.12][way];
            // Half or whole slips at mid travel would add up to a constant lag in both directions.
            let begin = [0.25, 0.75, 0.18, 0.33][way] - 0.5 / pitch;
            Box::new(move |w, n| {
                let run = 0.5 * (1.0 + n.direction * n.part);
                let wound = (run / pitch + begin).rem_euclid(1.0);
                let at = n.x - n.direction * 100.0 * size * wound;
                w.seen(n, at, at)
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
            let at = n.x - 50.0 * size * worn * n.direction;
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

impl World {
    fn reading_span(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let bare = self.run(|w, n| w.plain(n));
        for channel in Channel::ALL {
            let values: Vec<f64> = bare.of(channel).map(|r| r.value).collect();
            // The first trace, half way.
            let middle = values[self.positions / 2];
            low = values.iter().fold(low, |a, v| a.min(v - middle));
            high = values.iter().fold(high, |a, v| a.max(v - middle));
        }
        high - low
    }

    /// Root mean square of differences that forms free at every position, zeros of the channels, β
    /// and nothing else can take up.
    fn unabsorbed(&self, bare: &Observations, with: &Observations) -> f64 {
        let n = self.positions;
        let mut means = vec![[0.0; 4]; n];
        let per_cell = bare.readings.len() as f64 / (4 * n) as f64;
        let place = |x: f64| (x / self.travel * (n - 1) as f64).round() as usize;
        let change: Vec<f64> = (bare.readings.iter().zip(&with.readings))
            .map(|(a, b)| b.value - a.value)
            .collect();
        for (r, d) in bare.readings.iter().zip(&change) {
            means[place(r.x)][r.channel.index()] += d / per_cell;
        }
        let u = |k: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
        let line = |f: &dyn Fn(usize) -> f64| {
            let level = (0..n).map(f).sum::<f64>() / n as f64;
            let slope =
                (0..n).map(|k| f(k) * u(k)).sum::<f64>() / (0..n).map(|k| u(k) * u(k)).sum::<f64>();
            (level, slope)
        };
        let signs = [1.0, 1.0, -1.0, -1.0];
        let closure = |k: usize| (0..4).map(|c| signs[c] * means[k][c]).sum::<f64>() / 4.0;
        let sum = |k: usize| means[k].iter().sum::<f64>() / 4.0;
        let ((level, slope), (_, cone)) = (line(&closure), line(&sum));
        let square: f64 = (bare.readings.iter().zip(&change))
            .map(|(r, d)| {
                let (k, c) = (place(r.x), r.channel.index());
                let left = signs[c] * (closure(k) - level - slope * u(k)) + cone * u(k);
                (d - means[k][c] + left).powi(2)
            })
            .sum();
        (square / (change.len() - 3 * n - 1) as f64).sqrt()
    }
}

/// Readings with one way of an effect whose visible part is `visible` times the noise, or none.
pub fn measured(
    effect: &str,
    way: usize,
    visible: f64,
    seed: u64,
    positions: usize,
) -> Option<Observations> {
    // An indicator with periods goes on where its stylus goes on: its span is wide.
    let tilt = if effect == "cyclic-error" {
        1.5e-4
    } else {
        1.5e-5
    };
    let world = World::random(positions, seed, tilt);
    let bare = world.run(|w, n| w.plain(n));
    let mut readings = bare.clone();
    if visible > 0.0 {
        let target = visible * world.sigma();
        let mut size = 0.02;
        for _ in 0..25 {
            let mut shown = made(effect, way, size, seed)?;
            readings = world.run(&mut shown);
            let left = world.unabsorbed(&bare, &readings);
            if (left / target - 1.0).abs() < 0.05 {
                break;
            }
            size *= (target / left).clamp(0.2, 5.0);
        }
        let left = world.unabsorbed(&bare, &readings);
        if (left / target - 1.0).abs() > 0.1 {
            return None;
        }
    }
    world.noise(seed + 77, &mut readings);
    Some(readings)
}

/// Only noise.
pub fn nothing(seed: u64, positions: usize) -> Observations {
    measured("", 0, 0.0, seed, positions).unwrap_or(Observations {
        readings: Vec::new(),
    })
}
