//! The axis that is simulated: targets that noise may have told apart from the extreme ones are as extreme.

use super::super::figures::{Figure, Profile};
use super::noise::Noise;

/// Targets less than this many standard deviations from the extreme one, as that is measured, are taken
/// to be as extreme: for figures of means, and for those that rest on scatter, whose greatest values
/// lie farther out. Both by the coverage that they give (`docs/validation/coverage.md`).
const TIED: f64 = 3.0;
const TIED_SCATTER: f64 = 2.0;

/// The means of an axis on which targets that noise may have told apart are alike: those that are extreme
/// for a figure, a few of its standard deviations at a target from the extreme one. `more`
/// is the variance of each mean beside its scatter.
pub(super) fn tied(figure: Figure, profile: &Profile, noise: &Noise, more: f64) -> [Vec<f64>; 2] {
    let [forward, backward] = [0, 1].map(|d| profile.mean[d].clone().unwrap_or_default());
    let both = forward.iter().zip(&backward);
    let middle: Vec<f64> = both.clone().map(|(f, b)| 0.5 * (f + b)).collect();
    let reversal: Vec<f64> = both.map(|(f, b)| f - b).collect();
    let joined = |middle: Vec<f64>, reversal: Vec<f64>| {
        let side = |sign: f64| {
            let both = middle.iter().zip(&reversal);
            both.map(|(m, b)| m + sign * 0.5 * b).collect::<Vec<_>>()
        };
        [side(1.0), side(-1.0)]
    };
    let of_mean = noise.variance(|f, _| f, 1.0) + more;
    // Variance of the standard deviation of one target and direction.
    let of_std = noise.variance_of_std();
    let of_reversal = noise.variance(|f, b| f - b, 2.0) + 2.0 * more;
    let tied = if figure.rests_on_scatter() {
        TIED_SCATTER
    } else {
        TIED
    };
    let width = |variance: f64| tied * variance.sqrt();
    match figure {
        Figure::EForward
        | Figure::AForward
        | Figure::EBackward
        | Figure::ABackward
        | Figure::E
        | Figure::A
        | Figure::P => {
            let variance = of_mean
                + match figure {
                    Figure::A | Figure::AForward | Figure::ABackward => 4.0 * of_std,
                    Figure::P => 4.5 * of_std,
                    _ => 0.0,
                };
            let used: Vec<f64> = figure
                .directions()
                .iter()
                .flat_map(|d| [&forward, &backward][d.index()].iter().copied())
                .collect();
            let (low, high) = drawn_in(&used, width(variance));
            [forward, backward].map(|side| side.iter().map(|m| m.clamp(low, high)).collect())
        }
        Figure::M | Figure::Pa => {
            let variance = noise.variance(|f, b| 0.5 * (f + b), 0.5) + 0.5 * more;
            let (low, high) = drawn_in(&middle, width(variance));
            joined(
                middle.iter().map(|m| m.clamp(low, high)).collect(),
                reversal,
            )
        }
        Figure::B | Figure::U | Figure::UMean | Figure::R => {
            let variance = match figure {
                Figure::R => of_reversal + 8.0 * of_std,
                _ => of_reversal,
            };
            let greatest = reversal.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let most = (greatest - width(variance)).max(0.0);
            joined(
                middle,
                reversal.iter().map(|b| b.clamp(-most, most)).collect(),
            )
        }
        Figure::BMean | Figure::RForward | Figure::RBackward | Figure::Ps | Figure::PsMean => {
            [forward, backward]
        }
    }
}

/// The range of values less `width` at either end; its middle where nothing is left.
fn drawn_in(values: &[f64], width: f64) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if high - low > 2.0 * width {
        (low + width, high - width)
    } else {
        let middle = low + 0.5 * (high - low);
        (middle, middle)
    }
}
