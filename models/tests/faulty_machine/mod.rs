//! A machine with faults, measured by reversal: readings of known truth from formulas of their own. Nothing
//! here is shared with the fit, nor with the product's own maker of readings.

use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A curve whose second derivative runs in straight lines between evenly spaced points.
#[derive(Debug, Clone)]
pub struct Curve {
    step: f64,
    /// Height, slope and second derivative at each point.
    points: Vec<[f64; 3]>,
}

impl Curve {
    /// Random, without straight-line part over the places, of a root mean square there.
    pub fn random(
        random: &mut impl Rng,
        length: f64,
        cells: usize,
        places: &[f64],
        rms: f64,
    ) -> Self {
        let step = length / cells as f64;
        let bends: Vec<f64> = (0..=cells).map(|_| StandardNormal.sample(random)).collect();
        let mut points = vec![[0.0, 0.0, bends[0]]];
        for pair in bends.windows(2) {
            let [height, slope, _] = points[points.len() - 1];
            points.push([
                height + step * slope + step * step * (2.0 * pair[0] + pair[1]) / 6.0,
                slope + step * (pair[0] + pair[1]) / 2.0,
                pair[1],
            ]);
        }
        let mut curve = Self { step, points };
        let n = places.len() as f64;
        let middle = places.iter().sum::<f64>() / n;
        let height = places.iter().map(|x| curve.at(*x)).sum::<f64>() / n;
        let (mut product, mut spread) = (0.0, 0.0);
        for x in places {
            product += (x - middle) * (curve.at(*x) - height);
            spread += (x - middle).powi(2);
        }
        let slope = product / spread;
        for (k, point) in curve.points.iter_mut().enumerate() {
            point[0] -= height + slope * (k as f64 * step - middle);
            point[1] -= slope;
        }
        let square = places.iter().map(|x| curve.at(*x).powi(2)).sum::<f64>() / n;
        let factor = rms / square.sqrt();
        for point in &mut curve.points {
            point.iter_mut().for_each(|v| *v *= factor);
        }
        curve
    }

    /// Height at a place.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.points.len() - 2;
        let k = ((x / self.step).floor().max(0.0) as usize).min(last);
        let s = x - k as f64 * self.step;
        let ([height, slope, bend], next) = (self.points[k], self.points[k + 1][2]);
        height + s * (slope + s * (bend / 2.0 + s * (next - bend) / (6.0 * self.step)))
    }
}

/// What is wrong with a machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Half angle of a cone, rad.
    Cone(f64),
    /// The near indicator's gain less the far one's.
    Gain(f64),
    /// Drift of the near and far indicator's zero when all is over, µm, and the time constant, s.
    Drift(f64, f64, f64),
    /// A swing of the near and far indicator's zero, µm, so many times during all.
    Swing(f64, f64, f64),
    /// A jump of an indicator's zero, µm: near or far, at a share of all time.
    Jump(f64, bool, f64),
    /// Play of the indicators, µm.
    Play(f64),
    /// Second power of the reading: µm at 10 µm, near and far.
    Curvature(f64, f64),
    /// Lost motion of the slide, mm.
    LostMotion(f64),
    /// Lateral play of the slide, µm.
    LateralPlay(f64),
    /// The near indicator's periodic error: amplitude, µm; period, µm; phase.
    Cycle(f64, f64, f64),
    /// A bump: height, µm; place and standard width, mm; channel; all repeats or the first.
    Bump(f64, f64, f64, Channel, bool),
    /// The artefact shifted along its axis in the second spindle position, mm.
    Shift(f64),
    /// Thickness beyond what is known, mm.
    Thicker(f64),
    /// A round bar: radius, mm; obliquity of slide and bar across the plane, mm over half the travel.
    Askew(f64, f64, f64),
}

