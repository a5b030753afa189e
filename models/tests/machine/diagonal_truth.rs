//! The right-hand sides of the paper and readings of a machine with known errors.
#![allow(dead_code, reason = "each test file uses a part")]

use errsep_models::diagonal::{
    Axis, Component, Diagonal, DiagonalReading, ErrorTables, Location, Sequence, Target, Travel,
    WorkZone, exact_reading, predicted_reading,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const ZONE: WorkZone = WorkZone {
    travel: [600.0, 450.0, 300.0],
    steps: 6,
};

/// Random values at every node, those of definition included; only the tool's rotation by Z at the
/// bottom is zero, because the plane's equations do not know it.
pub fn errors(seed: u64) -> ErrorTables {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut tables = ErrorTables::zero(&ZONE);
    for component in Component::all() {
        let size = if component.rotation { 30e-6 } else { 5.0 };
        for value in tables.of_mut(component) {
            *value = size * rng.random_range(-1.0..1.0);
        }
        if component.rotation && component.axis == Axis::Z {
            tables.of_mut(component)[0] = 0.0;
        }
    }
    tables.squareness = std::array::from_fn(|_| 20e-6 * rng.random_range(-1.0..1.0));
    tables
}

/// Linear readings of all sequences on all diagonals; `face` in rad about Z on the face diagonals AC
/// and DB, `body` about every direction on the body diagonals.
pub fn readings(
    tables: &ErrorTables,
    target: Target,
    face: [f64; 2],
    body: f64,
) -> Vec<DiagonalReading> {
    everywhere(target, face, body, |diagonal, mirror, at| {
        predicted_reading(&ZONE, tables, diagonal, target, mirror, at, Travel::Forward)
    })
}

/// The same by exact geometry, of first order in the errors: half the difference between readings of
/// the machine and of one with all errors reversed, which leaves the third order, some 1e-7 µm.
pub fn by_exact_geometry(
    tables: &ErrorTables,
    target: Target,
    face: [f64; 2],
    body: f64,
) -> Vec<DiagonalReading> {
    let reversed = scaled(tables, -1.0);
    everywhere(target, face, body, |diagonal, mirror, at| {
        let exact =
            |t: &ErrorTables, m| exact_reading(&ZONE, t, diagonal, target, m, at, Travel::Forward);
        0.5 * (exact(tables, mirror) - exact(&reversed, -mirror))
    })
}

/// All errors times a factor.
pub fn scaled(tables: &ErrorTables, factor: f64) -> ErrorTables {
    let mut t = tables.clone();
    for f in t.functions.iter_mut().chain(&mut t.reversals) {
        for v in f {
            *v *= factor;
        }
    }
    t.squareness = t.squareness.map(|v| factor * v);
    t
}

fn everywhere(
    target: Target,
    face: [f64; 2],
    body: f64,
    value: impl Fn(Diagonal, Vector3<f64>, [usize; 3]) -> f64,
) -> Vec<DiagonalReading> {
    let mut all = Vec::new();
    for diagonal in Diagonal::ALL {
        let mirror = match diagonal {
            Diagonal::AC => Vector3::new(0.0, 0.0, face[0]),
            Diagonal::DB => Vector3::new(0.0, 0.0, face[1]),
            _ => Vector3::new(body, body, body),
        };
        for sequence in Sequence::STEPS {
            let mut stops = ZONE.stops(diagonal, sequence);
            stops.dedup();
            for at in stops {
                all.push(DiagonalReading {
                    diagonal,
                    target,
                    sequence,
                    repeat: 1,
                    travel: Travel::Forward,
                    at,
                    value: value(diagonal, mirror, at),
                });
            }
        }
    }
    all
}

/// The right-hand sides in the paper's own notation.
pub struct Truth<'a> {
    pub tables: &'a ErrorTables,
    pub em: [f64; 2],
}

