//! Whether noise that is correlated along its traces explains readings without repeats better than causes do.
//!
//! Where nothing is measured twice, what the fit leaves is all that is known of the noise, and it holds the causes too.
//! Causes are sought as if readings scattered independently, and then weighed: how likely are the readings without the
//! causes where noise is white, how likely are they as they came where it may be correlated? The unknowns of the law are
//! integrated out; each unknown of the causes costs half the logarithm of the number of readings (Schwarz, Ann. Statist. 6
//! (1978) 461).

use crate::attribution::context::{Cause, Context};
use crate::attribution::examined::Examined;
use crate::detection::residuals::by_residuals;
use crate::levels::LIKELIER_BY_CORRELATION;
use crate::noise::law::{Drifts, NoiseLaw, NoiseSource};

/// The law of noise of readings without repeats, where it is likelier than causes that stand beside white noise, or also
/// beside these; `context` is that of the readings as they came, whose noise is white.
pub(crate) fn correlated_instead(
    context: &Context<'_>,
    examined: &Examined<'_>,
) -> Option<NoiseLaw> {
    if context.law.source != NoiseSource::Neighbours {
        return None;
    }
    let (model, readings) = (examined.context.model, examined.readings);
    let causes = examined
        .found
        .as_ref()
        .map_or(&[][..], |found| &found.causes);
    let (amplitudes, _) = examined.context.amplitudes(readings, causes)?;
    let clean = readings - examined.context.change(causes, &amplitudes);
    let mut both = by_residuals(model, &[readings, &clean], context.law.sigma())?.into_iter();
    let (all, beside) = (both.next()?, both.next()?);
    let by_causes = beside.white - all.white;
    let unknowns: usize = causes.iter().map(Cause::unknowns).sum();
    // They are those of many that explain most.
    let choices = causes.len() as f64 * (context.catalogue.len().max(1) as f64).ln();
    let cost = 0.5 * unknowns as f64 * (readings.len() as f64).ln() + choices;
    let by_noise = all.any.log_evidence - all.white;
    let beside_causes = beside.any.log_evidence - beside.white;
    let instead = beside_causes > LIKELIER_BY_CORRELATION
        || by_noise > by_causes - cost - LIKELIER_BY_CORRELATION;
    instead.then(|| NoiseLaw::mean_of(all.any, Drifts::Never, NoiseSource::Residuals))
}
