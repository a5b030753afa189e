//! The columns of a plate's table where options name them.

use std::path::Path;

use super::fields::{Field, Split};
use super::header::{
    Column, Header, Kind, MOST_LINES, OTHER, Role, by_words, column, is_table, unit_told,
};
use crate::io::columns::{ColumnMap, Entry};
use crate::io::message::{Message, Place, list};
use crate::io::table::Unit;
use crate::io::units::LengthUnit;

/// Most words of a column's name between blanks.
const MOST_WORDS: usize = 6;

/// What is wrong with a map of columns: the line in which it shows, from 0, where there is one; what, and
/// the remedy.
type Wrong = (Option<usize>, String, String);

/// Whether the roles are those of a plate's table: nominal beside measured or deviation. (A `target` alone is
/// that of a diagonal test.)
pub(super) fn is_of_plate(map: &ColumnMap) -> bool {
    let kinds = || {
        map.entries().iter().filter_map(|e| match role_of(&e.role) {
            Some(Role::Of(kind, _)) => Some(kind),
            _ => None,
        })
    };
    kinds().any(|kind| kind == Kind::Nominal) && kinds().any(|kind| kind != Kind::Nominal)
}

/// What a role is called by: as a column would be named that is known by itself.
fn role_of(name: &str) -> Option<Role> {
    let known = column(name).filter(|c| c.unit.is_none())?;
    (!matches!(known.role, Role::Bare(_) | Role::Other)).then_some(known.role)
}

/// The line that names the columns, by themselves or as the map has them.
///
/// # Errors
/// No line does.
pub(super) fn header(path: &Path, lines: &[&str], map: &ColumnMap) -> Result<Header, Message> {
    if map.is_empty() {
        return Header::find(lines).ok_or_else(|| {
            Message::bad_input("no line names nominal and measured coordinates")
                .in_file(path)
                .remedy("name the columns in one line, such as: point, nominal x, nominal y, measured x, measured y")
        });
    }
    Header::named(lines, map).map_err(|(line, what, remedy)| {
        let message = Message::bad_input(what).remedy(remedy);
        match line {
            None => message.in_file(path),
            Some(at) => message.at(Place {
                file: path.to_owned(),
                line: at + 1,
                column: 1,
                text: lines[at].to_owned(),
                length: lines[at].len(),
            }),
        }
    })
}

impl Header {
    /// The first line that names all columns of the map.
    ///
    /// # Errors
    /// A role or a unit that no column of such a table has, roles that make no table, a column that no line
    /// names.
    fn named(lines: &[&str], map: &ColumnMap) -> Result<Self, Wrong> {
        let wanted = map.entries().iter().map(wanted);
        let wanted: Vec<(&str, Column)> = wanted.collect::<Result<_, _>>()?;
        let roles: Vec<Column> = wanted.iter().map(|(_, column)| *column).collect();
        if !is_table(&roles) {
            return Err((
                None,
                "--columns names no table of nominal and measured coordinates".to_owned(),
                "give each axis both: nominal x=…,measured x=… (or deviation x=…), or axis=…,nominal=…,measured=…"
                    .to_owned(),
            ));
        }
        let (mut unit, mut best) = (None, (0, 0));
        for (at, line) in lines.iter().enumerate().take(MOST_LINES) {
            let split = Split::of(line);
            let columns = columns(&split.fields(line), split, &wanted);
            let found = columns.iter().filter(|c| c.role != Role::Other).count();
            if found == wanted.len() {
                return Ok(Self {
                    line: at,
                    split,
                    columns,
                    unit,
                });
            }
            if found > best.0 {
                best = (found, at);
            }
            unit = unit_told(line).or(unit);
        }
        Err(missing(lines, best, &wanted))
    }
}

/// The column that an entry names, and what it holds.
fn wanted(entry: &Entry) -> Result<(&str, Column), Wrong> {
    let Some(role) = role_of(&entry.role) else {
        return Err((
            None,
            format!("no column of a plate's table holds `{}`", entry.role),
            "known are part, point, replicate, axis, nominal x, measured x, deviation x (likewise y and z), and \
             nominal, measured, deviation beside axis"
                .to_owned(),
        ));
    };
    let unit = match entry.unit {
        None => None,
        Some(Unit::Length(unit)) if matches!(role, Role::Of(..)) => Some(unit),
        Some(unit) => {
            return Err((
                None,
                format!("`{}` is no unit of `{}`", unit.name(), entry.role),
                format!(
                    "coordinates are in {}; other columns have no unit",
                    list(&LengthUnit::NAMES)
                ),
            ));
        }
    };
    Ok((&entry.column, Column { role, unit }))
}

