//! The forecast: values by the fit, their spread by drawing.
//!
//! With fitted values H y, H the projection onto what the model can be, causes f(a, s) of sizes a and shapes s
//! whose errors are δ = G ν, and a matrix C that carries values to the planned readings (`carried.rs`), the
//! forecast is C H (y − f) + f′ and misses by ν′ − C H (ν − D δ) − D′ δ: D and D′ are the derivatives of the
//! causes' changes by δ here and there, ν and ν′ the noise of both measurements. From that the least-squares
//! fit of what a new set-up changes is taken out. Laws of the noise are drawn from those that the repeats allow.

use errsep_models::model::{AnyModel, Effect, Estimate, FittedModel, Shape};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use crate::attribution::context::{Cause, Context};
use crate::attribution::shrink::GapMeter;
use crate::attribution::sizes::{Sizes, Unknown, first_amplitude};
use crate::detection::space::Space;
use crate::joined::{NotJoined, in_the_fit};
use crate::noise::law::{NoiseLaw, NoiseSource, draw_all};
use crate::options::Options;
use crate::sealing::ahead::{derivatives, held, placed, reported};
use crate::sealing::carried::{Anew, Carried};
use crate::sealing::sealed::{
    Interval, Sealed, SealedEffect, SealedGap, SealedNumber, SealedTrace,
};

/// Draws behind every spread, and those that are projected at once.
const DRAWS: usize = 600;
const BATCH: usize = 50;
/// Draws behind a null law that nothing here asks for.
pub(super) const NULL_DRAWS: usize = 50;

/// Why nothing can be sealed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NotSealed {
    /// The model does not say what a new set-up changes.
    #[error("of a {0} it is not known what stays the same in a further measurement")]
    NotCarried(&'static str),
    /// The plan has a channel without readings.
    #[error("the plan has the channel `{0}`, which this measurement has not")]
    NoChannel(String),
    /// The plan goes further than the measurement.
    #[error(
        "the plan reads {channel} at {x}, and this measurement knows it from {} to {} only",
        range[0], range[1]
    )]
    Beyond {
        /// The channel.
        channel: String,
        /// The position that is planned.
        x: f64,
        /// First and last position that were read.
        range: [f64; 2],
    },
    /// The causes cannot join the fit.
    #[error(transparent)]
    NotJoined(#[from] NotJoined),
    /// A cause does at each reading what came before makes of it.
    #[error(
        "`{0}` does something else in every trace, and what it will do in a further measurement is not known"
    )]
    DoneAnew(String),
    /// Sizes are known only together.
    #[error("the planned readings do not determine the sizes of the causes")]
    Undetermined,
}

/// `sealed` of a model of any kind.
pub(crate) fn sealed(
    model: &AnyModel,
    plan: &AnyModel,
    catalogue: Vec<Box<dyn Effect<AnyModel>>>,
    names: &[String],
    options: &Options,
) -> Result<Sealed, NotSealed> {
    in_the_fit(
        model,
        catalogue,
        names,
        options,
        |context, readings, causes, _| forecast(context, readings, causes, plan, options),
    )?
}

/// The causes of the measurement: amplitudes, errors and what they change.
struct Known {
    amplitudes: DVector<f64>,
    unknowns: Vec<Unknown>,
    covariance: DMatrix<f64>,
    /// How whitened, projected noise moves the unknowns.
    gain: DMatrix<f64>,
    /// The rest of their covariance, as a root.
    rest: DMatrix<f64>,
    change: DVector<f64>,
    /// Readings × unknowns.
    derivatives: DMatrix<f64>,
}

impl Known {
    fn new(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> Option<Self> {
        let n = readings.len();
        if causes.is_empty() {
            return Some(Self {
                amplitudes: DVector::zeros(0),
                unknowns: Vec::new(),
                covariance: DMatrix::zeros(0, 0),
                gain: DMatrix::zeros(0, n),
                rest: DMatrix::zeros(0, 0),
                change: DVector::zeros(n),
                derivatives: DMatrix::zeros(n, 0),
            });
        }
        let sizes = Sizes::told(context, readings, causes)?;
        let rest = &sizes.covariance - &sizes.gain * sizes.gain.transpose();
        let mut eigen = SymmetricEigen::new(0.5 * (&rest + rest.transpose()));
        eigen.eigenvalues.apply(|v| *v = v.max(0.0).sqrt());
        let root = &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues);
        Some(Self {
            change: context.change(causes, &sizes.amplitudes),
            derivatives: derivatives(context, causes, &sizes.amplitudes, &sizes.parameters),
            amplitudes: sizes.amplitudes,
            unknowns: sizes.parameters,
            covariance: sizes.covariance,
            gain: sizes.gain,
            rest: root,
        })
    }
}

