//! Where the noise comes from, and what is assumed of it, in words.

use errsep_models::reversal::simultaneous::NoiseOrigin;

use crate::report::number;

/// Share of the noise that might be correlated, and over which part of the range, where nothing tells.
pub const SUPPOSED: (f64, f64) = (0.5, 0.05);

/// Which noise, of which channels, with how many degrees of freedom. `supposed` is asked only where no
/// repeats tell of the law: over which length, mm, part of the noise is supposed to be correlated, whose
/// uncertainty that would change, and how many times as large it would be.
pub fn words(
    origin: NoiseOrigin,
    alike: bool,
    freedom: f64,
    supposed: impl FnOnce() -> Option<(f64, String, f64)>,
) -> String {
    let of = if alike {
        "the same in all channels"
    } else {
        "the channels differ"
    };
    let source = match origin {
        NoiseOrigin::Repeats { law, shared } => {
            let part = |variance: f64| number::plain(variance.sqrt(), 2);
            return format!(
                "from the repeats, {of}: white {} µm, correlated along a trace {} µm over {} mm, \
                 shift of a trace {} µm, slope by which a trace drifts {} µrad{}",
                part(law.white),
                part(law.correlated),
                number::plain(law.length, 2),
                part(law.shift),
                number::plain(1e3 * law.drift.sqrt(), 2),
                shared.map_or(String::new(), |s| together(s.correlation))
            );
        }
        NoiseOrigin::BetweenChannels { law } => {
            let part = |variance: f64| number::plain(variance.sqrt(), 2);
            return format!(
                "from what the channels read against each other, whatever the forms are, {of}: white {} µm, correlated \
                 along a trace {} µm over {} mm; nothing is repeated, so that what the model misses would look the same",
                part(law.white),
                part(law.correlated),
                number::plain(law.length, 2)
            );
        }
        NoiseOrigin::Declared => "declared in the set-up".to_owned(),
        NoiseOrigin::Residuals => {
            format!("from the residuals, {of}, {freedom:.0} degrees of freedom")
        }
    };
    match supposed() {
        Some((length, quantity, factor)) => format!(
            "{source}; taken as independent from reading to reading, of which repeats would tell \
             more: were half of its variance correlated over {} mm along a trace, u of {quantity} would be \
             {} times as large",
            number::plain(length, 2),
            number::plain(factor, 2)
        ),
        None => source,
    }
}

/// That opposite indicators share what repeats differ by.
fn together(correlation: f64) -> String {
    let means = if correlation < 0.0 {
        "one reads more as the other reads less, as where the slide runs elsewhere in each pass"
    } else {
        "they rise together, as where the artefact grows"
    };
    format!(
        "; opposite indicators share it in one pass (correlation {}): {means}",
        number::plain(correlation, 2)
    )
}

/// What a fit that misses more than the noise is told to mean; `missed` in µm.
pub fn disagreement(missed: f64) -> String {
    format!(
        "model and readings disagree: beside the noise the model misses {} µm (root mean square); \
         the uncertainties count it as if it were noise, which is no substitute for finding it",
        number::plain(missed, 2)
    )
}
