//! How many knots: from the data, by an information criterion over a ladder of fits.
//!
//! At the seed's tilts one factorisation gives the cost of the linear fit with K cells. The choice
//! is the least corrected Akaike criterion (Hurvich and Tsai, Biometrika 76, 1989),
//! m ln(RSS/m) + 2pm/(m − p − 1); Schwarz's criterion and generalised cross-validation stand beside
//! it in the table.

use errsep_solvers::linear::bordered::{Bordered, Solved};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredProblem, evaluate};

use super::error::FEWEST_FREE;
use super::ground::{Begun, begin};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::seed;
use super::unknowns::Unknowns;
use super::{Axis, ReversalError, gauge};
use crate::basis::bspline::CubicBSpline;
use crate::reversal::forward::Attitude;

/// One rung of the ladder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnotTrial {
    /// Number of cells.
    pub cells: usize,
    /// Number of unknowns of the whole fit.
    pub unknowns: usize,
    /// Root mean square of the weighted residuals over their degrees of freedom, relative to the
    /// first rung's guess of the noise.
    pub noise: f64,
    /// Corrected Akaike criterion.
    pub aicc: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Generalised cross-validation score.
    pub gcv: f64,
}

/// Rungs after the best one before the ladder is left.
pub const PATIENCE: usize = 3;

/// Readings' positions a cell must have on average, so that the table never ends in interpolation.
pub const POSITIONS_A_CELL: usize = 3;

/// Cell counts of the ladder: a factor of about √2 apart.
pub fn ladder(most: usize) -> impl Iterator<Item = usize> {
    (2..)
        .map(|k: u32| {
            let power = 1_usize << (k / 2);
            if k.is_multiple_of(2) {
                power
            } else {
                power + power / 2
            }
        })
        .take_while(move |cells| *cells <= most)
}

/// Number of different positions of the channel that has most.
pub fn positions(channels: &[ChannelReadings]) -> usize {
    let of = |c: &ChannelReadings| c.x.chunk_by(|a, b| a == b).count();
    channels.iter().map(of).max().unwrap_or(0)
}

/// Most cells that readings carry: a spline of K cells with its slope and offset has K + 3 unknowns and
/// needs as many positions (Schoenberg and Whitney 1953), and `free` readings more than all unknowns
/// tell the noise. `unknowns` are those of any number of cells.
pub fn most_cells(channels: &[ChannelReadings], unknowns: &Unknowns, free: usize) -> usize {
    let readings: usize = channels.iter().map(ChannelReadings::len).sum();
    let others = unknowns.free_count() - unknowns.band_count();
    let by_readings = readings.saturating_sub(others + free) / unknowns.forms.len().max(1);
    let by_positions = positions(channels).saturating_sub(FEWEST_POSITIONS - 1);
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
}

