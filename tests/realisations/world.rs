//! Machine, artefact and plan, and what readings of them can take up.

use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

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
    pub(super) fn channel(&self) -> Channel {
        match (self.indicator, self.spindle > 0.0) {
            (0, true) => Channel::C1A,
            (_, true) => Channel::C1B,
            (0, false) => Channel::C2B,
            (_, false) => Channel::C2A,
        }
    }

    /// +1 near, −1 far.
    pub(super) fn towards(&self) -> f64 {
        if self.indicator == 0 { 1.0 } else { -1.0 }
    }
}

/// Machine, artefact and plan.
pub struct World {
    pub(super) positions: usize,
    pub(super) repeats: u32,
    pub(super) travel: f64,
    pub(super) tilts: [f64; 3],
    pub(super) zeros: [f64; 4],
    pub(super) forms: [Vec<[f64; 3]>; 3],
    /// Waves of the forms: height, turns over the travel, phase.
    pub(super) waves: [Vec<[f64; 3]>; 3],
    /// Straight lines of the forms, taken off them.
    pub(super) lines: [f64; 3],
    /// Span of the readings about their middles, µm.
    pub(super) span: f64,
    /// Spindle positions alternate with the repeats.
    pub(super) alternating: bool,
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
            waves: [Vec::new(), Vec::new(), Vec::new()],
            lines: [0.0; 3],
            span: 1.0,
            alternating: seed.is_multiple_of(2),
            white,
            correlated: if seed % 4 < 2 { 0.0 } else { 0.7 * white },
        };
        world.levelled();
        world
    }

    /// Takes the straight lines off the forms.
    fn levelled(&mut self) {
        let positions = self.positions;
        let at = |k: usize| 2.0 * k as f64 / (positions - 1) as f64 - 1.0;
        let square: f64 = (0..positions).map(|k| at(k) * at(k)).sum();
        self.lines = [0, 1, 2].map(|which| {
            let along = (0..positions).map(|k| self.form(which, at(k)) * at(k));
            along.sum::<f64>() / square
        });
        self.span = self.reading_span();
    }

    /// The same with ground surfaces: waves down to less than two positions, lower the shorter they are.
    pub fn roughened(mut self, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0f0f);
        let most = 0.75 * self.positions as f64;
        for waves in &mut self.waves {
            waves.extend((0..60).map(|k| {
                let turns = 5.0 * (most / 5.0).powf((f64::from(k) + random.random::<f64>()) / 60.0);
                let height = 0.5 * (5.0 / turns) * (0.5 + random.random::<f64>());
                [
                    height,
                    turns,
                    std::f64::consts::TAU * random.random::<f64>(),
                ]
            }));
        }
        self.levelled();
        self
    }

    pub(super) fn form(&self, which: usize, part: f64) -> f64 {
        let steps = self.forms[which].iter();
        let waves = self.waves[which].iter();
        steps
            .map(|[h, at, w]| 0.7 * h * ((part - at) / w).tanh())
            .chain(
                waves.map(|[h, turns, phase]| {
                    h * (std::f64::consts::PI * turns * part + phase).sin()
                }),
            )
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
    pub(super) fn plain(&self, now: &Now) -> f64 {
        self.seen(now, now.x, now.x)
    }

    /// The readings with something done to each, in the order in which they are taken.
    pub(super) fn run(&self, mut shown: impl FnMut(&Self, &Now) -> f64) -> Observations {
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

    pub(super) fn noise(&self, seed: u64, readings: &mut Observations) {
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

impl World {
    pub(super) fn reading_span(&self) -> f64 {
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
    pub(super) fn unabsorbed(&self, bare: &Observations, with: &Observations) -> f64 {
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
