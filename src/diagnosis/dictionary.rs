//! All signatures that are looked for, and their scores.
//!
//! The score of a signature E on a projected residual e is T = |(EᵀPE)^(−½) Eᵀ a|², a = L⁻ᵀ P e:
//! chi-squared with as many degrees of freedom as E has columns when nothing is there.

use errsep_models::model::{Column, Effect, FittedModel, Shape};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::localise::{Item, scan_items};
use super::noise::NoiseLaw;
use super::space::Space;

/// A signature of which less than this part is visible is not looked for.
const INVISIBLE: f64 = 1e-4;

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
    pub columns: Vec<Column>,
    /// EᵀPE.
    pub gram: DMatrix<f64>,
    /// Part of its whitened length that the fit does not absorb.
    pub visible: f64,
    /// Whether only positive amplitudes are possible.
    pub positive: bool,
    /// Part of the variance of its score that comes from the shifts of traces.
    pub shift_share: f64,
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
}

/// The dictionary of one model, state and law of noise.
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Signatures.
    pub entries: Vec<Entry>,
    /// Families: the effects of the catalogue in its order, then the axes.
    pub families: Vec<Family>,
}

impl Dictionary {
    /// All signatures of a catalogue and all places to look at.
    pub fn new<M: FittedModel>(
        model: &M,
        catalogue: &[Box<dyn Effect<M>>],
        space: &Space,
        law: &NoiseLaw,
    ) -> Self {
        let mut dictionary = Self {
            entries: Vec::new(),
            families: Vec::new(),
        };
        for effect in catalogue {
            let amplitudes = effect.amplitudes();
            let positive = amplitudes.len() == 1 && amplitudes[0].low >= 0.0;
            let signatures: Vec<(Meaning, Vec<Column>)> = effect
                .grid(model)
                .into_par_iter()
                .map(|shape| {
                    let columns = effect.columns(model, &shape);
                    (Meaning::Effect(shape), columns)
                })
                .collect();
            dictionary.add(effect.name(), true, signatures, positive, space, law);
        }
        for (axis, items) in scan_items(model) {
            let signatures = items
                .into_iter()
                .map(|(item, columns)| (Meaning::Place(item), columns))
                .collect();
            dictionary.add(axis, false, signatures, false, space, law);
        }
        dictionary
    }

    fn add(
        &mut self,
        name: &str,
        is_effect: bool,
        signatures: Vec<(Meaning, Vec<Column>)>,
        positive: bool,
        space: &Space,
        law: &NoiseLaw,
    ) {
        let start = self.entries.len();
        let built: Vec<Option<Entry>> = signatures
            .into_par_iter()
            .map(|(meaning, columns)| entry(meaning, columns, positive, space, law))
            .collect();
        let mut visible: f64 = 0.0;
        for entry in built.into_iter().flatten() {
            visible = visible.max(entry.visible);
            if entry.visible > INVISIBLE {
                self.entries.push(entry);
            }
        }
        self.families.push(Family {
            name: name.to_owned(),
            entries: start..self.entries.len(),
            is_effect,
            visible,
        });
    }
}

/// Eᵀ a.
pub(super) fn products(columns: &[Column], adjoint: &DVector<f64>) -> DVector<f64> {
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
    columns: Vec<Column>,
    positive: bool,
    space: &Space,
    law: &NoiseLaw,
) -> Option<Entry> {
    let (projected, sizes) = space.forward_columns(&columns);
    let gram = projected.tr_mul(&projected);
    let whole: f64 = sizes.iter().map(|s| s * s).sum();
    if columns.is_empty() || whole.is_nan() || whole <= 0.0 {
        return None;
    }
    let visible = (gram.trace() / whole).clamp(0.0, 1.0);
    let unit = {
        let column = projected.column(0);
        column / column.norm().max(f64::MIN_POSITIVE)
    };
    Some(Entry {
        shift_share: space
            .shift_share(&unit.clone_owned(), law.shift)
            .clamp(0.0, 1.0),
        meaning,
        columns,
        gram,
        visible,
        positive,
    })
}

/// The statistic T from a score and its Gram matrix; zero where the sign is impossible.
pub(super) fn statistic(gram: &DMatrix<f64>, score: &DVector<f64>, positive: bool) -> f64 {
    if positive && score[0] <= 0.0 {
        return 0.0;
    }
    match (gram.nrows(), gram[(0, 0)]) {
        (1, size) => score[0] * score[0] / size.max(f64::MIN_POSITIVE),
        _ => {
            // A breath of ridge: two columns may coincide at the ends of a grid.
            let ridge = 1e-9 * gram.trace();
            let lifted = gram + DMatrix::identity(gram.nrows(), gram.nrows()) * ridge;
            lifted
                .cholesky()
                .map_or(0.0, |factor| score.dot(&factor.solve(score)))
        }
    }
}

/// −2 ln of the chi-squared tail beyond T.
pub(super) fn surprise(t: f64, freedom: usize) -> f64 {
    if t <= 0.0 {
        return 0.0;
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
    }
}