fn forecast(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    plan: &AnyModel,
    options: &Options,
) -> Result<Sealed, NotSealed> {
    let model = context.model;
    if let Some(cause) = causes.iter().find(|cause| cause.choices > 0) {
        let name = context.catalogue[cause.effect].name();
        return Err(NotSealed::DoneAnew(name.to_owned()));
    }
    let anew = plan.set_anew().ok_or(NotSealed::NotCarried(model.name()))?;
    let carried = Carried::new(model, plan)?;
    let known = Known::new(context, readings, causes).ok_or(NotSealed::Undetermined)?;
    let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
    let flat = Space::new(model, &unit);
    let clean = readings - &known.change;
    let fitted = &clean - flat.forward_vector(&clean);
    let smooth = model.smooth().unwrap_or_else(|| fitted.clone());
    let state = plan.refit(carried.vector(&smooth));
    let ahead = Context::new(
        &state,
        context.catalogue,
        context.law.clone(),
        NULL_DRAWS,
        options.seed,
    );
    let there = There::new(context, causes, &known, &ahead);
    let expected = carried.vector(&fitted);
    let spread = Spread::drawn(
        (context, &flat, &known),
        (&ahead, &there),
        (&carried, &Anew::new(&anew)),
        &expected,
        options.seed,
    );
    Ok(Sealed {
        unit: model.reading_unit().to_owned(),
        noise: context.law.parts,
        gap: spread.gap,
        effect: there.told((context, causes, &known), &ahead, &expected)?,
        quantity: spread.quantities,
        trace: SealedTrace::all(&state, &expected, &there.change, &spread.stds),
    })
}

/// The causes at the plan.
struct There {
    shapes: Vec<(usize, Shape)>,
    amplitudes: DVector<f64>,
    /// By unknown: how its errors there go with those here, where sizes are told relative to the state.
    scales: Vec<f64>,
    change: DVector<f64>,
    derivatives: DMatrix<f64>,
}

impl There {
    fn new(context: &Context<'_>, causes: &[Cause], known: &Known, ahead: &Context<'_>) -> Self {
        let mut shapes = Vec::with_capacity(causes.len());
        let mut amplitudes = known.amplitudes.clone();
        for (which, cause) in causes.iter().enumerate() {
            let first = first_amplitude(causes, which);
            let own = &known.amplitudes.as_slice()[first..first + cause.columns.len()];
            let effect = &context.catalogue[cause.effect];
            let (shape, moved) = effect.carried(context.model, ahead.model, &cause.shape, own);
            amplitudes.as_mut_slice()[first..first + own.len()].copy_from_slice(&moved);
            shapes.push((cause.effect, shape));
        }
        let ratio = |before: f64, after: f64| if before == 0.0 { 1.0 } else { after / before };
        let scale = |unknown: &Unknown| match *unknown {
            Unknown::Amplitude(which, k) => {
                let at = first_amplitude(causes, which) + k;
                ratio(known.amplitudes[at], amplitudes[at])
            }
            Unknown::Shape(which, j) => {
                ratio(causes[which].shape.values[j], shapes[which].1.values[j])
            }
        };
        let scales = known.unknowns.iter().map(scale).collect();
        let (placed, changes) = placed(ahead, &shapes, &amplitudes);
        Self {
            change: changes.column_sum(),
            derivatives: derivatives(ahead, &placed, &amplitudes, &known.unknowns),
            shapes,
            scales,
            amplitudes,
        }
    }

