//! LinuxCNC: `COMP_FILE` of a joint, type 0.
//!
//! A line a point: nominal, actual forward, actual reverse. The controller moves its motor to commanded +
//! nominal − actual, straight lines between, constant outside. Its reader stops at the first line that is
//! not three numbers, so that the file has no comment.

use super::{AxisTable, Content, Exported, Format, Kind, Request, Rounder, Unit};
use crate::io::Message;
use crate::io::units::{ARCSEC_PER_DEG, um_from_mm};

pub const FORMAT: Format = Format {
    name: "linuxcnc",
    meaning: "LinuxCNC: COMP_FILE of a joint (screw compensation, both directions)",
    takes: Kind::Positioning,
    write,
};

/// Points that the controller keeps.
const MOST: usize = 256;

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    request.without(FORMAT.name, &["--travel"])?;
    let Content::Positioning(errors) = content else {
        return Err(super::source::wrong(&FORMAT));
    };
    let table = AxisTable::of(errors, request.grid, request.reference)?;
    if table.positions.len() > MOST {
        return Err(Message::bad_input(format!(
            "LinuxCNC keeps {MOST} points, the result has {}",
            table.positions.len()
        ))
        .remedy("give --points 256 or fewer: the values between are interpolated"));
    }
    let unit = super::axis_unit(errors, request)?;
    let (scale, decimals) = match unit {
        None => (1.0, 9),
        Some(Unit::Mm) => (1.0, 6),
        Some(Unit::Inch) => (Unit::Inch.in_mm(), 8),
    };
    let mut rounder = Rounder::default();
    let mut text = String::new();
    let both = table.forward.iter().zip(&table.backward);
    for (nominal, (forward, backward)) in table.positions.iter().zip(both) {
        let line = [*nominal, nominal + forward, nominal + backward]
            .map(|v| rounder.fixed(v / scale, decimals));
        text += &format!("{}\n", line.join(" "));
    }
    let axis = request.axis.clone().or_else(|| errors.name.clone());
    let unit = unit.map_or("deg", Unit::name);
    let per = if errors.rotary {
        ARCSEC_PER_DEG
    } else {
        um_from_mm(1.0)
    };
    let (missed, known) = table.cost(errors, super::deviation_unit(errors), per);
    Ok(Exported {
        text,
        axis,
        unit: unit.to_owned(),
        reference: request.reference,
        sign: "Each line is nominal, actual forward, actual reverse; the controller adds nominal less actual to \
               the motor position."
            .to_owned(),
        exported: super::both_means(errors),
        not_exported: super::one_direction(errors),
        rounding: (rounder.largest, unit.to_owned()),
        missed,
        known,
        position_unit: errors.position_unit(),
        load: vec![
            "[JOINT_n] COMP_FILE = the file, COMP_FILE_TYPE = 0, in the set-up of the controller".to_owned(),
            "BACKLASH of this joint is ignored beside it".to_owned(),
            "the positions are those of the joint: home as when it was measured".to_owned(),
        ],
        verify: "Measure again with the file loaded: E and B must fall to the noise. If they double, the sign of \
                 the measurement is the other one."
            .to_owned(),
        ..Exported::default()
    })
}
