//! How many knots: from the data, by an information criterion over a ladder of fits.
//!
//! At the seed's tilts the cost of the linear fit with K cells is that of one linear problem. The choice
//! is the least corrected Akaike criterion (Hurvich and Tsai, Biometrika 76, 1989),
//! m ln(RSS/m) + 2pm/(m − p − 1); Schwarz's criterion and generalised cross-validation stand beside
//! it in the table. The ladder ends where rung after rung is worse, or where the positions carry no finer
//! rung (`carried.rs`). With few readings beside the unknowns the criterion's correction outweighs forms that stand far out of
//! the noise; there what the finest rung leaves is the measure (`sparse.rs`).

pub mod breaks;
mod carried;
mod climbed;
pub mod sparse;
mod waves;

use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance, Solved};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredProblem, evaluate};

use super::error::FEWEST_FREE;
use super::ground::{Begun, begin};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::rungs::{Rungs, Squares};
use super::seed;
use super::unknowns::Unknowns;
use super::{Axis, ReversalError, gauge};
use crate::basis::bspline::CubicBSpline;
use crate::reversal::finer_forms::{Curves, TIMES};
use crate::reversal::forward::Attitude;

pub use carried::{Carried, Finest, REFUSED};
use climbed::RungFit;
pub use climbed::{Climbed, KnotTrial, LinearStep, trial};
pub use waves::NoiseOfWaves;

/// Rungs after the best one before the ladder is left.
pub const PATIENCE: usize = 3;

/// How often knots are chosen again under the law of the noise that the fit on those before has told.
pub const MOST_CHOICES: usize = 3;

/// Cell counts of the ladder, from one: a factor of about √2 apart.
pub fn ladder() -> impl Iterator<Item = usize> {
    let powers = (2..2 * usize::BITS - 2).map(|k: u32| {
        let power = 1_usize << (k / 2);
        if k.is_multiple_of(2) {
            power
        } else {
            power + power / 2
        }
    });
    std::iter::once(1).chain(powers)
}

/// Number of different positions of the channel that has most.
pub fn positions(channels: &[ChannelReadings]) -> usize {
    different(most_read(channels))
}

/// The positions of the channel that has most different ones, in ascending order.
pub fn most_read(channels: &[ChannelReadings]) -> &[f64] {
    let all = channels.iter().map(|c| c.x.as_slice());
    all.max_by_key(|x| different(x)).unwrap_or_default()
}

fn different(x: &[f64]) -> usize {
    x.chunk_by(|a, b| a == b).count()
}

/// Most cells of a spline that has its slope and constant apart on so many positions.
pub fn most_by_positions(positions: usize) -> usize {
    positions.saturating_sub(FEWEST_POSITIONS - 1)
}

/// Most cells that readings carry: a spline of K cells with its slope and offset has K + 3 unknowns and
/// needs as many positions (Schoenberg and Whitney 1953), and `free` readings more than all unknowns
/// tell the noise. `unknowns` are those of any number of cells.
pub fn most_cells(channels: &[ChannelReadings], unknowns: &Unknowns, free: usize) -> usize {
    let readings: usize = channels.iter().map(ChannelReadings::len).sum();
    let others = unknowns.free_count() - unknowns.band_count();
    let by_readings = readings.saturating_sub(others + free) / unknowns.forms.len().max(1);
    let by_positions = most_by_positions(positions(channels));
    by_readings.saturating_sub(1).min(by_positions)
}

/// Positions that the spline of a single cell needs with its slope and offset.
pub const FEWEST_POSITIONS: usize = 4;

/// What the fits of the ladder share.
pub struct Choice<'a> {
    /// Sorted readings.
    pub channels: &'a [ChannelReadings],
    /// Tilt and offset of each channel's line.
    pub lines: &'a [(f64, f64)],
    /// The axis of the gauge.
    pub axis: Axis,
    /// Thickness, mm.
    pub thickness_mm: f64,
    /// 1/σ by channel.
    pub weights: &'a [f64],
    /// Effects in the fit.
    pub effects: Option<&'a Begun<'a>>,
    /// How fine the rungs may be.
    pub finest: Finest,
}

