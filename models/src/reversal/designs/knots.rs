//! How many knots each form of a design has, from the data.
//!
//! At the slopes of the channels' lines the cost of the linear fit is that of one linear problem; the least
//! corrected Akaike criterion of all unknowns decides
//! ([`knots`](crate::reversal::simultaneous::knots)). First all forms go up the ladder together, then each
//! form by itself up and down from there while that lowers the criterion, in turn until none moves. With few readings a
//! rung that leaves more than the finest does is refuted, as there: all forms take the fewest cells that are not, and
//! then each by itself fewer as long as they are not.

use std::collections::HashMap;

use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance, Solved};
use errsep_solvers::structured::{StructuredProblem, evaluate};
use nalgebra::DVector;

use super::error::DesignFitError;
use super::fit::FEWEST_FREE;
use super::ground::Ground;
use super::problem::DesignProblem;
use super::readings::range;
use super::staged;
use crate::reversal::finer_forms::{Curves, FinerForms};
use crate::reversal::simultaneous::Knots;
use crate::reversal::simultaneous::knots::breaks::breaks as breaks_of;
use crate::reversal::simultaneous::knots::{
    Carried, KnotTrial, NoiseOfWaves, PATIENCE, REFUSED, ladder, sparse, trial,
};

/// The break points of a fit.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    /// By form, mm.
    pub breaks: Vec<Vec<f64>>,
    /// Those that all forms together would have, mm.
    pub common: Vec<f64>,
    /// The ladder of all forms together, where they are chosen.
    pub table: Vec<KnotTrial>,
    /// The forms on them and on finer ones, where they are chosen.
    pub forms: Option<FinerForms>,
}

/// Times each form is tried again.
const ROUNDS: usize = 4;

/// Rungs that a form looks beyond one that is no better.
const BEYOND: usize = 2;

/// Cells of the finest form a cell of the coarsest: a row spans three cells of each form, in which all
/// unknowns of the finest lie side by side, and the cost grows with the square of their number.
const FINEST: usize = 8;

/// The break points that the options ask for, or that the data choose: by the waves of the noise, where they are known.
///
/// # Errors
/// [`DesignFitError`] where the readings do not carry them.
pub(super) fn breaks(
    ground: &Ground,
    waves: Option<NoiseOfWaves>,
) -> Result<Chosen, DesignFitError> {
    let alike = |breaks: Vec<f64>, table| Chosen {
        breaks: vec![breaks.clone(); ground.layout.forms.len()],
        common: breaks,
        table,
        forms: None,
    };
    match &ground.options.knots {
        Knots::At(breaks) => Ok(alike(breaks.clone(), Vec::new())),
        Knots::Cells(asked) => match ground.most_cells() {
            most if *asked > most && most > 0 => {
                let asked = *asked;
                Err(DesignFitError::TooManyKnots { asked, most })
            }
            _ => Ok(alike(on_cells(ground, *asked), Vec::new())),
        },
        Knots::Chosen => {
            let mut rungs = Rungs::new(ground, waves);
            let (best, mut table) = rungs.together()?;
            let refuting = rungs.refuting(best, &mut table)?;
            let forms = ground.layout.forms.len();
            let own: Vec<Vec<f64>> = match &refuting {
                Some((breaks, finest)) => rungs.fewer(breaks, finest)?,
                None if ground.options.alike => vec![rungs.breaks[best].clone(); forms],
                None => {
                    let own = rungs.by_form(best)?;
                    own.iter().map(|r| rungs.breaks[*r].clone()).collect()
                }
            };
            let common = refuting.map_or_else(|| rungs.breaks[best].clone(), |own| own.0);
            Ok(Chosen {
                forms: rungs.finer(&own, common.len() - 1)?,
                breaks: own,
                common,
                table,
            })
        }
    }
}

/// Breaks of so many cells.
fn on_cells(ground: &Ground, cells: usize) -> Vec<f64> {
    let (low, high) = range(ground.traces);
    let mut told: HashMap<Vec<bool>, bool> = HashMap::new();
    breaks_of(&positions(ground), [low, high], cells, |seen| {
        let known = told.get(seen).copied();
        known.unwrap_or_else(|| {
            let apart = staged::tell_apart(&ground.determined.forms, seen);
            told.insert(seen.to_vec(), apart);
            apart
        })
    })
}

