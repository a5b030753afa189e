//! Noise that is correlated along traces, as the closure profile tells it.
//!
//! (R1A + R1B − R2A − R2B)/2 has the covariance of the noise of one trace, whatever the forms are. White noise makes a slope
//! sure by n^−3/2; of noise that is correlated over many readings there are fewer independent ones.

use super::drift::Drifts;
use super::trace::Trace;
use crate::noise::{Law, Posterior, WithinCells, WithoutLines, decays, markov_form};
use crate::reversal::channel_noise::traces::MOST_CELLS;

/// Readings of a channel in a cell, at least, where channels are read at positions of their own.
const READINGS_A_CELL: usize = 2;

/// Adds to the covariance of the channels' slopes what correlated noise adds to that of white noise, `slopes` (variances,
/// (µm/mm)²), and of drifts, and gives its law for the mean of a channel's traces; nothing where it is likelier to be white. `closure`: the profile
/// (R1A + R1B − R2A − R2B)/4 at the positions of all traces, µm.
pub(super) fn add(
    drifts: &mut Drifts,
    traces: &[Trace],
    (x, closure): (&[f64], &[f64]),
    slopes: &[f64],
) -> Option<Law> {
    let as_often = |t: &Trace| t.count.iter().all(|n| *n == traces[0].count[0]);
    if !traces.iter().all(as_often) {
        return None;
    }
    let fewest = traces.iter().map(|t| t.x.len()).min().filter(|n| *n > 0)?;
    let alike = traces.iter().all(|t| t.x == x);
    // Between positions of a channel's own the profile is interpolated: what neighbours say beside means of several is not theirs.
    let each = match alike {
        true => x.len().div_ceil(MOST_CELLS),
        false => (READINGS_A_CELL * x.len())
            .div_ceil(fewest)
            .max(x.len().div_ceil(MOST_CELLS)),
    };
    let (mut within, mut places, mut means) = (WithinCells::default(), Vec::new(), Vec::new());
    for (x, closure) in x.chunks(each).zip(closure.chunks(each)) {
        let values = closure.iter().map(|c| 2.0 * c);
        let count = x.len() as f64;
        places.push(x.iter().sum::<f64>() / count);
        means.push(values.clone().sum::<f64>() / count);
        within.add(x[x.len() - 1] - x[0], values);
    }
    let mut values = WithoutLines::default();
    values.add(&places, means);
    let posterior = Posterior::of(&values)
        .filter(|p| p.may_be_noise(&within) && (alike || p.is_correlated()))?;
    let readings = each as f64 * fewest as f64 / x.len() as f64;
    let x = places;
    let middle = x.iter().sum::<f64>() / x.len() as f64;
    let spread: f64 = x.iter().map(|x| (x - middle).powi(2)).sum();
    let weights: Vec<f64> = x.iter().map(|x| (x - middle) / spread).collect();
    let white = 1.0 / spread;
    let of = posterior.possible().iter().map(|p| {
        let along = markov_form(&decays(&x, p.law.length), &weights, &weights);
        p.law.white * white + p.law.correlated * along
    });
    let (variance, freedom) = posterior.variance(&of.collect::<Vec<f64>>());
    for (c, white) in slopes.iter().enumerate() {
        let own = drifts.covariance[(c, c)];
        drifts.covariance[(c, c)] = own.max(variance - white);
    }
    drifts.freedom = drifts.freedom.min(freedom);
    if alike {
        return Some(within.law(&posterior));
    }
    let means = posterior.mean();
    Some(Law {
        white: readings * means.white,
        ..means
    })
}
