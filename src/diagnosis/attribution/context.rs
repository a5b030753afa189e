//! The workbench of one pass: state of the model, noise, space, dictionary and their null law.

use std::sync::{Arc, OnceLock};

use errsep_models::model::{AnyModel, Column, Effect, Shape};
use nalgebra::{DMatrix, DVector};

use rayon::prelude::*;

use crate::diagnosis::attribution::doubt::{DRAWS, Doubt, Drawn, FEW_DRAWS};
use crate::diagnosis::detection::dictionary::{
    Dictionary, Entry, Meaning, Places, statistic, surprise,
};
use crate::diagnosis::detection::folding::Sums;
use crate::diagnosis::detection::null::NullLaw;
use crate::diagnosis::detection::space::{Space, inner_products, orthonormal};
use crate::diagnosis::levels::{ADEQUATE, FAR, SEPARABLE, SLACK, SUSPECT};
use crate::diagnosis::noise::law::NoiseLaw;

/// A column of which less than this part, squared, is left beside the others is a sum of them and rounding.
const ROUNDING: f64 = 1e-10;
/// Part of the probability of what is adequate: where few draws of the state leave less than it, many do not leave
/// enough (of 198 remainders 32 draws told scores to 2 % of those of 128).
const PAST_DOUBT: f64 = 1e-2;
/// Vectors that signatures are multiplied with at once.
const WIDTH: usize = 8;

/// Everything that is fixed while causes are sought.
pub(in crate::diagnosis) struct Context<'a> {
    pub model: &'a AnyModel,
    pub catalogue: &'a [Box<dyn Effect<AnyModel>>],
    pub law: NoiseLaw,
    pub space: Space,
    pub dictionary: Dictionary,
    pub null: Arc<NullLaw>,
    /// Draws for the doubt about the state.
    pub drawn: Drawn,
}