impl Choice<'_> {
    /// Breaks of so many equal cells, cells without the readings they need joined to a neighbour.
    ///
    /// A cell needs readings of channels that tell all fitted forms apart; otherwise coefficients
    /// there would be determined by nothing.
    pub fn breaks(&self, unknowns: &Unknowns, cells: usize) -> Result<Vec<f64>, ReversalError> {
        let (low, high) = gauge::range(self.channels);
        let even = CubicBSpline::uniform(low, high, cells.max(1))?;
        let mut breaks = vec![low];
        let mut seen = vec![false; self.channels.len()];
        let mut at = vec![0; self.channels.len()];
        for right in &even.breaks()[1..] {
            for (c, channel) in self.channels.iter().enumerate() {
                let next = at[c] + channel.x[at[c]..].partition_point(|x| x < right);
                seen[c] |= next > at[c];
                at[c] = next;
            }
            if unknowns.told_apart_by(&seen) {
                breaks.push(*right);
                seen.fill(false);
            }
        }
        // What is left at the end belongs to the last cell.
        if breaks.len() > 1 {
            breaks.pop();
        }
        breaks.push(high);
        Ok(breaks)
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

    /// Goes up the ladder; the table and the best number of cells.
    pub fn choose(
        &self,
        unknowns_of: impl Fn(usize) -> Unknowns,
    ) -> Result<(usize, Vec<KnotTrial>), ReversalError> {
        let readings: usize = self.channels.iter().map(ChannelReadings::len).sum();
        let most = positions(self.channels) / POSITIONS_A_CELL;
        let mut table: Vec<KnotTrial> = Vec::new();
        let mut best = 0;
        for cells in std::iter::once(1).chain(ladder(most)) {
            let breaks = self.breaks(&unknowns_of(cells + 3), cells)?;
            let unknowns = unknowns_of(breaks.len() + 2);
            let count = unknowns.free_count();
            if table.last().is_some_and(|t| t.cells == breaks.len() - 1) {
                continue;
            }
            if readings < count + FEWEST_FREE {
                break;
            }
            let bases = self.bases(&unknowns, &breaks)?;
            let tilts = seed::tilts(&unknowns, self.lines);
            let start = begin(
                &unknowns,
                &tilts,
                self.lines,
                self.thickness_mm,
                self.effects,
            );
            let problem = Reversal::new(
                self.channels,
                unknowns,
                bases,
                self.axis,
                self.thickness_mm,
                self.weights.to_vec(),
            )
            .joining(self.effects.map(|e| &e.joined));
            let Some(squares) = squares_left(problem, start)? else {
                break;
            };
            table.push(trial(breaks.len() - 1, readings, count, squares));
            let last = table.len() - 1;
            if table[last].aicc < table[best].aicc {
                best = last;
            } else if last >= best + PATIENCE {
                break;
            }
        }
        let cells = table.get(best).map_or(1, |t| t.cells);
        Ok((cells, table))
    }
}

pub fn trial(cells: usize, readings: usize, unknowns: usize, squares: f64) -> KnotTrial {
    let (m, p) = (readings as f64, unknowns as f64);
    // Noise-free readings leave rounding only: keep the logarithm finite.
    let log = (squares / m).max(f64::MIN_POSITIVE).ln();
    KnotTrial {
        cells,
        unknowns,
        noise: (squares / (m - p)).sqrt(),
        aicc: m * log + 2.0 * p * m / (m - p - 1.0),
        bic: m * log + p * m.ln(),
        gcv: m * squares / (m - p).powi(2),
    }
}

/// The sum of squares that the linear fit leaves; with effects, which hang on the forms, that of a second
/// step from the forms that the first has found.
fn squares_left(mut problem: Reversal, start: Parameters) -> Result<Option<f64>, NoValue> {
    let mut evaluation = evaluate(&problem, &start)?;
    if problem.joined.is_some() {
        let free = problem.held().to_vec();
        for k in 0..problem.unknowns.effects.len() {
            problem.hold(problem.unknowns.effect(k), true);
        }
        if let Some(step) = solved(&problem, &evaluation.system) {
            evaluation = evaluate(&problem, &start.stepped(&step.band, &step.border))?;
        }
        for (j, held) in free.into_iter().enumerate() {
            problem.hold(j, held);
        }
    }
    Ok(linear_squares(&problem, &evaluation.system))
}

fn solved(problem: &Reversal, system: &Bordered) -> Option<Solved> {
    let missing = nalgebra::DVector::zeros(problem.constraints().len());
    let solved = system.solve(problem.constraints(), &missing, problem.held());
    solved.ok()
}

/// The sum of squares that the linear fit leaves.
fn linear_squares(problem: &Reversal, system: &Bordered) -> Option<f64> {
    let solved = solved(problem, system)?;
    let left =
        system.sum_of_squares() - 2.0 * system.predicted_reduction(&solved.band, &solved.border);
    Some(left.max(system.unreachable_residual().powi(2)))
}
