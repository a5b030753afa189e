//! Where the gap lies.

use errsep_models::model::FittedModel;
use nalgebra::DMatrix;

use super::bench::{Bench, Remainder};
use super::dictionary::{Meaning, statistic};
use super::verdict::Where;

/// Places that are not reported beyond this probability.
const PLACE_LEVEL: f64 = 0.05;

/// The strongest place on every axis, and the channels' shares.
pub(super) fn places<M: FittedModel>(
    bench: &Bench<'_, M>,
    first: &Remainder,
    excess: f64,
) -> Vec<Where> {
    let mut places: Vec<Where> = bench
        .dictionary
        .families
        .iter()
        .enumerate()
        .filter(|(_, family)| !family.is_effect)
        .filter_map(|(k, _)| {
            let (surprise, entry) = first.best[k];
            let p = bench.null.family(k, surprise);
            (p <= PLACE_LEVEL).then(|| place_of(bench, first, entry?, excess, p))?
        })
        .collect();
    let channels = channel_shares(bench, first, excess);
    places.extend(channels.into_iter().filter(|w| w.p_value < PLACE_LEVEL));
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(6);
    places
}

/// An entry of the dictionary as a place, with the part of the gap that it explains.
pub(super) fn place_of<M: FittedModel>(
    bench: &Bench<'_, M>,
    remainder: &Remainder,
    entry: usize,
    excess: f64,
    p_value: f64,
) -> Option<Where> {
    let entry = &bench.dictionary.entries[entry];
    let Meaning::Place(item) = &entry.meaning else {
        return None;
    };
    let residual = &remainder.residual;
    let whole = DMatrix::from_column_slice(residual.len(), 1, residual.as_slice());
    let adjoint = bench.space.adjoint(whole).column(0).clone_owned();
    let score = entry.products(&bench.dictionary.places.sums(&adjoint));
    let t = statistic(&entry.gram, &score, false);
    let reach = 1.96 * 2.0 * t.sqrt() / excess;
    let share = (t / excess).clamp(0.0, 1.0);
    let interval = [(share - reach).max(0.0), (share + reach).min(1.0)];
    Some(Where::new(item, share, interval, p_value))
}

/// The part of the gap in each channel.
pub(super) fn channel_shares<M: FittedModel>(
    bench: &Bench<'_, M>,
    first: &Remainder,
    excess: f64,
) -> Vec<Where> {
    let names = bench.model.channel_names();
    let count = names.len();
    if count < 2 {
        return Vec::new();
    }
    let mut sums = vec![(0.0, 0.0); count];
    for (place, e) in bench.model.places().iter().zip(first.residual.iter()) {
        sums[place.channel].0 += e * e;
        sums[place.channel].1 += 1.0;
    }
    let kept = bench.space.degrees_of_freedom() as f64 / bench.space.readings() as f64;
    sums.into_iter()
        .zip(names)
        .filter_map(|((sum, readings), name)| {
            let freedom = (readings * kept).max(1.0);
            let tail = statrs::function::gamma::checked_gamma_ur(freedom / 2.0, sum / 2.0).ok()?;
            let p = (tail * count as f64).min(1.0);
            let share = ((sum - freedom) / excess).clamp(0.0, 1.0);
            let reach = 1.96 * (2.0 * freedom + 4.0 * (sum - freedom).max(0.0)).sqrt() / excess;
            Some(Where {
                axis: "channel",
                value: name,
                from: None,
                to: None,
                share,
                share_ci95: [(share - reach).max(0.0), (share + reach).min(1.0)],
                p_value: p,
            })
        })
        .collect()
}
