//! Effects that can be unknowns of the fit: one file an effect.
//!
//! An effect is a list of unknowns and what they change at one stage of the measuring chain: where the
//! slide or the artefact stands ([`JoinedEffect::moves`]), the surface ([`JoinedEffect::bump`]), what the
//! indicator shows of what it sees ([`JoinedEffect::shown`], before or after its play), or that play
//! ([`JoinedEffect::play`]). To add one, write its file and add it to [`CATALOGUE`].

mod absorbed;
mod ambient_cycle;
mod axis_backlash;
mod cyclic_error;
mod gain_mismatch;
mod heights;
mod hysteresis;
mod indicator_nonlinearity;
mod lateral_backlash;
mod local_contamination;
mod off_crest;
mod reversal_shift;
mod setting;
mod taper;
mod thermal_drift;
mod thickness_shift;
mod zero_jump;

use std::borrow::Cow;
use std::fmt::Debug;
use std::sync::Arc;

use crate::reversal::Channel;

pub use heights::{HEIGHTS, Heights};
pub use setting::{Circumstances, Indicator, Setting, times};

/// An effect that the fit can take in, or why it cannot.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Its name, that of the catalogue of the diagnosis.
    pub name: &'static str,
    /// Whether it goes by the time of the readings.
    pub timed: bool,
    /// Its variants for a set of readings, of which the best is taken.
    pub variants: fn(&Setting) -> Vec<Arc<dyn JoinedEffect>>,
    /// Why it is refused: what takes it up already, and what to do.
    pub refused: fn(&Setting) -> Option<(&'static str, &'static str)>,
}

/// All effects by name.
pub const CATALOGUE: &[Entry] = &[
    ambient_cycle::ENTRY,
    axis_backlash::ENTRY,
    absorbed::COMMON_GAIN,
    cyclic_error::ENTRY,
    gain_mismatch::ENTRY,
    absorbed::GRAVITY_SAG,
    hysteresis::ENTRY,
    indicator_nonlinearity::ENTRY,
    lateral_backlash::ENTRY,
    local_contamination::ENTRY,
    off_crest::ENTRY,
    reversal_shift::ENTRY,
    taper::ENTRY,
    thermal_drift::ENTRY,
    thickness_shift::ENTRY,
    absorbed::TIP_RADIUS,
    zero_jump::ENTRY,
];

/// What an unknown of an effect is to the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A size: with all sizes zero the effect is not there.
    Amplitude,
    /// A parameter of shape, between its bounds.
    Shape,
    /// A parameter of shape that moves readings by steps: searched over, the others held.
    Searched,
}

/// An unknown of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Name.
    pub name: Cow<'static, str>,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub kind: Kind,
    /// Smallest value: plausible for an amplitude, allowed for a shape.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
}

impl Unknown {
    /// A size of either sign.
    pub const fn size(name: &'static str, unit: &'static str, reach: f64) -> Self {
        Self {
            name: Cow::Borrowed(name),
            unit,
            kind: Kind::Amplitude,
            low: -reach,
            high: reach,
        }
    }

    /// A parameter of shape.
    pub const fn shape(name: &'static str, unit: &'static str, low: f64, high: f64) -> Self {
        Self {
            name: Cow::Borrowed(name),
            unit,
            kind: Kind::Shape,
            low,
            high,
        }
    }

    /// The same with a range of its own.
    #[must_use]
    pub const fn between(mut self, low: f64, high: f64) -> Self {
        (self.low, self.high) = (low, high);
        self
    }
}

/// What moves under an indicator, and by how much per unit of an effect's first unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    /// The slide along its travel: x → x + δ, mm.
    Slide(f64),
    /// The artefact's attitude: ψ → ψ + τ, rad.
    Tilt(f64),
    /// The artefact along its own axis, mm.
    Axial(f64),
    /// The surface off the artefact's axis: h → h + δ, mm.
    HalfThickness(f64),
    /// The slide towards the near indicator, µm.
    Lateral(f64),
}

