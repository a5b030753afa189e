//! Results as the compensation files that controllers read, and as a calibration certificate.
//!
//! One file a format, one line in [`FORMATS`]. A format turns the [`Content`] of a result into the text
//! of its file and says with what sign, what was left out and how far rounding moved a value.

mod certificate;
mod cost;
mod csv;
mod etalon;
pub mod exact;
mod grid;
mod isg_leadscrew;
mod isg_volumetric;
mod klipper;
mod linuxcnc;
mod loaded;
mod lost_motion;
mod marlin;
mod reprapfirmware;
mod siemens_cec;
mod siemens_eec;
mod source;
mod squareness;
mod volumetric;

use serde_json::{Value, json};

pub use certificate::{Admin, Entry, Group, Numbers, Uncertainty};
pub use cost::{Known, Missed, in_words};
pub use grid::{AxisTable, Grid};
pub use loaded::Loaded;
pub use source::{AxisErrors, Content, MachineErrors, StraightnessProfile, read};

use crate::io::Message;

/// A format of a controller, or of a certificate.
pub struct Format {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is, in a few words.
    pub meaning: &'static str,
    /// What it is made from.
    pub takes: Kind,
    /// Makes the file.
    pub write: fn(&Content, &Request) -> Result<Exported, Message>,
}

/// Every format.
pub const FORMATS: [&Format; 13] = [
    &linuxcnc::FORMAT,
    &isg_leadscrew::FORMAT,
    &siemens_eec::FORMAT,
    &siemens_cec::FORMAT,
    &isg_volumetric::FORMAT,
    &etalon::FORMAT,
    &csv::FORMAT,
    &klipper::FORMAT,
    &marlin::FORMAT,
    &reprapfirmware::FORMAT,
    &lost_motion::MARLIN,
    &lost_motion::REPRAPFIRMWARE,
    &certificate::FORMAT,
];

/// What a result holds that a format can take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Deviations of one axis along itself.
    Positioning,
    /// A straightness profile.
    Straightness,
    /// The 21 component errors, or some of them.
    Machine,
    /// Squareness of the axes.
    Squareness,
    /// Numbers with their uncertainties.
    Numbers,
}

impl Kind {
    /// The results that hold it.
    pub const fn results(self) -> &'static str {
        match self {
            Self::Positioning => "a result of errsep positioning",
            Self::Straightness => {
                "a result of errsep straightness, reversal, four-sensor or fourier"
            }
            Self::Machine | Self::Squareness => {
                "a result of errsep step-diagonal or machine, or a machine (TOML)"
            }
            Self::Numbers => {
                "a result of errsep reversal, circle, positioning, straightness, four-sensor, step-diagonal or machine"
            }
        }
    }

    /// Whether a result holds it.
    pub const fn is_in(self, content: &Content) -> bool {
        matches!(
            (self, content),
            (Self::Positioning, Content::Positioning(_))
                | (Self::Straightness, Content::Straightness(_))
                | (Self::Machine | Self::Squareness, Content::Machine(_))
                | (Self::Numbers, Content::Numbers(_))
        )
    }
}

/// Unit of lengths in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Millimetre.
    Mm,
    /// Inch, 25.4 mm.
    Inch,
}

impl Unit {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Inch => "inch",
        }
    }

    /// Millimetres in one of it.
    pub const fn in_mm(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Inch => crate::io::units::LengthUnit::Inch.in_mm(),
        }
    }
}

/// What was asked for beside the format.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Request {
    /// Name or number of the axis for the controller.
    pub axis: Option<String>,
    /// Unit of the controller.
    pub unit: Option<Unit>,
    /// Where the deviation is to be zero, mm or degrees.
    pub reference: Option<f64>,
    /// An even grid in place of the positions measured.
    pub grid: Option<Grid>,
    /// Travels of axes whose errors have no positions of their own: axis letter, from, to, mm.
    pub travel: Vec<(char, f64, f64)>,
    /// Name of the file, without its folder.
    pub file_name: String,
    /// What a certificate says beside the numbers.
    pub admin: Option<Admin>,
}

impl Request {
    /// Refuses options that a format has no use for.
    ///
    /// # Errors
    /// One of `options` was given.
    fn without(&self, format: &str, options: &[&str]) -> Result<(), Message> {
        let given = [
            ("--axis", self.axis.is_some()),
            ("--unit", self.unit == Some(Unit::Inch)),
            ("--reference", self.reference.is_some()),
            ("--points or --step", self.grid.is_some()),
            ("--travel", !self.travel.is_empty()),
        ];
        match given
            .iter()
            .find(|(name, is)| *is && options.contains(name))
        {
            None => Ok(()),
            Some((name, _)) => Err(
                Message::bad_input(format!("{format} has no use for {name}"))
                    .remedy("leave it out"),
            ),
        }
    }
}

