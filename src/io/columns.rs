//! Names and units of a file's columns where they are not those of the documentation.

use std::fmt;
use std::str::FromStr;

use crate::io::message::{list, nearest};
use crate::io::table::Unit;

/// Which column of a file holds what, in which unit.
///
/// Written `role=column:unit`, several separated by commas: `x=z_mm:mm,1A=I_0_0:mm`. A role is the name
/// that the documentation of the command gives to a column. Without a unit, the one beside the column's
/// name holds, or the one of the documentation. Columns that are not named here are not read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColumnMap {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub role: String,
    pub column: String,
    pub unit: Option<Unit>,
}

impl ColumnMap {
    /// Adds one entry, `column` or `column:unit`.
    ///
    /// # Errors
    /// What is wrong, in words, and the remedy.
    pub fn add(&mut self, role: &str, column_and_unit: &str) -> Result<(), (String, String)> {
        let (column, unit) = match column_and_unit.rsplit_once(':') {
            None => (column_and_unit, None),
            Some((column, unit)) => {
                let known = Unit::from_name(unit).ok_or_else(|| {
                    let what = format!("`{unit}` is no unit of `{role}`");
                    (what, format!("units are {}", list(&Unit::NAMES)))
                })?;
                (column, Some(known))
            }
        };
        if role.is_empty() || column.is_empty() {
            return Err((
                format!("`{role}={column_and_unit}` lacks a name"),
                "write role=column or role=column:unit".to_owned(),
            ));
        }
        if self.names(role) {
            return Err((format!("`{role}` is given twice"), "give it once".into()));
        }
        if let Some(other) = self.entries.iter().find(|e| e.column == column) {
            return Err((
                format!(
                    "column `{column}` is to be both `{}` and `{role}`",
                    other.role
                ),
                "give each column one role".to_owned(),
            ));
        }
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

    /// The column of a role.
    pub fn column_of(&self, role: &str) -> Option<&str> {
        let entry = self.entries.iter().find(|e| e.role == role)?;
        Some(&entry.column)
    }

    /// Whether nothing was renamed.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// That every role is one of `known`.
    ///
    /// # Errors
    /// The role that is not, in words, and the remedy.
    pub fn only(&self, known: &[&str]) -> Result<(), (String, String)> {
        let is_unknown = |e: &&Entry| !known.contains(&e.role.as_str());
        let Some(Entry { role, .. }) = self.entries.iter().find(is_unknown) else {
            return Ok(());
        };
        let remedy = match nearest(role, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? Known are {}", list(known)),
            None => format!("known are {}", list(known)),
        };
        Err((format!("no column holds `{role}`"), remedy))
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }
}

/// As it is written.
impl fmt::Display for ColumnMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, entry) in self.entries.iter().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            write!(f, "{comma}{}={}", entry.role, entry.column)?;
            if let Some(unit) = entry.unit {
                write!(f, ":{}", unit.name())?;
            }
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for (text, told) in [
            ("x", "is not role=column"),
            ("x=", "lacks a name"),
            ("=a", "lacks a name"),
            ("x=a:furlong", "`furlong` is no unit of `x`"),
            ("x=a,x=b", "`x` is given twice"),
            ("x=a,y=a", "column `a` is to be both `x` and `y`"),
        ] {
            let why = text.parse::<ColumnMap>().unwrap_err();
            assert!(why.contains(told), "{text}: {why}");
        }
        let map: ColumnMap = "x=a: b:mm, time=t:min".parse().unwrap();
        assert_eq!(map.entries()[0].column, "a: b");
        assert_eq!(map.to_string().parse::<ColumnMap>().as_ref(), Ok(&map));
        assert!(map.only(&["x", "time"]).is_ok());
        let (what, remedy) = map.only(&["x", "times"]).unwrap_err();
        assert!(
            what.contains("`time`") && remedy.contains("`times`"),
            "{what}; {remedy}"
        );
    }
}
