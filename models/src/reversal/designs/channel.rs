//! Channels as two angles, and the sides of the artefact that they see.

use thiserror::Error;

use crate::reversal::Channel;

/// Angles count as the same up to here, degrees.
pub const SAME_ANGLE_DEG: f64 = 0.5;

/// More channels than this are a slip of a column.
pub const MOST_CHANNELS: usize = 64;

/// A trace of one indicator at one position of the spindle.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignChannel {
    /// Its name in files.
    pub name: String,
    /// Direction of the indicator about the spindle axis, degrees in 0..360.
    pub indicator: f64,
    /// Angle of the spindle, degrees in 0..360.
    pub spindle: f64,
}

/// Why channels make no design.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DesignError {
    /// No channel at all.
    #[error("there is no channel")]
    Empty,
    /// More than [`MOST_CHANNELS`].
    #[error("{0} channels are more than {MOST_CHANNELS}")]
    TooMany(usize),
    /// An angle that is not finite or beyond a hundred turns.
    #[error("channel {channel}: {angle} degrees is no angle")]
    NoAngle {
        /// The channel.
        channel: String,
        /// The angle, degrees.
        angle: f64,
    },
    /// Two channels of one name.
    #[error("two channels are called {0}")]
    SameName(String),
    /// Two channels with the same angles.
    #[error(
        "channels {first} and {second} have the same angles: indicator {indicator}°, spindle {spindle}°"
    )]
    SameAngles {
        /// The one.
        first: String,
        /// The other.
        second: String,
        /// Of the indicator, degrees.
        indicator: f64,
        /// Of the spindle, degrees.
        spindle: f64,
    },
    /// Text that is no list of angles.
    #[error("`{0}` is no channel: write indicator/spindle in degrees, such as 0/180")]
    NotTwoAngles(String),
}

impl DesignChannel {
    /// A channel of this name at these angles, degrees.
    ///
    /// # Errors
    /// [`DesignError::NoAngle`] for an angle that is not finite or beyond a hundred turns.
    pub fn new(name: impl Into<String>, indicator: f64, spindle: f64) -> Result<Self, DesignError> {
        let name = name.into();
        for angle in [indicator, spindle] {
            if !(angle.abs() <= 36_000.0) {
                let channel = name;
                return Err(DesignError::NoAngle { channel, angle });
            }
        }
        Ok(Self {
            name,
            indicator: in_turn(indicator),
            spindle: in_turn(spindle),
        })
    }

    /// A channel at these angles, named by them: `1A`, `1B`, `2A`, `2B` where it is one of those,
    /// `indicator/spindle` otherwise.
    ///
    /// # Errors
    /// As [`DesignChannel::new`].
    pub fn at(indicator: f64, spindle: f64) -> Result<Self, DesignError> {
        let mut channel = Self::new(String::new(), indicator, spindle).map_err(|e| match e {
            DesignError::NoAngle { angle, .. } => DesignError::NoAngle {
                channel: format!("{indicator}/{spindle}"),
                angle,
            },
            other => other,
        })?;
        channel.name = match channel.of_four() {
            Some(four) => four.name().to_owned(),
            None => format!(
                "{}/{}",
                angle_name(channel.indicator),
                angle_name(channel.spindle)
            ),
        };
        Ok(channel)
    }

    /// Which of the four channels of a horizontal reversal it is.
    pub fn of_four(&self) -> Option<Channel> {
        Channel::ALL.into_iter().find(|c| {
            let own = Self::from(*c);
            is_same(own.indicator, self.indicator) && is_same(own.spindle, self.spindle)
        })
    }

    /// The side of the artefact that it sees, ψ = φ − θ, degrees in 0..360.
    pub fn side(&self) -> f64 {
        in_turn(self.indicator - self.spindle)
    }

    /// Whether it has the angles of another one.
    pub fn is_at(&self, other: &Self) -> bool {
        is_same(self.indicator, other.indicator) && is_same(self.spindle, other.spindle)
    }
}

