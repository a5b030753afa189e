//! ISG kernel and TwinCAT CNC: volumetric compensation, `ISG_CSV`.
//!
//! A block an axis: a header of the argument and the component errors, white space between; `#` opens
//! the next block, `//` a comment. Values in mm and rad over mm. Errors of location have a block of one row.

use super::volumetric::{tables, unit_of};
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "isg-volumetric",
    meaning: "ISG kernel, TwinCAT CNC: volumetric compensation (ISG_CSV)",
    takes: Kind::Machine,
    write,
};

/// Decimals of mm and of rad.
pub(super) const DECIMALS: (usize, usize) = (7, 10);

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let tables = tables(&FORMAT, content, request)?;
    let mut rounder = Rounder::default();
    let mut parts = Vec::new();
    for block in &tables.blocks {
        let names = block.columns.iter().map(|c| c.component.to_string());
        let header: Vec<String> = std::iter::once(block.axis.letter().to_string())
            .chain(names)
            .collect();
        let mut part = header.join(" ") + "\n";
        for (i, position) in block.positions.iter().enumerate() {
            let values = block.columns.iter().map(|c| {
                let value = c.values.get(i).copied().unwrap_or_default();
                rounder.fixed(value, decimals(unit_of(c.component)))
            });
            let values: Vec<String> = values.collect();
            let position = rounder.fixed(*position, DECIMALS.0);
            part += &format!("{position} {}\n", values.join(" "));
        }
        parts.push(part);
    }
    if !tables.errors.squareness.is_empty() {
        let (names, values): (Vec<String>, Vec<String>) = tables
            .errors
            .squareness
            .iter()
            .map(|(c, v)| (c.to_string(), rounder.fixed(*v, DECIMALS.1)))
            .unzip();
        parts.push(format!("{}\n{}\n", names.join(" "), values.join(" ")));
    }
    let chain = "chain and workpiece_axes as the machine is built (workpiece_axes from the workpiece to the frame)";
    Ok(Exported {
        text: parts.join("#\n"),
        unit: "mm, rad".to_owned(),
        sign: SIGN.to_owned(),
        moves: tables.errors.moves.clone(),
        exported: tables.names(),
        not_exported: tables.errors.missing.clone(),
        rounding: (rounder.largest, "mm or rad".to_owned()),
        load: vec![
            "in the list file: file[0] = the file, file_format[0] ISG_CSV".to_owned(),
            chain.to_owned(),
            "negate with the names of errors whose sign is the other one".to_owned(),
        ],
        verify: VERIFY.to_owned(),
        ..Exported::default()
    })
}

pub(super) const SIGN: &str = "Errors as ISO 230-1 names them, unchanged: of the moving component, actual less nominal. The controller's \
     documents do not state their sign.";
pub(super) const VERIFY: &str = "Verify at one point far from the origin with one error active at a time: the deviation must fall; if \
     it doubles, negate that error in the list of the controller.";

pub(super) fn decimals(unit: &str) -> usize {
    if unit == "mm" { DECIMALS.0 } else { DECIMALS.1 }
}
