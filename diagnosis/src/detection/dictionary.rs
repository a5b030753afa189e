//! All signatures that are looked for, and their scores.
//!
//! The score of a signature E on a projected residual e is T = |(EᵀPE)^(−½) Eᵀ a|², a = L⁻ᵀ P e:
//! chi-squared with as many degrees of freedom as E has columns when nothing is there.

use std::sync::Arc;

use errsep_models::model::{AnyModel, Column, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DMatrixView, DVector, RealField};
use rayon::prelude::*;

use crate::detection::folding::{Folded, Folding, Sums};
use crate::detection::localise::{Item, scan_items};
use crate::detection::space::Space;
use crate::levels::INVISIBLE;

/// What a signature stands for.
#[derive(Debug, Clone)]
pub enum Meaning {
    /// An effect of the catalogue at one of its shapes.
    Effect(Shape),
    /// A place to look at.
    Place(Item),
}

/// One signature of the dictionary.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What it stands for.
    pub meaning: Meaning,
    /// Its columns.
    columns: Vec<Folded>,
    /// EᵀPE.
    pub gram: DMatrix<f64>,
    /// Part of its whitened length that the fit does not absorb.
    pub visible: f64,
    /// Whether only positive amplitudes are possible.
    pub positive: bool,
}

/// Signatures of one effect, or of one axis to look along.
#[derive(Debug, Clone)]
pub struct Family {
    /// Name of the effect or the axis.
    pub name: String,
    /// Its entries.
    pub entries: std::ops::Range<usize>,
    /// Whether it is an effect.
    pub is_effect: bool,
    /// Greatest visible part of its signatures, entries left out included.
    pub visible: f64,
    /// How many of its signatures were left out as they do not show.
    pub unseen: usize,
}

impl Entry {
    /// Number of columns.
    pub fn order(&self) -> usize {
        self.columns.len()
    }

    /// Eᵀ a for several a, one row a column.
    pub fn products<T: RealField + Copy, const BATCH: usize>(
        &self,
        adjoint: &Sums<T, BATCH>,
    ) -> Vec<[T; BATCH]> {
        self.columns.iter().map(|c| c.dot(adjoint)).collect()
    }

    /// Eᵀ a for one a.
    pub fn score(&self, adjoint: &Sums<f64, 1>) -> DVector<f64> {
        let own = self.columns.iter().map(|c| c.dot(adjoint)[0]);
        DVector::from_iterator(self.order(), own)
    }
}

/// An axis to look along and its items, each with its columns.
type Axis = (&'static str, Vec<(Item, Vec<Folded>)>);

/// The places to look at: the same for every state and every law of noise.
#[derive(Debug)]
pub struct Places {
    folding: Folding,
    axes: Vec<Axis>,
}

impl Places {
    /// All places at which a model's readings can be looked.
    pub fn new(model: &AnyModel) -> Self {
        let folding = Folding::new(model.places());
        let axes = scan_items(model)
            .into_iter()
            .map(|(axis, items)| {
                let folded = items
                    .into_iter()
                    .map(|(item, columns)| {
                        (item, columns.iter().map(|c| folding.fold(c)).collect())
                    })
                    .collect();
                (axis, folded)
            })
            .collect();
        Self { folding, axes }
    }

    /// The columns of a matrix, at most `BATCH`, with their sums, for [`Entry::products`].
    pub fn sums<T: RealField + Copy, const BATCH: usize>(
        &self,
        columns: DMatrixView<'_, f64>,
    ) -> Sums<T, BATCH> {
        self.folding.sums(columns)
    }

    /// A vector with its sums, for [`Entry::score`].
    pub fn sums_of(&self, vector: &DVector<f64>) -> Sums<f64, 1> {
        self.folding.sums(vector.as_view())
    }
}

/// The dictionary of one model and state in one space.
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Signatures.
    pub entries: Vec<Entry>,
    /// Families: the effects of the catalogue in its order, then the axes.
    pub families: Vec<Family>,
    /// The places to look at.
    pub places: Arc<Places>,
}

impl Dictionary {
    /// All signatures of a catalogue and all places to look at.
    pub fn new(
        model: &AnyModel,
        catalogue: &[Box<dyn Effect<AnyModel>>],
        places: Arc<Places>,
        space: &Space,
    ) -> Self {
        let mut dictionary = Self {
            entries: Vec::new(),
            families: Vec::new(),
            places: Arc::clone(&places),
        };
        let folding = &places.folding;
        for effect in catalogue {
            let built = effect
                .grid(model)
                .into_par_iter()
                .map(|shape| {
                    let columns = effect.columns(model, &shape);
                    let folded = columns.iter().map(|c| folding.fold(c)).collect();
                    let positive = is_positive(effect.as_ref(), &shape);
                    entry(Meaning::Effect(shape), &columns, folded, positive, space)
                })
                .collect();
            dictionary.add(effect.name(), true, !effect.absorbed(), built);
        }
        for (axis, items) in &places.axes {
            let built = items
                .par_iter()
                .map(|(item, folded)| {
                    let columns: Vec<Column> = folded.iter().map(|c| folding.unfold(c)).collect();
                    let meaning = Meaning::Place(item.clone());
                    entry(meaning, &columns, folded.clone(), false, space)
                })
                .collect();
            dictionary.add(axis, false, true, built);
        }
        dictionary
    }

