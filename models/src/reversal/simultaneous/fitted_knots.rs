//! The knots of a fit, and whether they are enough.

use rayon::prelude::*;

use super::knots::{KnotTrial, NoiseOfWaves};
use crate::reversal::channel_noise::white::Told;

/// Whether there are enough knots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KnotVerdict {
    /// Neighbouring residuals are not correlated.
    Enough,
    /// Neighbouring residuals go together: forms have detail that the knots cannot follow (or the
    /// noise itself is correlated).
    TooFew,
    /// Neighbouring residuals go together as the noise does, of which readings tell more than the model misses.
    AsTheNoise,
}

/// The knots of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedKnots {
    /// Break points on the slide's axis, mm.
    pub breaks: Vec<f64>,
    /// The ladder, where the number was chosen from the data.
    pub table: Vec<KnotTrial>,
    /// Correlation of residuals next to each other in a channel.
    pub neighbour_correlation: f64,
    /// That correlation in units of its standard deviation for white noise.
    pub neighbour_z: f64,
    /// What it says.
    pub verdict: KnotVerdict,
    /// The noise by which they were chosen, where its neighbours go together.
    pub(in crate::reversal) waves: Option<NoiseOfWaves>,
}

/// Correlation of neighbours beyond this many standard deviations is told.
const SUSPICIOUS_Z: f64 = 4.0;

impl FittedKnots {
    pub(in crate::reversal) fn new(
        breaks: Vec<f64>,
        table: Vec<KnotTrial>,
        residuals: &[Vec<f64>],
    ) -> Self {
        let sums: Vec<[f64; 3]> = residuals
            .par_iter()
            .map(|channel| {
                let count = channel.len() as f64;
                let scale = channel.iter().map(|r| r * r).sum::<f64>() / count;
                if !(scale > 0.0) {
                    return [0.0; 3];
                }
                let neighbours = channel.windows(2).map(|pair| pair[0] * pair[1]);
                [neighbours.sum::<f64>() / scale, count, count - 1.0]
            })
            .collect();
        let [products, squares, pairs] =
            [0, 1, 2].map(|k| sums.iter().map(|sum| sum[k]).sum::<f64>());
        let correlation = if squares > 0.0 {
            products / squares
        } else {
            0.0
        };
        // A fit with p unknowns leaves neighbours a correlation of about −p/m on average.
        let z = correlation * pairs.sqrt();
        let verdict = if z > SUSPICIOUS_Z {
            KnotVerdict::TooFew
        } else {
            KnotVerdict::Enough
        };
        Self {
            breaks,
            table,
            neighbour_correlation: correlation,
            neighbour_z: z,
            verdict,
            waves: None,
        }
    }

    /// The same under noise that is told apart from the model.
    pub(in crate::reversal) fn under(mut self, told: &Told) -> Self {
        let as_noise = told.scatter.correlated().is_some() && told.agreement.missed <= 0.0;
        if self.verdict == KnotVerdict::TooFew && as_noise {
            self.verdict = KnotVerdict::AsTheNoise;
        }
        self
    }

    /// The number of cells that the criterion alone would have, where it was refuted: of few readings it counts forms as noise.
    pub fn refuted(&self) -> Option<usize> {
        let best = self.table.iter().min_by(|a, b| a.aicc.total_cmp(&b.aicc))?;
        (best.cells < self.cells()).then_some(best.cells)
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.breaks.len() - 1
    }
}
