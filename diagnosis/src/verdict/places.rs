//! Where the gap lies.

use errsep_models::model::FittedModel;
use nalgebra::DMatrix;

use crate::attribution::context::Context;
use crate::attribution::remainder::Remainder;
use crate::detection::dictionary::{Entry, Meaning, statistic};
use crate::levels::{EVERYWHERE, PLACE, chi_squared_of_two};
use crate::verdict::types::Where;

/// The strongest place on every axis, and the channels' shares.
pub(crate) fn places(context: &Context<'_>, first: &Remainder, excess: f64) -> Vec<Where> {
    let mut places: Vec<Where> = context
        .dictionary
        .families
        .iter()
        .enumerate()
        .filter(|(_, family)| !family.is_effect)
        .filter_map(|(k, _)| {
            let (surprise, entry) = context.best(first, k);
            let p = context.null.family(k, surprise);
            (p <= PLACE).then(|| place_of(context, first, entry?, excess, p))?
        })
        .collect();
    let channels = channel_shares(context, first, excess);
    places.extend(channels.into_iter().filter(|w| w.p_value < PLACE));
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(6);
    places
}

/// An entry of the dictionary as a place, with the part of the gap that it explains. Where the same
/// pattern explains as much nearly everywhere, the place is the pattern alone.
pub(crate) fn place_of(
    context: &Context<'_>,
    remainder: &Remainder,
    entry: usize,
    excess: f64,
    p_value: f64,
) -> Option<Where> {
    let dictionary = &context.dictionary;
    let Meaning::Place(item) = &dictionary.entries[entry].meaning else {
        return None;
    };
    let residual = &remainder.residual;
    let whole = DMatrix::from_column_slice(residual.len(), 1, residual.as_slice());
    let adjoint = context.space.adjoint(whole).column(0).clone_owned();
    let sums = dictionary.places.sums_of(&adjoint);
    let explained = |entry: &Entry| statistic(&entry.gram, &entry.score(&sums), false);
    let t = explained(&dictionary.entries[entry]);
    let alike = dictionary
        .families
        .iter()
        .find(|family| family.entries.contains(&entry))
        .map_or(&[][..], |family| {
            &dictionary.entries[family.entries.clone()]
        })
        .iter()
        .filter_map(|other| match &other.meaning {
            Meaning::Place(place) if place.axis == item.axis && place.value == item.value => {
                Some((place.from?, place.to?, other))
            }
            _ => None,
        });
    let (mut tried, mut likely) = (Reach::default(), Reach::default());
    for (from, to, other) in alike {
        tried.take(from, to);
        if explained(other) > t - chi_squared_of_two(0.95) {
            likely.take(from, to);
        }
    }
    let reach = 1.96 * 2.0 * t.sqrt() / excess;
    let share = (t / excess).clamp(0.0, 1.0);
    let interval = [(share - reach).max(0.0), (share + reach).min(1.0)];
    let mut place = Where::new(context.model, item, share, interval, p_value);
    if likely.length() > EVERYWHERE * tried.length() {
        (place.from, place.to, place.unit) = (None, None, None);
    }
    // A wavelength that is not known is no place.
    (item.axis != "wavelength" || place.from.is_some()).then_some(place)
}

/// From the least to the greatest.
struct Reach(f64, f64);

impl Default for Reach {
    fn default() -> Self {
        Self(f64::INFINITY, f64::NEG_INFINITY)
    }
}

impl Reach {
    fn take(&mut self, from: f64, to: f64) {
        self.0 = self.0.min(from.min(to));
        self.1 = self.1.max(from.max(to));
    }

    fn length(&self) -> f64 {
        (self.1 - self.0).max(0.0)
    }
}

/// The part of the gap in each channel.
pub(crate) fn channel_shares(context: &Context<'_>, first: &Remainder, excess: f64) -> Vec<Where> {
    let names = context.model.channel_names();
    let count = names.len();
    if count < 2 {
        return Vec::new();
    }
    let mut sums = vec![(0.0, 0.0); count];
    for (place, e) in context.model.places().iter().zip(first.residual.iter()) {
        sums[place.channel].0 += e * e;
        sums[place.channel].1 += 1.0;
    }
    let kept = context.space.degrees_of_freedom() as f64 / context.space.readings() as f64;
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
                unit: None,
                share,
                share_ci95: [(share - reach).max(0.0), (share + reach).min(1.0)],
                p_value: p,
            })
        })
        .collect()
}
