//! How far the answers move when the causes are taken out of the readings.
//!
//! With w the weights of a quantity, Σ the covariance of the readings and c the causes' change, the
//! quantity is wᵀy before and wᵀ(y − c) after. To first order c moves by D δ with errors δ of the
//! causes' amplitudes and shapes, and those are G ν̃ in noise ν̃ that is white, so that with
//! g = Dᵀw and w̃ = W Σ w (W the whitening) the variances are |w̃|² before, gᵀCg of the move and
//! |w̃|² + gᵀCg − 2 w̃ᵀGᵀg after, C the covariance of amplitudes and shapes.
//!
//! Where signatures are taken at the fitted state, c also moves with the noise of that state
//! whatever the amplitudes: a change m of the readings in each draw of the state. The move's error
//! is then gᵀδ + wᵀm, and what wᵀm adds to the variances is taken from the draws.

use errsep_models::model::{AnyModel, FittedModel, Profile, Quantity};
use errsep_models::noise::about_middle;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context, raw_signatures};
use crate::attribution::reported::Bias;
use crate::attribution::sizes::{Sizes, Unknown, beside, first_amplitude};
use crate::noise::law::NoiseLaw;

/// A quantity that moves by less than this part of its uncertainty does not move: that is rounding.
const ROUNDING: f64 = 1e-9;

/// Draws of the state behind the uncertainty of a profile's move.
const STATES: usize = 32;

/// A profile's name, its values without and its values with the effects.
type MovedProfile = (String, Vec<f64>, Vec<f64>);

/// How the quantities move when the causes are taken out of readings, and the profiles with them.
pub(crate) fn biases(
    context: &Context<'_>,
    observed: &DVector<f64>,
    causes: &[Cause],
) -> (Vec<Bias>, Vec<MovedProfile>) {
    let taken = Taken::out_of(context, observed, causes);
    let corrected = match &taken {
        Some(taken) => observed - &taken.change,
        None => observed.clone(),
    };
    let readings = (observed, &corrected);
    let quantities = context.model.quantities().into_iter();
    let mut biases: Vec<Bias> = quantities
        .map(|quantity| of_quantity(context, readings, taken.as_ref(), quantity))
        .collect();
    let (own, profiles) = of_profiles(context, readings, taken.as_ref());
    biases.extend(own);
    (biases, profiles)
}

/// How a quantity moves from readings as they are to corrected ones.
fn of_quantity(
    context: &Context<'_>,
    (observed, corrected): (&DVector<f64>, &DVector<f64>),
    taken: Option<&Taken>,
    quantity: Quantity,
) -> Bias {
    let before = quantity.weights.dot(observed);
    let after = quantity.weights.dot(corrected);
    let spread = covariance_times(context.model, &context.law, &quantity.weights);
    let std = quantity.weights.dot(&spread).max(0.0).sqrt();
    let (moved_std, after_std) = taken.map_or((0.0, std), |taken| {
        let gradient = taken.derivatives.tr_mul(&quantity.weights);
        let mut whitened = DMatrix::from_column_slice(spread.len(), 1, spread.as_slice());
        context.space.whiten(&mut whitened);
        let common = (&taken.sizes.gain * whitened.column(0)).dot(&gradient);
        let state = taken.by_state(&quantity.weights, &gradient);
        let moved = (taken.variance(&gradient) + state.added).max(0.0);
        let common = common + state.common;
        let after = std * std + moved - 2.0 * common;
        (moved.sqrt(), after.max(0.0).sqrt())
    });
    let still = (after - before).abs() <= ROUNDING * std && moved_std <= ROUNDING * std;
    let (after, after_std, moved_std) = if still {
        (before, std, 0.0)
    } else {
        (after, after_std, moved_std)
    };
    Bias {
        quantity: quantity.name,
        before,
        after,
        moved: after - before,
        std,
        after_std,
        moved_std,
        unit: quantity.unit.to_owned(),
    }
}

/// How the profiles move, and the root mean square of each.
fn of_profiles(
    context: &Context<'_>,
    (observed, corrected): (&DVector<f64>, &DVector<f64>),
    taken: Option<&Taken>,
) -> (Vec<Bias>, Vec<MovedProfile>) {
    let profiles_of = |readings: DVector<f64>| context.model.refit(readings).profiles();
    let before = profiles_of(observed.clone());
    let after = profiles_of(corrected.clone());
    let moved = taken.map(|taken| MovedBy::out_of(taken, corrected, &profiles_of));
    let rms = |v: &DVector<f64>| v.norm() / (v.len().max(1) as f64).sqrt();
    let pairs = before.into_iter().zip(after).enumerate();
    let told = pairs.map(|(k, (b, a))| {
        let change = &a.values - &b.values;
        let std = b.noise_gain * context.law.sigma();
        let stds = moved.as_ref().map(|by| by.stds(k, &a, &change, std));
        let (moved_std, after_std) = stds.unwrap_or((0.0, std));
        let bias = Bias {
            quantity: b.name.clone(),
            before: rms(&b.values),
            after: rms(&a.values),
            moved: rms(&change),
            std,
            after_std,
            moved_std,
            unit: b.unit.to_owned(),
        };
        let values = |profile: Profile| profile.values.as_slice().to_vec();
        (bias, (b.name.clone(), values(b), values(a)))
    });
    told.unzip()
}

