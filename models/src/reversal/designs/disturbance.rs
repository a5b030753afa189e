//! Effects of the catalogue in their exact form, as they act on readings of a design. Nothing here is
//! shared with the catalogue's signatures: each is written out as it happens in the machine.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};

use super::channel::{Design, angle_name, is_same};

/// Radius of the stylus ball, mm.
const STYLUS_MM: f64 = 1.5;

/// What an effect is, with all that belongs to it beside its size and place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DesignEffectKind {
    /// Swing of the air, µm: so many cycles over the test, and its phase, rad.
    AmbientCycle {
        /// Cycles over the test.
        cycles: f64,
        /// Phase, rad.
        phase: f64,
    },
    /// Lost motion of the slide, mm.
    AxisBacklash,
    /// Gain of all indicators less one.
    CommonGain,
    /// Wave in what an indicator shows, µm.
    CyclicReading {
        /// Period, µm.
        period: f64,
        /// Phase, rad.
        phase: f64,
    },
    /// Wave over the travel in one position of the spindle, µm.
    CyclicPosition {
        /// Period, mm.
        period: f64,
        /// Phase, rad.
        phase: f64,
    },
    /// Gain of an indicator less one.
    GainMismatch,
    /// Sag of the free end, µm.
    GravitySag,
    /// Play between stylus and pointer, µm.
    Hysteresis,
    /// Angle by which the spindle stands beyond a position, rad.
    IndexingError,
    /// Deviation at the greatest reading of all, µm.
    IndicatorNonlinearity {
        /// Third power of the reading in place of the second.
        cubic: bool,
    },
    /// Step of the slide across its travel from forward to backward, µm.
    LateralBacklash,
    /// Height of a bump of dirt, µm.
    LocalContamination {
        /// The only repeat in which it lies there, or all.
        repeat: Option<u32>,
        /// Where, mm.
        x: f64,
        /// Standard width, mm.
        width: f64,
    },
    /// How far the stylus stands beside the crest of the bar at mid travel, mm.
    OffCrest,
    /// Oval cone, rad: cosine or sine of twice the angle.
    OvalCone {
        /// The sine.
        sine: bool,
    },
    /// Shift of the artefact along its axis in a position of the spindle, mm.
    ReversalShift,
    /// Lag of the slide just before it slips, mm.
    StickSlip {
        /// Slips over the travel.
        slips: f64,
        /// State at mid travel, 0 to 1.
        state: f64,
    },
    /// Half cone angle, rad.
    Taper,
    /// Drift at the end of the test, µm.
    ThermalDrift {
        /// Time constant, s.
        constant: f64,
    },
    /// Diameter that the set-up leaves out, mm.
    ThicknessShift,
    /// Radius of the stylus ball along the travel, mm.
    TipRadius,
    /// Jump of a zero, µm.
    ZeroJump {
        /// When, s.
        time: f64,
    },
}

/// Which readings an effect reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DesignPlace {
    /// All.
    Everywhere,
    /// Those of an indicator, by its place among the design's.
    Indicator(usize),
    /// Those in a position of the spindle, by its place among the design's.
    Position(usize),
    /// Those of a channel.
    Channel(usize),
    /// Along the horizontal (0) or the vertical (1).
    Axis(usize),
}

/// An effect with its size and place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DesignEffect {
    /// What it is.
    pub kind: DesignEffectKind,
    /// How large; the unit is that of the kind.
    pub size: f64,
    /// Where it acts.
    pub place: DesignPlace,
}

/// What the rest of an effect is drawn from.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignFrame {
    /// Travel from 0, mm.
    pub length_mm: f64,
    /// Diameter of the artefact, mm.
    pub thickness_mm: f64,
    /// Span of the readings of a channel, the greatest, µm.
    pub span_um: f64,
    /// Greatest reading off an indicator's zero, µm.
    pub reach_um: f64,
    /// Duration of the whole test, s.
    pub duration_s: f64,
    /// First and last time of every channel, s.
    pub times_s: Vec<(f64, f64)>,
    /// Reading of every channel at mid travel, µm.
    pub middle_um: Vec<f64>,
    /// Repeats.
    pub repeats: u32,
}