/// A machine, an artefact and a plan of measurement.
#[derive(Debug, Clone)]
pub struct Machine {
    /// α, β, γ, rad.
    pub tilts: [f64; 3],
    /// Thickness of the artefact, mm.
    pub thickness: f64,
    /// Zero of each channel, µm.
    pub offsets: [f64; 4],
    /// Form of the slide and of sides A and B, µm.
    pub forms: [Curve; 3],
    /// Positions, mm, growing.
    pub positions: Vec<f64>,
    /// Repeats, each forward and backward.
    pub repeats: u32,
    /// Seconds from reading to reading.
    pub interval: f64,
    /// Standard deviation of a reading, µm.
    pub noise: f64,
}

impl Machine {
    /// Random forms of 1 µm on so many cells over 300 mm.
    pub fn random(seed: u64, cells: usize, positions: usize, repeats: u32, noise: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed_0000);
        let length = 300.0;
        let positions: Vec<f64> = (0..positions)
            .map(|k| length * k as f64 / (positions - 1) as f64)
            .collect();
        let forms = [(); 3].map(|()| Curve::random(&mut random, length, cells, &positions, 1.0));
        Self {
            tilts: [40e-6, -15e-6, -150e-6],
            thickness: 42.0,
            offsets: [1.5, -0.7, 0.4, -2.0],
            forms,
            positions,
            repeats,
            interval: 2.0,
            noise,
        }
    }

    /// Time of the last reading, s.
    pub fn duration(&self) -> f64 {
        let passes = 2 * 2 * self.repeats as usize;
        (passes * self.positions.len() - 1) as f64 * self.interval
    }

    /// What an indicator is moved by, µm, with the slide commanded to x.
    fn displacement(
        &self,
        channel: Channel,
        repeat: u32,
        forward: bool,
        x: f64,
        faults: &[Fault],
    ) -> f64 {
        let (near, first) = match channel {
            Channel::C1A => (1.0, 1.0),
            Channel::C1B => (-1.0, 1.0),
            Channel::C2A => (-1.0, -1.0),
            Channel::C2B => (1.0, -1.0),
        };
        let way = if forward { 1.0 } else { -1.0 };
        let [alpha, beta, gamma] = self.tilts;
        let mut angle = near * alpha + first * beta + near * first * gamma;
        let (mut slide, mut axial, mut aside) = (x, 0.0, 0.0);
        let mut half = self.thickness / 2.0;
        for fault in faults {
            match *fault {
                Fault::Cone(cone) => angle += cone,
                Fault::LostMotion(lost) => slide -= way * lost / 2.0,
                Fault::LateralPlay(play) => aside -= way * play / 2.0,
                Fault::Shift(shift) if first < 0.0 => axial += shift,
                Fault::Thicker(more) => half += more / 2.0,
                _ => {}
            }
        }
        let side = &self.forms[if near * first > 0.0 { 1 } else { 2 }];
        let dirt = |u: f64| -> f64 {
            faults
                .iter()
                .map(|fault| match *fault {
                    Fault::Bump(height, place, width, where_to, always)
                        if where_to == channel && (always || repeat == 1) =>
                    {
                        height * (-((u - place) / width).powi(2) / 2.0).exp()
                    }
                    _ => 0.0,
                })
                .sum()
        };
        // What is lost beside the crest of a round bar, less what both spindle positions lose.
        let lost = |u: f64| -> f64 {
            let of = |fault: &Fault| match *fault {
                Fault::Askew(radius, slide, bar) => {
                    let depth = |turned: f64| {
                        let beside = (slide + turned * bar) * (u - 150.0) / 150.0;
                        radius - (radius * radius - beside * beside).sqrt()
                    };
                    1000.0 * (depth(first) - (depth(1.0) + depth(-1.0)) / 2.0)
                }
                _ => 0.0,
            };
            faults.iter().map(of).sum()
        };
        let surface = |u: f64| (side.at(u - axial) + dirt(u) - lost(u)) / 1000.0;
        // The point of the artefact's axis below the stylus, by iteration: it contracts by the form's slope
        // times the tilt.
        let mut u = slide;
        for _ in 0..30 {
            u = (slide + (half + surface(u)) * angle.sin()) / angle.cos();
        }
        let height = u * angle.sin() + (half + surface(u)) * angle.cos() - half;
        1000.0 * height + near * (self.forms[0].at(slide) + aside)
    }

    /// Where the indicator is moved to by it at a time, play apart.
    fn shown(&self, channel: Channel, time: f64, displacement: f64, faults: &[Fault]) -> f64 {
        let near = matches!(channel, Channel::C1A | Channel::C2B);
        let mut shown = displacement + self.offsets[channel.index()];
        for fault in faults {
            shown += match *fault {
                Fault::Gain(g) => shown * if near { g / 2.0 } else { -g / 2.0 },
                Fault::Curvature(a, b) => (if near { a } else { b }) * (shown / 10.0).powi(2),
                _ => 0.0,
            };
        }
        for fault in faults {
            shown += match *fault {
                Fault::Drift(a, b, constant) => {
                    let gone = |t: f64| 1.0 - (-t / constant).exp();
                    (if near { a } else { b }) * gone(time) / gone(self.duration())
                }
                Fault::Swing(a, b, cycles) => {
                    let turn = 2.0 * std::f64::consts::PI * cycles * time / self.duration();
                    if near {
                        a * (turn + 0.7).sin()
                    } else {
                        b * (turn - 1.1).sin()
                    }
                }
                Fault::Jump(size, of_near, share)
                    if of_near == near && time > share * self.duration() =>
                {
                    size
                }
                _ => 0.0,
            };
        }
        shown
    }

    /// What the scale of the indicator reads where it stands.
    fn read(channel: Channel, stands: f64, faults: &[Fault]) -> f64 {
        let near = matches!(channel, Channel::C1A | Channel::C2B);
        let off = faults.iter().map(|fault| match *fault {
            Fault::Cycle(size, period, phase) if near => {
                size * (2.0 * std::f64::consts::PI * stands / period + phase).sin()
            }
            _ => 0.0,
        });
        stands + off.sum::<f64>()
    }

    /// Readings with these faults and the noise of a seed: the same noise whatever the faults.
    pub fn measured(&self, faults: &[Fault], seed: u64) -> Observations {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let play = faults.iter().find_map(|f| match f {
            Fault::Play(width) => Some(*width),
            _ => None,
        });
        let n = self.positions.len();
        let mut readings = Vec::new();
        let mut pass = 0;
        for channels in [[Channel::C1A, Channel::C1B], [Channel::C2A, Channel::C2B]] {
            for repeat in 1..=self.repeats {
                for forward in [true, false] {
                    for channel in channels {
                        let stylus = |x: f64, time: f64| {
                            let moved = self.displacement(channel, repeat, forward, x, faults);
                            self.shown(channel, time, moved, faults)
                        };
                        let way = if forward { 1.0 } else { -1.0 };
                        let place =
                            |step: usize| self.positions[if forward { step } else { n - 1 - step }];
                        // The slide comes from 4 mm before the first position.
                        let mut came = place(0) - 4.0 * way;
                        let mut pointer = stylus(came, 0.0);
                        for step in 0..n {
                            let time = (pass * n + step) as f64 * self.interval;
                            let x = place(step);
                            let mut value = stylus(x, time);
                            if let Some(width) = play {
                                let stops = ((x - came).abs() / 0.2).ceil().max(1.0);
                                for k in 1..=stops as usize {
                                    let at = stylus(came + (x - came) * k as f64 / stops, time);
                                    pointer = pointer.max(at - width / 2.0).min(at + width / 2.0);
                                }
                                value = pointer;
                            }
                            came = x;
                            let e: f64 = StandardNormal.sample(&mut random);
                            readings.push(Reading {
                                channel,
                                repeat,
                                direction: if forward {
                                    Direction::Forward
                                } else {
                                    Direction::Backward
                                },
                                time: Some(time),
                                x,
                                value: Self::read(channel, value, faults) + self.noise * e,
                            });
                        }
                    }
                    pass += 1;
                }
            }
        }
        Observations { readings }
    }
}
