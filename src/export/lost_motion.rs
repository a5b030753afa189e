//! Lost motion by `M425`: Marlin, and RepRapFirmware from 3.5.
//!
//! One number an axis, mm, not negative: on each change of direction the firmware moves the motor so far further (Marlin
//! `M425 X0.012`, `M425 F1` for the whole of it; RepRapFirmware `M425 X0.012`). Klipper has none.

use super::source::AxisErrors;
use super::{Content, Exported, Format, Kind, Request, Rounder};
use crate::io::Message;
use crate::io::units::um_from_mm;
use crate::number::plain;

pub const MARLIN: Format = Format {
    name: "marlin-backlash",
    meaning: "Marlin: M425, the mean lost motion of an axis",
    takes: Kind::Positioning,
    write: marlin,
};

pub const REPRAPFIRMWARE: Format = Format {
    name: "reprapfirmware-backlash",
    meaning: "RepRapFirmware from 3.5: M425, the mean lost motion of an axis",
    takes: Kind::Positioning,
    write: reprapfirmware,
};

/// Axes that these firmwares have.
const AXES: &str = "XYZUVWABC";

/// Decimals of mm.
const DECIMALS: usize = 5;

fn marlin(content: &Content, request: &Request) -> Result<Exported, Message> {
    let (axis, distance, exported) = lost_motion(&MARLIN, content, request)?;
    Ok(Exported {
        text: format!("M425 {axis}{distance}\nM425 F1\nM500\n"),
        load: vec![
            "BACKLASH_COMPENSATION and BACKLASH_GCODE in Configuration_adv.h".to_owned(),
            "send the commands; M425 alone prints what is active, S spreads a correction over a distance".to_owned(),
        ],
        ..exported
    })
}

fn reprapfirmware(content: &Content, request: &Request) -> Result<Exported, Message> {
    let (axis, distance, exported) = lost_motion(&REPRAPFIRMWARE, content, request)?;
    Ok(Exported {
        text: format!("M425 {axis}{distance}\n"),
        load: vec![
            "the line in config.g; S spreads a correction over that many times its length, 10 where it is left out"
                .to_owned(),
        ],
        ..exported
    })
}

/// Letter of the axis, its lost motion as it stands in the file, and what is to be told, `text` and `load` left out.
fn lost_motion(
    format: &Format,
    content: &Content,
    request: &Request,
) -> Result<(char, String, Exported), Message> {
    let unused = ["--unit", "--reference", "--points or --step", "--travel"];
    request.without(format.name, &unused)?;
    let Content::Positioning(errors) = content else {
        return Err(super::source::wrong(format));
    };
    let axis = letter(format, errors, request)?;
    if errors.rotary {
        return Err(Message::bad_input(format!(
            "{} corrects lengths, this axis turns",
            format.name
        ))
        .remedy("give a linear axis"));
    }
    // What the axis stays behind on both sides: forward it ends short of where it ends backward.
    let lost: Vec<f64> = errors
        .backward
        .iter()
        .zip(&errors.forward)
        .map(|(backward, forward)| backward - forward)
        .collect();
    if !errors.both || lost.is_empty() {
        return Err(
            Message::bad_input("one direction was measured: it shows no lost motion")
                .remedy("measure each target from both directions"),
        );
    }
    let mean = lost.iter().sum::<f64>() / lost.len() as f64;
    let um = |mm: f64| plain(um_from_mm(mm), 3);
    if !(mean > 0.0) {
        return Err(Message::bad_input(format!(
            "the axis goes {} µm further forward than backward: that is no lost motion, and M425 takes none below zero",
            um(-mean)
        ))
        .remedy("check the sign of the measurement, and whether the controller corrects lost motion already"));
    }
    let spread = lost
        .iter()
        .fold(0.0_f64, |most, l| most.max((l - mean).abs()));
    let mut rounder = Rounder::default();
    let distance = rounder.fixed(mean, DECIMALS);
    Ok((
        axis,
        distance,
        Exported {
            axis: Some(axis.to_string()),
            unit: "mm".to_owned(),
            sign: "The mean over the targets of backward less forward, actual less target: what the axis loses when it \
                   turns round. The firmware moves the motor so much further on each change of direction."
                .to_owned(),
            exported: vec!["mean reversal".to_owned()],
            not_exported: vec![
                (
                    "reversal by target".to_owned(),
                    format!("one number an axis; it differs from the mean by up to {} µm", um(spread)),
                ),
                (
                    "mean deviation".to_owned(),
                    "the firmware has no table along an axis".to_owned(),
                ),
                (
                    "scatter".to_owned(),
                    "what differs from run to run stays".to_owned(),
                ),
            ],
            rounding: (rounder.largest, "mm".to_owned()),
            verify: "Measure again: the reversal B must fall to what differs from target to target. If it doubles, the sign of \
                     the measurement is the other one."
                .to_owned(),
            ..Exported::default()
        },
    ))
}

/// The letter of the axis in the firmware.
fn letter(format: &Format, errors: &AxisErrors, request: &Request) -> Result<char, Message> {
    let name = request.axis.as_ref().or(errors.name.as_ref());
    let mut letters = name.map(|name| name.trim().chars()).into_iter().flatten();
    match (letters.next(), letters.next()) {
        (Some(letter), None) if AXES.contains(letter.to_ascii_uppercase()) => {
            Ok(letter.to_ascii_uppercase())
        }
        _ => Err(Message::bad_input(format!(
            "{} needs the letter of the axis, one of {AXES}{}",
            format.name,
            name.map_or(String::new(), |name| format!(
                "; this one is named `{name}`"
            ))
        ))
        .remedy("give --axis X")),
    }
}
