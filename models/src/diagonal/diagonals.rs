//! The work zone, its diagonals and the order of motions along them.

use super::components::Axis;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A box with corner A at the origin: edges in mm and the same number of steps on each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WorkZone {
    /// Travel of X, Y and Z, mm.
    pub travel: [f64; 3],
    /// Steps on each axis.
    pub steps: usize,
}

/// What returns the beam from the tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// A plane mirror on the tool: sees the tool's rotations.
    Mirror,
    /// A retro-reflector on the tool with a fixed return mirror.
    RetroReflector,
}

impl Target {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::Mirror, Self::RetroReflector];
}

/// A diagonal of the work zone, named by its corners: A at the origin, B = +x, C = +x+y, D = +y, and
/// E, F, G, H above them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Diagonal {
    /// Body diagonal (+, +, +).
    AG,
    /// Body diagonal (−, +, +).
    BH,
    /// Body diagonal (−, −, +).
    CE,
    /// Body diagonal (+, −, +).
    DF,
    /// Face diagonal (+, +) of the bottom plane: the paper's diagonal 1.
    AC,
    /// Face diagonal (+, −) of the bottom plane: the paper's diagonal 2.
    DB,
}

impl Diagonal {
    /// All six.
    pub const ALL: [Self; 6] = [Self::AG, Self::BH, Self::CE, Self::DF, Self::AC, Self::DB];
    /// The four body diagonals.
    pub const BODY: [Self; 4] = [Self::AG, Self::BH, Self::CE, Self::DF];
    /// The two face diagonals.
    pub const FACE: [Self; 2] = [Self::AC, Self::DB];

    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::AG => "AG",
            Self::BH => "BH",
            Self::CE => "CE",
            Self::DF => "DF",
            Self::AC => "AC",
            Self::DB => "DB",
        }
    }

    /// The diagonal of a name in a file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|d| d.name() == name)
    }

    /// Direction of travel of each axis; 0 where it stands still.
    pub const fn signs(self) -> [i8; 3] {
        match self {
            Self::AG => [1, 1, 1],
            Self::BH => [-1, 1, 1],
            Self::CE => [-1, -1, 1],
            Self::DF => [1, -1, 1],
            Self::AC => [1, 1, 0],
            Self::DB => [1, -1, 0],
        }
    }

    /// Whether Z moves.
    pub const fn is_body(self) -> bool {
        self.signs()[2] != 0
    }

    /// Sense in which each axis approaches its stops on this travel: +1, −1, or 0 where it stands still.
    pub fn approach(self, travel: Travel) -> [i8; 3] {
        self.signs().map(|s| s * travel.sign())
    }

    /// First corner, mm.
    pub fn start(self, zone: &WorkZone) -> Vector3<f64> {
        let signs = self.signs();
        Vector3::from_fn(|a, _| if signs[a] < 0 { zone.travel[a] } else { 0.0 })
    }

    /// Unit vector of the beam, away from the laser.
    pub fn direction(self, zone: &WorkZone) -> Vector3<f64> {
        let signs = self.signs();
        Vector3::from_fn(|a, _| f64::from(signs[a]) * zone.travel[a]).normalize()
    }

    /// Directions about which the mirror of this diagonal can be misaligned with effect: about the
    /// horizontal line in its surface and about the line across it; only Z for a face diagonal.
    pub fn mirror_axes(self, zone: &WorkZone) -> Vec<Vector3<f64>> {
        let n = self.direction(zone);
        if self.is_body() {
            let horizontal = Vector3::z().cross(&n).normalize();
            vec![horizontal, n.cross(&horizontal)]
        } else {
            vec![Vector3::z()]
        }
    }
}

/// Sense of travel along a diagonal.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Travel {
    /// Away from the laser.
    #[default]
    Forward,
    /// Back to it, in the same run: the laser is not zeroed at the turn.
    Backward,
}

impl Travel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Forward, Self::Backward];

    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }

    /// The travel of a name in a file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// +1 forward, −1 backward.
    pub const fn sign(self) -> i8 {
        match self {
            Self::Forward => 1,
            Self::Backward => -1,
        }
    }
}

/// In which order the axes move within a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Sequence {
    /// X, Y, Z.
    XYZ,
    /// X, Z, Y.
    XZY,
    /// Y, X, Z.
    YXZ,
    /// Y, Z, X.
    YZX,
    /// Z, X, Y.
    ZXY,
    /// Z, Y, X.
    ZYX,
    /// All axes together: the diagonal displacement test.
    Together,
}