/// A cause at a shape, with its whitened, projected signature.
#[derive(Clone)]
pub(in crate::diagnosis) struct Cause {
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

/// What remains beside some causes.
pub(in crate::diagnosis) struct Remainder {
    pub residual: DVector<f64>,
    /// Its square, as far as it is trusted.
    pub square: f64,
    /// The residual as it is trusted, then the directions that are not looked along, as signatures see
    /// them.
    seen: Vec<Sums<f64, WIDTH>>,
    directions: usize,
    /// Families that stood out before it was doubted, and the entries where they did.
    suspects: Vec<(usize, usize)>,
    /// Greatest score of each family and the entry where it is, once it has been asked for.
    best: Vec<OnceLock<(f64, Option<usize>)>>,
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
            drawn: Drawn::default(),
        }
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
            drawn: Drawn::default(),
        }
    }

    /// The whitened, projected residual of readings.
    pub fn residual(&self, readings: &DVector<f64>) -> DVector<f64> {
        self.space.forward_vector(readings)
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

    /// Scores of everything beside some causes.
    pub fn remainder(&self, readings: &DVector<f64>, causes: &[Cause]) -> Remainder {
        let basis = span(causes, self.space.readings());
        self.scores(readings, &basis, &Doubt::default())
    }

    /// The same with the doubt about the state at which the causes' signatures are taken, where
    /// that can make the difference.
    pub fn judged(&self, readings: &DVector<f64>, causes: &[Cause]) -> Remainder {
        self.judged_by(readings, causes, DRAWS)
    }

    /// The same with the doubt by a number of draws of the state.
    pub fn judged_by(&self, readings: &DVector<f64>, causes: &[Cause], draws: usize) -> Remainder {
        let plain = self.remainder(readings, causes);
        if causes.is_empty() || self.adequate(causes, &plain) {
            return plain;
        }
        if draws > FEW_DRAWS {
            let Some(few) = self.doubted(readings, causes, &plain, FEW_DRAWS) else {
                return plain;
            };
            if self.suspected(&few, PAST_DOUBT * least_chance(causes)) {
                return few;
            }
        }
        let all = self.doubted(readings, causes, &plain, draws);
        all.unwrap_or(plain)
    }

    /// What remains beside causes, with the doubt about the state; nothing where that excuses none of it.
    fn doubted(
        &self,
        readings: &DVector<f64>,
        causes: &[Cause],
        plain: &Remainder,
        draws: usize,
    ) -> Option<Remainder> {
        let basis = span(causes, self.space.readings());
        let freedom = self.space.degrees_of_freedom() as f64;
        let most = freedom + FAR * (2.0 * freedom).sqrt();
        let mut open = self.open(readings, causes);
        let along = inner_products(&basis, &open);
        open.gemm(-1.0, &basis, &along, 1.0);
        let far = |residual: &DVector<f64>| plain.residual.dot(residual) > most;
        if far(&plain.residual) && far(&Doubt::of_open(&open).trusted(&plain.residual)) {
            return None;
        }
        let doubt = self.doubt(readings, (causes, &basis), open, draws);
        (!doubt.weights.is_empty()).then(|| {
            let mut left = self.scores(readings, &basis, &doubt);
            let known = plain.best.iter().enumerate();
            let known = known.filter_map(|(family, best)| Some((family, best.get()?.1?)));
            left.suspects = known.collect();
            left
        })
    }

    /// Probability that as much would stand out with nothing there: in any effect, at any place or
    /// in the misfit as a whole.
    pub fn detection(&self, left: &Remainder) -> f64 {
        self.null.detection(&self.surprises(left), left.square)
    }

    /// Probability that as much as causes leave would stand out with nothing else there, with the doubt about the
    /// state where that can make the difference.
    pub fn chance_beside(&self, readings: &DVector<f64>, causes: &[Cause]) -> f64 {
        let plain = self.remainder(readings, causes);
        let chance = self.detection(&plain);
        if chance > SUSPECT {
            return chance;
        }
        let doubted = self.doubted(readings, causes, &plain, DRAWS);
        doubted.map_or(chance, |left| self.detection(&left))
    }

    /// Probability that any family would stand out as much with nothing else there.
    pub fn global(&self, remainder: &Remainder) -> f64 {
        self.null.global(&self.surprises(remainder))
    }

    /// Whether causes leave nothing that stands out.
    pub fn adequate(&self, causes: &[Cause], left: &Remainder) -> bool {
        self.exceeds(left, least_chance(causes))
    }

    /// Whether as much as remains of any family would stand out with nothing there in more than a part of all cases.
    fn exceeds(&self, left: &Remainder, least: f64) -> bool {
        let mut families = 0..self.dictionary.families.len();
        // The probability of all falls with that of each.
        !self.suspected(left, least)
            && families.all(|k| self.null.global_of(k, self.best(left, k).0) > least)
    }

    /// Whether, of what stood out before it was doubted, as much would stand out with nothing there in no more than a
    /// part of all cases.
    fn suspected(&self, left: &Remainder, least: f64) -> bool {
        left.suspects.iter().any(|(family, entry)| {
            let surprise = self.surprise(&self.dictionary.entries[*entry], left);
            self.null.global_of(*family, surprise) <= least
        })
    }

    /// Greatest score of a family beside what the remainder is beside, and the entry where it is.
    pub fn best(&self, remainder: &Remainder, family: usize) -> (f64, Option<usize>) {
        let known = &remainder.best[family];
        if let Some(best) = known.get() {
            return *best;
        }
        // Not held locked meanwhile: a thread that waits for the others' share of the search may be given
        // a task that asks for the same.
        let best = self.greatest(remainder, family);
        let _ = known.set(best);
        best
    }

    fn surprises(&self, remainder: &Remainder) -> Vec<f64> {
        let families = 0..self.dictionary.families.len();
        families.map(|k| self.best(remainder, k).0).collect()
    }

    fn greatest(&self, remainder: &Remainder, family: usize) -> (f64, Option<usize>) {
        let range = self.dictionary.families[family].entries.clone();
        let surprise_of = |k: usize| (self.surprise(&self.dictionary.entries[k], remainder), k);
        range
            .into_par_iter()
            .map(surprise_of)
            .filter(|(surprise, _)| *surprise > 0.0)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map_or((0.0, None), |(surprise, k)| (surprise, Some(k)))
    }

    fn surprise(&self, entry: &Entry, remainder: &Remainder) -> f64 {
        let products: Vec<Vec<[f64; WIDTH]>> =
            remainder.seen.iter().map(|s| entry.products(s)).collect();
        let product = |k: usize, j: usize| products[j / WIDTH][k][j % WIDTH];
        let score = DVector::from_fn(entry.order(), |k, _| product(k, 0));
        if remainder.directions == 0 {
            return surprise(
                statistic(&entry.gram, &score, entry.positive),
                entry.order(),
            );
        }
        let overlap = DMatrix::from_fn(entry.order(), remainder.directions, |k, j| {
            product(k, j + 1)
        });
        let left = &entry.gram - &overlap * overlap.transpose();
        if left.trace() < SEPARABLE * entry.gram.trace() {
            return 0.0;
        }
        surprise(statistic(&left, &score, entry.positive), entry.order())
    }

    fn scores(&self, readings: &DVector<f64>, basis: &DMatrix<f64>, doubt: &Doubt) -> Remainder {
        let whole = self.residual(readings);
        let residual = &whole - basis * basis.tr_mul(&whole);
        let trusted = doubt.trusted(&residual);
        let mut spans: Vec<DVector<f64>> = basis.column_iter().map(|c| c.clone_owned()).collect();
        // A part w of a product is taken away by √w of the direction.
        let halves = doubt.directions.iter().zip(&doubt.weights);
        spans.extend(halves.map(|(direction, weight)| direction * weight.sqrt()));
        let directions = spans.len();
        spans.insert(0, trusted);
        let adjoint = self.space.adjoint(DMatrix::from_columns(&spans));
        let batches = (0..adjoint.ncols()).step_by(WIDTH);
        let seen = batches.map(|from| {
            let width = WIDTH.min(adjoint.ncols() - from);
            self.dictionary
                .places
                .sums(adjoint.columns(from, width).as_view())
        });
        Remainder {
            square: residual.dot(&spans[0]),
            residual,
            seen: seen.collect(),
            directions,
            suspects: Vec::new(),
            best: vec![OnceLock::new(); self.dictionary.families.len()],
        }
    }

    /// Square of what remains beside causes.
    pub fn misfit(&self, readings: &DVector<f64>, causes: &[Cause]) -> f64 {
        let whole = self.residual(readings);
        let basis = span(causes, self.space.readings());
        (&whole - &basis * basis.tr_mul(&whole)).norm_squared()
    }

    /// The start of an effect's search beside other causes: the best entry of its family.
    pub fn start(&self, remainder: &Remainder, effect: usize) -> Option<&Shape> {
        let family = self.family_of(effect)?;
        let entry = self.best(remainder, family).1?;
        match &self.dictionary.entries[entry].meaning {
            Meaning::Effect(shape) => Some(shape),
            Meaning::Place(_) => None,
        }
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

    /// Tail probability of an effect's greatest score.
    pub fn p_value(&self, remainder: &Remainder, effect: usize) -> f64 {
        self.family_of(effect)
            .map_or(1.0, |f| self.null.family(f, self.best(remainder, f).0))
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

/// Probability of what remains above which causes are adequate.
fn least_chance(causes: &[Cause]) -> f64 {
    ADEQUATE[causes.len().clamp(1, ADEQUATE.len()) - 1]
}

/// Unknowns of a shape with columns, readings × amplitudes. Of two ways as probable before the evidence takes
/// ln 2 away, and half the logarithm of the number of readings for an unknown.
pub(in crate::diagnosis) fn unknowns(
    (readings, amplitudes): (usize, usize),
    shape: &Shape,
    choices: usize,
) -> usize {
    let each = 2.0 * std::f64::consts::LN_2 / (readings.max(2) as f64).ln();
    amplitudes + shape.free() + (choices as f64 * each).ceil() as usize
}

/// Signatures of several causes side by side.
pub(in crate::diagnosis) fn stack(causes: &[Cause], readings: usize) -> DMatrix<f64> {
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
pub(in crate::diagnosis) fn raw_signatures(
    context: &Context<'_>,
    causes: &[Cause],
) -> DMatrix<f64> {
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
pub(in crate::diagnosis) fn span(causes: &[Cause], readings: usize) -> DMatrix<f64> {
    let stacked = stack(causes, readings);
    let sizes: Vec<f64> = stacked.column_iter().map(|c| c.norm()).collect();
    orthonormal(&stacked, &sizes)
}

/// A vector as a matrix of one column.
pub(in crate::diagnosis) fn as_matrix(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

/// The only column of a matrix.
pub(in crate::diagnosis) fn column(matrix: DMatrix<f64>) -> DVector<f64> {
    matrix.column(0).clone_owned()
}