/// Profiles of readings out of which something else is taken.
struct MovedBy<'t> {
    taken: &'t Taken,
    /// Each parameter of the causes moved by its standard uncertainty.
    parameters: Vec<Vec<Profile>>,
    /// The causes' change at drawn states.
    states: Vec<Vec<Profile>>,
}

impl<'t> MovedBy<'t> {
    fn out_of(
        taken: &'t Taken,
        corrected: &DVector<f64>,
        profiles_of: &(impl Fn(DVector<f64>) -> Vec<Profile> + Sync),
    ) -> Self {
        let columns = taken.derivatives.column_iter().zip(&taken.stds);
        let states = taken.sizes.draws.as_ref().map_or_else(Vec::new, |draws| {
            let moved = &draws.moved_as_read;
            (0..moved.ncols().min(STATES))
                .into_par_iter()
                .map(|draw| profiles_of(corrected - moved.column(draw)))
                .collect()
        });
        Self {
            taken,
            parameters: columns
                .map(|(column, std)| profiles_of(corrected - column * *std))
                .collect(),
            states,
        }
    }

    /// Standard uncertainties of the root mean square of the k-th profile's change, and of the profile after it.
    fn stds(&self, k: usize, after: &Profile, change: &DVector<f64>, std: f64) -> (f64, f64) {
        let mut slopes = DMatrix::zeros(change.len(), self.parameters.len());
        let own = self.parameters.iter().zip(&self.taken.stds);
        for (mut slope, (own, by)) in slopes.column_iter_mut().zip(own) {
            let moved = own.get(k).map(|own| (&own.values - &after.values) / *by);
            if let Some(moved) = moved.filter(|m| m.iter().all(|v| v.is_finite())) {
                slope.copy_from(&moved);
            }
        }
        // The derivative of a norm is the product with its direction.
        let count = change.len().max(1) as f64;
        let length = change.norm() * count.sqrt();
        let direction = change / length.max(f64::MIN_POSITIVE);
        let gradient = slopes.tr_mul(&direction);
        let spread = (&slopes * &self.taken.sizes.covariance).component_mul(&slopes);
        let (mut along, mut square) = (0.0, 0.0);
        for state in self.states.iter().filter_map(|own| own.get(k)) {
            let moved = &state.values - &after.values;
            along += moved.dot(&direction).powi(2) / self.states.len() as f64;
            square += moved.norm_squared() / self.states.len() as f64;
        }
        (
            (self.taken.variance(&gradient) + along).sqrt(),
            std.hypot(((spread.sum() + square) / count).max(0.0).sqrt()),
        )
    }
}

/// What causes change in the readings, and how that moves with their amplitudes and shapes.
struct Taken {
    change: DVector<f64>,
    sizes: Sizes,
    /// Readings × parameters of `sizes`.
    derivatives: DMatrix<f64>,
    /// Standard uncertainty of each parameter.
    stds: Vec<f64>,
}

impl Taken {
    fn out_of(context: &Context<'_>, readings: &DVector<f64>, causes: &[Cause]) -> Option<Self> {
        if causes.is_empty() {
            return None;
        }
        let sizes = Sizes::told(context, readings, causes)?;
        let signatures = signatures(context, readings, causes, &sizes.amplitudes);
        let derivative = |unknown: &Unknown| match *unknown {
            Unknown::Amplitude(which, k) => signatures
                .column(first_amplitude(causes, which) + k)
                .clone_owned(),
            Unknown::Shape(which, j) => {
                let cause = &causes[which];
                let first = first_amplitude(causes, which);
                let used = sizes.amplitudes.rows(first, cause.columns.len());
                let effect = &context.catalogue[cause.effect];
                let mut slope = DVector::zeros(readings.len());
                if let Some((low, high, apart)) = beside(context, cause, j) {
                    for (shape, sign) in [(low, -1.0), (high, 1.0)] {
                        let columns = effect.columns(context.model, &shape);
                        for (column, amplitude) in columns.iter().zip(used.iter()) {
                            slope += column.dense(readings.len()) * (sign * amplitude / apart);
                        }
                    }
                }
                slope
            }
        };
        let columns: Vec<DVector<f64>> = sizes.parameters.iter().map(derivative).collect();
        let variances = sizes.covariance.diagonal();
        Some(Self {
            change: &signatures * &sizes.amplitudes,
            derivatives: DMatrix::from_columns(&columns),
            stds: variances
                .iter()
                .map(|v| v.max(0.0).sqrt())
                .map(|std| if std.is_finite() { std } else { 0.0 })
                .collect(),
            sizes,
        })
    }