/// The order in which indicators apply what effects do to a reading; their play stands between [`Self::Added`] and
/// [`Self::Scale`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shows {
    /// It adds to what is seen, by the time or by the place.
    Added,
    /// It depends on where the indicator stands on its scale, after all that moves it there.
    Scale,
    /// It is what the indicator makes of where it stands: its gain, its curve.
    Characteristic,
    /// It adds to all readings of a pass, by where that was set to zero.
    Height,
}

/// Where an effect's unknowns stand among those of a play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    /// The unknown that is the width, µm.
    pub width: usize,
    /// The unknown that tells where in the play the pointer stands when a trace begins, −1 to 1.
    pub begins: usize,
}

/// What is told of an effect: a parameter as a function of the fit's unknowns, with its derivatives by
/// them.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit.
    pub unit: &'static str,
    /// The derivatives by the effect's unknowns: place and value.
    pub gradient: Vec<(usize, f64)>,
}

/// A reading as the search for a step sees it.
#[derive(Debug, Clone, Copy)]
pub struct Left {
    /// Where and when it was taken.
    pub at: Circumstances,
    /// Reading less model, µm.
    pub residual: f64,
    /// 1/σ, 1/µm.
    pub weight: f64,
}

/// An effect in one of its variants, for one set of readings.
pub trait JoinedEffect: Debug + Send + Sync {
    /// Its unknowns.
    fn unknowns(&self) -> Vec<Unknown>;

    /// The variant in words, where there are several.
    fn variant(&self) -> Option<String> {
        None
    }

    /// The values from which the fit begins, dense enough that the best lies near one of them. Sizes are
    /// found by the search; zero where they enter linearly.
    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.unknowns().len()]]
    }

    /// What its first unknown moves.
    fn moves(&self, _at: &Circumstances) -> Option<Move> {
        None
    }

    /// Whether it changes the surface.
    fn is_on_surface(&self) -> bool {
        false
    }

    /// Height (µm) and slope (µm/mm) that it adds to the surface at u, mm on the artefact's own axis; the
    /// derivatives of the height by its unknowns go to `by`.
    fn bump(
        &self,
        _at: &Circumstances,
        _u: f64,
        _values: &[f64],
        _by: &mut [f64],
    ) -> Option<(f64, f64)> {
        None
    }

    /// When indicators apply what it does to a reading; `None` where the effect does nothing there.
    fn shows(&self) -> Option<Shows> {
        None
    }

    /// What the indicator adds to what it sees, µm, and the derivative of that by what it sees; the
    /// derivatives by its unknowns go to `by`.
    fn shown(
        &self,
        _at: &Circumstances,
        _seen: f64,
        _values: &[f64],
        _by: &mut [f64],
    ) -> (f64, f64) {
        (0.0, 0.0)
    }

    /// The play of the indicator in a channel and direction.
    fn play(&self, _channel: Channel, _backward: bool) -> Option<Play> {
        None
    }

    /// The best value of the unknown that is searched, with its resolution (standard uncertainty): the
    /// readings with the present model's residuals, its other unknowns held.
    fn searched(&self, _left: &[Left], _values: &[f64]) -> Option<(f64, f64)> {
        None
    }

    /// What is told of it.
    fn told(&self, values: &[f64]) -> Vec<Told> {
        let named = self.unknowns().into_iter().zip(values).enumerate();
        named
            .map(|(k, (unknown, value))| Told {
                name: unknown.name.into_owned(),
                value: *value,
                unit: unknown.unit,
                gradient: vec![(k, 1.0)],
            })
            .collect()
    }
}

/// The only variant of an effect.
fn only(effect: impl JoinedEffect + 'static) -> Vec<Arc<dyn JoinedEffect>> {
    vec![Arc::new(effect)]
}

/// An effect that is never refused.
const fn welcome(_: &Setting) -> Option<(&'static str, &'static str)> {
    None
}