/// Of the traces, mm, in ascending order.
fn positions<'g>(ground: &'g Ground) -> Vec<&'g [f64]> {
    ground.traces.iter().map(|t| t.x.as_slice()).collect()
}

/// The ladder of cells.
struct Rungs<'g, 'a> {
    ground: &'g Ground<'a>,
    waves: Option<NoiseOfWaves>,
    carried: Carried<'g>,
    /// Place in the ladder of the next rung.
    next: usize,
    /// Different break points, finer and finer, mm.
    breaks: Vec<Vec<f64>>,
    /// What was tried, by the rung of each form: the criterion, where the readings carry it.
    tried: HashMap<Vec<usize>, Option<f64>>,
    /// The forms on the rungs of the ladder of all forms together.
    ladder: Vec<Curves>,
}

impl<'g, 'a> Rungs<'g, 'a> {
    fn new(ground: &'g Ground<'a>, waves: Option<NoiseOfWaves>) -> Self {
        let mut rungs = Self {
            ground,
            waves,
            carried: Carried::by(positions(ground), ground.finest),
            next: 0,
            breaks: Vec::new(),
            tried: HashMap::new(),
            ladder: Vec::new(),
        };
        let surely = |rungs: &Self, cells| {
            let breaks = |cells| on_cells(rungs.ground, cells);
            rungs.carried.surely_carries(cells, breaks)
        };
        while rungs.goes_on(0, surely) {}
        rungs
    }

    /// Adds the next different rung of the ladder that is carried, unless more in a row are refused; in place of one that is
    /// refused the most cells below it that are carried.
    fn goes_on(&mut self, mut refused: usize, carries: impl Fn(&Self, usize) -> bool) -> bool {
        while let Some(cells) = ladder().nth(self.next) {
            if self.carried.at_most(cells) < cells {
                break;
            }
            let last = self.breaks.last().map_or(0, |breaks| breaks.len() - 1);
            let found = if refused == 0 {
                Some(cells).filter(|cells| carries(self, *cells))
            } else {
                self.carried
                    .below(cells, last, |cells| carries(self, cells))
            };
            if found != Some(cells) {
                if refused == 0 {
                    break;
                }
                refused -= 1;
            }
            self.next += 1;
            let own = found.map(|cells| on_cells(self.ground, cells));
            if let Some(own) = own.filter(|own| own.len() > last + 1) {
                self.breaks.push(own);
                return true;
            }
        }
        false
    }

    /// Whether the positions carry a rung of so many cells.
    fn carries(&self, cells: usize) -> bool {
        let variances = |cells| sureness(self.ground, cells);
        self.carried
            .carries(cells, |cells| on_cells(self.ground, cells), variances)
    }

    /// The trial of a rung for each form; `None` where the readings do not carry it.
    fn trial(&self, rungs: &[usize]) -> Result<Option<KnotTrial>, DesignFitError> {
        let breaks = rungs.iter().map(|r| self.breaks[*r].clone()).collect();
        Ok(self.fitted(breaks)?.map(|own| own.0))
    }

    /// The trial of some breaks for each form, and the forms; `None` where the readings do not carry them.
    fn fitted(&self, breaks: Vec<Vec<f64>>) -> Result<Option<(KnotTrial, Curves)>, DesignFitError> {
        let readings = self.ground.readings();
        let cells: Vec<usize> = breaks.iter().map(|b| b.len() - 1).collect();
        let most = cells.iter().copied().max().unwrap_or(0);
        let (problem, start) = self.ground.problem(breaks)?;
        let count = problem.layout.free_count();
        if readings < count + FEWEST_FREE {
            return Ok(None);
        }
        let evaluation = evaluate(&problem, &start)?;
        let found = squares_left(&problem, &evaluation.system);
        Ok(found.map(|(squares, step)| {
            let there = start.stepped(&step.band, &step.border);
            let curves = Curves {
                cubics: problem.cubics(&there),
                bases: problem.splines.bases.clone(),
            };
            let own = trial(most, readings, count, squares);
            let under = |waves: NoiseOfWaves| {
                let more = cells.iter().map(|c| waves.more(*c)).sum();
                own.taking_up(readings, more, waves.variance())
            };
            let own = self.waves.map_or(own, under);
            (own, curves)
        }))
    }

