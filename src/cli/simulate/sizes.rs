//! Whether an effect can have the size at which it is switched on.

use errsep_models::model::Parameter;

use crate::io::Message;

/// Refuses a size outside the range of its parameter in the catalogue.
pub(super) fn possible(
    effect: &str,
    size: f64,
    parameter: Option<&Parameter>,
) -> Result<(), Message> {
    let Some(Parameter {
        name,
        unit,
        low,
        high,
    }) = parameter
    else {
        return Ok(());
    };
    if (*low..=*high).contains(&size) {
        return Ok(());
    }
    // A number without a unit is a share.
    let unit = match *unit {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    Err(Message::bad_input(format!(
        "--effect {effect}={size}: its {name} cannot be {size}{unit}"
    ))
    .remedy(format!("give {low} to {high}{unit}")))
}
