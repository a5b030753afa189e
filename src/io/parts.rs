//! Reading measured parts: one coordinate of one point of one part a row, or the tables that measuring
//! machines print.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use errsep_models::machine::{Axis, PartReading, Position};

use super::columns::ColumnMap;
use super::machine::read_points;
use super::message::Message;
use super::plates;
use super::source::Source;
use super::table::TableReader;

/// Reads the parts of these files. Those with nominal and measured coordinates side by side need no
/// `points`; the others have the columns `part`, `point`, `axis`, `value` (um) and, where given, `replicate`.
///
/// # Errors
/// A file that cannot be read, a point that is not among `points`, an axis other than x, y, z, points that
/// are called alike and lie elsewhere.
pub fn read_parts(
    files: &[PathBuf],
    map: &ColumnMap,
    points: Option<&Path>,
) -> Result<Vec<PartReading>, Message> {
    let mut places = None;
    let mut all: Vec<PartReading> = Vec::new();
    for file in files {
        let own = if plates::is_plate(file, map) {
            if let Some(points) = points {
                return Err(Message::bad_input("the points of this file are not needed")
                    .in_file(points)
                    .remedy(format!(
                        "{} has nominal coordinates of its own: leave --points out",
                        file.display()
                    )));
            }
            plates::read(file, map)?
        } else {
            let Some(points) = points else {
                // What cannot be read at all is told as that.
                Source::open(file).map_err(|e| {
                    Message::bad_input(format!("the file cannot be read: {e}"))
                        .in_file(file)
                        .remedy("check the name and the folder")
                })?;
                return Err(Message::bad_input("the table of the points is needed for these parts")
                    .in_file(file)
                    .remedy(
                        "give it with --points POINTS.csv, or nominal and measured coordinates side by side: \
                         point, nominal x, nominal y, measured x, measured y",
                    ));
            };
            if places.is_none() {
                places = Some(read_points(points)?);
            }
            read_by_axis(file, map, places.as_deref().unwrap_or_default())?
        };
        joins(&all, &own, file)?;
        all.extend(own);
    }
    Ok(all)
}

/// Nominal positions that differ by no more are the same, mm: what rounding to a unit leaves.
pub(super) const SAME_PLACE: f64 = 1e-3;

fn apart(a: &Position, b: &Position) -> bool {
    let steps = [a.x - b.x, a.y - b.y, a.z - b.z];
    steps.iter().any(|step| step.abs() > SAME_PLACE)
}

/// That the parts of a file are others than those before, with their points at the same places.
fn joins(before: &[PartReading], own: &[PartReading], file: &Path) -> Result<(), Message> {
    let parts: HashSet<&str> = before.iter().map(|r| r.part.as_str()).collect();
    if let Some(twice) = own.iter().find(|r| parts.contains(r.part.as_str())) {
        return Err(Message::bad_input(format!(
            "part {} stands in a file before as well",
            twice.part
        ))
        .in_file(file)
        .remedy(
            "give the file of each part a name of its own, or name the parts in a column `part`",
        ));
    }
    let places: HashMap<&str, Position> = before
        .iter()
        .map(|r| (r.feature.as_str(), r.position))
        .collect();
    let elsewhere = |r: &&PartReading| {
        places
            .get(r.feature.as_str())
            .is_some_and(|p| apart(p, &r.position))
    };
    match own.iter().find(elsewhere) {
        None => Ok(()),
        Some(r) => Err(Message::bad_input(format!(
            "point {} has another nominal position than in a file before",
            r.feature
        ))
        .in_file(file)
        .remedy("give points that differ names of their own")),
    }
}

/// Reads the columns `part`, `point`, `axis`, `value` (um) and, where given, `replicate`.
///
/// # Errors
/// A file that cannot be read, a point that is not among `points`, an axis other than x, y, z.
fn read_by_axis(
    path: &Path,
    map: &ColumnMap,
    points: &[(String, Position)],
) -> Result<Vec<PartReading>, Message> {
    let places: HashMap<&str, Position> = points.iter().map(|(n, p)| (n.as_str(), *p)).collect();
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["part", "point", "axis", "value", "replicate"])?;
    let (part, point) = (table.column("part")?, table.column("point")?);
    let (axis, value) = (table.column("axis")?, table.column("value")?.in_um());
    let replicate = table.optional("replicate");
    let mut readings = Vec::new();
    while let Some(row) = table.next_row()? {
        let feature = row.text(&point);
        let position = *places.get(feature).ok_or_else(|| {
            row.error(&point, format!("point {feature} is not among the points"))
                .remedy("add it to the file of the points, or remove the row")
        })?;
        let letter = row.text(&axis).to_uppercase();
        let direction = Axis::ALL
            .into_iter()
            .find(|a| a.letter().to_string() == letter)
            .ok_or_else(|| {
                row.error(
                    &axis,
                    format!("axis \"{}\" is none of x, y, z", row.text(&axis)),
                )
                .remedy("write x, y or z")
            })?;
        readings.push(PartReading {
            part: row.text(&part).to_owned(),
            feature: feature.to_owned(),
            axis: direction,
            replicate: replicate
                .as_ref()
                .map_or(Ok(1), |column| row.count(column))?,
            position,
            value: row.number(&value)?,
        });
    }
    if readings.is_empty() {
        return Err(table.no_rows());
    }
    Ok(readings)
}
