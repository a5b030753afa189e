//! The set-up of a reversal.

use std::collections::BTreeMap;
use std::path::Path;

use errsep_models::reversal::Convention;
use errsep_models::reversal::designs::{Design, DesignChannel, DesignError, Zero};
use errsep_models::reversal::staged::Interpolation;
use serde::Deserialize;
use toml::Spanned;

use super::crest::{self, Offsets, StylusBeside};
use super::data::ROLES;
use crate::io::{ColumnMap, Message, SetupFile};

/// What is known beside the readings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReversalSetup {
    /// Thickness (diameter) of the artefact, mm.
    pub thickness: Option<f64>,
    /// Whether the thickness is to be fitted by the simultaneous solution, from that value.
    pub fit_thickness: bool,
    /// Standard deviation of one reading, µm.
    pub noise: Option<f64>,
    /// How the slopes are read.
    pub convention: Convention,
    /// How rotated traces are brought back to the grid.
    pub interpolation: Interpolation,
    /// Cells between the knots of each form; absent: chosen from the data.
    pub knots: Option<usize>,
    /// Names and units of the columns.
    pub columns: ColumnMap,
    /// Channels by the angles of indicator and spindle.
    pub channels: Vec<DesignChannel>,
    /// What becomes of the indicators' zeros between the traces.
    pub zero: Zero,
    /// Styluses beside the crest of a bar.
    pub crest: Option<StylusBeside>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct File {
    artefact: Artefact,
    channels: BTreeMap<Spanned<String>, Spanned<Angles>>,
    indicator: Indicator,
    model: Model,
    columns: BTreeMap<Spanned<String>, Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Artefact {
    thickness: Option<Spanned<f64>>,
    fit_thickness: bool,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Indicator {
    noise: Option<Spanned<f64>>,
    zero: Zeros,
    tip_radius: Option<Spanned<f64>>,
    off_crest: Option<Spanned<Offsets>>,
}

/// The angles of a channel, degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Angles {
    indicator: f64,
    spindle: f64,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum Zeros {
    #[default]
    Reset,
    Kept,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Model {
    convention: Convention,
    interpolation: Interpolation,
    knots: Option<Spanned<u32>>,
}

/// Columns of the angles of a channel.
const OF_ANGLES: [&str; 2] = ["indicator", "spindle"];
/// A thicker artefact is a slip of the unit, mm.
const THICKEST: f64 = 1e5;

impl ReversalSetup {
    /// Reads a set-up.
    ///
    /// # Errors
    /// No TOML, an unknown key (the nearest known one is named), a value that cannot be.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let setup = SetupFile::read(path)?;
        let file: File = setup.parse()?;
        if let Some(d) = &file.artefact.thickness
            && !(0.0..=THICKEST).contains(d.as_ref())
        {
            return Err(setup.bad(
                d.span(),
                format!("a thickness of {} mm cannot be", d.as_ref()),
                "give the diameter of the artefact in mm, or leave it out",
            ));
        }
        if let Some(s) = &file.indicator.noise
            && !(*s.as_ref() > 0.0 && s.as_ref().is_finite())
        {
            return Err(setup.bad(
                s.span(),
                format!("a noise of {} um cannot be", s.as_ref()),
                "give the standard deviation of one reading in um, or leave it out to have it estimated",
            ));
        }
        if let Some(n) = &file.model.knots
            && *n.as_ref() == 0
        {
            return Err(setup.bad(
                n.span(),
                "0 knots carry no form",
                "give 1 or more cells, or leave it out to have their number chosen",
            ));
        }
        let channels = channels(&setup, &file.channels)?;
        let own = channels.iter().map(|channel| channel.name.as_str());
        let roles: Vec<&str> = ROLES.into_iter().chain(OF_ANGLES).chain(own).collect();
        let mut columns = ColumnMap::default();
        for (role, column) in &file.columns {
            columns
                .add(role.as_ref(), column.as_ref())
                .and_then(|()| columns.only(&roles))
                .map_err(|(what, remedy)| setup.bad(role.span(), what, remedy))?;
        }
        Ok(Self {
            channels,
            crest: crest::read(
                &setup,
                file.indicator.tip_radius.as_ref(),
                file.indicator.off_crest.as_ref(),
                file.artefact.thickness.as_ref().map(|d| *d.as_ref()),
            )?,
            zero: match file.indicator.zero {
                Zeros::Reset => Zero::Reset,
                Zeros::Kept => Zero::Kept,
            },
            thickness: file.artefact.thickness.map(Spanned::into_inner),
            fit_thickness: file.artefact.fit_thickness,
            noise: file.indicator.noise.map(Spanned::into_inner),
            convention: file.model.convention,
            interpolation: file.model.interpolation,
            knots: file.model.knots.map(|n| n.into_inner() as usize),
            columns,
        })
    }

    /// The set-up as a file would hold it.
    pub fn as_toml(&self) -> String {
        let mut text = String::from("[artefact]\n");
        match self.thickness {
            Some(d) => text += &format!("thickness = {d:?}      # mm\n"),
            None => text += "# thickness: not known, no thickness correction\n",
        }
        if self.fit_thickness {
            text += "fit_thickness = true\n";
        }
        text += "\n[indicator]\n";
        match self.noise {
            Some(s) => {
                text += &format!("noise = {s:?}      # um, standard deviation of one reading\n")
            }
            None => text += "# noise: estimated from the data\n",
        }
        let convention = match self.convention {
            Convention::Seed => "seed",
            Convention::Rigid => "rigid",
        };
        let interpolation = match self.interpolation {
            Interpolation::Linear => "linear",
            Interpolation::Cubic => "cubic",
        };
        text += &format!(
            "\n[model]\nconvention = \"{convention}\"\ninterpolation = \"{interpolation}\"\n"
        );
        if let Some(n) = self.knots {
            text += &format!("knots = {n}\n");
        }
        if let Some(crest) = &self.crest {
            text = text.replacen("\n[model]", &format!("{}\n[model]", crest.as_toml()), 1);
        }
        if self.zero == Zero::Kept {
            text = text.replacen("[indicator]\n", "[indicator]\nzero = \"kept\"\n", 1);
        }
        if !self.channels.is_empty() {
            text += "\n[channels]      # degrees\n";
        }
        for c in &self.channels {
            let (name, indicator, spindle) = (&c.name, c.indicator, c.spindle);
            text += &format!("{name:?} = {{ indicator = {indicator}, spindle = {spindle} }}\n");
        }
        text
    }
}

/// The channels of a set-up, each with angles of its own.
pub fn channels(
    setup: &SetupFile,
    table: &BTreeMap<Spanned<String>, Spanned<Angles>>,
) -> Result<Vec<DesignChannel>, Message> {
    let mut channels: Vec<DesignChannel> = Vec::with_capacity(table.len());
    for (name, angles) in table {
        let Angles { indicator, spindle } = angles.as_ref();
        let channel = DesignChannel::new(name.as_ref(), *indicator, *spindle).map_err(|why| {
            setup.bad(
                angles.span(),
                why.to_string(),
                "give both angles in degrees, 0 to 360",
            )
        })?;
        channels.push(channel);
        match Design::new(channels.clone()) {
            Ok(_) => {}
            Err(why @ DesignError::SameAngles { .. }) => {
                return Err(setup.bad(
                    angles.span(),
                    why.to_string(),
                    "give one of them its own angles; two traces of one channel are repeats of it: number \
                     them in a column `repeat`",
                ));
            }
            Err(why) => {
                return Err(setup.bad(name.span(), why.to_string(), "list each channel once"));
            }
        }
    }
    Ok(channels)
}
