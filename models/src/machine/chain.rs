//! The chain of slides between workpiece and tool, as data.

use nalgebra::Vector3;

use super::{Axis, MachineError};

/// Which side of the frame a slide is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// It carries the workpiece.
    Work,
    /// It carries the tool.
    Tool,
}

/// Whose deviation is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sense {
    /// Of the tool, seen from the workpiece (Soons, equation 1).
    #[default]
    Tool,
    /// Of the workpiece, seen from the tool (NISTIR 6868, equation 8). To first order the opposite.
    Work,
}

/// One slide of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slide {
    /// The axis it moves along.
    pub axis: Axis,
    /// Its side of the frame.
    pub side: Side,
    /// Whether the slide moves against its coordinate, as a table does when the coordinate is that
    /// of the tool relative to the workpiece.
    pub reversed: bool,
}

impl Slide {
    /// Displacement of the slide at a coordinate of its axis, mm.
    #[must_use]
    pub fn displacement(&self, coordinate: f64) -> f64 {
        if self.reversed {
            -coordinate
        } else {
            coordinate
        }
    }
}

/// A machine of three linear axes: which slide carries which.
///
/// Written from the workpiece to the tool with `F` for the frame: in `XYFZ`, the machine of NISTIR
/// 6868, X carries the workpiece and rides on Y, and Z carries the tool; in `FXYZ`, the machine of
/// Soons, X carries Y carries Z carries the tool. The errors of a slide are those of its own
/// motion, in the directions of the machine, at a reference point that travels with the slide and
/// lies in the machine's origin when all coordinates are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Slides that carry the workpiece, from the frame outwards.
    work: Vec<Slide>,
    /// Slides that carry the tool, from the frame outwards.
    tool: Vec<Slide>,
    /// The functional point from the last slide of the tool's side at zero coordinates, mm.
    tool_offset: Vector3<f64>,
}

impl Chain {
    /// Reads a chain such as `XYFZ`.
    ///
    /// # Errors
    /// Letters other than X, Y, Z, F, or not each of them once.
    pub fn parse(text: &str) -> Result<Self, MachineError> {
        let bad = |why| {
            Err(MachineError::BadChain {
                chain: text.to_owned(),
                why,
            })
        };
        let (mut work, mut tool) = (Vec::new(), Vec::new());
        let mut frame_seen = false;
        for letter in text.chars() {
            let axis = match letter {
                'X' => Axis::X,
                'Y' => Axis::Y,
                'Z' => Axis::Z,
                'F' if !frame_seen => {
                    frame_seen = true;
                    continue;
                }
                'F' => return bad("has two frames"),
                _ => return bad("has a letter other than X, Y, Z and F"),
            };
            if work.iter().chain(&tool).any(|s: &Slide| s.axis == axis) {
                return bad("has an axis twice");
            }
            let side = if frame_seen { Side::Tool } else { Side::Work };
            let list = if frame_seen { &mut tool } else { &mut work };
            list.push(Slide {
                axis,
                side,
                reversed: false,
            });
        }
        if !frame_seen {
            return bad("has no frame F");
        }
        if work.len() + tool.len() != 3 {
            return bad("lacks an axis");
        }
        work.reverse();
        Ok(Self {
            work,
            tool,
            tool_offset: Vector3::zeros(),
        })
    }

    /// The same chain with coordinates of the tool relative to the workpiece (ISO 841): the slides
    /// that carry the workpiece move against them.
    #[must_use]
    pub fn with_tool_coordinates(mut self) -> Self {
        self.work.iter_mut().for_each(|slide| slide.reversed = true);
        self
    }

    /// The same chain with the functional point at this offset from the last slide, mm.
    ///
    /// # Errors
    /// An offset that is not finite.
    pub fn with_tool_offset(mut self, offset: Vector3<f64>) -> Result<Self, MachineError> {
        if let Some(found) = offset.iter().copied().find(|v| !v.is_finite()) {
            return Err(MachineError::NotFinite {
                what: "a tool offset",
                found,
            });
        }
        self.tool_offset = offset;
        Ok(self)
    }

    /// The slides of one side, from the frame outwards.
    #[must_use]
    pub fn slides(&self, side: Side) -> &[Slide] {
        match side {
            Side::Work => &self.work,
            Side::Tool => &self.tool,
        }
    }

    /// The slide of an axis.
    #[must_use]
    pub fn slide(&self, axis: Axis) -> Slide {
        let found = self.work.iter().chain(&self.tool).find(|s| s.axis == axis);
        found.copied().unwrap_or(Slide {
            axis,
            side: Side::Tool,
            reversed: false,
        })
    }

    /// Offset of the functional point, mm.
    #[must_use]
    pub fn tool_offset(&self) -> Vector3<f64> {
        self.tool_offset
    }
}

impl std::fmt::Display for Chain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for slide in self.work.iter().rev() {
            write!(f, "{}", slide.axis.letter())?;
        }
        f.write_str("F")?;
        self.tool
            .iter()
            .try_for_each(|slide| write!(f, "{}", slide.axis.letter()))
    }
}
