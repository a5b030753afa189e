//! Klipper: a profile `[skew_correction NAME]`, and `SET_SKEW` with the lengths that give the same.
//!
//! x' = x − xy y − (xz − xy yz) z, y' = y − yz z, with xy = −C0Y, xz = B0Z, yz = −A0Z.

use super::squareness::squareness;
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "klipper",
    meaning: "Klipper: [skew_correction] profile and SET_SKEW",
    takes: Kind::Squareness,
    write,
};

/// Decimals of factors and lengths: three would err by a microradian.
const DECIMALS: usize = 9;
/// Side of the square whose diagonals `SET_SKEW` is told, mm.
const SIDE: f64 = 100.0;

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let (angles, exported) = squareness(&FORMAT, content, request)?;
    let factors = [("xy", -angles.c0y), ("xz", angles.b0z), ("yz", -angles.a0z)];
    let mut rounder = Rounder::default();
    let mut text = "[skew_correction errsep]\n".to_owned();
    for (plane, factor) in factors {
        text += &format!("{plane}_skew = {}\n", rounder.fixed(factor, DECIMALS));
    }
    let lengths: Vec<String> = factors
        .iter()
        .map(|(plane, factor)| {
            let tilt = 2.0 * factor / factor.hypot(1.0);
            let diagonal = |tilt: f64| SIDE * (2.0 + tilt).sqrt();
            format!(
                "{}={:.DECIMALS$},{:.DECIMALS$},{SIDE:.DECIMALS$}",
                plane.to_uppercase(),
                diagonal(tilt),
                diagonal(-tilt),
            )
        })
        .collect();
    text += &format!(
        "\n# The same for this session: SET_SKEW {}\n",
        lengths.join(" ")
    );
    Ok(Exported {
        text,
        sign: "xy = −C0Y, xz = B0Z, yz = −A0Z (tool against workpiece, X primary): x' = x − xy y − (xz − xy yz) z, \
               y' = y − yz z."
            .to_owned(),
        rounding: (rounder.largest, "rad".to_owned()),
        load: vec![
            "[skew_correction] and this section in the configuration".to_owned(),
            "SKEW_PROFILE LOAD=errsep in the start of a print".to_owned(),
        ],
        ..exported
    })
}
