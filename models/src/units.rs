//! Where mm and µm meet: exact geometry mixes positions with readings, and nothing else does.

/// Micrometres in a millimetre.
pub const UM_PER_MM: f64 = 1e3;

/// A length given in mm, in µm.
pub fn um_from_mm(mm: f64) -> f64 {
    mm * UM_PER_MM
}

/// A length given in µm, in mm.
pub fn mm_from_um(um: f64) -> f64 {
    um / UM_PER_MM
}
