//! Reading measured parts: one coordinate of one point of one part a row.

use std::collections::HashMap;
use std::path::Path;

use errsep_models::machine::{Axis, PartReading, Position};

use super::columns::ColumnMap;
use super::message::Message;
use super::table::TableReader;

/// Reads the columns `part`, `point`, `axis`, `value` (um) and, where given, `replicate`.
///
/// # Errors
/// A file that cannot be read, a point that is not among `points`, an axis other than x, y, z.
pub fn read_parts(
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
