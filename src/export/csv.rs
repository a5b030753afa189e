//! A neutral table of the component errors, for controllers whose formats are not known precisely enough.

use super::volumetric::{tables, unit_of};
use super::{Content, Exported, Format, Kind, Request};
use crate::io::{CsvTable, Message};

pub const FORMAT: Format = Format {
    name: "csv",
    meaning: "a table of the 21 errors by their ISO 230-1 names",
    takes: Kind::Machine,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let tables = tables(&FORMAT, content, request)?;
    let (mut names, mut axes, mut positions) = (Vec::new(), Vec::new(), Vec::new());
    let (mut values, mut units) = (Vec::new(), Vec::new());
    for block in &tables.blocks {
        for column in &block.columns {
            for (x, value) in block.positions.iter().zip(&column.values) {
                names.push(column.component.to_string());
                axes.push(block.axis.letter().to_string());
                positions.push(*x);
                values.push(*value);
                units.push(unit_of(column.component).to_owned());
            }
        }
    }
    for (component, value) in &tables.errors.squareness {
        names.push(component.to_string());
        axes.push(String::new());
        positions.push(f64::NAN);
        values.push(*value);
        units.push("rad".to_owned());
    }
    let table = CsvTable::new("errors.csv")
        .texts("error", names)
        .texts("axis", axes)
        .numbers("position_mm", positions)
        .numbers("value", values)
        .texts("unit", units);
    let unwritable = |e: String| Message::bad_input(format!("the table cannot be written: {e}"));
    let mut bytes = Vec::new();
    table
        .write(&mut bytes)
        .map_err(|e| unwritable(e.to_string()))?;
    Ok(Exported {
        text: String::from_utf8(bytes).map_err(|e| unwritable(e.to_string()))?,
        unit: "mm, rad".to_owned(),
        sign: "Errors as ISO 230-1 names them: of the moving component, actual less nominal."
            .to_owned(),
        moves: tables.errors.moves.clone(),
        exported: tables.names(),
        not_exported: tables.errors.missing.clone(),
        rounding: (0.0, "mm or rad".to_owned()),
        missed: tables.missed(),
        known: tables.known(),
        position_unit: "mm",
        load: Vec::new(),
        verify: "Convert one value by hand into the controller's form and verify it at one point."
            .to_owned(),
        ..Exported::default()
    })
}
