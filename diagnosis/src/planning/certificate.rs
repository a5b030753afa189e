//! The diagnosability certificate: what a plan of measurement can show, before any data.
//!
//! With Ê the projected, whitened signature: an effect of amplitude a has the signal-to-noise
//! ratio a|Ê|. It is seen with 80 % probability from (√T + 0.84)/|Ê|, T the threshold of its
//! family (`detection/smallest.rs`: where it has several shapes or differs from repeat to repeat); it is
//! told from another whose signature makes an angle θ with its own, with 99 % probability, from
//! 2.33/(|Ê| sin θ/2) (difference of two chi-squared statistics as a product of two normal variables).

use std::sync::Arc;

use errsep_models::model::{AnyModel, Column, Effect, FittedModel, Quantity};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::detection::dictionary::{Dictionary, Entry, Meaning, Places, statistic};
use crate::detection::null::NullLaw;
use crate::detection::smallest::{SizesByShape, smallest, typical};
use crate::detection::space::Space;
use crate::levels::{INVISIBLE, PLANNED, TELL, normal_quantile};
use crate::noise::law::NoiseLaw;
use crate::options::Options;

/// What a plan shows of one effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosability {
    /// The effect.
    pub effect: String,
    /// Part of it that the fit cannot absorb.
    pub visible: f64,
    /// Smallest amplitude seen with 80 % probability, if any that is plausible is.
    pub detectable: Option<f64>,
    /// How far that size is another for other shapes of the effect; none where they are alike.
    pub by_shape: Option<SizesByShape>,
    /// Whether it may have to be greater than that: it differs from repeat to repeat and is taken for noise in
    /// part.
    pub at_least: bool,
    /// Smallest amplitude told from every other effect with 99 % probability, if any that is
    /// plausible is.
    pub identifiable: Option<f64>,
    /// Unit of the amplitudes.
    pub unit: String,
    /// The effect it is most easily taken for.
    pub confused_with: Option<String>,
    /// Cosine of the angle between the two signatures.
    pub cosine: f64,
    /// Every other effect that could imitate the smallest size seen, with that cosine.
    #[serde(skip)]
    pub rivals: Vec<(String, f64)>,
    /// Root mean square of the detectable effect in the readings.
    pub visible_rms: Option<f64>,
    /// Bias of each quantity per unit of amplitude, with its unit.
    pub harm: Vec<(String, f64, String)>,
    /// Bias of each quantity per unit of the root mean square that the effect leaves visible in the
    /// readings, where it leaves any.
    pub harm_per_visible: Vec<(String, f64, String)>,
}

/// `certificate` of a model of any kind.
pub(crate) fn certificate(
    model: &AnyModel,
    catalogue: &[Box<dyn Effect<AnyModel>>],
    law: &NoiseLaw,
    options: &Options,
) -> Vec<Diagnosability> {
    let space = Space::expecting(model, law);
    let places = Arc::new(Places::new(model));
    let dictionary = Dictionary::new(model, catalogue, places, &space);
    let null = NullLaw::simulate(model, &dictionary, &space, law, options.draws, options.seed);
    let plan = Plan {
        model,
        catalogue,
        law,
        space,
        dictionary,
        level: null.level(options.false_alarm),
        null,
        quantities: model.quantities(),
    };
    let rows = catalogue.iter();
    rows.filter_map(|effect| plan.row(effect.as_ref()))
        .collect()
}

/// A plan of measurement with the law of what it shows where nothing is.
struct Plan<'s> {
    model: &'s AnyModel,
    catalogue: &'s [Box<dyn Effect<AnyModel>>],
    law: &'s NoiseLaw,
    space: Space,
    dictionary: Dictionary,
    null: NullLaw,
    /// Level of each family at which any is in alarm as often as is asked for.
    level: f64,
    quantities: Vec<Quantity>,
}