impl From<Channel> for DesignChannel {
    fn from(channel: Channel) -> Self {
        let (indicator, spindle) = match channel {
            Channel::C1A => (0.0, 0.0),
            Channel::C1B => (180.0, 0.0),
            Channel::C2A => (180.0, 180.0),
            Channel::C2B => (0.0, 180.0),
        };
        Self {
            name: channel.name().to_owned(),
            indicator,
            spindle,
        }
    }
}

/// A list of channels with different names and angles, and the sides they see.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    channels: Vec<DesignChannel>,
    /// Angles of the sides, growing, degrees.
    sides: Vec<f64>,
    /// By channel: which of them it sees.
    side_of: Vec<usize>,
}

impl Design {
    /// The design of these channels.
    ///
    /// # Errors
    /// [`DesignError`]: none, too many, or two alike.
    pub fn new(channels: Vec<DesignChannel>) -> Result<Self, DesignError> {
        if channels.is_empty() {
            return Err(DesignError::Empty);
        }
        if channels.len() > MOST_CHANNELS {
            return Err(DesignError::TooMany(channels.len()));
        }
        for (k, second) in channels.iter().enumerate() {
            for first in &channels[..k] {
                if first.is_at(second) {
                    return Err(DesignError::SameAngles {
                        first: first.name.clone(),
                        second: second.name.clone(),
                        indicator: first.indicator,
                        spindle: first.spindle,
                    });
                }
                if first.name == second.name {
                    return Err(DesignError::SameName(first.name.clone()));
                }
            }
        }
        let mut sides: Vec<f64> = Vec::new();
        for side in channels.iter().map(DesignChannel::side) {
            if !sides.iter().any(|s| is_same(*s, side)) {
                sides.push(if is_same(side, 0.0) { 0.0 } else { side });
            }
        }
        sides.sort_by(f64::total_cmp);
        let side_of = channels
            .iter()
            .map(|c| {
                let distance = |s: &f64| apart(*s, c.side());
                let nearest = (0..sides.len())
                    .min_by(|a, b| distance(&sides[*a]).total_cmp(&distance(&sides[*b])));
                nearest.unwrap_or(0)
            })
            .collect();
        Ok(Self {
            channels,
            sides,
            side_of,
        })
    }

    /// The design that a text such as `0/0,0/180,90/0` lists: indicator/spindle, degrees.
    ///
    /// # Errors
    /// [`DesignError`]: a channel that is not two angles, or as [`Design::new`].
    pub fn parse(text: &str) -> Result<Self, DesignError> {
        let channel = |word: &str| {
            let word = word.trim();
            if let Some(four) = Channel::from_name(word) {
                return Ok(DesignChannel::from(four));
            }
            let angles = word.split_once('/');
            let number = |t: &str| t.trim().trim_end_matches('°').parse::<f64>().ok();
            match angles.and_then(|(i, s)| Some((number(i)?, number(s)?))) {
                Some((indicator, spindle)) => DesignChannel::at(indicator, spindle),
                None => Err(DesignError::NotTwoAngles(word.to_owned())),
            }
        };
        Self::new(text.split(',').map(channel).collect::<Result<_, _>>()?)
    }

    /// The channels.
    pub fn channels(&self) -> &[DesignChannel] {
        &self.channels
    }

    /// The angles of the sides that are seen, growing, degrees.
    pub fn sides(&self) -> &[f64] {
        &self.sides
    }

    /// Which of the sides a channel sees.
    pub fn side_of(&self, channel: usize) -> usize {
        self.side_of[channel]
    }

    /// The different directions of the indicators, growing, degrees.
    pub fn indicators(&self) -> Vec<f64> {
        different(self.channels.iter().map(|c| c.indicator))
    }

    /// The different positions of the spindle, growing, degrees.
    pub fn positions(&self) -> Vec<f64> {
        different(self.channels.iter().map(|c| c.spindle))
    }