/// The columns of a line, those that are not named left out.
fn columns(fields: &[Field], split: Split, wanted: &[(&str, Column)]) -> Vec<Column> {
    let named = |text: &str| {
        let (bare, unit) = bare(text);
        let alike = |name: &str| {
            let name = words_of(name);
            name == words_of(text) || (unit.is_some() && name == words_of(bare))
        };
        let (_, found) = wanted.iter().find(|(name, _)| alike(name))?;
        Some(Column {
            unit: found.unit.or(unit),
            ..*found
        })
    };
    if split == Split::Blank {
        let known = |text: &str| named(text).or_else(|| column(text).map(|_| OTHER));
        return by_words(fields, MOST_WORDS, known);
    }
    let of = |field: &Field| named(field.text).unwrap_or(OTHER);
    fields.iter().map(of).collect()
}

/// A name with single blanks between its words.
fn words_of(name: &str) -> Vec<&str> {
    name.split_whitespace().collect()
}

/// A name without the unit in brackets behind it.
fn bare(name: &str) -> (&str, Option<LengthUnit>) {
    let open = name.rfind(['(', '[']);
    let unit = open.and_then(|at| {
        let inside = name[at + 1..].trim().strip_suffix([')', ']'])?;
        LengthUnit::from_name(inside.trim())
    });
    match (open, unit) {
        (Some(at), Some(unit)) => (name[..at].trim_end(), Some(unit)),
        _ => (name, None),
    }
}

fn missing(lines: &[&str], (found, at): (usize, usize), wanted: &[(&str, Column)]) -> Wrong {
    let line = lines.get(at).copied().unwrap_or_default();
    let split = Split::of(line);
    let there = columns(&split.fields(line), split, wanted);
    let absent = wanted
        .iter()
        .find(|(_, column)| there.iter().all(|c| c.role != column.role));
    let name = absent.or(wanted.first()).map_or("", |(name, _)| *name);
    match found {
        0 => (
            None,
            format!("no line names the column `{name}`"),
            "give the names as one line of the file has them, without their units".to_owned(),
        ),
        _ => (
            Some(at),
            format!("the line that names the columns has no column `{name}`"),
            "give the names as they stand in this line".to_owned(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(lines: &[&str], map: &str) -> Result<Header, Wrong> {
        Header::named(lines, &map.parse().unwrap())
    }

    #[test]
    fn columns_are_found_by_the_names_that_are_given() {
        let map = "point=Loch,nominal x=Sollwert A:mm,measured x=Wert A";
        for line in [
            "Loch;Sollwert A;Wert A (um);Pruefer",
            "Loch   Sollwert A   Wert A",
            "Loch\tSollwert A\tWert A",
        ] {
            let found = header(&["Bericht", "Units: inch", line], map).unwrap();
            assert_eq!(found.line, 2);
            let roles: Vec<Role> = found.columns.iter().map(|c| c.role).collect();
            let x = errsep_models::machine::Axis::ALL[0];
            assert_eq!(
                roles[..3],
                [
                    Role::Point,
                    Role::Of(Kind::Nominal, Some(x)),
                    Role::Of(Kind::Measured, Some(x)),
                ]
            );
            assert_eq!(found.columns[1].unit, Some(LengthUnit::Mm));
            let beside = line.contains("um").then_some(LengthUnit::Um);
            assert_eq!(
                (found.columns[2].unit, found.unit),
                (beside, Some(LengthUnit::Inch))
            );
        }
    }

    #[test]
    fn what_a_map_cannot_mean_is_told() {
        let lines = ["a,b,c"];
        for (map, told) in [
            ("nominal x=a", "names no table"),
            ("nominal x=a,measured y=b", "names no table"),
            ("nominal x=a,measured x=b,colour=c", "holds `colour`"),
            ("nominal x=a,measured x=b:s", "`s` is no unit"),
            ("nominal x=a,measured x=d", "has no column `d`"),
            ("nominal x=e,measured x=d", "no line names the column `e`"),
        ] {
            let (_, what, _) = header(&lines, map).unwrap_err();
            assert!(what.contains(told), "{map}: {what}");
        }
    }
}
