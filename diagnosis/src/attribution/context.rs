//! The workbench of one pass: state of the model, noise, space, dictionary and their null law.

use std::sync::Arc;

use errsep_models::model::{AnyModel, Column, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};

use crate::attribution::doubt::Drawn;
use crate::detection::basis::orthonormal;
use crate::detection::dictionary::{Dictionary, Entry, Places};
use crate::detection::null::NullLaw;
use crate::detection::space::Space;
use crate::levels::SLACK;
use crate::noise::contrasts::repeated;
use crate::noise::law::NoiseLaw;

/// What keeps this part of its length is seen whole.
const WHOLE: f64 = 0.999;
/// A column of which less than this part, squared, is left beside the others is a sum of them and rounding.
const ROUNDING: f64 = 1e-10;

/// Everything that is fixed while causes are sought.
pub(crate) struct Context<'a> {
    pub model: &'a AnyModel,
    pub catalogue: &'a [Box<dyn Effect<AnyModel>>],
    pub law: NoiseLaw,
    pub space: Space,
    pub dictionary: Dictionary,
    pub null: Arc<NullLaw>,
    /// Number of draws of the null law and their seed.
    draws: (usize, u64),
    /// Draws for the doubt about the state.
    pub drawn: Drawn,
}

/// A cause at a shape, with its whitened, projected signature.
#[derive(Clone)]
pub(crate) struct Cause {
    pub effect: usize,
    pub shape: Shape,
    pub columns: Vec<Column>,
    pub projected: DMatrix<f64>,
    /// Choices that the readings made for its shape.
    pub choices: usize,
}

impl Cause {
    /// Number of its amplitudes and free shape parameters, and of as many more as its choices are worth.
    pub fn unknowns(&self) -> usize {
        unknowns(self.projected.shape(), &self.shape, self.choices)
    }
}

impl<'a> Context<'a> {
    /// A context with a null law of its own.
    pub fn new(
        model: &'a AnyModel,
        catalogue: &'a [Box<dyn Effect<AnyModel>>],
        law: NoiseLaw,
        draws: usize,
        seed: u64,
    ) -> Self {
        let places = Arc::new(Places::new(model));
        let space = Space::expecting(model, &law);
        let dictionary = Dictionary::new(model, catalogue, places, &space);
        let null = Arc::new(NullLaw::simulate(
            model,
            &dictionary,
            &space,
            &law,
            draws,
            seed,
        ));
        Self {
            model,
            catalogue,
            law,
            space,
            dictionary,
            null,
            draws: (draws, seed),
            drawn: Drawn::default(),
        }
    }

    /// The context of the same readings under another law of noise, with a null law of its own; tails are those of this law.
    pub fn under(&self, law: NoiseLaw) -> Self {
        let law = law.with_tails_of(&self.law);
        Self::new(self.model, self.catalogue, law, self.draws.0, self.draws.1)
    }

