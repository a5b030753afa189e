//! Points of a circle from a table.

use std::path::Path;

use errsep_models::circle::{CircleError, LARGEST, Point, ReachedCircle};
use serde_json::json;

use super::{ColumnMap, Message, TableReader};

/// Why an orthogonal fit has no minimum, with how far it got.
pub fn not_converged(why: &CircleError, reason: &str, reached: Option<&ReachedCircle>) -> Message {
    let message = Message::not_converged(why.to_string());
    let Some(reached) = reached else {
        return message;
    };
    let length = |mm: f64| json!({"value": mm, "unit": "mm"});
    message.reaching(json!({
        "fit": {
            "radius": length(reached.circle.radius),
            "centre_x": length(reached.circle.centre.x),
            "centre_y": length(reached.circle.centre.y),
        },
        "residual": {"rms": reached.residual_rms_um, "unit": "um"},
        "convergence": {"converged": false, "reason": reason, "iterations": reached.iterations},
    }))
}

/// Points with the pass of each.
pub struct MeasuredCircle {
    /// The points, mm.
    pub points: Vec<Point>,
    /// The pass of each point; one for all where no column tells.
    pub passes: Vec<usize>,
}

/// Reads the columns `x` and `y`, mm; a column `repeat`, whole numbers, may stand beside them.
///
/// # Errors
/// The table lacks a column, has an unknown one, holds something that is no number, a number beyond
/// [`LARGEST`], or no row.
pub fn read_points(path: &Path, map: &ColumnMap) -> Result<MeasuredCircle, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["x", "y", "repeat"])?;
    let (x, y) = (table.column("x")?.in_mm(), table.column("y")?.in_mm());
    let repeat = table.optional("repeat");
    let (mut points, mut passes) = (Vec::new(), Vec::new());
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
        let pass = repeat.as_ref().map_or(Ok(1), |column| row.count(column))?;
        passes.push(pass as usize);
    }
    if points.is_empty() {
        return Err(table.no_rows());
    }
    Ok(MeasuredCircle { points, passes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use errsep_models::circle::Circle;

    #[test]
    fn a_fit_without_a_minimum_is_told_without_uncertainties() {
        let reached = ReachedCircle {
            circle: Circle {
                centre: Point::new(1.0, -2.0),
                radius: 30.0,
            },
            residual_rms_um: 0.5,
            iterations: 100,
        };
        let why = CircleError::NotConverged {
            reason: "iteration limit".to_owned(),
            reached: Some(reached),
        };
        let message = not_converged(&why, "iteration limit", Some(&reached));
        let told = message.reached().expect("how far it got");
        assert_eq!(
            told["fit"]["centre_y"],
            json!({"value": -2.0, "unit": "mm"})
        );
        assert_eq!(told["residual"], json!({"rms": 0.5, "unit": "um"}));
        assert_eq!(told["convergence"]["iterations"], 100);
        assert!(not_converged(&why, "", None).reached().is_none());
    }
}
