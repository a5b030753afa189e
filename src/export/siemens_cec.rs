//! Sinumerik: sag compensation of one axis by another, `$AN_CEC`, used for straightness.

use super::grid::AxisTable;
use super::siemens_eec::machine_axis;
use super::source::AxisErrors;
use super::{Content, Exported, Format, Kind, Request, Rounder, Unit};
use crate::io::Message;
use crate::io::units::um_from_mm;

pub const FORMAT: Format = Format {
    name: "siemens-cec",
    meaning: "Sinumerik: cross-axis compensation ($AN_CEC) of straightness",
    takes: Kind::Straightness,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    request.without(FORMAT.name, &["--travel"])?;
    let Content::Straightness(profile) = content else {
        return Err(super::source::wrong(&FORMAT));
    };
    let (input, output) = axes(request.axis.as_deref())?;
    let errors = AxisErrors {
        name: None,
        rotary: false,
        positions: profile.positions.clone(),
        forward: profile.deviations.clone(),
        backward: profile.deviations.clone(),
        both: false,
        known: None,
    };
    let table = AxisTable::of(&errors, request.grid, request.reference)?;
    let step = table.step(FORMAT.name)?;
    let unit = request.unit.unwrap_or(Unit::Mm);
    let (scale, decimals) = match unit {
        Unit::Inch => (Unit::Inch.in_mm(), 8),
        Unit::Mm => (1.0, 7),
    };
    let mut rounder = Rounder::default();
    let mut text = "%_N_NC_CEC_INI\nCHANDATA(1)\n".to_owned();
    for (i, value) in table.forward.iter().enumerate() {
        text += &format!(
            "$AN_CEC[0,{i}]={}\n",
            rounder.fixed(value / scale, decimals)
        );
    }
    text += &format!("$AN_CEC_INPUT_AXIS[0]=({input})\n$AN_CEC_OUTPUT_AXIS[0]=({output})\n");
    let ends =
        [table.positions.first(), table.positions.last()].map(|p| p.copied().unwrap_or_default());
    for (name, value) in [("STEP", step), ("MIN", ends[0]), ("MAX", ends[1])] {
        text += &format!(
            "$AN_CEC_{name}[0]={}\n",
            rounder.fixed(value / scale, decimals)
        );
    }
    text += "$AN_CEC_DIRECTION[0]=0\n$AN_CEC_MULT_BY_TABLE[0]=0\n$AN_CEC_IS_MODULO[0]=0\nM17\n";
    let (mut missed, mut known) = table.cost(&errors, "um", um_from_mm(1.0));
    known.extend(profile.known(&table.positions));
    missed
        .iter_mut()
        .for_each(|m| m.of.clone_from(&profile.name));
    Ok(Exported {
        text,
        axis: Some(format!("{input}:{output}")),
        unit: unit.name().to_owned(),
        reference: request.reference,
        sign: "A value is the deviation as the result has it; the controller's documents do not state which \
               way a positive value moves the output axis."
            .to_owned(),
        exported: vec![profile.name.clone()],
        not_exported: vec![(
            "straight-line part".to_owned(),
            "the slope of a straightness is squareness or alignment, no straightness".to_owned(),
        )],
        rounding: (rounder.largest, unit.name().to_owned()),
        missed,
        known,
        position_unit: errors.position_unit(),
        load: vec![
            "MD32710 $MA_CEC_ENABLE = 0 while loading, 1 afterwards".to_owned(),
            format!("MD18342 $MN_MM_CEC_MAX_POINTS[0] ≥ {}", table.positions.len()),
        ],
        verify: "Verify at one point: with the table active the deviation must fall there; if it doubles, turn \
                 the sign of all values."
            .to_owned(),
        ..Exported::default()
    })
}

/// Axis that is read and axis that is moved, of `X:Z`.
fn axes(given: Option<&str>) -> Result<(String, String), Message> {
    match given.and_then(|g| g.split_once(':')) {
        Some((input, output)) => {
            let axes = (machine_axis(Some(input))?, machine_axis(Some(output))?);
            if axes.0 == axes.1 {
                return Err(
                    Message::bad_input("an axis cannot be compensated across itself")
                        .remedy("give --axis X:Z, the axis that moves and the one that corrects"),
                );
            }
            Ok(axes)
        }
        None => Err(Message::bad_input("siemens-cec needs two axes")
            .remedy("give --axis X:Z, the axis that moves and the one that corrects")),
    }
}
