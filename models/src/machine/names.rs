//! The same 21 errors under three names, with the sign that turns one into the other.
//!
//! The table is data; a test feeds every error alone to the kinematics of [`super::Chain`] and to
//! the printed equations (Soons (1); NISTIR 6868 (9), whose deviation is that of the workpiece) and
//! compares.

use serde::Serialize;

use super::Component;

/// The names of one error. A symbol times its sign is the ISO component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Names {
    /// ISO 230-1.
    pub iso: &'static str,
    /// Soons; angular errors, bold in print, are written `E`.
    pub soons: &'static str,
    /// Sign of Soons' symbol.
    pub soons_sign: f64,
    /// NISTIR 6868.
    pub nistir: &'static str,
    /// Sign of the report's symbol.
    pub nistir_sign: f64,
}

const fn row(
    iso: &'static str,
    soons: &'static str,
    soons_sign: f64,
    nistir: &'static str,
    nistir_sign: f64,
) -> Names {
    Names {
        iso,
        soons,
        soons_sign,
        nistir,
        nistir_sign,
    }
}

/// One row a component, in the order of [`super::COMPONENTS`].
pub const NAMES: [Names; 21] = [
    row("EXX", "e_x(x)", 1.0, "delta_x(x)", 1.0),
    row("EYX", "e_y(x)", 1.0, "delta_y(x)", 1.0),
    row("EZX", "e_z(x)", 1.0, "delta_z(x)", 1.0),
    row("EAX", "E_x(x)", 1.0, "epsilon_x(x)", 1.0),
    row("EBX", "E_y(x)", 1.0, "epsilon_y(x)", 1.0),
    row("ECX", "E_z(x)", 1.0, "epsilon_z(x)", 1.0),
    row("EXY", "e_x(y)", 1.0, "delta_x(y)", 1.0),
    row("EYY", "e_y(y)", 1.0, "delta_y(y)", 1.0),
    row("EZY", "e_z(y)", 1.0, "delta_z(y)", 1.0),
    row("EAY", "E_x(y)", 1.0, "epsilon_x(y)", 1.0),
    row("EBY", "E_y(y)", 1.0, "epsilon_y(y)", 1.0),
    row("ECY", "E_z(y)", 1.0, "epsilon_z(y)", 1.0),
    row("EXZ", "e_x(z)", 1.0, "delta_x(z)", 1.0),
    row("EYZ", "e_y(z)", 1.0, "delta_y(z)", 1.0),
    row("EZZ", "e_z(z)", 1.0, "delta_z(z)", 1.0),
    row("EAZ", "E_x(z)", 1.0, "epsilon_x(z)", 1.0),
    row("EBZ", "E_y(z)", 1.0, "epsilon_y(z)", 1.0),
    row("ECZ", "E_z(z)", 1.0, "epsilon_z(z)", 1.0),
    row("A0Z", "S_yz", 1.0, "alpha_y(z)", 1.0),
    row("B0Z", "S_xz", -1.0, "alpha_x(z)", -1.0),
    row("C0Y", "S_xy", 1.0, "alpha_x(y)", 1.0),
];

/// The names of a component.
#[must_use]
pub fn names_of(component: Component) -> &'static Names {
    &NAMES[component.index()]
}
