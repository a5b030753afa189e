//! The 21 component errors and their ISO 230-1 names.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::MachineError;

/// A direction in space, or the linear axis that moves along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// X.
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

impl Axis {
    /// X, Y, Z.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1, 2.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Its capital letter.
    #[must_use]
    pub const fn letter(self) -> char {
        match self {
            Self::X => 'X',
            Self::Y => 'Y',
            Self::Z => 'Z',
        }
    }

    /// The letter of the rotation about it.
    #[must_use]
    pub const fn rotation_letter(self) -> char {
        match self {
            Self::X => 'A',
            Self::Y => 'B',
            Self::Z => 'C',
        }
    }
}

/// What kind of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Translation along the direction, a function of the position of the axis, um: positioning
    /// when the direction is that of the axis, otherwise straightness.
    Translation,
    /// Rotation about the direction, a function of the position of the axis, rad: roll, pitch, yaw.
    Rotation,
    /// Orientation of the whole path of the axis about the direction, one number, rad.
    Squareness,
}

/// One of the 21: kind, direction and axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Component {
    /// Kind of the error.
    pub kind: Kind,
    /// Direction of a translation, axis of a rotation.
    pub direction: Axis,
    /// The axis that moves.
    pub axis: Axis,
}

/// All 21, axis by axis, the three of location last.
pub const COMPONENTS: [Component; 21] = all();

const fn all() -> [Component; 21] {
    let mut list = [Component {
        kind: Kind::Squareness,
        direction: Axis::Z,
        axis: Axis::Y,
    }; 21];
    let mut i = 0;
    while i < 18 {
        let kind = if i % 6 < 3 {
            Kind::Translation
        } else {
            Kind::Rotation
        };
        list[i] = Component {
            kind,
            direction: Axis::ALL[i % 3],
            axis: Axis::ALL[i / 6],
        };
        i += 1;
    }
    list[18] = Component {
        kind: Kind::Squareness,
        direction: Axis::X,
        axis: Axis::Z,
    };
    list[19] = Component {
        kind: Kind::Squareness,
        direction: Axis::Y,
        axis: Axis::Z,
    };
    list
}

impl Component {
    /// Place in [`COMPONENTS`].
    #[must_use]
    pub fn index(self) -> usize {
        let within = self.direction.index();
        match self.kind {
            Kind::Translation => 6 * self.axis.index() + within,
            Kind::Rotation => 6 * self.axis.index() + 3 + within,
            Kind::Squareness if self.axis == Axis::Z => 18 + within,
            Kind::Squareness => 20,
        }
    }

    /// Unit of its value.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self.kind {
            Kind::Translation => "um",
            Kind::Rotation | Kind::Squareness => "rad",
        }
    }

    /// What it is called, such as "straightness of Y in X".
    #[must_use]
    pub fn description(self) -> String {
        let (axis, direction) = (self.axis.letter(), self.direction.letter());
        let turn = match (self.axis, self.direction) {
            (a, d) if a == d => "roll",
            (Axis::X, Axis::Y) | (Axis::Y, Axis::X) => "pitch",
            (Axis::X | Axis::Y, _) => "yaw",
            (Axis::Z, Axis::X) => "tilt about X",
            (Axis::Z, _) => "tilt about Y",
        };
        match self.kind {
            Kind::Translation if self.axis == self.direction => format!("positioning of {axis}"),
            Kind::Translation => format!("straightness of {axis} in {direction}"),
            Kind::Rotation => format!("{turn} of {axis}"),
            Kind::Squareness => {
                let other = if self.direction == Axis::X { 'Y' } else { 'X' };
                format!("squareness of {axis} to {other}")
            }
        }
    }
}

impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = match self.kind {
            Kind::Translation => self.direction.letter(),
            Kind::Rotation | Kind::Squareness => self.direction.rotation_letter(),
        };
        let first = if self.kind == Kind::Squareness {
            letter
        } else {
            'E'
        };
        let second = if self.kind == Kind::Squareness {
            '0'
        } else {
            letter
        };
        write!(f, "{first}{second}{}", self.axis.letter())
    }
}

impl FromStr for Component {
    type Err = MachineError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        COMPONENTS
            .into_iter()
            .find(|c| c.to_string() == name)
            .ok_or_else(|| MachineError::UnknownComponent {
                name: name.to_owned(),
            })
    }
}

impl Serialize for Component {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Component {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        name.parse().map_err(de::Error::custom)
    }
}
