//! The noise of readings that are taken along traces, and what repeats tell of it.
//!
//! One reading = white noise + a part that is correlated along its trace (Ornstein–Uhlenbeck: a Markov
//! process of variance o and correlation exp(−|Δx|/ℓ)) + a shift of the whole trace + a line by
//! which the whole trace drifts about its middle. [`Law`] holds the variances, [`Contrasts`] what differs between repeats of a trace, and [`Posterior`] which laws
//! these, or other [values](NoiseValues) that hold nothing but noise, allow. Nothing here needs a matrix of
//! readings × readings: every product with a covariance is one pass along the trace, at any spacing.

mod contrasts;
mod grid;
mod law;
mod likelihood;
mod moments;
mod posterior;
mod within_cells;
mod without_lines;

pub use contrasts::Contrasts;
pub use law::{Law, about_middle, decays, drift_form, markov_form};
pub use likelihood::{Likelihood, Likelihoods, OfWhole};
pub use moments::Moments;
pub use posterior::{NoiseValues, Possible, Posterior};
pub use within_cells::WithinCells;
pub use without_lines::WithoutLines;

/// A trace of this many readings can show what is correlated along it.
const LONG: usize = 20;

/// Shorter traces of so many readings can show it together, if they have so many readings in all.
const TOGETHER: (usize, usize) = (8, 100);

/// Least mean spacing and greatest length of the traces that are long enough to show more than white noise: 20 readings, or 8
/// where such traces have a hundred readings together; none where no trace is.
///
/// `traces`: number of readings of each with the positions of the first and the last.
pub fn spacing_and_length(
    traces: impl Iterator<Item = (usize, f64, f64)> + Clone,
) -> Option<(f64, f64)> {
    let (short, enough) = TOGETHER;
    let counts = traces.clone().map(|(count, _, _)| count);
    let together: usize = counts.filter(|count| *count >= short).sum();
    let least = if together >= enough { short } else { LONG };
    let long = traces.filter(|(count, _, _)| *count >= least);
    let each = long.map(|(count, first, last)| {
        let length = (last - first).abs();
        (length / (count - 1) as f64, length)
    });
    each.filter(|(spacing, _)| *spacing > 0.0 && spacing.is_finite())
        .reduce(|(a, b), (spacing, length)| (a.min(spacing), b.max(length)))
}

/// Number of positions with the first and the last.
fn ends(positions: &[f64]) -> Option<(usize, f64, f64)> {
    Some((positions.len(), *positions.first()?, *positions.last()?))
}