    /// The forms on their breaks and on finer ones, no form's coarser than the cells that are best for all together;
    /// `None` where the readings carry none.
    fn finer(self, own: &[Vec<f64>], common: usize) -> Result<Option<FinerForms>, DesignFitError> {
        let finer = own.iter().map(|b| {
            let cells = b.len() - 1;
            let finer = self.carried.finer(cells, |cells| self.carries(cells));
            on_cells(self.ground, finer.unwrap_or(cells).max(common))
        });
        let finer: Vec<Vec<f64>> = finer.collect();
        let mut both = own.iter().zip(&finer);
        if both.any(|(own, finer)| finer.len() <= own.len()) {
            return Ok(None);
        }
        let taken = self.fitted(own.to_vec())?.map(|own| own.1);
        let finer = self.fitted(finer)?.map(|own| own.1);
        let x = self.ground.most_read();
        Ok(taken
            .zip(finer)
            .map(|(taken, finer)| FinerForms::new(taken, finer, self.ladder, x)))
    }

    /// The fewest cells, of all forms alike, that leave no more than the finest but for noise, where readings are few and
    /// the best of the ladder leaves more; and the finest.
    fn refuting(
        &self,
        best: usize,
        table: &mut Vec<KnotTrial>,
    ) -> Result<Option<(Vec<f64>, KnotTrial)>, DesignFitError> {
        let Some(taken) = table.get(best).copied() else {
            return Ok(None);
        };
        let (positions, readings) = (self.ground.positions(), self.ground.readings());
        let last = table.last().map_or(0, |t| t.unknowns);
        if !sparse::are_few(positions, readings, last) {
            return Ok(None);
        }
        let forms = self.ground.layout.forms.len();
        let on = |cells: usize| -> Result<_, DesignFitError> {
            let breaks = on_cells(self.ground, cells);
            let fitted = self.fitted(vec![breaks.clone(); forms])?;
            Ok(fitted.map(|own| (breaks, own.0)))
        };
        let mut finest = None;
        let beyond = sparse::beyond(taken.cells, positions, &self.carried, |cells| {
            self.carries(cells)
        });
        for cells in beyond.iter().rev().copied() {
            finest = on(cells)?;
            if finest.is_some() {
                break;
            }
        }
        let Some((_, finest)) = finest else {
            return Ok(None);
        };
        if !sparse::leaves_more(&taken, &finest, readings) {
            return Ok(None);
        }
        table.truncate(best + 1);
        for cells in beyond {
            let Some((breaks, own)) = on(cells)? else {
                break;
            };
            if table.last().is_some_and(|before| before.cells < own.cells) {
                table.push(own);
                if !sparse::leaves_more(&own, &finest, readings) {
                    return Ok(Some((breaks, finest)));
                }
            }
        }
        Ok(None)
    }

    /// The breaks of each form, of rungs below these common ones, that still leave no more than the finest but for noise.
    fn fewer(&self, common: &[f64], finest: &KnotTrial) -> Result<Vec<Vec<f64>>, DesignFitError> {
        let mut own = vec![common.to_vec(); self.ground.layout.forms.len()];
        if self.ground.options.alike {
            return Ok(own);
        }
        let coarser = self.breaks.iter().filter(|b| b.len() < common.len());
        let coarser: Vec<&Vec<f64>> = coarser.rev().collect();
        for form in 0..own.len() {
            for breaks in &coarser {
                let mut tried = own.clone();
                tried[form] = (*breaks).clone();
                let fitted = if near(tried.iter().map(|b| b.len() - 1)) {
                    self.fitted(tried.clone())?
                } else {
                    None
                };
                let passes =
                    |t: &KnotTrial| !sparse::leaves_more(t, finest, self.ground.readings());
                if !fitted.is_some_and(|(t, _)| passes(&t)) {
                    break;
                }
                own = tried;
            }
        }
        Ok(own)
    }

