//! The only place where units change. Inside, positions are mm, readings and forms µm, angles rad.

pub use errsep_models::units::{UM_PER_MM, mm_from_um, um_from_mm};

/// Microradians in a radian.
pub const URAD_PER_RAD: f64 = 1e6;

/// Arcseconds in a radian.
pub const ARCSEC_PER_RAD: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

/// Seconds of arc in a degree.
pub const ARCSEC_PER_DEG: f64 = 3600.0;

/// Seconds in an hour.
pub const SECONDS_PER_HOUR: f64 = 3600.0;

/// A unit as people read it: the micro sign for the `u` of the files.
pub fn symbol(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "urad" => "µrad",
        "arcsec" => "″",
        "um/h" => "µm/h",
        "arcsec/h" => "″/h",
        "deg" => "°",
        other => other,
    }
}

/// A share such as a coverage, in per cent with as many places as it was given.
pub fn per_cent(share: f64) -> f64 {
    (share * 1e8).round() / 1e6
}

/// An angle in µrad, as people read it.
pub fn urad_from_rad(rad: f64) -> f64 {
    rad * URAD_PER_RAD
}

/// An angle in seconds of arc, as people read it.
pub fn arcsec_from_rad(rad: f64) -> f64 {
    rad * ARCSEC_PER_RAD
}

/// A unit of length that a file may be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LengthUnit {
    /// Nanometre.
    Nm,
    /// Micrometre.
    Um,
    /// Millimetre.
    Mm,
    /// Metre.
    M,
    /// Inch, 25.4 mm.
    Inch,
    /// Millionth of an inch.
    Microinch,
}

impl LengthUnit {
    /// The names that files and options may use.
    pub const NAMES: [&'static str; 6] = ["nm", "um", "mm", "m", "inch", "uinch"];

    /// The unit of a name (`um` and `µm` both mean micrometre).
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "nm" => Some(Self::Nm),
            "um" | "µm" | "μm" => Some(Self::Um),
            "mm" => Some(Self::Mm),
            "m" => Some(Self::M),
            "inch" | "in" => Some(Self::Inch),
            "uinch" | "uin" | "µinch" | "µin" | "μinch" | "μin" => Some(Self::Microinch),
            _ => None,
        }
    }

    /// Millimetres in one of this unit.
    pub const fn in_mm(self) -> f64 {
        match self {
            Self::Nm => 1e-6,
            Self::Um => 1e-3,
            Self::Mm => 1.0,
            Self::M => 1e3,
            Self::Inch => 25.4,
            Self::Microinch => 25.4e-6,
        }
    }

    /// Micrometres in one of this unit.
    pub const fn in_um(self) -> f64 {
        match self {
            Self::Nm => 1e-3,
            Self::Um => 1.0,
            Self::Mm => 1e3,
            Self::M => 1e6,
            Self::Inch => 25_400.0,
            Self::Microinch => 0.0254,
        }
    }
}
