//! Soons' estimators as a table: signed edges of cells, a divisor, and the error step they stand for.
//!
//! A cell is written by the index of each axis, `i` or `k = N − 1 − i`; the pattern also tells the
//! diagonal. Where the paper's print is wrong the table has the corrected form: (40) with + AD kik,
//! (46) with AB throughout, (18) restored beside (14).

use super::components::{Axis, Component};
use super::diagonals::{Diagonal, Target, WorkZone};
use Target::{Mirror, RetroReflector};

/// Direction cosines of AG or AC, length d of a diagonal step and steps of the axes, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    pub(super) n: [f64; 3],
    pub(super) d: f64,
    pub(super) step: [f64; 3],
}

impl Scale {
    pub(super) fn of(zone: &WorkZone, body: bool) -> Self {
        let diagonal = if body { Diagonal::AG } else { Diagonal::AC };
        let n = diagonal.direction(zone);
        let mut step = zone.step();
        if !body {
            step[2] = 0.0;
        }
        Self {
            n: [n.x, n.y, n.z],
            d: step.iter().map(|s| s * s).sum::<f64>().sqrt(),
            step,
        }
    }
}

/// One signed edge: corners, cell pattern, sign.
pub(super) type Term = (&'static str, &'static str, f64);

/// One estimator.
#[derive(Debug, Clone, Copy)]
pub struct Estimator {
    /// Equation of the paper.
    pub equation: &'static str,
    /// Target for which it holds.
    pub target: Target,
    /// ISO 230-1 name of the error whose step from i to i + 1 it gives where all angular errors and
    /// mirror misalignments vanish; a check that should give zero has none.
    pub stands_for: Option<&'static str>,
    pub(super) terms: &'static [Term],
    pub(super) divisor: fn(&Scale) -> f64,
}

impl Estimator {
    /// The error that it stands for.
    pub fn component(&self) -> Option<Component> {
        self.stands_for.and_then(Component::from_name)
    }

    /// Whether it needs body diagonals.
    pub fn is_body(&self) -> bool {
        self.terms.iter().any(|t| t.1.len() == 3)
    }

    /// Axis along whose index it is a profile: that of the error it stands for, X where there is none.
    pub fn axis(&self) -> Axis {
        self.component().map_or(Axis::X, |c| c.axis)
    }
}

/// The cell and the diagonal of a pattern at step `i`.
pub(super) fn cell(pattern: &str, i: usize, steps: usize) -> Option<(Diagonal, [usize; 3])> {
    let k = steps.checked_sub(1 + i)?;
    let mut index = [0; 3];
    for (slot, letter) in index.iter_mut().zip(pattern.chars()) {
        *slot = match letter {
            'i' => i,
            'k' => k,
            _ => return None,
        };
    }
    let diagonal = match pattern {
        "ii" => Diagonal::AC,
        "ik" | "ki" => Diagonal::DB,
        "iii" => Diagonal::AG,
        "kii" | "ikk" => Diagonal::BH,
        "kki" | "iik" => Diagonal::CE,
        "iki" | "kik" => Diagonal::DF,
        _ => return None,
    };
    Some((diagonal, index))
}

const UM_PER_RAD_MM: f64 = 1e3;

const fn row(
    equation: &'static str,
    target: Target,
    stands_for: Option<&'static str>,
    terms: &'static [Term],
    divisor: fn(&Scale) -> f64,
) -> Estimator {
    Estimator {
        equation,
        target,
        stands_for,
        terms,
        divisor,
    }
}