impl Choice<'_> {
    /// Breaks of so many cells.
    pub fn breaks(&self, unknowns: &Unknowns, cells: usize) -> Vec<f64> {
        let (low, high) = gauge::range(self.channels);
        let told = |seen: &[bool]| unknowns.told_apart_by(seen);
        breaks::breaks(&self.positions(), [low, high], cells, told)
    }

    /// Of the channels, mm, in ascending order.
    fn positions(&self) -> Vec<&[f64]> {
        self.channels.iter().map(|c| c.x.as_slice()).collect()
    }

    /// The bases of the fitted forms on these breaks: the slide's on the positions, the artefact's
    /// stretched to where the tilted probes touch it.
    pub fn bases(
        &self,
        unknowns: &Unknowns,
        breaks: &[f64],
    ) -> Result<Vec<CubicBSpline>, ReversalError> {
        let (low, high) = gauge::range(self.channels);
        let slide = CubicBSpline::new(breaks.to_vec())?;
        let mut bases = Vec::with_capacity(unknowns.forms.len());
        for form in &unknowns.forms {
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for (channel, line) in self.channels.iter().zip(self.lines) {
                if form.is_side_of(channel.channel) {
                    let attitude = Attitude::new(line.0, self.thickness_mm / 2.0)?;
                    let touched = |x: f64| (x + attitude.half_mm * attitude.sin) / attitude.cos;
                    if let (Some(first), Some(last)) = (channel.x.first(), channel.x.last()) {
                        from = from.min(touched(*first));
                        to = to.max(touched(*last));
                    }
                }
            }
            if from < to {
                let stretched = breaks
                    .iter()
                    .map(|b| from + (to - from) * ((b - low) / (high - low)))
                    .collect();
                bases.push(CubicBSpline::new(stretched)?);
            } else {
                bases.push(slide.clone());
            }
        }
        Ok(bases)
    }

    /// Goes up the ladder. Without effects the rungs come from normal equations, and from orthogonal
    /// factorisations where rounding could decide.
    pub fn choose(
        &self,
        unknowns_of: impl Fn(usize) -> Unknowns,
    ) -> Result<Climbed, ReversalError> {
        if let Some(chosen) = self.by_moments(&unknowns_of)? {
            return Ok(chosen);
        }
        self.climb(&unknowns_of, |unknowns, bases| {
            let fitted = self.by_factors(unknowns, bases)?;
            Ok(fitted.map(|(left, curves)| {
                let (rounding, linear) = (0.0, None);
                (Squares { left, rounding }, RungFit { curves, linear })
            }))
        })
    }

    /// The ladder by normal equations; `None` where they do not tell.
    fn by_moments(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
    ) -> Result<Option<Climbed>, ReversalError> {
        let Some(rungs) = self.rungs(unknowns_of) else {
            return Ok(None);
        };
        let mut told = true;
        let squares = |unknowns: Unknowns, bases: Vec<CubicBSpline>| {
            let linear = rungs.solve(&unknowns, &bases);
            let found = linear.and_then(|linear| Some((rungs.squares(&linear)?, linear.step())));
            told &= found.is_some();
            Ok(found.map(|(squares, step)| {
                let there = self.start(&unknowns).stepped(&step.0, &step.1);
                let curves = unknowns.curves(&bases, self.axis, &there);
                let linear = Some(LinearStep { step, bases });
                (squares, RungFit { curves, linear })
            }))
        };
        let climbed = self.climb(unknowns_of, squares)?;
        Ok((told && climbed.clear).then_some(climbed))
    }

    /// The readings gathered for normal equations; `None` with effects, which know single readings.
    fn rungs(&self, unknowns_of: &impl Fn(usize) -> Unknowns) -> Option<Rungs<'_>> {
        if self.effects.is_some() {
            return None;
        }
        let unknowns = unknowns_of(FEWEST_POSITIONS);
        let start = self.start(&unknowns);
        let begin = (0..self.channels.len()).map(|c| {
            let offset = start.border[unknowns.offset(c)];
            (unknowns.slope(c, &start.border), offset)
        });
        let ground = (self.axis, self.thickness_mm);
        Rungs::new(self.channels, begin, self.weights, ground)
    }

    /// Goes up the ladder with the sums of squares that `squares` finds.
    fn climb(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
        mut squares: impl FnMut(
            Unknowns,
            Vec<CubicBSpline>,
        ) -> Result<Option<(Squares, RungFit)>, ReversalError>,
    ) -> Result<Climbed, ReversalError> {
        let readings = self.readings();
        let carried = Carried::by(self.positions(), self.finest);
        let carries = |cells: usize| self.carries(unknowns_of, &carried, cells);
        let mut climbed = Climbed::of(readings);
        for cells in carried.rungs(ladder(), carries) {
            let (unknowns, bases) = self.rung(unknowns_of, cells)?;
            let count = unknowns.free_count();
            let cells = bases[0].cell_count();
            if climbed.table.last().is_some_and(|t| t.cells == cells) {
                continue;
            }
            if readings < count + FEWEST_FREE {
                break;
            }
            let Some((squares, found)) = squares(unknowns, bases)? else {
                break;
            };
            let trial = trial(cells, readings, count, squares.left);
            climbed.add(trial, squares, found);
            if climbed.table.len() > climbed.best + PATIENCE {
                break;
            }
        }
        let last = climbed.table.last().map_or(0, |t| t.unknowns);
        if sparse::are_few(positions(self.channels), readings, last) {
            self.climb_to_the_finest(unknowns_of, &mut squares, &mut climbed, &carried)?;
        }
        self.look_finer(unknowns_of, squares, &mut climbed, &carried)?;
        Ok(climbed)
    }

    /// The fit on more cells than the best rung has, where the ladder did not come so far.
    fn look_finer(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
        mut squares: impl FnMut(
            Unknowns,
            Vec<CubicBSpline>,
        ) -> Result<Option<(Squares, RungFit)>, ReversalError>,
        climbed: &mut Climbed,
        carried: &Carried<'_>,
    ) -> Result<(), ReversalError> {
        let carries = |cells: usize| self.carries(unknowns_of, carried, cells);
        let Some(cells) = carried.finer(climbed.cells(), carries) else {
            return Ok(());
        };
        if cells == TIMES * climbed.cells() && climbed.on_cells(cells) {
            return Ok(());
        }
        let (unknowns, bases) = self.rung(unknowns_of, cells)?;
        let finer = bases[0].cell_count() > climbed.cells();
        if finer && self.readings() >= unknowns.free_count() + FEWEST_FREE {
            climbed.finer = squares(unknowns, bases)?.map(|(_, fit)| fit.curves);
        }
        Ok(())
    }

    fn readings(&self) -> usize {
        self.channels.iter().map(ChannelReadings::len).sum()
    }

    /// Whether the positions carry a rung of so many cells.
    fn carries(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
        carried: &Carried<'_>,
        cells: usize,
    ) -> bool {
        let breaks = |cells: usize| self.breaks(&unknowns_of(cells + 3), cells);
        carried.carries(cells, breaks, |cells| self.sureness(unknowns_of, cells))
    }

    /// Variances of the tilts on a rung, as far as their ratios from rung to rung tell; `None` where it has none.
    fn sureness(&self, unknowns_of: &impl Fn(usize) -> Unknowns, cells: usize) -> Option<Vec<f64>> {
        let (unknowns, bases) = self.rung(unknowns_of, cells).ok()?;
        let tilts = unknowns.tilt_count();
        let start = self.start(&unknowns);
        let problem = self.problem(unknowns, bases);
        let system = evaluate(&problem, &start).ok()?.system;
        let solved = solved(&problem, &system)?;
        let covariance = BorderedCovariance::new(&system, &solved);
        Some((0..tilts).map(|k| covariance.border()[(k, k)]).collect())
    }

    /// The unknowns and bases with so many cells.
    fn rung(
        &self,
        unknowns_of: &impl Fn(usize) -> Unknowns,
        cells: usize,
    ) -> Result<(Unknowns, Vec<CubicBSpline>), ReversalError> {
        let breaks = self.breaks(&unknowns_of(cells + 3), cells);
        let unknowns = unknowns_of(breaks.len() + 2);
        let bases = self.bases(&unknowns, &breaks)?;
        Ok((unknowns, bases))
    }

    /// Where the fit begins: at the tilts that come nearest to the lines.
    fn start(&self, unknowns: &Unknowns) -> Parameters {
        let tilts = seed::tilts(unknowns, self.lines);
        begin(
            unknowns,
            &tilts,
            self.lines,
            self.thickness_mm,
            self.effects,
        )
    }

    /// The sum of squares that the linear fit leaves and its forms, by an orthogonal factorisation of all rows.
    fn by_factors(
        &self,
        unknowns: Unknowns,
        bases: Vec<CubicBSpline>,
    ) -> Result<Option<(f64, Curves)>, ReversalError> {
        let start = self.start(&unknowns);
        Ok(squares_left(self.problem(unknowns, bases), start)?)
    }

    fn problem(&self, unknowns: Unknowns, bases: Vec<CubicBSpline>) -> Reversal<'_> {
        Reversal::new(
            self.channels,
            unknowns,
            bases,
            self.axis,
            self.thickness_mm,
            self.weights.to_vec(),
        )
        .joining(self.effects.map(|e| &e.joined))
    }
}

