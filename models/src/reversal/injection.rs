//! The effects of the catalogue in their exact form, as a maker of readings switches them on.

use rand::{Rng, RngExt};

use super::Channel;

/// An effect in its exact form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Injection {
    /// Half cone angle, rad.
    Taper(f64),
    /// Axial shift in the second spindle position, mm.
    ReversalShift(f64),
    /// Thickness of the artefact that the model leaves out, mm.
    ThicknessShift(f64),
    /// Gain of the near less that of the far indicator.
    GainMismatch(f64),
    /// Gain of both indicators less one.
    CommonGain(f64),
    /// Deviation at the greatest reading off the indicator's zero, µm; quadratic or cubic.
    IndicatorNonlinearity {
        /// Deviation, µm.
        deviation: f64,
        /// Third power in place of the second.
        cubic: bool,
    },
    /// Exponential drift over the whole test, µm.
    ThermalDrift {
        /// Drift at the end, µm.
        drift: f64,
        /// Time constant, s.
        constant: f64,
        /// Both indicators drift alike, in place of opposite.
        alike: bool,
    },
    /// Lost motion of the slide, mm.
    AxisBacklash(f64),
    /// Width of the indicator's play, µm.
    Hysteresis(f64),
    /// A jump of one indicator's zero.
    ZeroJump {
        /// Size, µm.
        jump: f64,
        /// The channel being read.
        channel: Channel,
        /// When, s.
        time: f64,
    },
    /// A bump of dirt.
    LocalContamination {
        /// Height, µm.
        height: f64,
        /// The channel in which it lies under the stylus.
        channel: Channel,
        /// The only repeat in which it lies there, or all.
        repeat: Option<u32>,
        /// Where, mm.
        position: f64,
        /// Standard width, mm.
        width: f64,
    },
    /// A periodic error.
    CyclicError {
        /// Amplitude, µm.
        amplitude: f64,
        /// Period: µm of the reading or mm of the travel.
        period: f64,
        /// Phase, rad.
        phase: f64,
        /// Periodic in the reading, in place of the travel in the first spindle position.
        of_reading: bool,
    },
    /// Sag of the free end, µm.
    GravitySag(f64),
    /// Radius of the stylus ball, mm.
    TipRadius(f64),
}

impl Injection {
    /// The effect of a name in the catalogue at a size; what else it needs is drawn at random.
    pub fn named(name: &str, size: f64, frame: &Frame, random: &mut impl Rng) -> Option<Self> {
        let travel = frame.travel.1 - frame.travel.0;
        let channel = Channel::ALL[random.random_range(0..4)];
        let inside = 0.15 + 0.7 * random.random::<f64>();
        Some(match name {
            "taper" => Self::Taper(size),
            "reversal-shift" => Self::ReversalShift(size),
            "thickness-shift" => Self::ThicknessShift(size),
            "gain-mismatch" => Self::GainMismatch(size),
            "common-gain" => Self::CommonGain(size),
            "indicator-nonlinearity" => Self::IndicatorNonlinearity {
                deviation: size,
                cubic: random.random_bool(0.4),
            },
            "thermal-drift" => Self::ThermalDrift {
                drift: size,
                constant: frame.duration * 10f64.powf(-1.0 + 1.3 * random.random::<f64>()),
                alike: random.random_bool(0.4),
            },
            "axis-backlash" => Self::AxisBacklash(size),
            "hysteresis" => Self::Hysteresis(size),
            "zero-jump" => {
                let (from, to) = frame.times[channel.index()];
                Self::ZeroJump {
                    jump: size,
                    channel,
                    time: from + inside * (to - from),
                }
            }
            "local-contamination" => Self::LocalContamination {
                height: size,
                channel,
                repeat: random
                    .random_bool(0.5)
                    .then(|| random.random_range(1..=frame.repeats.max(1))),
                position: frame.travel.0 + inside * travel,
                width: travel * (0.01 + 0.04 * random.random::<f64>()),
            },
            "cyclic-error" => {
                let of_reading = random.random_bool(0.4);
                let cycles = 4.0 + 20.0 * random.random::<f64>();
                let whole = if of_reading { frame.span } else { travel };
                Self::CyclicError {
                    amplitude: size,
                    period: whole / cycles,
                    phase: 6.3 * random.random::<f64>(),
                    of_reading,
                }
            }
            "gravity-sag" => Self::GravitySag(size),
            "tip-radius" => Self::TipRadius(size),
            _ => return None,
        })
    }
}

