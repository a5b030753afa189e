//! Points of a circle from a table.

use std::path::Path;

use errsep_models::circle::Point;

use super::{Message, TableReader};

/// Reads the columns `x` and `y`, mm.
///
/// # Errors
/// The table lacks a column, has an unknown one, holds something that is no number, or no row.
pub fn read_points(path: &Path) -> Result<Vec<Point>, Message> {
    let mut table = TableReader::open(path)?;
    table.only(&["x", "y"])?;
    let (x, y) = (table.column("x")?, table.column("y")?);
    let mut points = Vec::new();
    while let Some(row) = table.next_row()? {
        points.push(Point::new(row.number(&x)?, row.number(&y)?));
    }
    if points.is_empty() {
        return Err(table.no_rows());
    }
    Ok(points)
}