/// The sum of squares that the linear fit leaves, and its forms; with effects, which hang on the forms, those of a
/// second step from the forms that the first has found.
fn squares_left(
    mut problem: Reversal,
    start: Parameters,
) -> Result<Option<(f64, Curves)>, NoValue> {
    let (mut at, mut evaluation) = (start.clone(), evaluate(&problem, &start)?);
    if problem.joined.is_some() {
        let free = problem.held().to_vec();
        for k in 0..problem.unknowns.effects.len() {
            problem.hold(problem.unknowns.effect(k), true);
        }
        if let Some(step) = solved(&problem, &evaluation.system) {
            at = start.stepped(&step.band, &step.border);
            evaluation = evaluate(&problem, &at)?;
        }
        for (j, held) in free.into_iter().enumerate() {
            problem.hold(j, held);
        }
    }
    let system = &evaluation.system;
    Ok(solved(&problem, system).map(|step| {
        let left =
            system.sum_of_squares() - 2.0 * system.predicted_reduction(&step.band, &step.border);
        let there = at.stepped(&step.band, &step.border);
        let curves = problem
            .unknowns
            .curves(&problem.bases, problem.axis, &there);
        (left.max(system.unreachable_residual().powi(2)), curves)
    }))
}

fn solved(problem: &Reversal, system: &Bordered) -> Option<Solved> {
    let missing = nalgebra::DVector::zeros(problem.constraints().len());
    let solved = system.solve(problem.constraints(), &missing, problem.held());
    solved.ok()
}

#[cfg(test)]
mod tests;