    fn variance(&self, gradient: &DVector<f64>) -> f64 {
        gradient.dot(&(&self.sizes.covariance * gradient)).max(0.0)
    }

    /// What the noise of the state adds for a quantity beside the errors of the parameters.
    fn by_state(&self, weights: &DVector<f64>, gradient: &DVector<f64>) -> ByState {
        let Some(draws) = &self.sizes.draws else {
            return ByState::default();
        };
        let in_readings = [draws.noise_in_readings(), &draws.moved_as_read];
        let [noise, moved] = in_readings.map(|m| m.tr_mul(weights));
        let known = draws.errors(&self.sizes.gain).tr_mul(gradient);
        let plain = (&self.sizes.gain * draws.projected_noise()).tr_mul(gradient);
        let all = &known + moved;
        let count = all.len().max(1) as f64;
        ByState {
            added: (all.norm_squared() - known.norm_squared()) / count,
            common: noise.dot(&(all - plain)) / count,
        }
    }
}

/// What the noise of the state adds to the variance of a move, and to its covariance with the
/// noise of the quantity itself.
#[derive(Default)]
struct ByState {
    added: f64,
    common: f64,
}

/// Signatures of causes as they stand in the readings, readings × amplitudes: those that are linear in
/// the state at the state as read without the causes.
fn signatures(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    amplitudes: &DVector<f64>,
) -> DMatrix<f64> {
    let mut signatures = raw_signatures(context, causes);
    let changes = context.changes_at(causes, amplitudes);
    let clean = context.without(readings, causes, &changes);
    let read = context.model.refit_as_smooth(clean).as_read();
    for (k, cause) in causes.iter().enumerate() {
        if !context.catalogue[cause.effect].is_linear_in_state() {
            continue;
        }
        let columns = context.columns_at(k, (context.model, &read), causes, &changes);
        for (j, column) in columns.iter().enumerate() {
            let at = first_amplitude(causes, k) + j;
            signatures.set_column(at, &column.dense(readings.len()));
        }
    }
    signatures
}

/// Σ w, the scatter that the model expects included.
fn covariance_times(model: &AnyModel, law: &NoiseLaw, weights: &DVector<f64>) -> DVector<f64> {
    let law = &law.parts;
    let mut spread = weights * law.white;
    for trace in model.traces() {
        let w = weights.rows(trace.start, trace.len());
        let places = &model.places()[trace.clone()];
        let mut own = spread.rows_mut(trace.start, trace.len());
        own.add_scalar_mut(law.shift * w.sum());
        if law.drift > 0.0 {
            let x: Vec<f64> = places.iter().map(|place| place.x).collect();
            let along = DVector::from_vec(about_middle(&x));
            own.axpy(law.drift * along.dot(&w), &along, 1.0);
        }
        if law.correlated <= 0.0 {
            continue;
        }
        // Σ wⱼ exp(−|xᵢ − xⱼ|/ℓ) by its recursions from either end of the trace.
        let decay = |k: usize| (-(places[k].x - places[k - 1].x).abs() / law.length).exp();
        let mut behind = 0.0;
        for k in 0..w.len() {
            if k > 0 {
                behind *= decay(k);
            }
            behind += w[k];
            own[k] += law.correlated * behind;
        }
        let mut ahead = 0.0;
        for k in (0..w.len()).rev() {
            own[k] += law.correlated * ahead;
            ahead += w[k];
            if k > 0 {
                ahead *= decay(k);
            }
        }
    }
    for column in model.expected_scatter() {
        let pairs = || column.rows.iter().zip(&column.values);
        let along: f64 = pairs().map(|(&k, v)| weights[k] * v).sum();
        pairs().for_each(|(&k, v)| spread[k] += along * v);
    }
    spread
}

/// √(wᵀ Σ w).
pub(crate) fn weighted_std(model: &AnyModel, law: &NoiseLaw, weights: &DVector<f64>) -> f64 {
    let variance = weights.dot(&covariance_times(model, law, weights));
    variance.max(0.0).sqrt()
}
