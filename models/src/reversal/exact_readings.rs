//! Readings of a reversal with known truth and any effect of the catalogue switched on, each in
//! its exact form. Nothing here is shared with the signatures by which the diagnosis finds them.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub use super::exact_form::Form;
use super::injection::Zero;
pub use super::injection::{Frame, Injection};
use super::{Channel, Direction, Observations, Reading};

/// The noise of a scene, standard deviations in µm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SceneNoise {
    /// White part.
    pub white: f64,
    /// Part correlated along a trace.
    pub correlated: f64,
    /// Its correlation length, mm.
    pub length: f64,
    /// Shift of each trace.
    pub shift: f64,
}

/// A machine, an artefact and a plan of measurement with known truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Commanded positions, mm.
    pub positions: Vec<f64>,
    /// Repeats of every trace.
    pub repeats: u32,
    /// Whether every trace is also run backward.
    pub both_directions: bool,
    /// Seconds between readings.
    pub interval: f64,
    /// α, β, γ, rad.
    pub tilts: [f64; 3],
    /// Offsets of the four channels, µm.
    pub offsets: [f64; 4],
    /// Form of the slide.
    pub m: Form,
    /// Form of side A.
    pub s_a: Form,
    /// Form of side B.
    pub s_b: Form,
    /// Noise.
    pub noise: SceneNoise,
    /// Effects.
    pub effects: Vec<Injection>,
}

impl Scene {
    /// A random scene without effects.
    pub fn random(
        positions: usize,
        repeats: u32,
        tilt: f64,
        form: f64,
        noise: SceneNoise,
        random: &mut impl Rng,
    ) -> Self {
        let travel = 150.0 + 300.0 * random.random::<f64>();
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let tilts = [tilt * normal(), tilt * normal(), tilt * normal()];
        let offsets = [normal(), normal(), normal(), normal()].map(|v| 5.0 * v);
        let positions: Vec<f64> = (0..positions)
            .map(|k| travel * k as f64 / (positions.max(2) - 1) as f64)
            .collect();
        let mut shape = |size: f64| Form::random(size, travel, 9, random).level(&positions);
        let (m, s_a, s_b) = (shape(form), shape(form), shape(form));
        Self {
            positions,
            repeats,
            both_directions: true,
            interval: 0.5,
            tilts,
            offsets,
            m,
            s_a,
            s_b,
            noise,
            effects: Vec::new(),
        }
    }

