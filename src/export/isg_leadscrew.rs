//! ISG kernel and TwinCAT CNC: list of leadscrew compensation, `kw.ssfk`.
//!
//! Positions and values in 0.1 µm, non-equidistant, a value for each direction: actual less setpoint.

use super::{AxisTable, Content, Exported, Format, Kind, Request, Rounder, Unit};
use crate::io::Message;
use crate::io::units::um_from_mm;

pub const FORMAT: Format = Format {
    name: "isg-leadscrew",
    meaning: "ISG kernel, TwinCAT CNC: leadscrew compensation (kw.ssfk, both directions)",
    takes: Kind::Positioning,
    write,
};

/// Steps of 0.1 µm in a mm.
const PER_MM: f64 = 1e4;
/// Entries that the controller keeps by default.
const MOST: usize = 1500;
/// The greatest whole number of the controller.
const GREATEST: f64 = 2_147_483_647.0;

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    request.without(FORMAT.name, &["--travel", "--unit"])?;
    let Content::Positioning(errors) = content else {
        return Err(super::source::wrong(&FORMAT));
    };
    if errors.rotary || request.unit == Some(Unit::Inch) {
        return Err(
            Message::bad_input("isg-leadscrew writes 0.1 um of a linear axis")
                .remedy("give a result of a linear axis, without --unit inch"),
        );
    }
    let table = AxisTable::of(errors, request.grid, request.reference)?;
    let count = table.positions.len();
    if count > MOST {
        return Err(Message::bad_input(format!(
            "the controller keeps {MOST} entries, the result has {count}"
        ))
        .remedy("give --points 1500 or fewer: the values between are interpolated"));
    }
    let axis = request.axis.clone().or_else(|| errors.name.clone());
    let number = number_of(axis.as_deref())?;
    let mut rounder = Rounder::default();
    let setpoints = whole(&mut rounder, &table.positions)?;
    if setpoints.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(
            Message::bad_input("two points lie within 0.1 um of each other")
                .remedy("give fewer --points or a longer --step"),
        );
    }
    let mut text = format!("kopf.log_achs_nr {number}\n");
    let plain = |name: &&String| {
        name.chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-".contains(c))
    };
    if let Some(name) = errors.name.as_ref().filter(plain) {
        text += &format!("kopf.log_achs_name {name}\n");
    }
    text += &format!(
        "kw.ssfk.unit 1\nkw.ssfk.interval 0\nkw.ssfk.kw_startpos {}\nkw.ssfk.kw_nr_max {count}\nkw.ssfk.bilateral 1\n",
        setpoints.first().map_or("0", String::as_str)
    );
    let columns = [
        ("setpoint", setpoints),
        ("pos", whole(&mut rounder, &table.forward)?),
        ("neg", whole(&mut rounder, &table.backward)?),
    ];
    for (name, values) in columns {
        for (i, value) in values.iter().enumerate() {
            text += &format!("kw.ssfk.table[{i}].{name} {value}\n");
        }
    }
    let (missed, known) = table.cost(errors, "um", um_from_mm(1.0));
    Ok(Exported {
        text,
        axis: Some(number.to_string()),
        unit: "0.1 um".to_owned(),
        reference: request.reference,
        sign: "pos and neg are actual less setpoint.".to_owned(),
        exported: super::both_means(errors),
        not_exported: super::one_direction(errors),
        rounding: (rounder.largest, "0.1 um".to_owned()),
        missed,
        known,
        position_unit: errors.position_unit(),
        load: vec!["lr_param.ssfk 1 in the list of the axis".to_owned()],
        verify: "Measure again with the list loaded: E and B must fall to the noise.".to_owned(),
        ..Exported::default()
    })
}

/// Values in whole steps.
fn whole(rounder: &mut Rounder, values: &[f64]) -> Result<Vec<String>, Message> {
    values
        .iter()
        .map(|v| {
            let steps = v * PER_MM;
            if steps.abs() <= GREATEST {
                return Ok(rounder.fixed(steps, 0));
            }
            Err(Message::bad_input(format!(
                "{v} mm is more than the controller counts in 0.1 um"
            ))
            .remedy("export a part of the axis that lies within 214 m"))
        })
        .collect()
}

/// The number of an axis: as given, or 1, 2, 3 of X, Y, Z.
fn number_of(axis: Option<&str>) -> Result<u32, Message> {
    let known = match axis {
        Some("X") => Some(1),
        Some("Y") => Some(2),
        Some("Z") => Some(3),
        Some(other) => other.parse().ok().filter(|n| *n > 0),
        None => None,
    };
    known.ok_or_else(|| {
        Message::bad_input("the logical number of the axis is not known")
            .remedy("give --axis N with the number (log_achs_nr) that the controller has")
    })
}
