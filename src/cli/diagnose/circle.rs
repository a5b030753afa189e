//! Points of a circle.

use std::path::Path;

use errsep_models::circle::{CircleError, CirclePoints, Point};
use errsep_models::model::AnyModel;
use serde::Deserialize;

use super::Args;
use super::case::Case;
use crate::cli::Answer;
use crate::io::circle::not_converged;
use crate::io::{ColumnMap, Message, SetupFile, TableReader};
use crate::report::number;

/// The set-up.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    #[serde(default)]
    circle: CircleSetup,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct CircleSetup {
    /// Standard deviation of a radial deviation, µm.
    noise: Option<f64>,
}

/// Most points that are diagnosed together: noise is a matrix of the points of a pass.
const MOST: usize = 4000;

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let setup: Setup = match &args.setup {
        Some(path) => SetupFile::read(path)?.parse()?,
        None => Setup::default(),
    };
    super::positive(setup.circle.noise, "[circle] noise", args)?;
    let noise = args.noise.or(setup.circle.noise);
    let points = read(&args.data, &args.columns.map())?;
    if points.len() > MOST {
        return Err(Message::bad_input(format!(
            "{} points are more than the {MOST} that are diagnosed together",
            points.len()
        ))
        .in_file(&args.data)
        .remedy("take every n-th point"));
    }
    for (point, _) in &points {
        let at = format!("x = {:e}, y = {:e}", point.x, point.y);
        super::within_reach("a coordinate", point.x, &at, args)?;
        super::within_reach("a coordinate", point.y, &at, args)?;
    }
    let model = CirclePoints::new(&points, noise).map_err(|e| {
        let message = match e {
            CircleError::StraighterThanAnyCircle => Message::not_determined(e.to_string()),
            CircleError::NotConverged {
                ref reason,
                ref reached,
            } => not_converged(&e, reason, reached.as_ref()),
            _ => Message::bad_input(e.to_string()),
        };
        message
            .in_file(&args.data)
            .remedy("give four or more different points of a circle, columns x and y in mm")
    })?;
    let circle = model.circle();
    Case {
        readings: format!("{} points", points.len()),
        model: AnyModel::new(&model),
        along: "angle",
        notes: vec![format!(
            "Centre and radius are given as they move from the circle of all points: centre ({}, {}) mm, radius {} mm.",
            number::fixed(circle.centre.x, 6),
            number::fixed(circle.centre.y, 6),
            number::fixed(circle.radius, 6)
        )],
        inputs: Vec::new(),
    }
    .answer(args)
}

/// Columns x and y, mm, and where it applies repeat.
fn read(path: &Path, map: &ColumnMap) -> Result<Vec<(Point, u32)>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["x", "y", "repeat"])?;
    let (x, y) = (table.column("x")?.in_mm(), table.column("y")?.in_mm());
    let repeat = table.optional("repeat");
    let mut points = Vec::new();
    while let Some(row) = table.next_row()? {
        let number = repeat.as_ref().map_or(Ok(1), |column| row.count(column))?;
        points.push((Point::new(row.number(&x)?, row.number(&y)?), number));
    }
    if points.is_empty() {
        return Err(table.no_rows());
    }
    Ok(points)
}
