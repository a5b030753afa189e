//! Forms at few positions.
//!
//! With m readings and p unknowns the corrected criterion adds 2pm/(m − p − 1), which outweighs any misfit as p comes
//! near m: forms of 2 µm read at seven positions with a noise of 0.05 µm would be smoothed away and told as noise.
//! Four channels close whatever the forms are, so that the finest rung that the positions carry still tells the
//! noise, by which a coarser one is judged: F = ((RSS − RSS₀)/(p₀ − p)) / (RSS₀/(m − p₀)) (Fisher).

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{
    Choice, Climbed, FEWEST_FREE, FEWEST_POSITIONS, KnotTrial, POSITIONS_A_CELL, RungFit, Squares,
    positions, trial,
};
use crate::basis::bspline::CubicBSpline;
use crate::reversal::simultaneous::ReversalError;
use crate::reversal::simultaneous::unknowns::Unknowns;

/// Where the ladder carries fewer cells the positions are few.
const CELLS: usize = 12;

/// Probability under noise alone below which a rung leaves more than noise.
const LEVEL: f64 = 0.01;

/// Whether so many positions are few.
pub fn are_few(positions: usize) -> bool {
    positions / POSITIONS_A_CELL < CELLS
}

impl Choice<'_> {
    /// Takes in place of the best rung the one with the fewest cells that leaves no more than the finest does but for
    /// noise, where the best leaves more.
    pub(super) fn climb_to_the_finest(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
        squares: &mut impl FnMut(
            Unknowns,
            Vec<CubicBSpline>,
        ) -> Result<Option<(Squares, RungFit)>, ReversalError>,
        climbed: &mut Climbed,
    ) -> Result<(), ReversalError> {
        let readings = self.readings();
        let places = positions(self.channels);
        let most = places.saturating_sub(FEWEST_POSITIONS - 1);
        let mut finer: Vec<(KnotTrial, RungFit)> = Vec::new();
        for cells in places / POSITIONS_A_CELL + 1..=most {
            let (unknowns, bases) = self.rung(unknowns_of, cells)?;
            let (count, cells) = (unknowns.free_count(), bases[0].cell_count());
            let known = climbed.table.iter().chain(finer.iter().map(|f| &f.0));
            if readings < count + FEWEST_FREE || known.last().is_some_and(|t| t.cells >= cells) {
                break;
            }
            let Some((squares, fit)) = squares(unknowns, bases)? else {
                break;
            };
            let trial = trial(cells, readings, count, squares.left);
            finer.push((trial, fit));
        }
        let Some((finest, ..)) = finer.last() else {
            return Ok(());
        };
        let (finest, best) = (*finest, climbed.table.get(climbed.best).copied());
        let enough = |rung: &KnotTrial| !leaves_more(rung, &finest, readings);
        if best.as_ref().is_none_or(enough) {
            return Ok(());
        }
        for (trial, fit) in finer {
            climbed.push(trial, fit);
        }
        let passes = climbed.table[climbed.best + 1..].iter().position(enough);
        if let Some(after) = passes {
            climbed.best += 1 + after;
        }
        Ok(())
    }
}

/// Whether a rung leaves more than the finest does and noise allows.
pub fn leaves_more(rung: &KnotTrial, finest: &KnotTrial, readings: usize) -> bool {
    let free = |t: &KnotTrial| (readings - t.unknowns) as f64;
    let left = |t: &KnotTrial| t.noise * t.noise * free(t);
    let more = free(rung) - free(finest);
    if more <= 0.0 {
        return false;
    }
    let ratio = (left(rung) - left(finest)) / more / finest.noise.powi(2).max(f64::MIN_POSITIVE);
    FisherSnedecor::new(more, free(finest)).is_ok_and(|law| law.sf(ratio.max(0.0)) < LEVEL)
}
