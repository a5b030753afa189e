//! A measurement against what was sealed before it was made.

use errsep_models::model::{AnyModel, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};

use crate::attribution::context::{Cause, Context};
use crate::attribution::shrink::GapMeter;
use crate::attribution::sizes::Sizes;
use crate::noise::law::NoiseLaw;
use crate::options::Options;
use crate::sealing::ahead::{AT_REST, SETTLED, fitted, held, placed, reported};
use crate::sealing::carried::{Anew, between};
use crate::sealing::forecast::{NULL_DRAWS, usable};
use crate::sealing::score::{
    Checked, CheckedEffect, CheckedGap, CheckedNumber, CheckedTrace, Standing,
};
use crate::sealing::sealed::{REACH, Sealed, SealedEffect, SealedNumber, SealedTrace};

/// *Limit.* Standard deviations beyond which a number disagrees, or differs from zero: 1 %, two-sided.
const FAR: f64 = 2.575_829;
/// *Limit.* A size that the measurement itself tells to less than so many standard deviations is not tested.
const TOLD: f64 = 3.0;

/// `checked` of a model of any kind.
pub(crate) fn checked(
    model: &AnyModel,
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
    sealed: &Sealed,
    options: &Options,
) -> Option<Checked> {
    let mut catalogue: Vec<Option<_>> = catalogue.into_iter().map(Some).collect();
    let mut take = |name: &str| {
        let own = |e: &&mut Option<Box<dyn Effect<AnyModel>>>| {
            e.as_ref().is_some_and(|e| e.name() == name)
        };
        catalogue.iter_mut().find(own).and_then(Option::take)
    };
    let chosen: Option<Vec<Box<dyn Effect<AnyModel>>>> =
        sealed.effect.iter().map(|e| take(&e.name)).collect();
    let chosen = chosen?;
    let law = NoiseLaw::stated(sealed.noise);
    let readings = model.linearised();
    let matched = Matched::new(model, sealed, &readings);
    let context = Context::new(model, &chosen, law.clone(), NULL_DRAWS, options.seed);
    let planned = model.refit(matched.expected.clone());
    let (state, carried, change) = set_up(&context, sealed, &planned);
    let context = context.moved(&state, law.clone());
    let (causes, _) = changes(&context, &carried);
    let missed = matched.missed(model, &(&readings - &change))?;
    let meter = GapMeter::new(model, &law, options.seed);
    let clean = &readings - &change;
    let nothing = meter.square(&DVector::zeros(readings.len()), 0).0;
    // Where the causes change more here than they were to, what is not known of their sizes counts more too.
    let doubt = doubt_of(sealed);
    let moved = &change - &matched.causes;
    let quantities = sealed.quantity.iter().filter_map(|number| {
        let own = state
            .quantities()
            .into_iter()
            .find(|q| q.name == number.name)?;
        let added = doubt * own.weights.dot(&moved);
        let stds = [number.std, number.next_std, number.found_std.hypot(added)];
        let there = SealedNumber::new(number.name.clone(), number.unit.clone(), number.value, stds);
        Some(CheckedNumber::new(&there, own.weights.dot(&clean), None))
    });
    Some(Checked {
        unit: model.reading_unit(),
        trace: matched.told(model, sealed, &missed),
        quantities: quantities.collect(),
        without: CheckedGap::without(
            &sealed.gap.without,
            meter.square(&readings, 0).0,
            [&matched.causes, &change].map(|v| meter.square(v, 0).0 - nothing),
            doubt,
        ),
        with: CheckedGap::new(&sealed.gap.with, meter.square(&clean, 0).0),
        effects: effects(&context, &readings, causes, &sealed.effect, &carried),
        missed,
    })
}

/// Shapes and amplitudes of the causes, carried over.
type Carried = Vec<(Shape, Vec<f64>)>;

/// The state without the causes as they were sealed, their shapes and amplitudes there, and what they change.
fn set_up(
    context: &Context<'_>,
    sealed: &Sealed,
    planned: &AnyModel,
) -> (AnyModel, Carried, DVector<f64>) {
    let model = context.model;
    let mut change = DVector::zeros(model.places().len());
    let mut state = model.clone();
    let mut carried = Vec::new();
    for _ in 0..SETTLED {
        state = model.refit(model.observed() - &change);
        let own = |(k, e): (usize, &SealedEffect)| {
            carried_to(context.catalogue[k].as_ref(), e, (planned, &state))
        };
        carried = sealed
            .effect
            .iter()
            .enumerate()
            .map(own)
            .collect::<Vec<_>>();
        let next = changes(&context.moved(&state, context.law.clone()), &carried)
            .1
            .column_sum();
        let moved = (&next - &change).norm();
        change = next;
        if moved <= AT_REST * change.norm() {
            break;
        }
    }
    (state, carried, change)
}

