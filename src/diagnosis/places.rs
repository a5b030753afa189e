//! Where the gap lies.

use errsep_models::model::FittedModel;
use nalgebra::DMatrix;

use super::bench::{Bench, Remainder};
use super::dictionary::{Meaning, statistic};
use super::verdict::Where;

/// Places that are not reported beyond this probability.
pub(super) const PLACE_LEVEL: f64 = 0.05;

/// The strongest place on every axis, and the channels' shares.
pub(super) fn places<M: FittedModel>(
    bench: &Bench<'_, M>,
    first: &Remainder,
    excess: f64,
) -> Vec<Where> {
    let interval = |t: f64| {
        let reach = 1.96 * 2.0 * t.sqrt() / excess;
        let share = (t / excess).clamp(0.0, 1.0);
        (share, [(share - reach).max(0.0), (share + reach).min(1.0)])
    };
    let mut places = Vec::new();
    for (k, family) in bench.dictionary.families.iter().enumerate() {
        let (surprise, Some(entry)) = first.best[k] else {
            continue;
        };
        let p = bench.null.family(k, surprise);
        if family.is_effect || p > PLACE_LEVEL {
            continue;
        }
        let entry = &bench.dictionary.entries[entry];
        if let Meaning::Place(item) = &entry.meaning {
            let adjoint = bench
                .space
                .adjoint(DMatrix::from_column_slice(
                    first.residual.len(),
                    1,
                    first.residual.as_slice(),
                ))
                .column(0)
                .clone_owned();
            let score = entry.products(&bench.dictionary.places.sums(&adjoint));
            let t = statistic(&entry.gram, &score, false);
            let (share, ci) = interval(t);
            places.push(Where::new(item, share, ci, p));
        }
    }
    places.extend(channels(bench, first, excess));
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(6);
    places
}

/// The part of the gap in each channel.
fn channels<M: FittedModel>(bench: &Bench<'_, M>, first: &Remainder, excess: f64) -> Vec<Where> {
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
            (p < PLACE_LEVEL).then(|| Where {
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