/// One reading as it is taken.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    pub channel: usize,
    pub indicator: usize,
    pub position: usize,
    /// Angles of indicator and side, rad.
    pub phi: f64,
    pub psi: f64,
    pub repeat: u32,
    /// +1 forward.
    pub way: f64,
    /// Commanded position, mm.
    pub x: f64,
    /// s.
    pub time: f64,
}

/// What stands under an indicator.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Where the slide is, mm.
    pub slide: f64,
    /// The side that is seen, rad.
    pub psi: f64,
    /// What the channel's tilt is more, rad.
    pub tilt: f64,
    /// How far the artefact has moved along its axis, mm.
    pub shift: f64,
    /// mm.
    pub thickness: f64,
}

/// Names of the effects that act on readings of a design.
pub const DESIGN_EFFECTS: [&str; 20] = [
    "ambient-cycle",
    "axis-backlash",
    "common-gain",
    "cyclic-error",
    "gain-mismatch",
    "gravity-sag",
    "hysteresis",
    "indexing-error",
    "indicator-nonlinearity",
    "lateral-backlash",
    "local-contamination",
    "off-crest",
    "oval-cone",
    "reversal-shift",
    "stick-slip",
    "taper",
    "thermal-drift",
    "thickness-shift",
    "tip-radius",
    "zero-jump",
];

impl DesignEffect {
    /// The effect of a name at a size; what else it needs is drawn at random. `None` for a name that is
    /// none of [`DESIGN_EFFECTS`], and where the design has no place for it.
    pub fn named(
        name: &str,
        size: f64,
        design: &Design,
        frame: &DesignFrame,
        random: &mut impl Rng,
    ) -> Option<Self> {
        use DesignEffectKind as Kind;
        let any = |count: usize, random: &mut dyn FnMut() -> f64| {
            ((count as f64 * random()) as usize).min(count - 1)
        };
        let mut draw = || random.random::<f64>();
        let indicator = DesignPlace::Indicator(any(design.indicators().len(), &mut draw));
        let channel = any(design.channels().len(), &mut draw);
        // The first position is the one from which the others are counted.
        let others = design.positions().len() - 1;
        let position =
            (others > 0).then(|| DesignPlace::Position(1 + any(others.max(1), &mut draw)));
        let seen = |axis: usize| {
            let part = |a: f64| {
                if axis == 0 {
                    a.to_radians().cos()
                } else {
                    a.to_radians().sin()
                }
            };
            design.indicators().iter().any(|a| part(*a).abs() > 0.02)
        };
        let axes: Vec<usize> = (0..2).filter(|axis| seen(*axis)).collect();
        let axis = DesignPlace::Axis(axes[any(axes.len(), &mut draw)]);
        let inside = 0.15 + 0.7 * draw();
        let phase = TAU * draw();
        let one_or_all = if draw() < 0.5 {
            indicator
        } else {
            DesignPlace::Everywhere
        };
        let chance = draw();
        let (kind, place) = match name {
            "ambient-cycle" => {
                let cycles = 1.2 + 3.0 * draw();
                (Kind::AmbientCycle { cycles, phase }, one_or_all)
            }
            "axis-backlash" => (Kind::AxisBacklash, DesignPlace::Everywhere),
            "common-gain" => (Kind::CommonGain, DesignPlace::Everywhere),
            "cyclic-error" => {
                let cycles = 4.0 + 20.0 * draw();
                match position {
                    Some(position) if chance < 0.5 => {
                        let period = frame.length_mm / cycles;
                        (Kind::CyclicPosition { period, phase }, position)
                    }
                    _ => {
                        let period = frame.span_um / cycles;
                        (Kind::CyclicReading { period, phase }, indicator)
                    }
                }
            }
            "gain-mismatch" => (Kind::GainMismatch, indicator),
            "gravity-sag" => (Kind::GravitySag, DesignPlace::Everywhere),
            "hysteresis" => (Kind::Hysteresis, one_or_all),
            "indexing-error" => (Kind::IndexingError, position?),
            "indicator-nonlinearity" => {
                let cubic = chance < 0.4;
                (Kind::IndicatorNonlinearity { cubic }, indicator)
            }
            "lateral-backlash" => (Kind::LateralBacklash, axis),
            "local-contamination" => {
                let own = 1 + any(frame.repeats.max(1) as usize, &mut draw) as u32;
                let kind = Kind::LocalContamination {
                    repeat: (chance < 0.5).then_some(own),
                    x: frame.length_mm * inside,
                    width: frame.length_mm * (0.01 + 0.04 * draw()),
                };
                (kind, DesignPlace::Channel(channel))
            }
            "off-crest" => (Kind::OffCrest, DesignPlace::Everywhere),
            "oval-cone" => {
                let sine = design
                    .sides()
                    .iter()
                    .any(|s| (2.0 * s.to_radians()).sin().abs() > 0.02);
                let sine = sine && chance < 0.5;
                (Kind::OvalCone { sine }, DesignPlace::Everywhere)
            }
            "reversal-shift" => (Kind::ReversalShift, position?),
            "stick-slip" => {
                let (slips, state) = (3.0 + 5.0 * draw(), 0.25 + 0.1 * (draw() - 0.5));
                (Kind::StickSlip { slips, state }, DesignPlace::Everywhere)
            }
            "taper" => (Kind::Taper, DesignPlace::Everywhere),
            "thermal-drift" => {
                let constant = frame.duration_s * 10f64.powf(-1.0 + 1.3 * draw());
                (Kind::ThermalDrift { constant }, one_or_all)
            }
            "thickness-shift" => (Kind::ThicknessShift, DesignPlace::Everywhere),
            "tip-radius" => (Kind::TipRadius, DesignPlace::Everywhere),
            "zero-jump" => {
                let place = if chance < 0.5 {
                    indicator
                } else {
                    DesignPlace::Channel(channel)
                };
                let (from, to) = frame.times_of(design, place);
                let time = from + inside * (to - from);
                (Kind::ZeroJump { time }, place)
            }
            _ => return None,
        };
        Some(Self { kind, size, place })
    }

