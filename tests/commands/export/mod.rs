//! Every format read back by a reader written from the controller's own rules, and the command.

mod axis;
mod certificate;
mod command_line;
mod cost;
mod lost_motion;
mod machine;
mod skew;

use errsep::export::{Content, Exported, FORMATS, Request};

/// Exports, or the message.
fn export(format: &str, content: &Content, request: &Request) -> Result<Exported, String> {
    let format = FORMATS.into_iter().find(|f| f.name == format).unwrap();
    (format.write)(content, request).map_err(|m| m.render())
}

/// Straight lines between, constant outside, as every one of these controllers has it.
fn lines(points: &[(f64, f64)], x: f64) -> f64 {
    let (first, last) = (points[0], points[points.len() - 1]);
    if x <= first.0 {
        return first.1;
    }
    for pair in points.windows(2) {
        if x <= pair[1].0 {
            return pair[0].1 + (pair[1].1 - pair[0].1) * (x - pair[0].0) / (pair[1].0 - pair[0].0);
        }
    }
    last.1
}