    /// Goes up the ladder with all forms together: the best rung, and the table.
    fn together(&mut self) -> Result<(usize, Vec<KnotTrial>), DesignFitError> {
        let (mut table, mut best): (Vec<KnotTrial>, usize) = (Vec::new(), 0);
        let forms = self.ground.layout.forms.len();
        for rung in 0.. {
            if rung == self.breaks.len() && !self.goes_on(REFUSED, Self::carries) {
                break;
            }
            let all = vec![rung; forms];
            let breaks = vec![self.breaks[rung].clone(); forms];
            let fitted = self.fitted(breaks)?;
            self.tried
                .insert(all, fitted.as_ref().map(|own| own.0.aicc));
            let Some((own, curves)) = fitted else {
                break;
            };
            self.ladder.push(curves);
            table.push(own);
            if own.aicc < table[best].aicc {
                best = rung;
            } else if rung >= best + PATIENCE {
                break;
            }
        }
        Ok((best, table))
    }

    fn criterion(&mut self, rungs: &[usize]) -> Result<f64, DesignFitError> {
        let known = self.tried.get(rungs).copied();
        let own = match known {
            Some(own) => own,
            None => {
                let own = self.trial(rungs)?.map(|t| t.aicc);
                self.tried.insert(rungs.to_vec(), own);
                own
            }
        };
        Ok(own.unwrap_or(f64::INFINITY))
    }

    /// The rung of each form, from one that is best for all together.
    fn by_form(&mut self, common: usize) -> Result<Vec<usize>, DesignFitError> {
        let mut at = vec![common; self.ground.layout.forms.len()];
        let mut best = self.criterion(&at)?;
        for _ in 0..ROUNDS {
            let before = at.clone();
            for form in 0..at.len() {
                for up in [false, true] {
                    let (mut rung, mut since) = (at[form], 0);
                    while since < BEYOND {
                        let next = if up {
                            rung.checked_add(1)
                        } else {
                            rung.checked_sub(1)
                        };
                        let Some(next) = next.filter(|n| *n < self.breaks.len()) else {
                            break;
                        };
                        (rung, since) = (next, since + 1);
                        let mut tried = at.clone();
                        tried[form] = rung;
                        if !near(tried.iter().map(|r| self.breaks[*r].len() - 1)) {
                            break;
                        }
                        let own = self.criterion(&tried)?;
                        if own < best {
                            (best, at, since) = (own, tried, 0);
                        }
                    }
                }
            }
            if at == before {
                break;
            }
        }
        Ok(at)
    }
}

/// Whether the finest of these numbers of cells is no finer beside the coarsest than the band carries.
fn near(cells: impl Iterator<Item = usize> + Clone) -> bool {
    let coarsest = cells.clone().min().unwrap_or(1);
    cells.max().unwrap_or(1) <= FINEST * coarsest
}

/// Variances of the slopes with all forms on so many cells, as far as their ratios tell; `None` where there are none.
fn sureness(ground: &Ground, cells: usize) -> Option<Vec<f64>> {
    let breaks = on_cells(ground, cells);
    let (problem, start) = ground
        .problem(vec![breaks; ground.layout.forms.len()])
        .ok()?;
    let system = evaluate(&problem, &start).ok()?.system;
    let (_, solved) = squares_left(&problem, &system)?;
    let covariance = BorderedCovariance::new(&system, &solved);
    let slopes = 0..problem.layout.slope_count;
    Some(slopes.map(|k| covariance.border()[(k, k)]).collect())
}

/// The sum of squares that the linear fit leaves, and the step there.
fn squares_left(problem: &DesignProblem, system: &Bordered) -> Option<(f64, Solved)> {
    let missing = DVector::zeros(problem.constraints().len());
    let mut held = problem.held().to_vec();
    // No thickness shows where the forms are still zero.
    if let Some(index) = problem.layout.thickness_index() {
        held[index] = true;
    }
    let solved = system.solve(problem.constraints(), &missing, &held).ok()?;
    let left =
        system.sum_of_squares() - 2.0 * system.predicted_reduction(&solved.band, &solved.border);
    Some((left.max(system.unreachable_residual().powi(2)), solved))
}
