//! What is concluded: verdict and gap decided together, so that neither can contradict the other.
//!
//! Whether there is a gap at all is decided once, by the test of detection, which looks at every
//! effect, every place and the misfit as a whole. The verdict is `none` where that test does not
//! reject and what differs between repeats is noise (`compose.rs`), and a size of zero is then in the
//! interval of the gap: an interval is the set of sizes that are not rejected, and the test speaks for
//! zero, the misfit's own spread for the rest.
//! The sentence, the text, the page and the JSON are all made from this.

use crate::attribution::confidence::Answer;
use crate::attribution::shrink::shrink;
use crate::attribution::shrink::{HeldOut, Size};
use crate::levels::PROMISE;
use crate::verdict::types::{Gap, Kind};

/// What the gap was measured to be, before anything is concluded from it.
pub(crate) struct Measured {
    /// Unit of the readings.
    pub unit: &'static str,
    /// Standard deviation of one reading, or of the mean of those that each is gathered from.
    pub noise: f64,
    /// How many those are.
    pub readings_in_each: f64,
    /// Without the causes.
    pub before: Size,
    /// With them.
    pub after: Size,
    /// The shrinking that the score promised.
    pub predicted_shrink: f64,
    /// On held-out repeats.
    pub held_out: Option<HeldOut>,
    /// Whether what differs between repeats is no noise, as it comes back along the travel or goes on in time.
    pub no_noise: bool,
}

/// Kind of the verdict and the gap that goes with it.
pub(crate) struct Conclusion {
    pub kind: Kind,
    pub gap: Gap,
}

impl Conclusion {
    /// Concludes from the test's probability, the causes found and the gap measured.
    pub fn of(alarmed: bool, found: Option<&Answer>, measured: Measured) -> Self {
        let Measured {
            unit,
            noise,
            readings_in_each,
            before,
            after,
            predicted_shrink,
            held_out,
            no_noise,
        } = measured;
        let shrunk = shrink(before.rms, after.rms);
        // A gap that stands clear and does not shrink as its score promised has another cause.
        let kept_promise = !before.is_clear() || shrunk > PROMISE * predicted_shrink;
        let kind = match found {
            _ if !alarmed => Kind::None,
            // Beside the whole cause there is noise and nothing else.
            Some(answer) if answer.complete && kept_promise && !no_noise => Kind::Effect,
            _ => Kind::Unknown,
        };
        let with_zero = |size: Size| Size {
            ci95: [0.0, size.ci95[1]],
            ..size
        };
        let told = |size| {
            if kind == Kind::None {
                with_zero(size)
            } else {
                size
            }
        };
        Self {
            kind,
            gap: Gap {
                unit,
                noise,
                readings_in_each,
                before: told(before),
                after: told(after),
                shrink: shrunk,
                predicted_shrink,
                held_out,
            },
        }
    }
}
