//! Readings of the reversal and the signs with which each channel sees the unknowns.

use serde::{Deserialize, Serialize};

/// One of the four traces: which indicator, which spindle position, which side of the artefact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Channel {
    /// Near indicator, spindle at 0°, surface A.
    #[serde(rename = "1A")]
    C1A,
    /// Far indicator, spindle at 0°, surface B.
    #[serde(rename = "1B")]
    C1B,
    /// Far indicator, spindle at 180°, surface A.
    #[serde(rename = "2A")]
    C2A,
    /// Near indicator, spindle at 180°, surface B.
    #[serde(rename = "2B")]
    C2B,
}

impl Channel {
    /// All four, in the order in which contrasts are written.
    pub const ALL: [Self; 4] = [Self::C1A, Self::C1B, Self::C2A, Self::C2B];

    /// Name in files: `1A`, `1B`, `2A`, `2B`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::C1A => "1A",
            Self::C1B => "1B",
            Self::C2A => "2A",
            Self::C2B => "2B",
        }
    }

    /// The channel of a name in a file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }

    /// Place in [`Channel::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Sign `i` of the machine form M and of α: +1 near, −1 far.
    pub const fn indicator_sign(self) -> f64 {
        match self {
            Self::C1A | Self::C2B => 1.0,
            Self::C1B | Self::C2A => -1.0,
        }
    }

    /// Sign `p` of β: +1 with the spindle at 0°, −1 at 180°.
    pub const fn spindle_sign(self) -> f64 {
        match self {
            Self::C1A | Self::C1B => 1.0,
            Self::C2A | Self::C2B => -1.0,
        }
    }

    /// Sign `i·p` of γ: +1 on surface A, −1 on surface B.
    pub const fn side_sign(self) -> f64 {
        self.indicator_sign() * self.spindle_sign()
    }

    /// Whether the channel runs on surface A.
    pub const fn is_side_a(self) -> bool {
        matches!(self, Self::C1A | Self::C2A)
    }
}

/// Direction of travel of the slide while the trace was taken.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Towards greater x.
    #[default]
    Forward,
    /// Towards smaller x.
    Backward,
}

/// One indicator reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Which trace.
    pub channel: Channel,
    /// Repeat number, from 1.
    pub repeat: u32,
    /// Direction of travel.
    pub direction: Direction,
    /// Seconds since the first reading; absent where the file has no times.
    pub time: Option<f64>,
    /// Commanded slide position, mm.
    pub x: f64,
    /// Reading, µm, positive towards the indicator.
    pub value: f64,
}

/// All readings of one reversal, in the order of the file. Traces may have different grids.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Observations {
    /// The readings.
    pub readings: Vec<Reading>,
}

impl Observations {
    /// The channels that have at least one reading, in the order of [`Channel::ALL`].
    pub fn channels(&self) -> Vec<Channel> {
        let mut seen = [false; 4];
        for reading in &self.readings {
            seen[reading.channel.index()] = true;
        }
        Channel::ALL
            .into_iter()
            .filter(|c| seen[c.index()])
            .collect()
    }

    /// Direction and repeat of a reading, by its place.
    pub(crate) fn taken(&self, reading: usize) -> (Direction, u32) {
        let reading = &self.readings[reading];
        (reading.direction, reading.repeat)
    }

    /// The readings of one channel, in the order of the file.
    pub fn of(&self, channel: Channel) -> impl Iterator<Item = &Reading> {
        self.readings.iter().filter(move |r| r.channel == channel)
    }
}
