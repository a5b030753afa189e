//! Marlin: `M852 I J K`, the same factors and shear as Klipper's.

use super::squareness::squareness;
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "marlin",
    meaning: "Marlin: M852 skew factors",
    takes: Kind::Squareness,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let (angles, exported) = squareness(&FORMAT, content, request)?;
    let mut rounder = Rounder::default();
    let [i, j, k] = [-angles.c0y, angles.b0z, -angles.a0z].map(|f| rounder.fixed(f, 9));
    Ok(Exported {
        text: format!("M852 I{i} J{j} K{k}\nM500\n"),
        sign: "I = xy = −C0Y, J = xz = B0Z, K = yz = −A0Z (tool against workpiece, X primary): \
               x' = x − xy y − (xz − xy yz) z, y' = y − yz z."
            .to_owned(),
        rounding: (rounder.largest, "rad".to_owned()),
        load: vec![
            "SKEW_CORRECTION, SKEW_CORRECTION_GCODE and SKEW_CORRECTION_FOR_Z in Configuration.h".to_owned(),
            "send the commands; M852 alone prints what is active: a factor beyond SKEW_FACTOR_MIN and _MAX is dropped"
                .to_owned(),
        ],
        ..exported
    })
}