impl Injection {
    /// The order in which what acts on a reading does so: where the stylus stands, what moves the mount, the play, an error
    /// of the scale, which stands where all of these have moved it, and last the gain and the curve of the indicator.
    pub fn stage(self) -> u8 {
        match self {
            Self::ThermalDrift { .. } | Self::ZeroJump { .. } => 1,
            Self::Hysteresis(_) => 2,
            _ if self.is_of_scale() => 3,
            _ if self.is_characteristic() => 4,
            _ => 0,
        }
    }

    /// Whether it is the gain or the curve of an indicator.
    pub(super) fn is_characteristic(self) -> bool {
        matches!(
            self,
            Self::GainMismatch(_) | Self::CommonGain(_) | Self::IndicatorNonlinearity { .. }
        )
    }

    /// Whether it is an error of an indicator's scale.
    pub(super) fn is_of_scale(self) -> bool {
        matches!(
            self,
            Self::CyclicError {
                of_reading: true,
                ..
            }
        )
    }
}

/// What an indicator's errors are counted from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zero {
    /// Reading of every channel at mid travel, µm.
    pub middle: [f64; 4],
    /// Greatest reading off the indicators' zero, µm.
    pub reach: f64,
    /// Duration of the whole test, s.
    pub duration: f64,
}

impl Injection {
    /// What an indicator shows beyond what it sees, µm, with the slide at x, mm, after a time, s. Its
    /// play, which remembers, is not among it.
    pub(super) fn shown_beyond(
        self,
        zero: &Zero,
        channel: Channel,
        x: f64,
        time: f64,
        seen: f64,
    ) -> f64 {
        let about = seen - zero.middle[channel.index()];
        match self {
            Self::GainMismatch(gain) => 0.5 * channel.indicator_sign() * gain * about,
            Self::CommonGain(gain) => gain * about,
            Self::IndicatorNonlinearity { deviation, cubic } => {
                deviation * (seen / zero.reach).powi(if cubic { 3 } else { 2 })
            }
            Self::ThermalDrift {
                drift,
                constant,
                alike,
            } => {
                let sign = if alike { 1.0 } else { channel.indicator_sign() };
                sign * drift * (-time / constant).exp_m1() / (-zero.duration / constant).exp_m1()
            }
            Self::ZeroJump {
                jump,
                channel: which,
                time: when,
            } if which == channel && time > when => jump,
            Self::CyclicError {
                amplitude,
                period,
                phase,
                of_reading,
            } => {
                let turn = std::f64::consts::TAU / period;
                if of_reading {
                    amplitude * (turn * seen + phase).sin()
                } else if channel.spindle_sign() > 0.0 {
                    amplitude * (turn * x + phase).sin()
                } else {
                    0.0
                }
            }
            _ => 0.0,
        }
    }

    /// Height of dirt under the stylus at a place of the artefact, mm, in µm.
    pub(super) fn dirt(self, channel: Channel, repeat: u32, place: f64) -> f64 {
        match self {
            Self::LocalContamination {
                height,
                channel: which,
                repeat: when,
                position,
                width,
            } if which == channel && when.is_none_or(|r| r == repeat) => {
                height * (-0.5 * ((place - position) / width).powi(2)).exp()
            }
            _ => 0.0,
        }
    }

    /// Sag at a part of the travel, 0 to 1, µm: a beam held at one end under its own weight.
    pub(super) fn sag(self, part: f64) -> f64 {
        match self {
            Self::GravitySag(end) => end * part * part * (6.0 - 4.0 * part + part * part) / 3.0,
            _ => 0.0,
        }
    }
}

/// What the secondary parameters of an effect are drawn from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// First and last position, mm.
    pub travel: (f64, f64),
    /// Span of the readings, µm.
    pub span: f64,
    /// Duration of the whole test, s.
    pub duration: f64,
    /// First and last time of every channel, s.
    pub times: [(f64, f64); 4],
    /// Repeats.
    pub repeats: u32,
}
