//! Forms at few positions or of few readings.
//!
//! With m readings and p unknowns the corrected criterion adds 2pm/(m − p − 1), which outweighs any misfit as p comes
//! near m: forms of 2 µm read at seven positions with a noise of 0.05 µm would be smoothed away and told as noise.
//! Four channels close whatever the forms are, so that the finest rung that the positions carry still tells the
//! noise, by which a coarser one is judged: F = ((RSS − RSS₀)/(p₀ − p)) / (RSS₀/(m − p₀)) (Fisher).

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{
    Carried, Choice, Climbed, FEWEST_FREE, KnotTrial, RungFit, Squares, ladder, positions, trial,
};
use crate::basis::bspline::CubicBSpline;
use crate::reversal::simultaneous::ReversalError;
use crate::reversal::simultaneous::unknowns::Unknowns;

/// Fewer positions are few whatever the readings.
const POSITIONS: usize = 36;

/// Readings an unknown of the last rung that was tried, below which they are few: the correction is a fifth of the
/// criterion's penalty there, and grows from rung to rung.
const READINGS: usize = 6;

/// Probability under noise alone below which a rung leaves more than noise: where the finest leaves few degrees of
/// freedom, and so shows little, and elsewhere.
const LEVELS: [f64; 2] = [0.01, 0.001];

/// Fewer degrees of freedom than these are few.
const FREE: f64 = 50.0;

/// Whether so many positions, or so many readings beside the unknowns of the last rung that was tried, are few.
pub fn are_few(positions: usize, readings: usize, unknowns: usize) -> bool {
    positions < POSITIONS || readings < READINGS * unknowns
}

/// Cells beyond so many that are carried: any number where positions are few, else those of the ladder.
pub fn beyond(
    cells: usize,
    positions: usize,
    carried: &Carried<'_>,
    carries: impl Fn(usize) -> bool,
) -> Vec<usize> {
    if positions < POSITIONS {
        carried.rungs(cells + 1.., carries).collect()
    } else {
        let rungs = ladder().filter(|rung| *rung > cells);
        carried.rungs(rungs, carries).collect()
    }
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
        carried: &Carried<'_>,
    ) -> Result<(), ReversalError> {
        let readings = self.readings();
        let tried = climbed.table.last().map_or(0, |t| t.cells);
        let mut finer: Vec<(KnotTrial, RungFit)> = Vec::new();
        let carries = |cells: usize| self.carries(unknowns_of, carried, cells);
        for cells in beyond(tried, positions(self.channels), carried, carries) {
            let (unknowns, bases) = self.rung(unknowns_of, cells)?;
            let (count, cells) = (unknowns.free_count(), bases[0].cell_count());
            if readings < count + FEWEST_FREE {
                break;
            }
            if cells <= finer.last().map_or(tried, |(t, _)| t.cells) {
                continue;
            }
            let Some((squares, fit)) = squares(unknowns, bases)? else {
                break;
            };
            let trial = trial(cells, readings, count, squares.left);
            finer.push((trial, fit));
        }
        let finest = finer.last().map(|f| f.0).or(climbed.table.last().copied());
        let Some(finest) = finest else {
            return Ok(());
        };
        let best = climbed.table.get(climbed.best).copied();
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
    let level = LEVELS[usize::from(free(finest) >= FREE)];
    FisherSnedecor::new(more, free(finest)).is_ok_and(|law| law.sf(ratio.max(0.0)) < level)
}
