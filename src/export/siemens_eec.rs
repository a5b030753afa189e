//! Sinumerik: spindle pitch and measuring system error compensation, `$AA_ENC_COMP`.
//!
//! An even grid, one value for both directions; a positive value moves the axis the negative way, so that
//! it is the error itself.

use super::{AxisTable, Content, Exported, Format, Kind, Request, Rounder, Unit};
use crate::io::Message;
use crate::io::units::{ARCSEC_PER_DEG, um_from_mm};

pub const FORMAT: Format = Format {
    name: "siemens-eec",
    meaning: "Sinumerik: encoder and leadscrew compensation ($AA_ENC_COMP)",
    takes: Kind::Positioning,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    request.without(FORMAT.name, &["--travel"])?;
    let Content::Positioning(errors) = content else {
        return Err(super::source::wrong(&FORMAT));
    };
    let reference = request
        .reference
        .unwrap_or_else(|| reference_of(&errors.positions));
    let table = AxisTable::of(errors, request.grid, Some(reference))?;
    let step = table.step(FORMAT.name)?;
    let unit = super::axis_unit(errors, request)?;
    let (scale, decimals) = match unit {
        Some(Unit::Inch) => (Unit::Inch.in_mm(), 8),
        _ => (1.0, 7),
    };
    let axis = machine_axis(request.axis.as_deref().or(errors.name.as_deref()))?;
    let mut rounder = Rounder::default();
    let mut text = "%_N_AX_EEC_INI\nCHANDATA(1)\n".to_owned();
    for (i, value) in table.mean().iter().enumerate() {
        let value = rounder.fixed(value / scale, decimals);
        text += &format!("$AA_ENC_COMP[0,{i},{axis}]={value}\n");
    }
    let ends =
        [table.positions.first(), table.positions.last()].map(|p| p.copied().unwrap_or_default());
    for (name, value) in [("STEP", step), ("MIN", ends[0]), ("MAX", ends[1])] {
        let value = rounder.fixed(value / scale, decimals);
        text += &format!("$AA_ENC_COMP_{name}[0,{axis}]={value}\n");
    }
    text += &format!("$AA_ENC_COMP_IS_MODULO[0,{axis}]=0\nM17\n");
    let mut not_exported = super::one_direction(errors);
    if errors.both {
        not_exported.push((
            "reversal B".to_owned(),
            "the table has one value for both directions, their mean: enter the mean reversal as backlash (MD32450)"
                .to_owned(),
        ));
    }
    let unit = unit.map_or("deg", Unit::name);
    let per = if errors.rotary {
        ARCSEC_PER_DEG
    } else {
        um_from_mm(1.0)
    };
    let (missed, known) = table.cost(errors, super::deviation_unit(errors), per);
    Ok(Exported {
        text,
        axis: Some(axis),
        unit: unit.to_owned(),
        reference: Some(reference),
        sign: "A value is actual less target; positive moves the axis the negative way.".to_owned(),
        exported: vec!["mean of both directions at each point".to_owned()],
        not_exported,
        rounding: (rounder.largest, unit.to_owned()),
        missed,
        known,
        position_unit: errors.position_unit(),
        load: vec![
            "MD32700 $MA_ENC_COMP_ENABLE = 0 while loading, 1 afterwards".to_owned(),
            format!(
                "MD38000 $MA_MM_ENC_COMP_MAX_POINTS ≥ {}",
                table.positions.len()
            ),
        ],
        verify: "Measure again with the table active: M must fall to the noise.".to_owned(),
        ..Exported::default()
    })
}

/// Zero where the axis has it, else its first point.
fn reference_of(positions: &[f64]) -> f64 {
    match (positions.first(), positions.last()) {
        (Some(first), Some(last)) if (*first..=*last).contains(&0.0) => 0.0,
        (Some(first), _) => *first,
        _ => 0.0,
    }
}

/// The name of a machine axis; a letter alone gets the number 1.
pub(super) fn machine_axis(name: Option<&str>) -> Result<String, Message> {
    let plain = |n: &&str| {
        n.starts_with(|c: char| c.is_ascii_alphabetic())
            && n.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    match name.filter(plain) {
        Some(letter) if letter.len() == 1 => Ok(format!("{letter}1")),
        Some(name) => Ok(name.to_owned()),
        None => Err(
            Message::bad_input("the name of the machine axis is not known")
                .remedy("give --axis X1 with the name that the controller has"),
        ),
    }
}