impl Truth<'_> {
    /// Value of an ISO component at a node, translations in µm, rotations in rad.
    pub fn e(&self, name: &str, i: usize) -> f64 {
        self.tables.of(Component::from_name(name).unwrap())[i]
    }

    pub fn step(&self, name: &str, i: usize) -> f64 {
        self.e(name, i + 1) - self.e(name, i)
    }

    pub fn right(&self, equation: &str, i: usize) -> f64 {
        let k = ZONE.steps - 1 - i;
        let [dx, dy, dz] = ZONE.step();
        // Lengths in mm times rad times this are µm.
        let um = 1e3;
        let (x, y, z) = (
            |i: usize| um * dx * i as f64,
            |i: usize| um * dy * i as f64,
            |i: usize| um * dz * i as f64,
        );
        let (ux, uy, uz) = (um * dx, um * dy, um * dz);
        let [xy, xz, yz] = Location::ALL.map(|l| self.tables.squareness_of(l));
        let [em1, em2] = self.em;
        let (e, step) = (|n, i| self.e(n, i), |n, i| self.step(n, i));
        match equation {
            "(14)" => step("ECY", i),
            "(17)" => step("ECY", k),
            "(19)" => {
                step("EXX", i) - 0.5 * (y(i) + y(k + 1)) * step("ECX", i)
                    + 0.5 * uy * (e("ECY", k) - e("ECY", i) + em2 - em1)
            }
            "(20)" => step("EYY", i) + 0.5 * ux * (em1 - em2),
            "(21)" => {
                step("EYX", i) + 0.5 * (x(k) - x(i + 1)) * step("ECX", i)
                    - ux * e("ECX", i)
                    - 0.5 * ux * (e("ECY", i) + e("ECY", k) + em1 + em2)
            }
            "(22)" => step("EXY", i) + uy * (e("ECY", i) - xy + 0.5 * (em1 + em2)),
            "(24)" => step("EXX", i) - 0.5 * (y(i) + y(k + 1)) * step("ECX", i),
            "(25)" => step("EYY", i) + 0.5 * ux * (e("ECX", k + 1) - e("ECX", i + 1)),
            "(26)" => step("EYX", i) + 0.5 * (x(k + 1) - x(i)) * step("ECX", i),
            "(27)" => step("EXY", i) - uy * (xy + 0.5 * (e("ECX", k + 1) + e("ECX", i + 1))),
            "(28)" => step("ECX", i),
            "(29)+(32)" => step("EBY", i),
            "(32)-(29)" => step("ECY", i),
            "(30)+(33)" => step("EBZ", i),
            "(33)-(30)" => step("ECZ", i),
            "-(31)-(34)" => step("EAZ", i),
            "(35)" => step("EZZ", i),
            "(36)" => step("EXZ", i) - uz * (xz + e("EBZ", i)),
            "(37)" => step("EYZ", i) + uz * (-yz + e("EAZ", i)),
            "(38)" => 0.0,
            "(39)" => {
                step("EYY", i)
                    - 0.5 * (z(i) + z(k + 1)) * step("EAY", i)
                    - 0.5 * uz * (e("EAZ", i) - e("EAZ", k))
            }
            "(40)" => {
                step("EXY", i)
                    + 0.5 * (z(i) + z(k + 1)) * step("EBY", i)
                    + uy * (-xy + 0.5 * (2.0 * e("ECY", i) + e("ECZ", i) + e("ECZ", k)))
            }
            "(41)" => {
                step("EZY", i) + 0.5 * (y(k) - y(i + 1)) * step("EAY", i)
                    - 0.5 * uy * (2.0 * e("EAY", i) + e("EAZ", i) + e("EAZ", k))
            }
            "(42)" => {
                -0.5 * (z(k) - z(i + 1)) * step("EBY", i) + 0.5 * uy * (e("ECZ", i) - e("ECZ", k))
            }
            "(43)" => {
                step("EXX", i) + 0.5 * (z(i) + z(k + 1)) * step("EBX", i)
                    - 0.5 * (y(i) + y(k + 1)) * step("ECX", i)
                    - 0.5 * uy * (e("ECY", i) - e("ECY", k))
                    + 0.5 * uz * (e("EBZ", i) - e("EBZ", k))
            }
            "(44)" => {
                step("EYX", i) - 0.5 * (z(i) + z(k + 1)) * step("EAX", i)
                    + 0.5 * (x(k) - x(i + 1)) * step("ECX", i)
                    - 0.5
                        * ux
                        * (2.0 * e("ECX", i)
                            + e("ECY", i)
                            + e("ECY", k)
                            + e("ECZ", i)
                            + e("ECZ", k))
            }
            "(45)" => {
                step("EZX", i) + 0.5 * (y(i) + y(k + 1)) * step("EAX", i)
                    - 0.5 * (x(k) - x(i + 1)) * step("EBX", i)
                    + 0.5
                        * ux
                        * (2.0 * e("EBX", i)
                            + e("EBY", i)
                            + e("EBY", k)
                            + e("EBZ", i)
                            + e("EBZ", k))
            }
            "(46)" => uz * (e("EBY", i) - e("EBY", k)) - uy * (e("ECZ", i) - e("ECZ", k)),
            other => panic!("no right-hand side of {other}"),
        }
    }
}
