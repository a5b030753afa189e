//! The shape of a gap that no effect explains: a fingerprint without a formula.

use std::collections::BTreeMap;

use errsep_models::model::FittedModel;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::attribution::remainder::Remainder;
use crate::levels::{ABSENT, PRESENT};
use crate::search::Reach;
use crate::verdict::places::{channel_shares, place_of};
use crate::verdict::types::{Fingerprint, Nearest, Where};

/// What can be said of a gap without naming it.
pub(crate) fn fingerprint(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    excess: f64,
) -> Fingerprint {
    let shares = channel_shares(context, first, excess);
    let named = |keep: &dyn Fn(&Where) -> bool| -> Vec<String> {
        shares
            .iter()
            .filter(|w| keep(w))
            .map(|w| w.value.clone())
            .collect()
    };
    let energies = Energies::of(context, &first.residual);
    Fingerprint {
        present: named(&|w| w.p_value < PRESENT),
        absent: named(&|w| w.p_value > ABSENT),
        odd: energies.odd,
        repeated: energies.repeated,
        nearest: nearest(context, readings, first, excess),
    }
}

/// The effect that explains most, and what stands against it.
fn nearest(
    context: &Context<'_>,
    readings: &DVector<f64>,
    first: &Remainder,
    excess: f64,
) -> Option<Nearest> {
    let whole = first.residual.norm_squared();
    let alone = context.beside(context.model, readings, &[]);
    let explained: Vec<(f64, Vec<Cause>)> = (0..context.catalogue.len())
        .into_par_iter()
        .filter_map(|effect| {
            let start = context.start(first, effect)?;
            let cause = vec![alone.refine(effect, (start, Reach::WIDE)).0];
            let explained = whole - context.misfit(readings, &cause);
            Some((explained, cause))
        })
        .collect();
    let best = explained.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let (explained, cause) = best?;
    let beside = context.remainder(readings, &cause);
    // The place that stands out most beside it says why it is not the cause.
    let against = (0..context.dictionary.families.len())
        .filter(|k| !context.dictionary.families[*k].is_effect)
        .filter_map(|k| {
            let (surprise, entry) = context.best(&beside, k);
            Some((context.null.family(k, surprise), entry?))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .and_then(|(p, entry)| place_of(context, &beside, entry, excess, p));
    Some(Nearest {
        effect: context.catalogue[cause[0].effect].name().to_owned(),
        cosine: (explained / excess).clamp(0.0, 1.0).sqrt(),
        p_value: context.global(&beside),
        against,
    })
}

/// How the gap behaves when the direction turns and when the trace is repeated.
struct Energies {
    odd: Option<f64>,
    repeated: Option<f64>,
}

impl Energies {
    /// Shares of the whitened residual's square beyond its noise. Noise gives every mean of r
    /// readings the variance 1/r.
    fn of(context: &Context<'_>, residual: &DVector<f64>) -> Self {
        let mut cells: BTreeMap<usize, [Vec<f64>; 2]> = BTreeMap::new();
        for (place, e) in context.model.places().iter().zip(residual.iter()) {
            let side = usize::from(place.direction < 0.0);
            cells.entry(place.cell).or_default()[side].push(*e);
        }
        let kept =
            context.space.degrees_of_freedom() as f64 / context.space.readings().max(1) as f64;
        let (mut odd, mut even, mut steady, mut changing) = (0.0, 0.0, 0.0, 0.0);
        let (mut turned, mut repeats) = (false, false);
        for sides in cells.values() {
            let mean = |v: &Vec<f64>| v.iter().sum::<f64>() / v.len() as f64;
            if let [forward, backward] = sides
                && !forward.is_empty()
                && !backward.is_empty()
            {
                turned = true;
                let noise = 0.25 * (1.0 / forward.len() as f64 + 1.0 / backward.len() as f64);
                odd += (0.5 * (mean(forward) - mean(backward))).powi(2) - kept * noise;
                even += (0.5 * (mean(forward) + mean(backward))).powi(2) - kept * noise;
            }
            for side in sides.iter().filter(|s| s.len() > 1) {
                repeats = true;
                let n = side.len() as f64;
                let level = mean(side);
                steady += n * level * level - kept;
                changing +=
                    side.iter().map(|e| (e - level).powi(2)).sum::<f64>() - kept * (n - 1.0);
            }
        }
        let part = |a: f64, b: f64, known: bool| {
            let sum = a.max(0.0) + b.max(0.0);
            (known && sum > 0.0).then(|| a.max(0.0) / sum)
        };
        Self {
            odd: part(odd, even, turned),
            repeated: part(steady, changing, repeats),
        }
    }
}