impl Plan<'_> {
    /// What it shows of an effect; nothing of one that no reading could show.
    fn row(&self, effect: &dyn Effect<AnyModel>) -> Option<Diagnosability> {
        let mut families = self.dictionary.families.iter();
        let family = families.position(|f| f.is_effect && f.name == effect.name())?;
        let visible = self.dictionary.families[family].visible;
        let first = effect.grid(self.model).into_iter().next();
        let first = first.map(|shape| effect.columns(self.model, &shape));
        let first = first.unwrap_or_default();
        let amplitudes = effect.amplitudes();
        let unit = amplitudes.first();
        let mut row = Diagnosability {
            effect: effect.name().to_owned(),
            visible,
            detectable: None,
            by_shape: None,
            at_least: false,
            identifiable: None,
            unit: unit.map_or(String::new(), |p| p.unit.to_owned()),
            confused_with: None,
            cosine: 0.0,
            rivals: Vec::new(),
            visible_rms: None,
            harm: self.harm(&first),
            harm_per_visible: Vec::new(),
        };
        let entry = typical(&self.dictionary, &self.dictionary.families[family]);
        if let Some(entry) = entry.filter(|_| visible >= PLANNED) {
            self.add_shown(&mut row, effect, (family, entry), &first);
        }
        Some(row)
    }

    /// Bias of each quantity per unit of an effect.
    fn harm(&self, columns: &[Column]) -> Vec<(String, f64, String)> {
        let Some(column) = columns.first() else {
            return Vec::new();
        };
        let full = column.dense(self.space.readings());
        let of = |q: &Quantity| (q.name.clone(), q.weights.dot(&full), q.unit.to_owned());
        self.quantities.iter().map(of).collect()
    }

    /// Adds what is shown of an effect by its typical entry; `first`: its signature at the first shape of the grid.
    fn add_shown(
        &self,
        row: &mut Diagnosability,
        effect: &dyn Effect<AnyModel>,
        (family, entry): (usize, &Entry),
        first: &[Column],
    ) {
        let (n, dictionary) = (self.space.readings(), &self.dictionary);
        let columns = dictionary.columns(entry);
        let (projected, _) = self.space.forward_columns(&columns);
        let length = projected.column(0).norm();
        let unit = projected.column(0) / length.max(f64::MIN_POSITIVE);
        let threshold = |order| self.null.threshold(family, self.level, order);
        let own = threshold(entry.order());
        let found = smallest((self.model, self.law), (length, &columns[0]), own);
        row.rivals = self.rivals(effect.name(), &unit, found.size * length);
        for (name, cosine) in &row.rivals {
            if *cosine > row.cosine {
                row.cosine = *cosine;
                row.confused_with = Some(name.clone());
            }
        }
        let most = greatest_plausible(effect);
        row.detectable = Some(found.size).filter(|size| *size <= most);
        row.by_shape = row.detectable.and_then(|_| {
            SizesByShape::new(dictionary, &dictionary.families[family], threshold, most)
        });
        row.at_least = found.at_least;
        let per_unit = length * self.law.sigma() / (n as f64).sqrt();
        // The harm is that of the first shape of the grid, so its own visible part counts.
        let part = self.space.gram(first).matrix[(0, 0)].sqrt() / length;
        let harm = row.harm.iter();
        row.harm_per_visible = harm
            .map(|(name, bias, unit)| (name.clone(), bias / (part * per_unit), unit.clone()))
            .collect();
        row.visible_rms = Some(found.size * per_unit);
        let half_angle = 0.5 * row.cosine.acos();
        row.identifiable = (half_angle.sin() > 1e-3)
            .then(|| (normal_quantile(TELL) / (length * half_angle.sin())).max(found.size))
            .filter(|size| *size <= most);
    }

    /// Every other effect that could imitate a signature of unit length at a signal-to-noise ratio, with the greatest
    /// cosine; what that takes must be plausible.
    fn rivals(&self, name: &str, unit: &DVector<f64>, ratio: f64) -> Vec<(String, f64)> {
        let column = DMatrix::from_column_slice(unit.len(), 1, unit.as_slice());
        let adjoint = self.space.adjoint(column).column(0).clone_owned();
        let adjoint = self.dictionary.places.sums_of(&adjoint);
        let nearest = |other: &dyn Effect<AnyModel>| -> Option<f64> {
            let mut families = self.dictionary.families.iter();
            let rival = families
                .find(|f| f.is_effect && f.name == other.name() && f.visible >= INVISIBLE)?;
            let entries = self.dictionary.entries[rival.entries.clone()].iter();
            let effects = entries.filter(|entry| matches!(entry.meaning, Meaning::Effect(_)));
            let cosines = effects.filter_map(|entry| {
                let square = statistic(&entry.gram, &entry.score(&adjoint), false);
                let cosine = square.clamp(0.0, 1.0).sqrt();
                let needed = ratio * cosine / entry.gram[(0, 0)].sqrt();
                (needed <= greatest_plausible(other)).then_some(cosine)
            });
            Some(cosines.fold(0.0, f64::max)).filter(|cosine| *cosine > 0.0)
        };
        let others = self.catalogue.iter().filter(|o| o.name() != name);
        others
            .filter_map(|other| Some((other.name().to_owned(), nearest(other.as_ref())?)))
            .collect()
    }
}

/// The greatest plausible size of an effect.
pub(crate) fn greatest_plausible(effect: &dyn Effect<AnyModel>) -> f64 {
    effect
        .amplitudes()
        .first()
        .map_or(f64::INFINITY, |p| p.low.abs().max(p.high.abs()))
}
