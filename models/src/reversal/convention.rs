//! The four slope contrasts: what each is called and what it means in either convention, and what
//! no such measurement can show.

use serde::{Deserialize, Serialize};

use super::Channel;

/// How the slopes of the four channels are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Convention {
    /// Untapered: α, β, γ with the signs `i`, `p`, `i·p`; the contrast + + + + is held to be zero.
    #[default]
    #[serde(alias = "untapered")]
    Seed,
    /// α, set-up tilt, cone; the contrast + + − − closes to zero on any rigid artefact.
    Rigid,
}

/// One of the four orthogonal contrasts of the channel slopes (signs in the order 1A 1B 2A 2B).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Contrast {
    /// + − − +: slide against spindle axis.
    Alpha,
    /// + + − −: sign of the spindle position.
    Spindle,
    /// + − + −: sign of the side of the artefact.
    Side,
    /// + + + +: mean of all.
    Mean,
}

impl Contrast {
    /// All four, in the order α, β, γ, τ of the untapered convention.
    pub const ALL: [Self; 4] = [Self::Alpha, Self::Spindle, Self::Side, Self::Mean];

    /// The sign with which a channel enters.
    pub const fn sign(self, channel: Channel) -> f64 {
        match self {
            Self::Alpha => channel.indicator_sign(),
            Self::Spindle => channel.spindle_sign(),
            Self::Side => channel.side_sign(),
            Self::Mean => 1.0,
        }
    }

    /// Its signs in the order 1A 1B 2A 2B.
    pub const fn pattern(self) -> &'static str {
        match self {
            Self::Alpha => "+ - - +",
            Self::Spindle => "+ + - -",
            Self::Side => "+ - + -",
            Self::Mean => "+ + + +",
        }
    }

    /// Its name in a convention.
    pub const fn name(self, convention: Convention) -> &'static str {
        match (self, convention) {
            (Self::Alpha, _) => "alpha",
            (Self::Spindle, Convention::Seed) => "beta",
            (Self::Side, Convention::Seed) => "gamma",
            (Self::Mean, Convention::Seed) | (Self::Spindle, Convention::Rigid) => "closure",
            (Self::Side, Convention::Rigid) => "set-up",
            (Self::Mean, Convention::Rigid) => "cone",
        }
    }

    /// What a value means.
    pub const fn meaning(self, convention: Convention) -> &'static str {
        match (self, convention) {
            (Self::Alpha, _) => "tilt between slide and spindle axis",
            (Self::Spindle, Convention::Seed) => {
                "set-up tilt; zero for rigid parts, a value means drift between the spindle positions or an imperfect reversal"
            }
            (Self::Side, Convention::Seed) => {
                "tilt of the artefact: its set-up and obliqueness of its sides together"
            }
            (Self::Mean, Convention::Seed) => {
                "zero for an untapered artefact; a value means a taper"
            }
            (Self::Spindle, Convention::Rigid) => {
                "zero for rigid parts; a value means drift between the spindle positions or an imperfect reversal"
            }
            (Self::Side, Convention::Rigid) => {
                "tilt of the artefact's axis to the spindle axis, with the obliqueness of its sides (not separable)"
            }
            (Self::Mean, Convention::Rigid) => {
                "half the cone angle: the diameter changes along the artefact"
            }
        }
    }
}

impl Convention {
    /// The contrast that the convention says is zero.
    pub const fn closure(self) -> Contrast {
        match self {
            Self::Seed => Contrast::Mean,
            Self::Rigid => Contrast::Spindle,
        }
    }

    /// The three contrasts that the convention holds for tilts.
    pub const fn tilts(self) -> [Contrast; 3] {
        match self {
            Self::Seed => [Contrast::Alpha, Contrast::Spindle, Contrast::Side],
            Self::Rigid => [Contrast::Alpha, Contrast::Side, Contrast::Mean],
        }
    }
}

/// What no reversal of this kind can show, whatever its size, and why.
pub const NOT_SHOWN: [(&str, &str); 5] = [
    (
        "gravity-sag",
        "sag of the artefact does not turn with the spindle: it is counted as form of the slide, M",
    ),
    (
        "tip-radius",
        "an error that stays with a side of the artefact, such as that of the stylus radius, is counted as S_A or S_B",
    ),
    (
        "common-gain",
        "a gain error common to both indicators scales every result alike",
    ),
    (
        "offsets",
        "the zero of each indicator and the diameter of the artefact are lost in the offsets",
    ),
    (
        "straight part of the forms",
        "the slope of M cannot be told from alpha, that of S_A and S_B not from the other tilts: forms have no straight-line part here",
    ),
];
