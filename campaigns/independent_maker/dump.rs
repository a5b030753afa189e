//! Readings of a case as files, for the real command.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use errsep_models::reversal::Direction;

use crate::case::Case;

/// Writes `NAME.csv`, and `NAME.toml` where the thickness is known.
pub fn dump(folder: &Path, name: &str, case: &Case) -> Result<(), String> {
    let name: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    let mut text = String::from("channel,repeat,direction,time,x,reading\n");
    for reading in &case.observations.readings {
        let direction = match reading.direction {
            Direction::Forward => "forward",
            Direction::Backward => "backward",
        };
        let _ = writeln!(
            text,
            "{},{},{direction},{},{},{}",
            reading.channel.name(),
            reading.repeat,
            reading.time.unwrap_or(0.0),
            reading.x,
            reading.value
        );
    }
    let write = |ending: &str, text: &str| {
        let path = folder.join(format!("{name}.{ending}"));
        fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    write("csv", &text)?;
    match case.thickness {
        Some(thickness) => write("toml", &format!("[artefact]\nthickness = {thickness}\n")),
        None => Ok(()),
    }
}