    /// The causes as they are sealed.
    fn told(
        &self,
        (context, causes, known): (&Context<'_>, &[Cause], &Known),
        ahead: &Context<'_>,
        expected: &DVector<f64>,
    ) -> Result<Vec<SealedEffect>, NotSealed> {
        if causes.is_empty() {
            return Ok(Vec::new());
        }
        let shapes: Vec<(usize, Shape)> = self
            .shapes
            .iter()
            .map(|(effect, shape)| (*effect, held(shape)))
            .collect();
        let (placed, _) = placed(ahead, &shapes, &self.amplitudes);
        let with = expected + &self.change;
        let sizes = Sizes::told(ahead, &with, &placed).ok_or(NotSealed::Undetermined)?;
        // What another shape makes of the sizes that are found with the sealed one.
        let moved =
            &self.derivatives * DMatrix::from_diagonal(&DVector::from_vec(self.scales.clone()));
        let response = &sizes.gain * ahead.space.forward(moved).0;
        let found = &response * &known.covariance * response.transpose() + &sizes.covariance;
        let scales = DMatrix::from_diagonal(&DVector::from_vec(self.scales.clone()));
        let own = &scales * &known.covariance * &scales;
        let of = |which: usize| {
            let (effect, shape) = &self.shapes[which];
            let first = first_amplitude(causes, which);
            let count = causes[which].columns.len();
            let amplitudes = &self.amplitudes.as_slice()[first..first + count];
            let effect = context.catalogue[*effect].as_ref();
            let told = |unknowns: &[Unknown], covariance: &DMatrix<f64>| {
                reported(effect, (which, shape), amplitudes, unknowns, covariance)
            };
            let known_to = told(&known.unknowns, &own);
            let found = told(&sizes.parameters, &found);
            let alone = told(&sizes.parameters, &sizes.covariance);
            let numbers = known_to.into_iter().zip(alone).zip(found);
            let number = |((own, alone), found): ((Estimate, Estimate), Estimate)| {
                let stds = [own.std, alone.std, found.std];
                let told = stds.iter().all(|std| usable(*std));
                told.then(|| SealedNumber::new(own.name, own.unit, own.value, stds))
            };
            SealedEffect {
                name: effect.name().to_owned(),
                variant: effect.variant_name(ahead.model, shape),
                variant_number: shape.variant,
                shape: shape.values.clone(),
                amplitudes: amplitudes.to_vec(),
                parameter: numbers.filter_map(number).collect(),
            }
        };
        Ok((0..causes.len()).map(of).collect())
    }
}

/// Whether a standard deviation is one.
pub(super) fn usable(std: f64) -> bool {
    std > 0.0 && std.is_finite()
}

/// What chance makes of the forecast.
struct Spread {
    /// Of every planned reading.
    stds: DVector<f64>,
    quantities: Vec<SealedNumber>,
    gap: SealedGap,
}

impl Spread {
    fn drawn(
        (context, flat, known): (&Context<'_>, &Space, &Known),
        (ahead, there): (&Context<'_>, &There),
        (carried, anew): (&Carried, &Anew),
        expected: &DVector<f64>,
        seed: u64,
    ) -> Self {
        let meter = GapMeter::new(ahead.model, &ahead.law, seed);
        let quantities: Vec<_> = (ahead.model.quantities().into_iter())
            .filter(|q| anew.spares(&q.weights))
            .collect();
        let weights = match &quantities[..] {
            [] => DMatrix::zeros(expected.len(), 0),
            some => {
                DMatrix::from_columns(&some.iter().map(|q| q.weights.clone()).collect::<Vec<_>>())
            }
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7365_616c);
        let mut squares = DVector::zeros(expected.len());
        let mut of_weights = vec![[0.0; 2]; quantities.len()];
        let (mut without, mut with) = (Vec::with_capacity(DRAWS), Vec::with_capacity(DRAWS));
        for batch in 0..DRAWS / BATCH {
            let (off, missed) = drawn(
                (context, flat, known),
                (ahead, there),
                carried,
                batch,
                &mut random,
            );
            for column in missed.column_iter() {
                let seen = expected + column;
                with.push(meter.square(&seen, 0).0);
                without.push(meter.square(&(seen + &there.change), 0).0);
            }
            for (k, sums) in of_weights.iter_mut().enumerate() {
                let weights = weights.column(k);
                sums[0] += off.tr_mul(&weights).norm_squared();
                sums[1] += missed.tr_mul(&weights).norm_squared();
            }
            for column in anew.taken_out(missed).column_iter() {
                squares += column.component_mul(&column);
            }
        }
        let std = |sum: f64| (sum / DRAWS as f64).sqrt();
        let told = quantities
            .into_iter()
            .zip(of_weights)
            .map(|(q, [own, found])| {
                let value = q.weights.dot(expected);
                SealedNumber::new(
                    q.name,
                    q.unit.to_owned(),
                    value,
                    [std(own), 0.0, std(found)],
                )
            });
        Self {
            stds: squares.map(std),
            quantities: told.collect(),
            gap: SealedGap {
                without: Interval::of(&without),
                with: Interval::of(&with),
            },
        }
    }
}

/// What the forecast is off by and what the further measurement misses it by, planned readings × draws.
fn drawn(
    (context, flat, known): (&Context<'_>, &Space, &Known),
    (ahead, there): (&Context<'_>, &There),
    carried: &Carried,
    batch: usize,
    random: &mut ChaCha8Rng,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut noise = DMatrix::zeros(context.space.readings(), BATCH);
    let mut missed = DMatrix::zeros(ahead.space.readings(), BATCH);
    for j in 0..BATCH {
        let law = context.law.possible(batch * BATCH + j, random);
        noise.set_column(j, &draw_all(&law, context.model, random));
        missed.set_column(j, &draw_all(&law, ahead.model, random));
    }
    let mut errors = &known.gain * context.space.forward(noise.clone()).0;
    errors += &known.rest
        * DMatrix::from_fn(known.rest.ncols(), BATCH, |_, _| {
            StandardNormal.sample(random)
        });
    noise -= &known.derivatives * &errors;
    for (mut row, scale) in errors.row_iter_mut().zip(&there.scales) {
        row *= *scale;
    }
    let off =
        carried.columns(&(&noise - flat.forward(noise.clone()).0)) + &there.derivatives * errors;
    missed -= &off;
    (off, missed)
}
