//! ISG kernel and TwinCAT CNC: volumetric compensation, `ISG_CSV`.
//!
//! A block an axis: a header of the argument and the component errors, white space between; `#` opens
//! the next block, `//` a comment. Values in mm and rad over mm. Errors of location have a block of one row.
//! The list names the file, the logical numbers of the axes and the chain: a key and its value a line, `#` a
//! comment.

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
    Ok(Exported {
        text: tables.comments("//") + &parts.join("#\n"),
        list: Some(list(&request.file_name, tables.errors.chain.as_deref())?),
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
            "in the list file: file[0] with the folder of the controller in which the file stands"
                .to_owned(),
            "X, Y and Z with the logical numbers of the axes, where they are not 1, 2 and 3"
                .to_owned(),
            match tables.errors.chain {
                Some(_) => CHAIN_KNOWN,
                None => CHAIN_UNKNOWN,
            }
            .to_owned(),
            "negate with the names of errors whose sign is the other one".to_owned(),
        ],
        verify: VERIFY.to_owned(),
        ..Exported::default()
    })
}

const CHAIN_KNOWN: &str =
    "chain and workpiece_axes are those of the result, from the workpiece to the tool";
const CHAIN_UNKNOWN: &str = "add chain and workpiece_axes as the machine is built (the axes from the workpiece to the tool, and how many of them carry \
     the workpiece): the result does not tell them";

/// The list in which the controller finds the file.
fn list(file: &str, chain: Option<&str>) -> Result<String, Message> {
    if file.contains(char::is_whitespace) {
        return Err(Message::bad_input(
            "a name with white space cannot stand in the list of the controller",
        )
        .remedy("give --out without white space"));
    }
    let mut text = "# Volumetric compensation\nX 1\nY 2\nZ 3\n".to_owned();
    if let Some(chain) = chain {
        let (work, _) = chain.split_once('F').unwrap_or(("", chain));
        let axes = chain.replace('F', "");
        text += &format!("chain {axes}\nworkpiece_axes {}\n", work.len());
    }
    Ok(text + &format!("file[0] {file}\nfile_format[0] ISG_CSV\n"))
}

pub(super) const SIGN: &str = "Errors as ISO 230-1 names them, unchanged: of the moving component, actual less nominal. The controller's \
     documents do not state their sign.";
pub(super) const VERIFY: &str = "Verify at one point far from the origin with one error active at a time: the deviation must fall; if \
     it doubles, negate that error in the list of the controller.";

pub(super) fn decimals(unit: &str) -> usize {
    if unit == "mm" { DECIMALS.0 } else { DECIMALS.1 }
}
