//! Names and units of a file's columns where they are not those of the documentation.

use std::str::FromStr;

use errsep_models::reversal::Channel;

use crate::io::message::{list, nearest};
use crate::io::units::LengthUnit;

/// Which column of a file holds what, in which unit.
///
/// Written `role=column:unit`, several separated by commas: `x=z_mm:mm,1A=I_0_0:mm`. The unit may
/// be left out: mm for `x`, µm for readings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnMap {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    role: String,
    column: String,
    unit: Option<LengthUnit>,
}

/// What a column can hold.
pub const ROLES: [&str; 10] = [
    "channel",
    "repeat",
    "direction",
    "time",
    "x",
    "reading",
    "1A",
    "1B",
    "2A",
    "2B",
];

/// What a column of a run in which the bar turns can hold beside these.
const OF_A_RUN: &str = "spindle";

impl ColumnMap {
    /// Adds one entry, `column` or `column:unit`.
    ///
    /// # Errors
    /// What is wrong, in words, and the remedy.
    pub fn add(&mut self, role: &str, column_and_unit: &str) -> Result<(), (String, String)> {
        if !ROLES.contains(&role) && role != OF_A_RUN {
            let remedy = match nearest(role, ROLES) {
                Some(near) => format!("did you mean `{near}`? Known are {}", list(&ROLES)),
                None => format!("known are {}", list(&ROLES)),
            };
            return Err((format!("no column holds `{role}`"), remedy));
        }
        if self.entries.iter().any(|e| e.role == role) {
            return Err((format!("`{role}` is given twice"), "give it once".into()));
        }
        let (column, unit) = match column_and_unit.rsplit_once(':') {
            None => (column_and_unit, None),
            Some((column, unit)) => {
                let is_length =
                    role == "x" || role == "reading" || Channel::from_name(role).is_some();
                let known = LengthUnit::from_name(unit).filter(|_| is_length);
                if known.is_none() {
                    return Err((
                        format!("`{unit}` is no unit of `{role}`"),
                        if is_length {
                            format!("units are {}", list(&LengthUnit::NAMES))
                        } else {
                            format!("`{role}` has no unit: write {role}={column}")
                        },
                    ));
                }
                (column, known)
            }
        };
        self.entries.push(Entry {
            role: role.to_owned(),
            column: column.to_owned(),
            unit,
        });
        Ok(())
    }

    /// Whether a column was given for this role.
    pub fn names(&self, role: &str) -> bool {
        self.entries.iter().any(|e| e.role == role)
    }

    /// Whether nothing was renamed.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The column that holds a role; its own name where nothing was renamed, `None` where others
    /// were renamed and this one was not.
    pub fn column<'a>(&'a self, role: &'a str) -> Option<&'a str> {
        match self.entries.iter().find(|e| e.role == role) {
            Some(entry) => Some(&entry.column),
            None => self.is_empty().then_some(role),
        }
    }

    /// The unit given for a role.
    pub fn unit(&self, role: &str) -> Option<LengthUnit> {
        self.entries.iter().find(|e| e.role == role)?.unit
    }
}

impl FromStr for ColumnMap {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut map = Self::default();
        for entry in text.split(',') {
            let (role, column) = entry
                .split_once('=')
                .ok_or_else(|| format!("\"{entry}\" is not role=column or role=column:unit"))?;
            map.add(role.trim(), column.trim())
                .map_err(|(what, remedy)| format!("{what}; {remedy}"))?;
        }
        Ok(map)
    }
}
