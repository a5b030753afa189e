//! What could hide in these readings.

use errsep_models::model::{AnyModel, Effect, FittedModel, Quantity};

use crate::attribution::bias::weighted_std;
use crate::attribution::context::Context;
use crate::detection::smallest::{SizesByShape, smallest, typical};
use crate::levels::INVISIBLE;
use crate::options::Options;
use crate::planning::certificate::greatest_plausible;
use crate::verdict::types::{Harm, Hidden};

/// Harms whose ratio is below this are equal.
const EQUAL: f64 = 1.0 + 1e-6;

/// What these readings would not have shown, for every effect that is not named.
pub(crate) fn hidden(context: &Context<'_>, named: &[String], options: &Options) -> Vec<Hidden> {
    let quantities: Vec<(Quantity, f64)> = context
        .model
        .quantities()
        .into_iter()
        .map(|q| {
            let std = weighted_std(context.model, &context.law, &q.weights);
            (q, std)
        })
        .collect();
    let level = context.null.level(options.false_alarm);
    let mut list = Vec::new();
    for (effect, description) in context.catalogue.iter().enumerate() {
        if named.iter().any(|n| n == description.name()) {
            continue;
        }
        let Some(family) = context.family_of(effect) else {
            continue;
        };
        let own = &context.dictionary.families[family];
        let visible = own.visible;
        let most = greatest_plausible(description.as_ref());
        let entry = typical(&context.dictionary, own).filter(|_| visible >= INVISIBLE);
        let smallest = entry.and_then(|entry| {
            let signature = context.dictionary.columns(entry).into_iter().next()?;
            let threshold = context.null.threshold(family, level, entry.order());
            let noise = (context.model, &context.law);
            Some(smallest(
                noise,
                (entry.gram[(0, 0)].sqrt(), &signature),
                threshold,
            ))
        });
        let smallest = smallest.filter(|smallest| smallest.size <= most);
        let by_shape = smallest.and_then(|_| {
            let threshold = |order| context.null.threshold(family, level, order);
            SizesByShape::new(&context.dictionary, own, threshold, most)
        });
        list.push(Hidden {
            effect: description.name().to_owned(),
            visible,
            detectable: smallest.map(|s| s.size),
            by_shape,
            at_least: smallest.is_some_and(|s| s.at_least),
            unit: description
                .amplitudes()
                .first()
                .map_or(String::new(), |p| p.unit.to_owned()),
            harm: harm(context, description.as_ref(), &quantities),
        });
    }
    list.sort_by(|a, b| a.visible.total_cmp(&b.visible));
    list
}

/// How an effect moves the quantity that it harms most, measured in the standard uncertainties that stand beside the
/// quantities.
fn harm(
    context: &Context<'_>,
    effect: &dyn Effect<AnyModel>,
    quantities: &[(Quantity, f64)],
) -> Option<Harm> {
    let shape = effect.grid(context.model).into_iter().next()?;
    let column = effect.columns(context.model, &shape).into_iter().next()?;
    let column = column.dense(context.space.readings());
    let moved = quantities.iter().map(|(quantity, std)| {
        let bias = quantity.weights.dot(&column);
        (quantity, bias, bias.abs() / *std)
    });
    // Of equal harms that to the quantity named first.
    let most = moved.reduce(|most, next| if next.2 > EQUAL * most.2 { next } else { most });
    most.map(|(quantity, per_unit, _)| Harm {
        quantity: quantity.name.clone(),
        per_unit,
        unit: quantity.unit.to_owned(),
    })
}