/// All estimators of sections 4 and 5.
pub const ESTIMATORS: &[Estimator] = &[
    row(
        "(14)",
        Mirror,
        Some("ECY"),
        &[("AB", "ii", 1.0), ("DC", "ii", -1.0)],
        |s| UM_PER_RAD_MM * s.n[0] * s.n[1] * s.d,
    ),
    row(
        "(17)",
        Mirror,
        None,
        &[("AB", "ik", 1.0), ("DC", "ik", -1.0)],
        |s| -UM_PER_RAD_MM * s.n[0] * s.n[1] * s.d,
    ),
    row(
        "(19)",
        Mirror,
        Some("EXX"),
        &[("AB", "ii", 1.0), ("AB", "ik", 1.0)],
        |s| 2.0 * s.n[0],
    ),
    row(
        "(20)",
        Mirror,
        Some("EYY"),
        &[("BC", "ii", 1.0), ("AD", "ki", -1.0)],
        |s| 2.0 * s.n[1],
    ),
    row(
        "(21)",
        Mirror,
        Some("EYX"),
        &[("AB", "ii", 1.0), ("AB", "ik", -1.0)],
        |s| 2.0 * s.n[1],
    ),
    row(
        "(22)",
        Mirror,
        Some("EXY"),
        &[("BC", "ii", 1.0), ("AD", "ki", 1.0)],
        |s| 2.0 * s.n[0],
    ),
    row(
        "(24)",
        RetroReflector,
        Some("EXX"),
        &[("AB", "ii", 1.0), ("DC", "ik", 1.0)],
        |s| 2.0 * s.n[0],
    ),
    row(
        "(25)",
        RetroReflector,
        Some("EYY"),
        &[("BC", "ii", 1.0), ("BC", "ki", -1.0)],
        |s| 2.0 * s.n[1],
    ),
    row(
        "(26)",
        RetroReflector,
        Some("EYX"),
        &[("AB", "ii", 1.0), ("DC", "ik", -1.0)],
        |s| 2.0 * s.n[1],
    ),
    row(
        "(27)",
        RetroReflector,
        Some("EXY"),
        &[("BC", "ii", 1.0), ("BC", "ki", 1.0)],
        |s| 2.0 * s.n[0],
    ),
    row(
        "(28)",
        RetroReflector,
        Some("ECX"),
        &[("AB", "ii", 1.0), ("DC", "ii", -1.0)],
        |s| UM_PER_RAD_MM * s.n[0] * s.n[1] * s.d,
    ),
    row(
        "(29)+(32)",
        Mirror,
        Some("EBY"),
        &[
            ("DC", "iii", 1.0),
            ("AB", "iii", -1.0),
            ("DC", "iik", 1.0),
            ("AB", "iik", -1.0),
        ],
        |s| 2.0 * UM_PER_RAD_MM * s.step[0] * s.n[2],
    ),
    row(
        "(32)-(29)",
        Mirror,
        Some("ECY"),
        &[
            ("DC", "iik", 1.0),
            ("AB", "iik", -1.0),
            ("DC", "iii", -1.0),
            ("AB", "iii", 1.0),
        ],
        |s| 2.0 * UM_PER_RAD_MM * s.step[0] * s.n[1],
    ),
    row(
        "(30)+(33)",
        Mirror,
        Some("EBZ"),
        &[
            ("EF", "iii", 1.0),
            ("AB", "iii", -1.0),
            ("EF", "kki", 1.0),
            ("AB", "kki", -1.0),
        ],
        |s| 2.0 * UM_PER_RAD_MM * s.step[0] * s.n[2],
    ),
    row(
        "(33)-(30)",
        Mirror,
        Some("ECZ"),
        &[
            ("EF", "kki", 1.0),
            ("AB", "kki", -1.0),
            ("EF", "iii", -1.0),
            ("AB", "iii", 1.0),
        ],
        |s| 2.0 * UM_PER_RAD_MM * s.step[0] * s.n[1],
    ),
    row(
        "-(31)-(34)",
        Mirror,
        Some("EAZ"),
        &[
            ("EH", "iii", -1.0),
            ("AD", "iii", 1.0),
            ("EH", "kki", -1.0),
            ("AD", "kki", 1.0),
        ],
        |s| 2.0 * UM_PER_RAD_MM * s.step[1] * s.n[2],
    ),
    row(
        "(35)",
        Mirror,
        Some("EZZ"),
        &[
            ("CG", "iii", 1.0),
            ("DH", "kii", 1.0),
            ("AE", "kki", 1.0),
            ("BF", "iki", 1.0),
        ],
        |s| 4.0 * s.n[2],
    ),
    row(
        "(36)",
        Mirror,
        Some("EXZ"),
        &[
            ("CG", "iii", 1.0),
            ("DH", "kii", -1.0),
            ("AE", "kki", -1.0),
            ("BF", "iki", 1.0),
        ],
        |s| 4.0 * s.n[0],
    ),
    row(
        "(37)",
        Mirror,
        Some("EYZ"),
        &[
            ("CG", "iii", 1.0),
            ("DH", "kii", 1.0),
            ("AE", "kki", -1.0),
            ("BF", "iki", -1.0),
        ],
        |s| 4.0 * s.n[1],
    ),
    row(
        "(38)",
        Mirror,
        None,
        &[
            ("CG", "iii", 1.0),
            ("DH", "kii", -1.0),
            ("AE", "kki", 1.0),
            ("BF", "iki", -1.0),
        ],
        |_| 1.0,
    ),
    row(
        "(39)",
        Mirror,
        Some("EYY"),
        &[
            ("BC", "iii", 1.0),
            ("AD", "kii", 1.0),
            ("BC", "iik", -1.0),
            ("AD", "kik", -1.0),
        ],
        |s| 4.0 * s.n[1],
    ),
    row(
        "(40)",
        Mirror,
        Some("EXY"),
        &[
            ("BC", "iii", 1.0),
            ("AD", "kii", -1.0),
            ("BC", "iik", -1.0),
            ("AD", "kik", 1.0),
        ],
        |s| 4.0 * s.n[0],
    ),
    row(
        "(41)",
        Mirror,
        Some("EZY"),
        &[
            ("BC", "iii", 1.0),
            ("AD", "kii", 1.0),
            ("BC", "iik", 1.0),
            ("AD", "kik", 1.0),
        ],
        |s| 4.0 * s.n[2],
    ),
    row(
        "(42)",
        Mirror,
        None,
        &[
            ("BC", "iii", 1.0),
            ("AD", "kii", -1.0),
            ("BC", "iik", 1.0),
            ("AD", "kik", -1.0),
        ],
        |s| 4.0 * s.n[0],
    ),
    row(
        "(43)",
        Mirror,
        Some("EXX"),
        &[
            ("AB", "iii", 1.0),
            ("AB", "ikk", -1.0),
            ("AB", "iik", -1.0),
            ("AB", "iki", 1.0),
        ],
        |s| 4.0 * s.n[0],
    ),
    row(
        "(44)",
        Mirror,
        Some("EYX"),
        &[
            ("AB", "iii", 1.0),
            ("AB", "ikk", 1.0),
            ("AB", "iik", -1.0),
            ("AB", "iki", -1.0),
        ],
        |s| 4.0 * s.n[1],
    ),
    row(
        "(45)",
        Mirror,
        Some("EZX"),
        &[
            ("AB", "iii", 1.0),
            ("AB", "ikk", 1.0),
            ("AB", "iik", 1.0),
            ("AB", "iki", 1.0),
        ],
        |s| 4.0 * s.n[2],
    ),
    row(
        "(46)",
        Mirror,
        None,
        &[
            ("AB", "iii", 1.0),
            ("AB", "ikk", -1.0),
            ("AB", "iik", 1.0),
            ("AB", "iki", -1.0),
        ],
        |s| 2.0 * s.n[0],
    ),
];
