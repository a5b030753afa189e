//! Why there is no answer, as a message that points into the file.

use std::path::Path;

use errsep_models::reversal::staged::NoSolution;

use crate::io::Message;
use crate::io::reversal::ReversalData;

/// What to do about readings that climb too steeply.
pub const OTHER_UNITS: &str = "x is in mm and readings in um: if the file has others, say so with \
    --columns, such as x=x:mm,1A=1A:mm";

/// The message for readings that the staged solution refuses.
pub fn message(why: &NoSolution, file: &Path, data: &ReversalData) -> Message {
    let (channel, remedy) = match why {
        NoSolution::NoReadings => (None, "add readings below the first line"),
        NoSolution::NotUsable { .. } => (None, "correct it in the data or the set-up"),
        NoSolution::TooFewPositions { channel, .. } => (
            Some(*channel),
            "read every channel at three or more different positions x",
        ),
        NoSolution::TooSteep { channel, .. } => (Some(*channel), OTHER_UNITS),
        NoSolution::NoOverlap { .. } => (
            None,
            "measure all channels over the same stretch of the slide",
        ),
        NoSolution::Folded { channel } => (Some(*channel), "use --method shear or --simultaneous"),
    };
    let message = Message::bad_input(why.to_string()).remedy(remedy);
    match channel.and_then(|c| data.first_reading(c)) {
        Some(place) => message.at(place.clone()),
        None => message.in_file(file),
    }
}