/// The greatest relative uncertainty of a sealed size.
fn doubt_of(sealed: &Sealed) -> f64 {
    let sizes = sealed.effect.iter().flat_map(|e| &e.parameter);
    let known = sizes.filter(|n| n.value != 0.0);
    known
        .map(|n| (n.std / n.value).abs().min(1.0))
        .fold(0.0, f64::max)
}

fn carried_to(
    effect: &dyn Effect<AnyModel>,
    sealed: &SealedEffect,
    (from, to): (&AnyModel, &AnyModel),
) -> (Shape, Vec<f64>) {
    let shape = Shape {
        variant: sealed.variant_number,
        values: sealed.shape.clone(),
        steps: vec![0.0; sealed.shape.len()],
    };
    let (shape, amplitudes) = effect.carried(from, to, &shape, &sealed.amplitudes);
    (held(&shape), amplitudes)
}

fn changes(context: &Context<'_>, carried: &[(Shape, Vec<f64>)]) -> (Vec<Cause>, DMatrix<f64>) {
    let shapes: Vec<(usize, Shape)> = carried
        .iter()
        .enumerate()
        .map(|(k, (shape, _))| (k, shape.clone()))
        .collect();
    let amplitudes: Vec<f64> = carried.iter().flat_map(|(_, own)| own).copied().collect();
    placed(context, &shapes, &DVector::from_vec(amplitudes))
}

fn effects(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: Vec<Cause>,
    sealed: &[SealedEffect],
    carried: &[(Shape, Vec<f64>)],
) -> Vec<CheckedEffect> {
    let found = (!causes.is_empty())
        .then(|| {
            let causes = fitted(context, readings, causes)?;
            let sizes = Sizes::told(context, readings, &causes)?;
            Some((causes, sizes))
        })
        .flatten();
    let of = |(which, sealed): (usize, &SealedEffect)| {
        let effect = context.catalogue[which].as_ref();
        let (shape, amplitudes) = &carried[which];
        let nothing = DMatrix::zeros(0, 0);
        let expected = reported(effect, (which, shape), amplitudes, &[], &nothing);
        let own = found
            .as_ref()
            .map(|(causes, sizes)| sizes.of(context, causes, which));
        let number = |number: &SealedNumber| {
            let own = own.as_ref()?.iter().find(|e| e.name == number.name)?;
            let here = expected.iter().find(|e| e.name == number.name)?.value;
            // Sizes that are told relative to the state are so at this one.
            let grown = if number.value == 0.0 {
                1.0
            } else {
                here / number.value
            };
            // What was carried over keeps its uncertainty; the measurement's own is as it was made.
            let carried = (number.found_std.powi(2) - number.next_std.powi(2))
                .max(0.0)
                .sqrt();
            let stds = [
                number.std * grown.abs(),
                own.std,
                own.std.hypot(carried * grown.abs()),
            ];
            let there = SealedNumber::new(number.name.clone(), number.unit.clone(), here, stds);
            usable(own.std).then(|| CheckedNumber::new(&there, own.value, Some(own.std)))
        };
        let numbers: Vec<CheckedNumber> = sealed.parameter.iter().filter_map(number).collect();
        CheckedEffect {
            effect: sealed.name.clone(),
            variant: sealed.variant.clone(),
            standing: standing(&numbers),
            numbers,
        }
    };
    sealed.iter().enumerate().map(of).collect()
}

fn standing(numbers: &[CheckedNumber]) -> Standing {
    let ratio =
        |value: f64, number: &CheckedNumber| value.abs() / number.std.unwrap_or(f64::INFINITY);
    let told = |n: &&CheckedNumber| ratio(n.sealed, n) >= TOLD;
    if !numbers.iter().any(|n| told(&n)) {
        return Standing::Untested;
    }
    let agree = numbers.iter().all(|n| n.z.abs() <= FAR);
    let there = numbers.iter().filter(told).any(|n| ratio(n.found, n) > FAR);
    match (agree, there) {
        (true, true) => Standing::Stands,
        (_, false) => Standing::Gone,
        (false, true) => Standing::Changed,
    }
}