    /// The context of another state and law of noise of the same readings. The null law is kept: it
    /// is one of standardised scores, so it knows the noise only through the angles between the
    /// signatures, and a state some hundredths away leaves those as they are.
    pub fn moved<'b>(&self, model: &'b AnyModel, law: NoiseLaw) -> Context<'b>
    where
        'a: 'b,
    {
        let space = Space::expecting(model, &law);
        let places = Arc::clone(&self.dictionary.places);
        let dictionary = Dictionary::new(model, self.catalogue, places, &space);
        Context {
            model,
            catalogue: self.catalogue,
            law,
            space,
            dictionary,
            null: Arc::clone(&self.null),
            draws: self.draws,
            drawn: Drawn::default(),
        }
    }

    /// The whitened, projected residual of readings.
    pub fn residual(&self, readings: &DVector<f64>) -> DVector<f64> {
        self.space.forward_vector(readings)
    }

    /// Whether what differs between repeats is seen whole: no unknown of the model takes up part of a shift of one trace
    /// against the next one that repeats it.
    pub fn repeats_show_whole(&self) -> bool {
        let traces = self.model.traces();
        let alike = repeated(self.model.places(), traces);
        let pairs = alike.iter().flat_map(|alike| alike.windows(2));
        let shifts = pairs.map(|pair| {
            let [before, after] = [0, 1].map(|k| traces[pair[k]].clone());
            let signs = before
                .clone()
                .map(|_| -1.0)
                .chain(after.clone().map(|_| 1.0));
            Column {
                values: signs.collect(),
                rows: before.chain(after).collect(),
            }
        });
        let mut shifts = shifts.filter(|shift| !shift.rows.is_empty());
        shifts.all(|shift| {
            let (seen, sizes) = self.space.forward_columns(&[shift]);
            seen.norm() > WHOLE * sizes[0]
        })
    }

    /// A cause of the catalogue at a shape, by the signature at a state of the model.
    pub fn cause(&self, state: &AnyModel, effect: usize, shape: Shape) -> Cause {
        let columns = self.catalogue[effect].columns(state, &shape);
        Cause {
            effect,
            choices: self.catalogue[effect].choices(&shape),
            shape,
            projected: self.space.forward_columns(&columns).0,
            columns,
        }
    }

    /// Square of what remains beside causes.
    pub fn misfit(&self, readings: &DVector<f64>, causes: &[Cause]) -> f64 {
        let whole = self.residual(readings);
        let basis = span(causes, self.space.readings());
        (&whole - &basis * basis.tr_mul(&whole)).norm_squared()
    }

    /// The family of an effect.
    pub fn family_of(&self, effect: usize) -> Option<usize> {
        let name = self.catalogue[effect].name();
        self.dictionary
            .families
            .iter()
            .position(|f| f.is_effect && f.name == name)
    }

    /// Columns of a family's first entry: of an effect in its usual form.
    pub fn order_of(&self, family: usize) -> usize {
        let first = self.dictionary.families[family].entries.start;
        self.dictionary.entries.get(first).map_or(0, Entry::order)
    }

    /// Amplitudes of causes fitted together, with their covariance; nothing where one of the signatures is a sum of
    /// the others.
    pub fn amplitudes(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let stacked = stack(causes, self.space.readings());
        let gram = stacked.tr_mul(&stacked);
        let factor = gram.clone().cholesky()?;
        let pivots = factor.l_dirty().diagonal().map(|pivot| pivot * pivot);
        if (pivots.iter().zip(gram.diagonal().iter())).any(|(pivot, own)| *pivot < ROUNDING * own) {
            return None;
        }
        let covariance = factor.inverse();
        let score = stacked.tr_mul(&self.residual(readings));
        Some((&covariance * score, covariance))
    }

    /// Amplitudes of causes fitted beside some directions.
    pub fn amplitudes_beside(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        directions: &DMatrix<f64>,
    ) -> Option<DVector<f64>> {
        let stacked = stack(causes, self.space.readings());
        let beside = &stacked - directions * directions.tr_mul(&stacked);
        let gram = beside.tr_mul(&beside).cholesky()?;
        Some(gram.solve(&beside.tr_mul(&self.residual(readings))))
    }

    /// The readings' change by causes at given amplitudes.
    pub fn change(&self, causes: &[Cause], amplitudes: &DVector<f64>) -> DVector<f64> {
        let mut change = DVector::zeros(self.space.readings());
        let mut at = 0;
        for cause in causes {
            for column in &cause.columns {
                for (&row, value) in column.rows.iter().zip(&column.values) {
                    change[row] += amplitudes[at] * value;
                }
                at += 1;
            }
        }
        change
    }

    /// Whether amplitudes and shapes lie where the effect is physically possible.
    pub fn plausible(
        &self,
        effect: usize,
        shape: &Shape,
        amplitudes: &[f64],
        stds: &[f64],
    ) -> bool {
        let effect = &self.catalogue[effect];
        let inside = effect
            .amplitudes_at(shape)
            .iter()
            .zip(amplitudes)
            .zip(stds)
            .all(|((p, a), u)| {
                // A size that the readings hardly know excuses none far out of range.
                let slack = (2.0 * u).min(SLACK * (p.high - p.low));
                *a > p.low - slack && *a < p.high + slack
            });
        inside
            && effect.possible(self.model, shape, amplitudes)
            && effect
                .shape_parameters()
                .iter()
                .zip(&shape.values)
                .all(|(p, v)| *v >= p.low && *v <= p.high)
    }
}

/// Unknowns of a shape with columns, readings × amplitudes. Of two ways as probable before the evidence takes
/// ln 2 away, and half the logarithm of the number of readings for an unknown.
pub(crate) fn unknowns(
    (readings, amplitudes): (usize, usize),
    shape: &Shape,
    choices: usize,
) -> usize {
    let each = 2.0 * std::f64::consts::LN_2 / (readings.max(2) as f64).ln();
    amplitudes + shape.free() + (choices as f64 * each).ceil() as usize
}

/// Signatures of several causes side by side.
pub(crate) fn stack(causes: &[Cause], readings: usize) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = causes
        .iter()
        .flat_map(|c| c.projected.column_iter().map(|v| v.clone_owned()))
        .collect();
    if columns.is_empty() {
        DMatrix::zeros(readings, 0)
    } else {
        DMatrix::from_columns(&columns)
    }
}

/// Signatures as they stand in the readings, readings × amplitudes.
pub(crate) fn raw_signatures(context: &Context<'_>, causes: &[Cause]) -> DMatrix<f64> {
    let n = context.space.readings();
    let columns: Vec<DVector<f64>> = causes
        .iter()
        .flat_map(|c| &c.columns)
        .map(|c| c.dense(n))
        .collect();
    if columns.is_empty() {
        DMatrix::zeros(n, 0)
    } else {
        DMatrix::from_columns(&columns)
    }
}

/// An orthonormal basis of the causes' signatures.
pub(crate) fn span(causes: &[Cause], readings: usize) -> DMatrix<f64> {
    let stacked = stack(causes, readings);
    let sizes: Vec<f64> = stacked.column_iter().map(|c| c.norm()).collect();
    orthonormal(&stacked, &sizes)
}

/// A vector as a matrix of one column.
pub(crate) fn as_matrix(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

/// The only column of a matrix.
pub(crate) fn column(matrix: DMatrix<f64>) -> DVector<f64> {
    matrix.column(0).clone_owned()
}
