//! The smallest size in which an effect would be seen in some readings.
//!
//! An effect of size a, whose signature the fit leaves with the length L in units of the noise, reaches
//! the statistic T at which it stands out with the probability Φ(aL − √T). Where it has several
//! shapes, the one of median length stands for all: by the longest, sizes of the others would be told too
//! small, and the shortest may hardly show at all, so that no useful size would be told.
//! How far the sizes of its other shapes lie from that is told beside it.
//! What differs from repeat to repeat is taken for noise in part: it swells the noise as the repeats show
//! it, or makes it seem correlated, and so hides itself. Of such an effect the size is a lower bound.

use errsep_models::model::{AnyModel, Column, FittedModel};
use errsep_models::noise::Law;
use serde::Serialize;

use crate::detection::dictionary::{Dictionary, Entry, Family};
use crate::levels::{PASSES_FOR_NOISE, POWER, SWELLS, normal_quantile};
use crate::noise::contrasts::Contrasts;
use crate::noise::law::NoiseLaw;

/// The smallest size that is seen with 80 % probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Smallest {
    pub size: f64,
    /// Whether the effect is taken for noise in part, so that this is the least it may be.
    pub at_least: bool,
}

/// Part of the shapes that is left out at either end where their range is told.
const LEFT_OUT: f64 = 0.1;
/// Sizes of shapes that differ by less are alike.
const ALIKE: f64 = 1.2;

/// The smallest sizes of an effect over its shapes, without the tenth that shows best and the tenth that
/// shows worst.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizesByShape {
    /// Of the shape that shows best.
    pub from: f64,
    /// Of the shape that shows worst, its amplitudes in those proportions that show worst (two indicators that drift
    /// against each other); none where that shows at no plausible size.
    pub to: Option<f64>,
}

impl SizesByShape {
    /// Of a family; none where its shapes are alike. `statistic`: where a signature of so many columns stands out;
    /// `most`: the greatest plausible size.
    pub(crate) fn new(
        dictionary: &Dictionary,
        family: &Family,
        statistic: impl Fn(usize) -> f64,
        most: f64,
    ) -> Option<Self> {
        let shapes = by_length(dictionary, family);
        let size = |square: f64, entry: &Entry| {
            let length = square.max(0.0).sqrt().max(f64::MIN_POSITIVE);
            least_size(length, statistic(entry.order()))
        };
        let (best, worst) = ends(shapes.len(), family.unseen);
        let from = (shapes.get(best)).map(|entry| size(entry.gram[(0, 0)], entry))?;
        let mut least: Vec<f64> = (shapes.iter())
            .map(|entry| size(entry.gram.symmetric_eigenvalues().min(), entry))
            .collect();
        least.sort_by(|a, b| b.total_cmp(a));
        let to = worst.and_then(|worst| least.get(worst)).copied();
        let alike = to.is_some_and(|to| to <= ALIKE * from);
        (!alike).then(|| Self {
            from,
            to: to.filter(|size| *size <= most),
        })
    }
}

/// Which of the shapes that show, the shortest first, stands for those that show best, and which for those that show
/// worst; none where so many show at no size that one of these does.
fn ends(shown: usize, unseen: usize) -> (usize, Option<usize>) {
    let left_out = (LEFT_OUT * (shown + unseen) as f64) as usize;
    let best = shown.saturating_sub(1 + left_out);
    (best, left_out.checked_sub(unseen))
}

/// The shape of an effect that stands for all of its family: that of median length beside the fit.
pub(crate) fn typical<'d>(dictionary: &'d Dictionary, family: &Family) -> Option<&'d Entry> {
    let shapes = by_length(dictionary, family);
    shapes.get(shapes.len() / 2).copied()
}

fn by_length<'d>(dictionary: &'d Dictionary, family: &Family) -> Vec<&'d Entry> {
    let mut shapes: Vec<&Entry> = dictionary.entries[family.entries.clone()].iter().collect();
    shapes.sort_by(|a, b| a.gram[(0, 0)].total_cmp(&b.gram[(0, 0)]));
    shapes
}

fn least_size(length: f64, statistic: f64) -> f64 {
    (statistic.sqrt() + normal_quantile(POWER)) / length
}

/// The smallest size of an effect in a shape: `length` and `signature` per unit of its size, `statistic` where a
/// signature of so many columns stands out.
pub(crate) fn smallest(
    (model, law): (&AnyModel, &NoiseLaw),
    (length, signature): (f64, &Column),
    statistic: f64,
) -> Smallest {
    let size = least_size(length, statistic);
    Smallest {
        size,
        at_least: model.stated_noise().is_none() && swells(model, law, signature, size),
    }
}

/// Whether an effect of a size changes what the differences between repeats tell of the noise.
fn swells(model: &AnyModel, law: &NoiseLaw, signature: &Column, size: f64) -> bool {
    let full = signature.dense(model.places().len());
    let contrasts = Contrasts::of(model, &full);
    if contrasts.count() == 0 {
        return false;
    }
    let white = law.parts.white.max(f64::MIN_POSITIVE);
    if model.correlated_noise() && contrasts.reach().is_some() {
        let seen = contrasts.likelihood(&Law { white, ..law.parts });
        return size * size * seen.quadratic / white > PASSES_FOR_NOISE;
    }
    let (variance, _) = contrasts.scatter();
    size * size * variance / white > SWELLS
}

#[cfg(test)]
mod tests {
    use super::ends;

    /// Exact limits: all show; a tenth shows at no size; more do; fewer show than are left out.
    #[test]
    fn a_tenth_is_left_out_at_either_end() {
        assert_eq!(ends(20, 0), (17, Some(2)));
        assert_eq!(ends(18, 2), (15, Some(0)));
        assert_eq!(ends(17, 3), (14, None));
        assert_eq!(ends(2, 28), (0, None));
        assert_eq!(ends(1, 0), (0, Some(0)));
    }
}