    /// The columns of an entry.
    pub fn columns(&self, entry: &Entry) -> Vec<Column> {
        let folding = &self.places.folding;
        entry.columns.iter().map(|c| folding.unfold(c)).collect()
    }

    fn add(&mut self, name: &str, is_effect: bool, sought: bool, built: Vec<Option<Entry>>) {
        let start = self.entries.len();
        let mut visible: f64 = 0.0;
        let all = built.len();
        for entry in built.into_iter().flatten() {
            visible = visible.max(entry.visible);
            if sought && entry.visible > INVISIBLE {
                self.entries.push(entry);
            }
        }
        let seen = self.entries.len() - start;
        self.families.push(Family {
            name: name.to_owned(),
            entries: start..self.entries.len(),
            is_effect,
            visible,
            unseen: all - seen,
        });
    }
}

/// Whether only positive amplitudes of an effect are possible.
pub(crate) fn is_positive(effect: &dyn Effect<AnyModel>, shape: &Shape) -> bool {
    matches!(effect.amplitudes_at(shape).as_slice(), [only] if only.low >= 0.0)
}

/// Eᵀ a.
pub(crate) fn products(columns: &[Column], adjoint: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(
        columns.len(),
        columns.iter().map(|column| {
            column
                .rows
                .iter()
                .zip(&column.values)
                .map(|(&row, value)| value * adjoint[row])
                .sum::<f64>()
        }),
    )
}

fn entry(
    meaning: Meaning,
    columns: &[Column],
    folded: Vec<Folded>,
    positive: bool,
    space: &Space,
) -> Option<Entry> {
    let gram = space.gram(columns);
    if columns.is_empty() || gram.whole.is_nan() || gram.whole <= 0.0 {
        return None;
    }
    Some(Entry {
        meaning,
        columns: folded,
        visible: (gram.matrix.trace() / gram.whole).clamp(0.0, 1.0),
        gram: gram.matrix,
        positive,
    })
}

/// The statistic T from a score and its Gram matrix; zero where the sign is impossible.
pub(crate) fn statistic(gram: &DMatrix<f64>, score: &DVector<f64>, positive: bool) -> f64 {
    if positive && score[0] <= 0.0 {
        return 0.0;
    }
    if gram.nrows() == 1 {
        return score[0] * score[0] / gram[(0, 0)].max(f64::MIN_POSITIVE);
    }
    score.dot(&(inverse(gram) * score)).max(0.0)
}

/// (EᵀPE)⁻¹ with a breath of ridge: two columns may coincide at the ends of a grid.
pub(crate) fn inverse(gram: &DMatrix<f64>) -> DMatrix<f64> {
    let n = gram.nrows();
    if n == 1 {
        return DMatrix::from_element(1, 1, 1.0 / gram[(0, 0)].max(f64::MIN_POSITIVE));
    }
    let lifted = gram + DMatrix::identity(n, n) * (1e-9 * gram.trace());
    lifted
        .cholesky()
        .map_or_else(|| DMatrix::zeros(n, n), |factor| factor.inverse())
}

/// −2 ln of the chi-squared tail beyond T.
pub(crate) fn surprise(t: f64, freedom: usize) -> f64 {
    if !(t > 0.0) {
        return 0.0;
    }
    // Beyond that the logarithm of the tail is lost in rounding.
    if t >= f64::MAX.sqrt() {
        return t.min(f64::MAX);
    }
    match freedom {
        1 => {
            // 2 Q(√T): exact until it nears underflow, by its continued fraction beyond.
            if t < 400.0 {
                -2.0 * statrs::function::erf::erfc((t / 2.0).sqrt()).ln()
            } else {
                let tail = 1.0 - 1.0 / (t + 3.0 - 2.0 * 5.0 / (t + 9.0));
                t + (std::f64::consts::PI * t / 2.0).ln() - 2.0 * tail.ln()
            }
        }
        2 => t,
        d => {
            let half = d as f64 / 2.0;
            let tail = statrs::function::gamma::gamma_ur(half, t / 2.0);
            if tail > 1e-250 {
                -2.0 * tail.ln()
            } else {
                t - 2.0 * (half - 1.0) * (t / 2.0).ln()
                    + 2.0 * statrs::function::gamma::ln_gamma(half)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::surprise;

    #[test]
    fn the_tail_joins_where_its_formulas_meet() {
        // Truncation: what the continued fraction neglects falls as 8/T³, here 1.25·10⁻⁷ (it is
        // 2.5·10⁻³ at T = 9, in arithmetic of forty digits).
        let below = surprise(400.0 - 1e-9, 1);
        let above = surprise(400.0 + 1e-9, 1);
        assert!((below - above).abs() < 1.3e-7, "{below} {above}");
        // 2 Q(5) = 5.733·10⁻⁷ (certified digits).
        assert!((surprise(25.0, 1) + 2.0 * 5.733e-7f64.ln()).abs() < 1e-3);
        assert!((surprise(3.0, 2) - 3.0).abs() < 1e-12);
        // What overflows stands out, what is no number does not.
        for freedom in 1..5 {
            assert!(surprise(f64::INFINITY, freedom) == f64::MAX);
            assert!(surprise(1e200, freedom) == 1e200);
            assert!(surprise(f64::NAN, freedom) == 0.0);
        }
    }
}