/// A file and what is told about it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Exported {
    /// The file.
    pub text: String,
    /// The list with which a controller finds the file, where it takes one; it is written beside.
    pub list: Option<String>,
    /// The axis, as the file names it.
    pub axis: Option<String>,
    /// Unit of the values in the file.
    pub unit: String,
    /// Where the deviation is zero, in `reference_unit`.
    pub reference: Option<f64>,
    /// What a positive value means.
    pub sign: String,
    /// Which side each axis carries, where that is known.
    pub moves: Option<String>,
    /// What stands in the file.
    pub exported: Vec<String>,
    /// What does not, and why.
    pub not_exported: Vec<(String, String)>,
    /// How far rounding moved a value at most, in `unit` or in what is named.
    pub rounding: (f64, String),
    /// How far the table misses each error between its points, where it has points of its own.
    pub missed: Vec<Missed>,
    /// How well the values are known, as far as the result tells.
    pub known: Vec<Known>,
    /// Unit of the positions of these: mm or deg.
    pub position_unit: &'static str,
    /// What to do in the controller.
    pub load: Vec<String>,
    /// How to see that the sign is right.
    pub verify: String,
}

impl Exported {
    /// `errsep.export/1`.
    pub fn about(&self, format: &str) -> Value {
        let left: Vec<Value> = self
            .not_exported
            .iter()
            .map(|(name, why)| json!({"name": name, "why": why}))
            .collect();
        json!({
            "schema": "errsep.export/1",
            "format": format,
            "axis": self.axis,
            "unit": self.unit,
            "reference": self.reference,
            "sign": self.sign,
            "moves": self.moves,
            "exported": self.exported,
            "not_exported": left,
            "largest_rounding": {"value": self.rounding.0, "unit": self.rounding.1},
            "resampling": self.resampling(),
            "uncertainty": self.known.iter().map(Known::as_json).collect::<Vec<_>>(),
            "position_unit": (!self.position_unit.is_empty()).then_some(self.position_unit),
            "load": self.load,
            "verify": self.verify,
        })
    }
}

impl Exported {
    /// The worst of the unit that comes first (lengths before angles), and that of each error.
    fn resampling(&self) -> Option<Value> {
        let unit = self
            .missed
            .iter()
            .map(|m| m.unit)
            .min_by_key(|u| *u == "rad")?;
        let own = self.missed.iter().filter(|m| m.unit == unit);
        let mut told = own.max_by(|a, b| a.value.total_cmp(&b.value))?.as_json();
        told["each"] = self.missed.iter().map(Missed::as_json).collect();
        Some(told)
    }
}

/// Numbers in a file: fixed decimals, and how far that moved one at most.
#[derive(Debug, Default)]
struct Rounder {
    largest: f64,
}

impl Rounder {
    /// A number with so many decimals, without a negative zero.
    fn fixed(&mut self, value: f64, decimals: usize) -> String {
        let text = format!("{value:.decimals$}");
        let read: f64 = text.parse().unwrap_or(f64::NAN);
        self.largest = self.largest.max((read - value).abs());
        if read == 0.0 {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    }
}

/// Unit of the values of an axis; none for degrees.
fn axis_unit(errors: &AxisErrors, request: &Request) -> Result<Option<Unit>, Message> {
    match (errors.rotary, request.unit) {
        (true, Some(_)) => Err(Message::bad_input(
            "--unit is of a linear axis, this one is rotary",
        )
        .remedy("leave --unit out: the values are in degrees")),
        (true, None) => Ok(None),
        (false, unit) => Ok(Some(unit.unwrap_or(Unit::Mm))),
    }
}

/// Unit of the deviations of an axis, as files name it.
const fn deviation_unit(errors: &AxisErrors) -> &'static str {
    if errors.rotary { "arcsec" } else { "um" }
}

fn both_means(errors: &AxisErrors) -> Vec<String> {
    let told: &[&str] = if errors.both {
        &["mean deviation forward", "mean deviation backward"]
    } else {
        &["mean deviation of the one direction measured, for both"]
    };
    told.iter().map(|&t| t.to_owned()).collect()
}

fn one_direction(errors: &AxisErrors) -> Vec<(String, String)> {
    let scatter = (
        "scatter".to_owned(),
        "a table corrects means; what differs from run to run stays".to_owned(),
    );
    if errors.both {
        return vec![scatter];
    }
    let why = "one direction was measured";
    vec![("reversal".to_owned(), why.to_owned()), scatter]
}
