//! The 21 errors under their ISO 230-1 names.

use serde::{Deserialize, Serialize};

/// A linear axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Axis {
    /// X, which carries Y.
    X,
    /// Y, which carries Z.
    Y,
    /// Z, which carries the tool.
    Z,
}

impl Axis {
    /// All three, from the foundation to the tool.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1, 2.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// `X`, `Y`, `Z`.
    pub const fn letter(self) -> char {
        ['X', 'Y', 'Z'][self as usize]
    }
}

/// What an error function is, which decides what of it is a matter of definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeKind {
    /// Along the motion. Zero at corner A by definition.
    Positioning,
    /// Across the motion. Zero at both ends by definition: the slopes belong to the axes' directions.
    Straightness,
    /// A rotation. Zero at corner A by definition.
    Angular,
}

/// One of the 18 error functions: a translation along, or a rotation about, a direction when an axis
/// moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Component {
    /// Whether it is a rotation about `direction` rather than a translation along it.
    pub rotation: bool,
    /// Direction of the error.
    pub direction: Axis,
    /// Axis that moves.
    pub axis: Axis,
}

impl Component {
    /// Number of error functions.
    pub const COUNT: usize = 18;

    /// All, ordered by the moving axis, translations before rotations.
    pub fn all() -> impl Iterator<Item = Self> {
        Axis::ALL.into_iter().flat_map(|axis| {
            [false, true].into_iter().flat_map(move |rotation| {
                Axis::ALL.into_iter().map(move |direction| Self {
                    rotation,
                    direction,
                    axis,
                })
            })
        })
    }

    /// Place in [`Component::all`].
    pub const fn index(self) -> usize {
        self.axis.index() * 6 + if self.rotation { 3 } else { 0 } + self.direction.index()
    }

    /// ISO 230-1 name: `EXX`, `EYX`, `ECX`, ….
    pub fn name(self) -> String {
        let letters = if self.rotation {
            ['A', 'B', 'C']
        } else {
            ['X', 'Y', 'Z']
        };
        format!("E{}{}", letters[self.direction.index()], self.axis.letter())
    }

    /// The component of an ISO 230-1 name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|c| c.name() == name)
    }

    /// Positioning, straightness or angular.
    pub fn kind(self) -> NodeKind {
        match (self.rotation, self.direction == self.axis) {
            (true, _) => NodeKind::Angular,
            (false, true) => NodeKind::Positioning,
            (false, false) => NodeKind::Straightness,
        }
    }

    /// For people, in the words of ISO 230-1: "positioning of X", "straightness of Y in Z", "yaw of X"; of Z,
    /// which stands upright, "tilt of Z about X".
    pub fn words(self) -> String {
        let (axis, direction) = (self.axis.letter(), self.direction.letter());
        match self.kind() {
            NodeKind::Positioning => format!("positioning of {axis}"),
            NodeKind::Straightness => format!("straightness of {axis} in {direction}"),
            NodeKind::Angular => match (self.axis, self.direction) {
                (a, d) if a == d => format!("roll of {axis}"),
                (Axis::Z, _) => format!("tilt of {axis} about {direction}"),
                (_, Axis::Z) => format!("yaw of {axis}"),
                _ => format!("pitch of {axis}"),
            },
        }
    }

    /// The same with its symbol: "yaw of X (ECX)".
    pub fn words_and_symbol(self) -> String {
        format!("{} ({})", self.words(), self.name())
    }
}

/// One of the three squareness errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Location {
    /// Y to X: C0Y = +S_xy.
    XY,
    /// Z to X: B0Z = −S_xz.
    XZ,
    /// Z to Y: A0Z = +S_yz.
    YZ,
}

impl Location {
    /// All three.
    pub const ALL: [Self; 3] = [Self::XY, Self::XZ, Self::YZ];

    /// ISO 230-1 name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::XY => "C0Y",
            Self::XZ => "B0Z",
            Self::YZ => "A0Z",
        }
    }

    /// Sign from the paper's S (positive where the angle exceeds 90°) to the ISO 230-1 angle.
    pub const fn iso_sign(self) -> f64 {
        match self {
            Self::XZ => -1.0,
            Self::XY | Self::YZ => 1.0,
        }
    }

    /// For people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::XY => "squareness of Y to X",
            Self::XZ => "squareness of Z to X",
            Self::YZ => "squareness of Z to Y",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_places_agree() {
        for (place, component) in Component::all().enumerate() {
            assert_eq!(component.index(), place);
            assert_eq!(Component::from_name(&component.name()), Some(component));
        }
        assert_eq!(Component::all().count(), Component::COUNT);
        let yaw = Component::from_name("ECX").unwrap();
        assert_eq!(yaw.words_and_symbol(), "yaw of X (ECX)");
        for (name, words) in [
            ("EAX", "roll of X"),
            ("EBX", "pitch of X"),
            ("EAY", "pitch of Y"),
            ("EBY", "roll of Y"),
            ("ECY", "yaw of Y"),
            ("EAZ", "tilt of Z about X"),
            ("ECZ", "roll of Z"),
        ] {
            assert_eq!(Component::from_name(name).unwrap().words(), words);
        }
        assert_eq!(
            Component::from_name("EXY").unwrap().words(),
            "straightness of Y in X"
        );
    }
}
