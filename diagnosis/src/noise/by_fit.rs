//! Single readings that stand out where repeats are too few to tell: of what a fit leaves, along each trace.
//!
//! Of a single reading that is off, the fit leaves more in that reading than in any other at its position. Where one
//! reading of each channel stands at a position all of them may show it alike; then each is pulled in, which takes off what
//! the fit leaves there and nothing else.

use std::collections::BTreeMap;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;

use crate::levels::KEPT;
use crate::noise::piles::{Heights, Pile, edge, over_neighbours, stands_out};
use crate::noise::spikes::Residual;

/// Rounds in which readings are pulled in: the fit follows a reading that is off, and leaves a part of it.
const ROUNDS: usize = 6;
/// A reading shows as much as another if it shows this part.
const AS_MUCH: f64 = 0.99;

/// Traces of too few repeats.
pub(crate) struct ByFit {
    piles: Vec<Pile>,
    pub residual: Residual,
    /// The readings at the position of each reading.
    together: Vec<Vec<usize>>,
    /// Standard deviation of a height from rounding alone.
    least: f64,
}

impl ByFit {
    pub fn new(model: &AnyModel, piles: Vec<Pile>, residual: Residual) -> Self {
        let mut at: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for (row, place) in model.places().iter().enumerate() {
            at.entry(place.x.to_bits()).or_default().push(row);
        }
        let places = model.places().iter();
        let together = places.map(|place| at.get(&place.x.to_bits()).cloned().unwrap_or_default());
        Self {
            piles,
            residual,
            together: together.collect(),
            least: model.rounding(),
        }
    }

    /// The variance of readings of white noise.
    pub fn variance(&self, readings: &DVector<f64>) -> f64 {
        (self.residual.of)(readings).norm_squared() / self.residual.freedom.max(1) as f64
    }

    /// What is left along each trace of each pile, with its heights.
    pub fn heights(&self, residual: &DVector<f64>) -> Vec<Vec<Heights>> {
        let of_trace =
            |rows: &Vec<usize>| over_neighbours(rows.iter().map(|row| residual[*row]).collect());
        let of_pile = |pile: &Pile| pile.traces.iter().map(of_trace).collect();
        self.piles.iter().map(of_pile).collect()
    }

    /// Pulls single spikes in, and counts them.
    pub fn pull_in(&self, readings: &mut DVector<f64>) -> usize {
        let mut limit = None;
        let mut touched = vec![false; readings.len()];
        for _ in 0..ROUNDS {
            let residual = (self.residual.of)(readings);
            let heights = self.heights(&residual);
            let Some(edge) = limit.or_else(|| edge(&heights, self.least)) else {
                return 0;
            };
            limit = Some(edge);
            let mut pulled = Vec::new();
            for (pile, heights) in self.piles.iter().zip(&heights) {
                for (own, (away, near)) in heights.iter().enumerate() {
                    for (k, height) in near.iter().enumerate() {
                        let row = pile.traces[own][k];
                        let spike = || {
                            stands_out(away, k, *height)
                                && self.farthest(&residual, row)
                                && is_of_one(heights, own, k)
                        };
                        if height.abs() > edge && spike() {
                            pulled.push((row, height - edge.copysign(*height)));
                        }
                    }
                }
            }
            if pulled.is_empty() {
                break;
            }
            for (row, excess) in pulled {
                readings[row] -= excess;
                touched[row] = true;
            }
        }
        touched.into_iter().filter(|touched| *touched).count()
    }

    /// Whether no other reading at the position is left farther off.
    fn farthest(&self, residual: &DVector<f64>, row: usize) -> bool {
        let own = residual[row].abs();
        let others = self.together[row].iter();
        others
            .into_iter()
            .all(|other| own >= AS_MUCH * residual[*other].abs())
    }
}

/// Whether the other traces of the channel do not show a height: what they show is no spike.
fn is_of_one(heights: &[Heights], own: usize, k: usize) -> bool {
    let height = heights[own].1[k];
    let mut others = (0..heights.len()).filter(|j| *j != own);
    others.all(|j| (height - heights[j].1[k]) * height.signum() > KEPT * height.abs())
}