    /// The unit of its size.
    pub fn unit(&self) -> &'static str {
        use DesignEffectKind as Kind;
        match self.kind {
            Kind::AxisBacklash
            | Kind::OffCrest
            | Kind::ReversalShift
            | Kind::StickSlip { .. }
            | Kind::ThicknessShift
            | Kind::TipRadius => "mm",
            Kind::CommonGain | Kind::GainMismatch => "1",
            Kind::IndexingError | Kind::OvalCone { .. } | Kind::Taper => "rad",
            _ => "um",
        }
    }

    /// Where it acts, in words; empty where everywhere.
    pub fn place_in_words(&self, design: &Design) -> String {
        match self.place {
            DesignPlace::Everywhere => String::new(),
            DesignPlace::Indicator(k) => {
                format!("indicator at {}", angle_name(design.indicators()[k]))
            }
            DesignPlace::Position(k) => {
                format!("spindle at {}", angle_name(design.positions()[k]))
            }
            DesignPlace::Channel(k) => format!("channel {}", design.channels()[k].name),
            DesignPlace::Axis(0) => "horizontal".to_owned(),
            DesignPlace::Axis(_) => "vertical".to_owned(),
        }
    }

    fn reaches(&self, m: &Moment) -> bool {
        match self.place {
            DesignPlace::Everywhere | DesignPlace::Axis(_) => true,
            DesignPlace::Indicator(k) => m.indicator == k,
            DesignPlace::Position(k) => m.position == k,
            DesignPlace::Channel(k) => m.channel == k,
        }
    }

    /// What it changes of slide, artefact and spindle.
    pub(super) fn before(&self, frame: &DesignFrame, m: &Moment, standing: &mut Standing) {
        use DesignEffectKind as Kind;
        if !self.reaches(m) {
            return;
        }
        match self.kind {
            Kind::AxisBacklash => standing.slide -= 0.5 * m.way * self.size,
            Kind::StickSlip { slips, state } => {
                let run = m.way * (m.x / frame.length_mm - 0.5);
                standing.slide -= m.way * self.size * (slips * run + state).rem_euclid(1.0);
            }
            Kind::IndexingError => standing.psi -= self.size,
            Kind::ReversalShift => standing.shift += self.size,
            Kind::ThicknessShift => standing.thickness += self.size,
            Kind::Taper => standing.tilt += self.size,
            Kind::OvalCone { sine: false } => standing.tilt += self.size * (2.0 * m.psi).cos(),
            Kind::OvalCone { sine: true } => standing.tilt += self.size * (2.0 * m.psi).sin(),
            _ => {}
        }
    }

    /// What the stylus is moved by beside slide and artefact, µm: `slope` of the side under it (µm/mm) and
    /// how far (mm) slide and bar have wandered across the line of the indicator since mid travel.
    pub(super) fn at_the_stylus(
        &self,
        frame: &DesignFrame,
        m: &Moment,
        slope: f64,
        across: f64,
    ) -> f64 {
        use DesignEffectKind as Kind;
        if !self.reaches(m) {
            return 0.0;
        }
        match self.kind {
            Kind::LateralBacklash => {
                let seen = match self.place {
                    DesignPlace::Axis(0) => m.phi.cos(),
                    _ => m.phi.sin(),
                };
                0.5 * m.way * self.size * seen
            }
            Kind::LocalContamination { repeat, x, width }
                if repeat.is_none_or(|own| own == m.repeat) =>
            {
                self.size * (-0.5 * ((m.x - x) / width).powi(2)).exp()
            }
            // A beam held at one end under its own weight; up and down alone.
            Kind::GravitySag => {
                let part = m.x / frame.length_mm;
                self.size * m.phi.sin() * part * part * (6.0 - 4.0 * part + part * part) / 3.0
            }
            // Arrow heights of the ball in the slope, and of bar and ball beside the crest.
            Kind::TipRadius => 0.5e-3 * self.size * slope * slope,
            Kind::OffCrest => {
                let beside = self.size + across;
                -1e3 * beside * beside / (2.0 * (0.5 * frame.thickness_mm + STYLUS_MM))
            }
            _ => 0.0,
        }
    }

    /// What moves an indicator beyond its stylus, µm; its play, which remembers, is not among it.
    pub(super) fn of_the_mount(&self, frame: &DesignFrame, m: &Moment) -> f64 {
        use DesignEffectKind as Kind;
        if !self.reaches(m) {
            return 0.0;
        }
        let part = m.time / frame.duration_s;
        match self.kind {
            Kind::AmbientCycle { cycles, phase } => {
                self.size * ((TAU * cycles * part + phase).sin() - phase.sin())
            }
            Kind::CyclicPosition { period, phase } => {
                self.size * (TAU * m.x / period + phase).sin()
            }
            Kind::ThermalDrift { constant } => {
                let whole = (-frame.duration_s / constant).exp_m1();
                self.size * (-m.time / constant).exp_m1() / whole
            }
            Kind::ZeroJump { time } if m.time > time => self.size,
            _ => 0.0,
        }
    }

    /// What an indicator makes of where all that moves it has brought it to, µm: the error of its scale, its gain and its
    /// curve.
    pub(super) fn of_the_scale(&self, frame: &DesignFrame, m: &Moment, stands: f64) -> f64 {
        use DesignEffectKind as Kind;
        if !self.reaches(m) {
            return 0.0;
        }
        match self.kind {
            Kind::CyclicReading { period, phase } => {
                self.size * (TAU * stands / period + phase).sin()
            }
            Kind::CommonGain | Kind::GainMismatch => {
                self.size * (stands - frame.middle_um[m.channel])
            }
            Kind::IndicatorNonlinearity { cubic } => {
                self.size * (stands / frame.reach_um).powi(if cubic { 3 } else { 2 })
            }
            _ => 0.0,
        }
    }

    /// The width of the play at a moment, µm.
    pub(super) fn play(&self, m: &Moment) -> Option<f64> {
        let plays = self.kind == DesignEffectKind::Hysteresis && self.reaches(m);
        plays.then_some(self.size)
    }
}

impl DesignFrame {
    /// First and last time at a place, s.
    fn times_of(&self, design: &Design, place: DesignPlace) -> (f64, f64) {
        let own = |c: usize| match place {
            DesignPlace::Channel(k) => c == k,
            DesignPlace::Indicator(k) => {
                is_same(design.channels()[c].indicator, design.indicators()[k])
            }
            _ => true,
        };
        let all = self.times_s.iter().enumerate().filter(|(c, _)| own(*c));
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (_, (a, b))| {
            (l.min(*a), h.max(*b))
        })
    }
}
