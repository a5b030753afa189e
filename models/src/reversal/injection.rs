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