/// The readings of a measurement beside the planned ones.
struct Matched {
    /// What was to be read without the causes; where nothing was planned, what was read.
    expected: DVector<f64>,
    /// What the causes were to change.
    causes: DVector<f64>,
    /// Half the band of each reading, where it was planned.
    bands: Vec<Option<f64>>,
}

impl Matched {
    fn new(model: &AnyModel, sealed: &Sealed, readings: &DVector<f64>) -> Self {
        let names = model.channel_names();
        let sorted = |trace: &SealedTrace| {
            let mut nodes: Vec<(f64, usize)> =
                trace.x.iter().enumerate().map(|(k, x)| (*x, k)).collect();
            nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
            nodes
        };
        let nodes: Vec<Vec<(f64, usize)>> = sealed.trace.iter().map(sorted).collect();
        let mut expected = readings.clone();
        let mut causes = DVector::zeros(readings.len());
        let mut bands = vec![None; readings.len()];
        for range in model.traces() {
            let Some(first) = model.places().get(range.start) else {
                continue;
            };
            let own = sealed.trace.iter().position(|t| {
                names.get(first.channel) == Some(&t.channel)
                    && t.repeat == first.repeat
                    && t.direction * first.direction > 0.0
            });
            let Some(own) = own else { continue };
            let trace = &sealed.trace[own];
            for row in range.clone() {
                let Some(sum) = between(&nodes[own], model.places()[row].x) else {
                    continue;
                };
                let at = |values: &[f64]| -> f64 { sum.iter().map(|(k, w)| w * values[*k]).sum() };
                causes[row] = at(&trace.causes);
                expected[row] = at(&trace.expected) - causes[row];
                bands[row] = Some(at(&trace.band));
            }
        }
        Self {
            expected,
            causes,
            bands,
        }
    }

    /// What readings without the causes differ by, with half their bands; nothing where none was planned.
    fn missed(&self, model: &AnyModel, clean: &DVector<f64>) -> Option<Vec<Option<(f64, f64)>>> {
        let rows: Vec<usize> = (0..self.bands.len())
            .filter(|k| self.bands[*k].is_some())
            .collect();
        if rows.is_empty() {
            return None;
        }
        let anew = Anew::new(&model.set_anew()?.select_rows(&rows));
        let differences = DMatrix::from_fn(rows.len(), 1, |k, _| {
            clean[rows[k]] - self.expected[rows[k]]
        });
        let left = anew.taken_out(differences);
        let mut missed = vec![None; self.bands.len()];
        for (k, row) in rows.iter().enumerate() {
            missed[*row] = self.bands[*row].map(|band| (left[(k, 0)], band));
        }
        Some(missed)
    }

    fn told(
        &self,
        model: &AnyModel,
        sealed: &Sealed,
        missed: &[Option<(f64, f64)>],
    ) -> CheckedTrace {
        let inside = |(miss, band): (f64, f64)| miss.abs() <= band;
        let part = |of: &dyn Fn(usize) -> bool| {
            let own = missed
                .iter()
                .enumerate()
                .filter(|(k, _)| of(*k))
                .filter_map(|(_, m)| *m);
            let count = own.clone().count();
            (count > 0).then(|| own.filter(|m| inside(*m)).count() as f64 / count as f64)
        };
        let compared = missed.iter().flatten();
        let count = compared.clone().count();
        let square =
            |(miss, band): &(f64, f64)| (REACH * miss / band.max(f64::MIN_POSITIVE)).powi(2);
        let planned: usize = sealed.trace.iter().map(|t| t.x.len()).sum();
        let by_channel = model.channel_names().into_iter().enumerate();
        let by_channel = by_channel
            .filter_map(|(c, name)| Some((name, part(&|k| model.places()[k].channel == c)?)));
        CheckedTrace {
            readings: count,
            coverage: part(&|_| true).unwrap_or(0.0),
            expected: 0.95,
            mean_square: compared.map(square).sum::<f64>() / count.max(1) as f64,
            by_channel: by_channel.collect(),
            not_planned: missed.len() - count,
            missing: planned.saturating_sub(count),
        }
    }
}
