//! The diagnosability certificate: what a plan of measurement can show, before any data.
//!
//! With Ê the projected, whitened signature: an effect of amplitude a has the signal-to-noise
//! ratio a|Ê|. It is seen with 80 % probability from (√T + 0.84)/|Ê|, T the threshold of its
//! family (`detection/smallest.rs`: where it has several shapes or differs from repeat to repeat); it is
//! told from another whose signature makes an angle θ with its own, with 99 % probability, from
//! 2.33/(|Ê| sin θ/2) (difference of two chi-squared statistics as a product of two normal variables).

use std::sync::Arc;

use errsep_models::model::{AnyModel, Effect, FittedModel};
use nalgebra::DMatrix;
use serde::Serialize;

use crate::diagnosis::detection::dictionary::{Dictionary, Meaning, Places, statistic};
use crate::diagnosis::detection::null::NullLaw;
use crate::diagnosis::detection::smallest::{SizesByShape, smallest, typical};
use crate::diagnosis::detection::space::Space;
use crate::diagnosis::levels::{INVISIBLE, PLANNED, TELL, normal_quantile};
use crate::diagnosis::noise::law::NoiseLaw;
use crate::diagnosis::options::Options;

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
pub(in crate::diagnosis) fn certificate(
    model: &AnyModel,
    catalogue: &[Box<dyn Effect<AnyModel>>],
    law: &NoiseLaw,
    options: &Options,
) -> Vec<Diagnosability> {
    let space = Space::expecting(model, law);
    let places = Arc::new(Places::new(model));
    let dictionary = Dictionary::new(model, catalogue, places, &space);
    let null = NullLaw::simulate(model, &dictionary, &space, law, options.draws, options.seed);
    let quantities = model.quantities();
    let level = null.level(options.false_alarm);
    let n = space.readings();
    let mut rows = Vec::new();
    for effect in catalogue {
        let Some(family) = dictionary
            .families
            .iter()
            .position(|f| f.is_effect && f.name == effect.name())
        else {
            continue;
        };
        let visible = dictionary.families[family].visible;
        let first = effect
            .grid(model)
            .into_iter()
            .next()
            .map(|shape| effect.columns(model, &shape))
            .unwrap_or_default();
        let harm = first.first().map_or_else(Vec::new, |column| {
            let full = column.dense(n);
            quantities
                .iter()
                .map(|q| (q.name.clone(), q.weights.dot(&full), q.unit.to_owned()))
                .collect()
        });
        let mut row = Diagnosability {
            effect: effect.name().to_owned(),
            visible,
            detectable: None,
            by_shape: None,
            at_least: false,
            identifiable: None,
            unit: effect
                .amplitudes()
                .first()
                .map_or(String::new(), |p| p.unit.to_owned()),
            confused_with: None,
            cosine: 0.0,
            rivals: Vec::new(),
            visible_rms: None,
            harm,
            harm_per_visible: Vec::new(),
        };
        let entry = typical(&dictionary, &dictionary.families[family]);
        if let Some(entry) = entry.filter(|_| visible >= PLANNED) {
            let columns = dictionary.columns(entry);
            let (projected, _) = space.forward_columns(&columns);
            let length = projected.column(0).norm();
            let unit = projected.column(0) / length.max(f64::MIN_POSITIVE);
            let adjoint = space
                .adjoint(DMatrix::from_column_slice(n, 1, unit.as_slice()))
                .column(0)
                .clone_owned();
            let adjoint = dictionary.places.sums_of(&adjoint);
            let threshold = null.threshold(family, level, entry.order());
            let found = smallest((model, law), (length, &columns[0]), threshold);
            for other in catalogue.iter().filter(|o| o.name() != effect.name()) {
                let Some(rival) = dictionary
                    .families
                    .iter()
                    .find(|f| f.is_effect && f.name == other.name() && f.visible >= INVISIBLE)
                else {
                    continue;
                };
                let mut nearest: f64 = 0.0;
                for candidate in &dictionary.entries[rival.entries.clone()] {
                    let score = candidate.score(&adjoint);
                    let cosine = statistic(&candidate.gram, &score, false)
                        .clamp(0.0, 1.0)
                        .sqrt();
                    // What it takes to imitate the smallest size that is seen must be plausible.
                    let needed = found.size * length * cosine / candidate.gram[(0, 0)].sqrt();
                    if needed > greatest_plausible(other.as_ref())
                        || !matches!(candidate.meaning, Meaning::Effect(_))
                    {
                        continue;
                    }
                    nearest = nearest.max(cosine);
                    if cosine > row.cosine {
                        row.cosine = cosine;
                        row.confused_with = Some(other.name().to_owned());
                    }
                }
                if nearest > 0.0 {
                    row.rivals.push((other.name().to_owned(), nearest));
                }
            }
            let most = greatest_plausible(effect.as_ref());
            row.detectable = Some(found.size).filter(|size| *size <= most);
            row.by_shape = row.detectable.and_then(|_| {
                let threshold = |order| null.threshold(family, level, order);
                SizesByShape::new(&dictionary, &dictionary.families[family], threshold, most)
            });
            row.at_least = found.at_least;
            let per_unit = length * law.sigma() / (n as f64).sqrt();
            // The harm is that of the first shape of the grid, so its own visible part counts.
            let first = space.gram(&first).matrix[(0, 0)].sqrt() / length;
            row.harm_per_visible = row
                .harm
                .iter()
                .map(|(name, bias, unit)| (name.clone(), bias / (first * per_unit), unit.clone()))
                .collect();
            row.visible_rms = Some(found.size * length * law.sigma() / (n as f64).sqrt());
            let half_angle = 0.5 * row.cosine.acos();
            row.identifiable = (half_angle.sin() > 1e-3)
                .then(|| (normal_quantile(TELL) / (length * half_angle.sin())).max(found.size))
                .filter(|size| *size <= most);
        }
        rows.push(row);
    }
    rows
}

/// The greatest plausible size of an effect.
pub(in crate::diagnosis) fn greatest_plausible(effect: &dyn Effect<AnyModel>) -> f64 {
    effect
        .amplitudes()
        .first()
        .map_or(f64::INFINITY, |p| p.low.abs().max(p.high.abs()))
}
