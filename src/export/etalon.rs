//! Etalon exchange format: a block a parameter, `VALUE` or `Gridpoints`. Values in mm and rad over mm.

use super::isg_volumetric::{DECIMALS, SIGN, VERIFY, decimals};
use super::volumetric::{tables, unit_of};
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "etalon",
    meaning: "Etalon exchange format (ETALON_EXCHANGE) of the 21 errors",
    takes: Kind::Machine,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let tables = tables(&FORMAT, content, request)?;
    let mut rounder = Rounder::default();
    let mut text = tables.comments("//");
    for block in &tables.blocks {
        for column in &block.columns {
            text += &format!("[{}]\nGridpoints = {{\n", column.component);
            for (x, value) in block.positions.iter().zip(&column.values) {
                let value = rounder.fixed(*value, decimals(unit_of(column.component)));
                text += &format!("{} {value}\n", rounder.fixed(*x, DECIMALS.0));
            }
            text += "}\n";
        }
    }
    for (component, value) in &tables.errors.squareness {
        let value = rounder.fixed(*value, DECIMALS.1);
        text += &format!("[{component}]\nVALUE = {value}\n");
    }
    Ok(Exported {
        text,
        unit: "mm, rad".to_owned(),
        sign: SIGN.to_owned(),
        moves: tables.errors.moves.clone(),
        exported: tables.names(),
        not_exported: tables.errors.missing.clone(),
        rounding: (rounder.largest, "mm or rad".to_owned()),
        missed: tables.missed(),
        known: tables.known(),
        position_unit: "mm",
        load: vec![
            "in the list file: file[0] = the file, file_format[0] ETALON_EXCHANGE".to_owned(),
        ],
        verify: VERIFY.to_owned(),
        ..Exported::default()
    })
}