    /// Length of travel, mm.
    pub fn travel(&self) -> f64 {
        match (self.positions.first(), self.positions.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    fn passes(&self) -> u32 {
        self.repeats * if self.both_directions { 2 } else { 1 }
    }

    /// Duration of the whole test, s.
    pub fn duration(&self) -> f64 {
        2.0 * f64::from(self.passes()) * self.positions.len() as f64 * self.interval
    }

    /// What the secondary parameters of an effect are drawn from.
    pub fn frame(&self) -> Frame {
        let half = 0.5 * self.duration();
        Frame {
            travel: (0.0, self.travel()),
            span: self.reading_span(),
            duration: self.duration(),
            times: Channel::ALL.map(|c| {
                if c.spindle_sign() > 0.0 {
                    (0.0, half)
                } else {
                    (half, 2.0 * half)
                }
            }),
            repeats: self.repeats,
        }
    }

    /// Smallest to greatest reading of all channels about their middles, µm.
    pub fn reading_span(&self) -> f64 {
        let middle = 0.5 * self.travel();
        let values: Vec<f64> = Channel::ALL
            .into_iter()
            .flat_map(|c| {
                let zero = self.geometry(c, middle, 1.0, 1, false);
                self.positions
                    .iter()
                    .map(move |x| self.geometry(c, *x, 1.0, 1, false) - zero)
                    .collect::<Vec<_>>()
            })
            .collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - low
    }

    fn reading_reach(&self) -> f64 {
        Channel::ALL
            .into_iter()
            .flat_map(|c| self.positions.iter().map(move |x| (c, *x)))
            .map(|(c, x)| self.geometry(c, x, 1.0, 1, false).abs())
            .fold(f64::MIN_POSITIVE, f64::max)
    }

    /// The displacement under an indicator, µm: exact rigid geometry of slide and artefact.
    fn geometry(
        &self,
        channel: Channel,
        commanded: f64,
        direction: f64,
        repeat: u32,
        effects: bool,
    ) -> f64 {
        let active: &[Injection] = if effects { &self.effects } else { &[] };
        let [alpha, beta, gamma] = self.tilts;
        let mut angle = channel.indicator_sign() * alpha
            + channel.spindle_sign() * beta
            + channel.side_sign() * gamma;
        let (mut slide, mut axial, mut half, mut radius) = (commanded, 0.0, 0.0, 0.0);
        for effect in active {
            match *effect {
                Injection::Taper(cone) => angle += cone,
                Injection::AxisBacklash(lost) => slide -= 0.5 * direction * lost,
                Injection::ReversalShift(shift) if channel.spindle_sign() < 0.0 => axial += shift,
                Injection::ThicknessShift(thickness) => half += 0.5 * thickness,
                Injection::TipRadius(r) => radius += r,
                _ => {}
            }
        }
        let side = if channel.is_side_a() {
            &self.s_a
        } else {
            &self.s_b
        };
        let dirt = |u: f64| -> f64 { active.iter().map(|e| e.dirt(channel, repeat, u)).sum() };
        let surface = |u: f64| {
            let here = side.at(u - axial);
            let slope = (side.at(u - axial + 0.01) - side.at(u - axial - 0.01)) / 0.02e3;
            (here + dirt(u) + 0.5e3 * radius * slope * slope) * 1e-3
        };
        // u: position on the artefact's own axis that lies under the stylus, by fixed point; the
        // map contracts by |S′ tan ψ|, far below one.
        let (sine, cosine) = angle.sin_cos();
        let mut u = slide;
        for _ in 0..60 {
            let next = (slide + (half + surface(u)) * sine) / cosine;
            let step = (next - u).abs();
            u = next;
            if step < 1e-12 {
                break;
            }
        }
        let reading = u * sine + (half + surface(u)) * cosine - half;
        let part = if self.travel() > 0.0 {
            slide / self.travel()
        } else {
            0.0
        };
        let bend: f64 = active.iter().map(|e| e.sag(part)).sum();
        reading * 1e3
            + channel.indicator_sign() * (self.m.at(slide) + bend)
            + self.offsets[channel.index()]
    }

    /// Where an indicator is moved to by a displacement at a time, before its play, what it makes of that, and noise.
    fn indicated(
        &self,
        zero: &Zero,
        channel: Channel,
        x: f64,
        time: f64,
        displacement: f64,
    ) -> f64 {
        let moved = |e: &Injection| !e.is_of_scale() && !e.is_characteristic();
        displacement + self.beyond(zero, channel, (x, time), displacement, moved)
    }

    /// What some effects add to what an indicator stands at.
    fn beyond(
        &self,
        zero: &Zero,
        channel: Channel,
        (x, time): (f64, f64),
        stands: f64,
        which: impl Fn(&Injection) -> bool,
    ) -> f64 {
        let own = self.effects.iter().filter(|e| which(e));
        own.map(|effect| effect.shown_beyond(zero, channel, x, time, stands))
            .sum()
    }

    /// Readings without noise.
    pub fn exact(&self) -> Observations {
        self.readings(None)
    }

    /// Readings with noise.
    pub fn measured(&self, seed: u64) -> Observations {
        self.readings(Some(ChaCha8Rng::seed_from_u64(seed)))
    }

    fn readings(&self, mut random: Option<ChaCha8Rng>) -> Observations {
        let mut readings = Vec::new();
        let middle = 0.5 * self.travel();
        let zero = Zero {
            middle: Channel::ALL.map(|c| self.geometry(c, middle, 1.0, 1, false)),
            reach: self.reading_reach(),
            duration: self.duration(),
        };
        let mut pass = 0;
        for spindle in [1.0, -1.0] {
            for repeat in 1..=self.repeats {
                let directions: &[Direction] = if self.both_directions {
                    &[Direction::Forward, Direction::Backward]
                } else {
                    &[Direction::Forward]
                };
                for &direction in directions {
                    for channel in Channel::ALL
                        .into_iter()
                        .filter(|c| c.spindle_sign() == spindle)
                    {
                        self.trace(
                            channel,
                            repeat,
                            direction,
                            pass,
                            &zero,
                            &mut random,
                            &mut readings,
                        );
                    }
                    pass += 1;
                }
            }
        }
        Observations { readings }
    }

    #[expect(clippy::too_many_arguments, reason = "one trace of a plan")]
    fn trace(
        &self,
        channel: Channel,
        repeat: u32,
        direction: Direction,
        pass: usize,
        zero: &Zero,
        random: &mut Option<ChaCha8Rng>,
        readings: &mut Vec<Reading>,
    ) {
        let n = self.positions.len();
        // Play of the indicators, µm.
        let width: f64 = self
            .effects
            .iter()
            .map(|e| match e {
                Injection::Hysteresis(width) => *width,
                _ => 0.0,
            })
            .sum();
        let sign = if direction == Direction::Forward {
            1.0
        } else {
            -1.0
        };
        let mut normal = || -> f64 {
            random
                .as_mut()
                .map_or(0.0, |source| StandardNormal.sample(source))
        };
        let shift = self.noise.shift * normal();
        let mut walk = self.noise.correlated * normal();
        let mut pointer: Option<f64> = None;
        for step in 0..n {
            let k = if sign > 0.0 { step } else { n - 1 - step };
            let x = self.positions[k];
            let time = (pass * n + step) as f64 * self.interval;
            let displacement = self.geometry(channel, x, sign, repeat, true);
            let mut shown = self.indicated(zero, channel, x, time, displacement);
            if width > 0.0 {
                // The slide comes from a little before the first position.
                let before = self.indicated(
                    zero,
                    channel,
                    x - sign * 1e-3,
                    time,
                    self.geometry(channel, x - sign * 1e-3, sign, repeat, true),
                );
                let last = pointer.unwrap_or(shown - 0.5 * width * (shown - before).signum());
                let next = last.clamp(shown - 0.5 * width, shown + 0.5 * width);
                pointer = Some(next);
                shown = next;
            }
            let made = |e: &Injection| e.is_of_scale() || e.is_characteristic();
            shown += self.beyond(zero, channel, (x, time), shown, made);
            if step > 0 && self.noise.correlated > 0.0 {
                let previous = self.positions[if sign > 0.0 { k - 1 } else { k + 1 }];
                let decay = (-(x - previous).abs() / self.noise.length).exp();
                walk =
                    decay * walk + self.noise.correlated * (1.0 - decay * decay).sqrt() * normal();
            }
            readings.push(Reading {
                channel,
                repeat,
                direction,
                time: Some(time),
                x,
                value: shown + shift + walk + self.noise.white * normal(),
            });
        }
    }
}
