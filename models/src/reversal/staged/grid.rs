//! Positions at which the channels are combined, and what each channel has there.

use super::NoSolution;
use super::designs::Designs;
use super::resample::{Interpolation, Stencil};
use super::trace::Trace;
use crate::reversal::cells::{SAME_PLACE, Union};

/// Traces share a grid where this share of the positions of each is one where the forms are told apart
/// by readings alone.
const SHARED: f64 = 0.75;

/// A trace has no value between readings that are more than this many spacings apart.
pub const LONGEST_GAP: f64 = 2.5;

/// Positions nearer to the coarsest trace's than this share of its spacing add no detail to its grid.
const NEAR: f64 = 0.75;

/// The common grid. At every position of it the channels that have a value tell the forms apart.
#[derive(Debug)]
pub struct Grid {
    /// Positions, mm, growing.
    pub x: Vec<f64>,
    /// By trace and position: the value there, made of the trace's points.
    pub sights: Vec<Vec<Option<Stencil>>>,
    /// Which traces have a value, by position.
    pub subsets: Vec<usize>,
    /// Whether the positions are the traces' own, so that nothing was interpolated.
    pub one_grid: bool,
    /// Median distance of its positions before some were left out, mm.
    pub spacing: f64,
    /// Positions nearer to each other than this are one, mm.
    pub same: f64,
}

impl Grid {
    /// The grid of these traces.
    ///
    /// Where the traces share their positions, but for missing readings, these are the grid, and a
    /// channel without a reading has no value there. Otherwise it is the grid of the trace with the
    /// greatest spacing, so that no trace is asked for detail that it does not have, with positions of
    /// the others where that trace has a hole. A trace is interpolated between near readings only.
    ///
    /// # Errors
    /// [`NoSolution::NoOverlap`] where fewer than three positions are left, or fewer than three that
    /// all four channels have.
    pub fn of(traces: &[Trace], designs: &Designs, how: Interpolation) -> Result<Self, NoSolution> {
        let (low, high) = (traces.iter().map(Trace::range))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (a, b)| {
                (l.min(a), h.max(b))
            });
        let same = SAME_PLACE * (high - low);
        let union: Vec<f64> = Union::of(traces.iter().map(|t| &t.x[..])).collect();
        let own = Self::on(union, traces, designs, same, |trace, x, _| {
            let near = trace.partition_point(|p| *p < x - same);
            let is_there = trace.get(near).is_some_and(|p| *p <= x + same);
            is_there.then(|| Stencil::point(near))
        });
        let shared =
            own.sights.iter().zip(traces).all(|(sights, t)| {
                sights.iter().flatten().count() as f64 >= SHARED * t.x.len() as f64
            });
        let grid = if shared {
            own
        } else {
            let spacing = |x: &[f64]| median_spacing(x).unwrap_or(0.0);
            let coarsest = coarsest_grid(traces);
            let coarse = spacing(&coarsest);
            Self {
                one_grid: false,
                ..Self::on(coarsest, traces, designs, same, |trace, x, spacing| {
                    Stencil::at(trace, x, same, LONGEST_GAP * coarse.max(spacing), None, how)
                })
            }
        };
        let positions = designs.fewest(&grid.subsets);
        if positions < 3 {
            return Err(NoSolution::NoOverlap { positions });
        }
        Ok(grid)
    }

    /// The positions among `x` at which the forms are told apart by what each trace has: a function of
    /// its positions, the position, and its median spacing.
    fn on(
        x: Vec<f64>,
        traces: &[Trace],
        designs: &Designs,
        same: f64,
        sight: impl Fn(&[f64], f64, f64) -> Option<Stencil>,
    ) -> Self {
        let spacings: Vec<f64> = traces
            .iter()
            .map(|t| median_spacing(&t.x).unwrap_or(0.0))
            .collect();
        let mut grid = Self {
            x: Vec::with_capacity(x.len()),
            sights: vec![Vec::with_capacity(x.len()); traces.len()],
            subsets: Vec::with_capacity(x.len()),
            one_grid: true,
            spacing: median_spacing(&x).unwrap_or(0.0),
            same,
        };
        let mut here = Vec::with_capacity(traces.len());
        for p in x {
            here.clear();
            let (mut subset, mut bit) = (0, 1);
            for (trace, spacing) in traces.iter().zip(&spacings) {
                let stencil = sight(&trace.x, p, *spacing);
                subset += if stencil.is_some() { bit } else { 0 };
                bit *= 2;
                here.push(stencil);
            }
            if designs.weights(subset).is_none() {
                continue;
            }
            grid.x.push(p);
            grid.subsets.push(subset);
            for (sights, stencil) in grid.sights.iter_mut().zip(&here) {
                sights.push(*stencil);
            }
        }
        grid
    }
}

/// The positions of the trace with the greatest spacing, and those of others where it has holes.
fn coarsest_grid(traces: &[Trace]) -> Vec<f64> {
    let mut order: Vec<(f64, &Trace)> = traces
        .iter()
        .filter_map(|t| Some((median_spacing(&t.x)?, t)))
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some((spacing, first)) = order.first().copied() else {
        return Vec::new();
    };
    let mut grid = first.x.clone();
    for (_, trace) in &order[1..] {
        let mut further: Vec<f64> = Vec::new();
        for x in &trace.x {
            let right = grid.partition_point(|g| g < x);
            let left = right.checked_sub(1).map(|k| grid[k]);
            let neighbours = [left, grid.get(right).copied(), further.last().copied()];
            let mut distances = neighbours.iter().flatten().map(|g| (g - x).abs());
            if distances.all(|d| d >= NEAR * spacing) {
                further.push(*x);
            }
        }
        grid.extend(further);
        grid.sort_by(f64::total_cmp);
    }
    grid
}

/// The median distance of neighbours, mm; `None` of fewer than two positions.
fn median_spacing(x: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return None;
    }
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}