impl Sequence {
    /// The six step sequences.
    pub const STEPS: [Self; 6] = [
        Self::XYZ,
        Self::XZY,
        Self::YXZ,
        Self::YZX,
        Self::ZXY,
        Self::ZYX,
    ];

    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::XYZ => "XYZ",
            Self::XZY => "XZY",
            Self::YXZ => "YXZ",
            Self::YZX => "YZX",
            Self::ZXY => "ZXY",
            Self::ZYX => "ZYX",
            Self::Together => "together",
        }
    }

    /// The sequence of a name in a file; `XY` and `YX` are those of a plane.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "XY" => Some(Self::XYZ),
            "YX" => Some(Self::YXZ),
            _ => Self::STEPS
                .into_iter()
                .chain([Self::Together])
                .find(|s| s.name() == name),
        }
    }

    /// The axes in the order of their motion; empty when they move together.
    pub const fn order(self) -> &'static [Axis] {
        use Axis::{X, Y, Z};
        match self {
            Self::XYZ => &[X, Y, Z],
            Self::XZY => &[X, Z, Y],
            Self::YXZ => &[Y, X, Z],
            Self::YZX => &[Y, Z, X],
            Self::ZXY => &[Z, X, Y],
            Self::ZYX => &[Z, Y, X],
            Self::Together => &[],
        }
    }
}

impl WorkZone {
    /// The corners where a run begins and ends, as grid indices.
    pub(super) fn ends(&self, diagonal: Diagonal) -> ([usize; 3], [usize; 3]) {
        let signs = diagonal.signs();
        (
            signs.map(|s| if s < 0 { self.steps } else { 0 }),
            signs.map(|s| if s > 0 { self.steps } else { 0 }),
        )
    }

    /// Whether grid indices are those of a stop of a run: each axis has made as many steps along the diagonal
    /// as the next in the sequence, or one of them one more than all after it.
    pub fn is_stop(&self, diagonal: Diagonal, sequence: Sequence, at: [usize; 3]) -> bool {
        let (signs, (first, _)) = (diagonal.signs(), self.ends(diagonal));
        let inside = (0..3).all(|a| match signs[a] {
            0 => at[a] == first[a],
            _ => at[a] <= self.steps,
        });
        let order = match sequence {
            Sequence::Together => &Axis::ALL[..],
            _ => sequence.order(),
        };
        let mut made = order
            .iter()
            .map(|axis| axis.index())
            .filter(|&a| signs[a] != 0)
            .map(|a| at[a].abs_diff(first[a]));
        let Some(head) = made.next() else {
            return inside;
        };
        let spread = usize::from(sequence != Sequence::Together);
        let mut before = head;
        inside
            && made.all(|steps| {
                let falls = steps <= before && head <= steps + spread;
                before = steps;
                falls
            })
    }

    /// The stops of one run, as grid indices, the start included.
    pub fn stops(&self, diagonal: Diagonal, sequence: Sequence) -> Vec<[usize; 3]> {
        let signs = diagonal.signs();
        let (mut at, _) = self.ends(diagonal);
        let mut stops = vec![at];
        let advance = |at: &mut [usize; 3], a: usize| match signs[a] {
            1 => at[a] += 1,
            -1 => at[a] -= 1,
            _ => {}
        };
        for _ in 0..self.steps {
            if sequence == Sequence::Together {
                for a in 0..3 {
                    advance(&mut at, a);
                }
                stops.push(at);
            }
            for axis in sequence.order() {
                if signs[axis.index()] != 0 {
                    advance(&mut at, axis.index());
                    stops.push(at);
                }
            }
        }
        stops
    }

    /// The position of grid indices, mm.
    pub fn position(&self, index: [usize; 3]) -> Vector3<f64> {
        Vector3::from_fn(|a, _| self.travel[a] * index[a] as f64 / self.steps as f64)
    }

    /// Length of one step of each axis, mm.
    pub fn step(&self) -> [f64; 3] {
        self.travel.map(|t| t / self.steps as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_known_by_their_indices() {
        let zone = WorkZone {
            travel: [600.0, 500.0, 400.0],
            steps: 3,
        };
        for diagonal in Diagonal::ALL {
            for sequence in Sequence::STEPS.into_iter().chain([Sequence::Together]) {
                let stops = zone.stops(diagonal, sequence);
                for place in 0..125 {
                    let at = [place % 5, place / 5 % 5, place / 25];
                    let known = zone.is_stop(diagonal, sequence, at);
                    assert_eq!(
                        known,
                        stops.contains(&at),
                        "{diagonal:?} {sequence:?} {at:?}"
                    );
                }
            }
        }
    }
}