    /// The same channels with one more; `None` where its angles are there already.
    pub fn with(&self, channel: DesignChannel) -> Option<Self> {
        let mut channels = self.channels.clone();
        channels.push(channel);
        Self::new(channels).ok()
    }
}

/// Angles that differ by more than [`SAME_ANGLE_DEG`], growing.
fn different(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    for angle in angles {
        if !found.iter().any(|a| is_same(*a, angle)) {
            found.push(angle);
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

/// An angle as 0..360 degrees; within [`SAME_ANGLE_DEG`]/1000 of a turn it is 0.
fn in_turn(degrees: f64) -> f64 {
    let angle = degrees.rem_euclid(360.0);
    if 360.0 - angle < SAME_ANGLE_DEG / 1e3 {
        0.0
    } else {
        angle
    }
}

/// How far apart two angles are, degrees.
fn apart(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(360.0);
    d.min(360.0 - d)
}

/// Whether two angles count as the same.
pub fn is_same(a: f64, b: f64) -> bool {
    apart(a, b) <= SAME_ANGLE_DEG
}

/// An angle as it stands in names: `0`, `90`, `22.5`.
pub fn angle_name(degrees: f64) -> String {
    let rounded = (degrees * 10.0).round() / 10.0;
    format!("{}", rounded + 0.0)
}

/// cos and sin of an angle in degrees; a part that half a degree could bring about is zero, and exact
/// at right angles.
pub fn direction(degrees: f64) -> [f64; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let least = SAME_ANGLE_DEG.to_radians().sin();
    let clean = |part: f64, other: f64| match (part.abs() <= least, other.abs() <= least) {
        (true, _) => 0.0,
        (false, true) => part.signum(),
        _ => part,
    };
    [clean(cos, sin), clean(sin, cos)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_what_the_angles_show() {
        let design = Design::parse("1A, 180/0, 90/90, 270/0.3,0/360.2").unwrap_err();
        assert!(matches!(design, DesignError::SameAngles { .. }), "{design}");
        let design = Design::parse("0/0, 180/0, 90/90, 270/0.3, 90/0").unwrap();
        // 0 − 0, 180 − 0, 90 − 90, 270 − 0.3, 90 − 0: exact, sums of whole and tenth degrees.
        assert_eq!(design.sides(), [0.0, 90.0, 180.0, 269.7]);
        let seen: Vec<usize> = (0..5).map(|c| design.side_of(c)).collect();
        assert_eq!(seen, [0, 2, 0, 3, 1]);
        let names: Vec<&str> = design.channels().iter().map(|c| &c.name[..]).collect();
        assert_eq!(names, ["1A", "1B", "90/90", "270/0.3", "90/0"]);
        assert_eq!(design.positions(), [0.0, 90.0]);
    }

    #[test]
    fn the_four_channels_are_found_by_their_angles() {
        for channel in Channel::ALL {
            let own = DesignChannel::from(channel);
            let turned = DesignChannel::at(own.indicator - 360.0, own.spindle + 720.0).unwrap();
            assert_eq!(turned, own);
            let [m, _] = direction(own.indicator);
            assert_eq!(m, channel.indicator_sign());
            assert_eq!(own.side() == 0.0, channel.is_side_a());
        }
    }

    #[test]
    fn what_is_no_design_is_refused() {
        let refused = |text: &str| Design::parse(text).unwrap_err();
        assert_eq!(refused("0/0,x"), DesignError::NotTwoAngles("x".into()));
        assert_eq!(refused(""), DesignError::NotTwoAngles(String::new()));
        assert!(matches!(refused("0/nan"), DesignError::NoAngle { .. }));
        assert!(matches!(refused("inf/0"), DesignError::NoAngle { .. }));
        assert_eq!(Design::new(Vec::new()), Err(DesignError::Empty));
        let twice = vec![
            DesignChannel::new("a", 0.0, 0.0).unwrap(),
            DesignChannel::new("a", 90.0, 0.0).unwrap(),
        ];
        assert_eq!(Design::new(twice), Err(DesignError::SameName("a".into())));
    }
}
