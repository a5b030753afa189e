//! RepRapFirmware: `M556`, with the opposite sign: x' = x + tanXY y + tanXZ z, y' = y + tanYZ z.

use super::squareness::squareness;
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "reprapfirmware",
    meaning: "RepRapFirmware: M556 axis skew",
    takes: Kind::Squareness,
    write,
};

/// The length on which the errors are told, mm.
const LENGTH: f64 = 100.0;

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let (angles, exported) = squareness(&FORMAT, content, request)?;
    let mut rounder = Rounder::default();
    let [x, y, z] = [angles.c0y, angles.a0z, -angles.b0z].map(|f| rounder.fixed(LENGTH * f, 7));
    Ok(Exported {
        text: format!("M556 S{LENGTH} X{x} Y{y} Z{z}\n"),
        unit: "mm on 100 mm".to_owned(),
        sign: "X = 100 C0Y, Y = 100 A0Z, Z = −100 B0Z (tool against workpiece, X primary): \
               x' = x + tanXY y + tanXZ z, y' = y + tanYZ z."
            .to_owned(),
        rounding: (rounder.largest, "mm on 100 mm".to_owned()),
        load: vec!["the line in config.g".to_owned()],
        ..exported
    })
}
