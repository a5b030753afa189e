//! Whether traces that drift explain what differs between repeats better than causes do.
//!
//! An indicator that is touched or set to zero before a pass settles while it reads, and each trace gets a slope of its own.
//! A cause that goes on in time (a warm-up, a slow cycle of the room) tilts traces too, and would be noise under a law in
//! which they drift. So causes are sought under laws without drifts first, and what they come to is then weighed: how likely
//! are the repeats without the causes where no trace drifts, how likely are they with all that is in them where each may?
//! The unknowns of the law are integrated out; each unknown of the causes costs half the logarithm of the number of readings
//! (Schwarz, Ann. Statist. 6 (1978) 461).

use crate::attribution::context::{Cause, Context};
use crate::attribution::examined::Examined;
use crate::detection::estimate::evidence;
use crate::levels::LIKELIER_BY_DRIFTS;
use crate::noise::law::Drifts;

/// Whether drifts of whole traces belong in the law of the noise; `context` is that of the readings as they came, whose law
/// knows none.
pub(crate) fn drifts_instead(context: &Context<'_>, examined: &Examined<'_>) -> bool {
    let (model, readings) = (examined.context.model, examined.readings);
    let by_drifts = || {
        let steady = context.law.log_evidence?;
        Some(evidence(model, readings, Drifts::Possible)? - steady)
    };
    let Some(by_drifts) = by_drifts().filter(|gain| *gain > LIKELIER_BY_DRIFTS) else {
        return false;
    };
    let causes = examined
        .found
        .as_ref()
        .map_or(&[][..], |found| &found.causes);
    let Some((amplitudes, _)) = examined.context.amplitudes(readings, causes) else {
        return false;
    };
    let clean = readings - examined.context.change(causes, &amplitudes);
    let beside = |drifts| evidence(model, &clean, drifts);
    let gains = || {
        let (steady, drifting) = (beside(Drifts::Never)?, beside(Drifts::Possible)?);
        Some((steady - context.law.log_evidence?, drifting - steady))
    };
    let Some((by_causes, beside_causes)) = gains() else {
        return false;
    };
    let unknowns: usize = causes.iter().map(Cause::unknowns).sum();
    let cost = 0.5 * unknowns as f64 * (readings.len() as f64).ln();
    beside_causes > LIKELIER_BY_DRIFTS || by_drifts > by_causes - cost
}
