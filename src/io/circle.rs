//! Points of a circle from a table.

use std::path::Path;

use errsep_models::circle::{LARGEST, Point};

use super::{ColumnMap, Message, TableReader};

/// Reads the columns `x` and `y`, mm; a column `repeat` may stand beside them.
///
/// # Errors
/// The table lacks a column, has an unknown one, holds something that is no number, a number beyond
/// [`LARGEST`], or no row.
pub fn read_points(path: &Path, map: &ColumnMap) -> Result<Vec<Point>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["x", "y", "repeat"])?;
    let (x, y) = (table.column("x")?.in_mm(), table.column("y")?.in_mm());
    let mut points = Vec::new();
    while let Some(row) = table.next_row()? {
        let coordinate = |column| {
            let value = row.number(column)?;
            if value.abs() > LARGEST {
                return Err(row
                    .error(
                        column,
                        format!(
                            "{value:e} mm is more than the {LARGEST:e} mm that can be calculated with"
                        ),
                    )
                    .remedy("check the unit and the column"));
            }
            Ok(value)
        };
        points.push(Point::new(coordinate(&x)?, coordinate(&y)?));
    }
    if points.is_empty() {
        return Err(table.no_rows());
    }
    Ok(points)
}
