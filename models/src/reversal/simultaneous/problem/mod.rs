//! The reversal as a structured least-squares problem.
//!
//! A task is one cell and one channel: the readings for which the lower of the two cells that a
//! reading sees (slide's form at x, artefact's form at u) is that cell. Both are monotone in x, so
//! a task is a run of the sorted readings, and its ends are found by bisection.

mod tasks;

use std::borrow::Cow;

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::{Constraints, Share};
use errsep_solvers::loss::Loss;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredProblem};

use rayon::prelude::*;

use super::gauge::{self, Axis};
use super::joined::Joined;
use super::placed::Placed;
use super::readings::ChannelReadings;
use super::rows::{CellForm, Points, Run};
use super::starts::{slide_starts, starts};
use super::unknowns::{Form, Unknowns};
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::forward::Attitude;

/// The problem: readings, bases, weights.
#[derive(Debug, Clone)]
pub struct Reversal<'a> {
    /// Sorted readings.
    pub channels: &'a [ChannelReadings],
    /// The unknowns.
    pub unknowns: Unknowns,
    /// The bases of the fitted forms, all of the same number of cells.
    pub bases: Vec<CubicBSpline>,
    /// The axis of the gauge.
    pub axis: Axis,
    /// Thickness where it is not an unknown, mm.
    pub thickness_mm: f64,
    /// 1/σ of a reading of each channel, 1/µm.
    pub weights: Vec<f64>,
    /// Loss of a weighted residual.
    pub loss: Loss,
    /// Whether rows under a robust loss are only reweighted by √ρ′, which lowers the cost from
    /// anywhere but converges linearly. Otherwise they carry the loss's curvature, which converges
    /// quadratically from nearby.
    pub far: bool,
    /// Effects that are unknowns of the fit.
    pub(super) joined: Option<Joined<'a>>,
    /// The coefficients of ξ in each basis.
    pub(super) xi: Vec<Vec<f64>>,
    constraints: Constraints,
    held: Vec<bool>,
    /// First reading at or beyond each break of the slide's form, by channel.
    slide_starts: Vec<Vec<usize>>,
}

impl<'a> Reversal<'a> {
    /// The problem for these unknowns and bases.
    pub fn new(
        channels: &'a [ChannelReadings],
        unknowns: Unknowns,
        bases: Vec<CubicBSpline>,
        axis: Axis,
        thickness_mm: f64,
        weights: Vec<f64>,
    ) -> Self {
        let xi = bases
            .iter()
            .map(|basis| basis.line(axis.xi(0.0), 1.0 / axis.scale))
            .collect();
        let constraints = gauge::constraints(&unknowns, &bases, channels, axis);
        let held = unknowns.held();
        let slide_starts = slide_starts(&unknowns, &bases, channels);
        Self {
            channels,
            unknowns,
            bases,
            axis,
            thickness_mm,
            weights,
            loss: Loss::Quadratic,
            far: false,
            joined: None,
            xi,
            constraints,
            held,
            slide_starts,
        }
    }

    /// The same with effects, whose unknowns are among those of this problem.
    pub(super) fn joining(mut self, joined: Option<&Joined<'a>>) -> Self {
        self.joined = joined.cloned();
        for (k, searched) in joined.iter().flat_map(|j| j.are_searched()).enumerate() {
            self.held[self.unknowns.effect(k)] = searched;
        }
        self
    }

    /// The same without effects.
    pub(super) fn joining_none(&self) -> Self {
        let mut without = self.clone();
        without.joined = None;
        without.held.truncate(self.unknowns.effect(0));
        without.unknowns.effects.clear();
        without.constraints =
            gauge::constraints(&without.unknowns, &self.bases, self.channels, self.axis);
        without
    }

    /// Whether a border unknown keeps the value it has.
    pub(super) fn is_held(&self, index: usize) -> bool {
        self.held[index]
    }

    /// Number of cells of every form.
    pub fn cell_count(&self) -> usize {
        self.bases.first().map_or(0, CubicBSpline::cell_count)
    }

    /// The gauge.
    pub fn gauge(&self) -> &Constraints {
        &self.constraints
    }

    /// Holds a border unknown at its value, or lets it go.
    pub fn hold(&mut self, index: usize, held: bool) {
        self.held[index] = held;
    }

    /// The thickness at a point, mm.
    pub fn thickness(&self, at: &Parameters) -> f64 {
        self.unknowns
            .thickness_index()
            .map_or(self.thickness_mm, |j| at.border[j])
    }

    /// The fitted forms, less their lines, as polynomials of their cells, µm.
    pub fn cubics(&self, at: &Parameters) -> Vec<Vec<Cubic>> {
        self.unknowns.cubics(&self.bases, self.axis, at)
    }

    /// Unknowns of the band that a row spans where its two cells lie at most so far apart.
    fn width(&self, apart: usize) -> usize {
        (self.unknowns.forms.len() * (4 + apart)).min(self.unknowns.band_count())
    }

    /// Goes through the runs of a task: readings from..to, cell of the artefact's form, cell of
    /// the slide's.
    fn runs(
        &self,
        prepared: &Prepared,
        channel: usize,
        cell: usize,
        mut run: impl FnMut(usize, usize, usize, usize) -> Result<(), NoValue>,
    ) -> Result<(), NoValue> {
        let side = &prepared.side_starts[channel];
        let slide = self.slide_starts.get(channel).unwrap_or(side);
        let cells = self.cell_count();
        // A reading belongs to the lower of its two cells: to cell k from the later start on.
        let start = side[cell].max(slide[cell]);
        let end = side[cell + 1].max(slide[cell + 1]);
        let (mut at_side, mut at_slide) = (cell, cell);
        let mut from = start;
        while from < end {
            while at_side + 1 < cells && side[at_side + 1] <= from {
                at_side += 1;
            }
            while at_slide + 1 < cells && slide[at_slide + 1] <= from {
                at_slide += 1;
            }
            let to = end.min(side[at_side + 1]).min(slide[at_slide + 1]);
            run(from, to, at_side, at_slide)?;
            from = to;
        }
        Ok(())
    }

    /// What the readings of a channel share, in two cells.
    fn run<'b>(
        &'b self,
        prepared: &Prepared,
        channel: usize,
        side: usize,
        slide: usize,
    ) -> Run<'b> {
        let cell = |form: usize, k: usize| {
            let (left, width) = self.bases[form].cell(k);
            CellForm {
                left,
                width,
                form: prepared.cubics[form][k],
                basis: self.bases[form].polynomials(k),
            }
        };
        let name = self.channels[channel].channel;
        Run {
            attitude: prepared.attitudes[channel],
            side: cell(self.unknowns.side_of(name), side),
            slide: self
                .unknowns
                .place(Form::Slide)
                .map(|form| (cell(form, slide), name.indicator_sign())),
            offset: prepared.offsets[channel],
            weight: self.weights[channel],
            thickness: self.unknowns.thickness,
        }
    }

    /// Reading less model, µm, of every reading: by channel, in the order of its sorted readings.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue> {
        let prepared = self.prepare(at)?;
        if let Some(placed) = &prepared.placed {
            return Ok(placed.residuals(self.channels));
        }
        self.channels
            .par_iter()
            .enumerate()
            .map(|(c, channel)| {
                let mut residuals = Vec::with_capacity(channel.len());
                let mut points = Box::<Points>::default();
                let unit = -1.0 / self.weights[c];
                for cell in 0..self.cell_count() {
                    self.runs(&prepared, c, cell, |from, to, side, slide| {
                        let run = self.run(&prepared, c, side, slide);
                        for first in (from..to).step_by(Tall::CAPACITY) {
                            let last = to.min(first + Tall::CAPACITY);
                            let (x, value) = (&channel.x[first..last], &channel.value[first..last]);
                            points.locate(&run, x, value)?;
                            residuals.extend(points.residual[..x.len()].iter().map(|r| unit * r));
                        }
                        Ok(())
                    })?;
                }
                Ok(residuals)
            })
            .collect()
    }

    /// At most `most` readings of each channel in each cell.
    pub fn thinned(&self, most: usize) -> Vec<ChannelReadings> {
        let channels = self.channels.iter().enumerate();
        channels
            .map(|(c, channel)| channel.thinned(&self.cell_starts(c), most))
            .collect()
    }

    /// How many readings these are.
    pub fn thinned_count(&self, most: usize) -> usize {
        let in_channel = |c: usize| -> usize {
            let starts = self.cell_starts(c);
            let counts = starts.windows(2).map(|w| w[1].saturating_sub(w[0]));
            counts.map(|count| count.min(most)).sum()
        };
        (0..self.channels.len()).map(in_channel).sum()
    }

    /// First reading of a channel in each cell.
    fn cell_starts(&self, channel: usize) -> Cow<'_, [usize]> {
        match self.slide_starts.get(channel) {
            Some(starts) => Cow::Borrowed(starts),
            None => {
                let readings = &self.channels[channel];
                let form = self.unknowns.side_of(readings.channel);
                Cow::Owned(starts(&readings.x, self.bases[form].breaks()))
            }
        }
    }

    /// The same unknowns, gauge and weights over other readings of the same channels.
    pub fn over<'b>(&self, channels: &'b [ChannelReadings]) -> Reversal<'b>
    where
        'a: 'b,
    {
        let mut joined = self.joined.clone();
        if let Some(joined) = &mut joined {
            joined.hold_turning(None);
        }
        Reversal {
            joined,
            channels,
            unknowns: self.unknowns.clone(),
            bases: self.bases.clone(),
            axis: self.axis,
            thickness_mm: self.thickness_mm,
            weights: self.weights.clone(),
            loss: self.loss,
            far: self.far,
            xi: self.xi.clone(),
            constraints: self.constraints.clone(),
            held: self.held.clone(),
            slide_starts: slide_starts(&self.unknowns, &self.bases, channels),
        }
    }
}

impl Reversal<'_> {
    /// Where the rows of each channel begin when all are written below each other.
    pub fn row_starts(&self) -> Vec<usize> {
        self.channels
            .iter()
            .scan(0, |next, c| {
                let start = *next;
                *next += c.len();
                Some(start)
            })
            .collect()
    }

    /// Hands out all rows in batches: channel, place of the first among its sorted readings, band
    /// unknowns of the local columns, what they are to the border, rows.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn for_each_batch(
        &self,
        at: &Parameters,
        mut take: impl FnMut(usize, usize, &[Option<usize>], &[Share], &Tall),
    ) -> Result<(), NoValue> {
        let prepared = self.prepare(at)?;
        if let Some(placed) = &prepared.placed {
            placed.for_each_row(self, take);
            return Ok(());
        }
        let mut points = Box::<Points>::default();
        let mut batch = Tall::new(16);
        for (c, channel) in self.channels.iter().enumerate() {
            for cell in 0..self.cell_count() {
                self.runs(&prepared, c, cell, |from, to, side, slide| {
                    let run = self.run(&prepared, c, side, slide);
                    let band = self.band_columns(c, side, slide);
                    let shares = self.shares(c, side, slide);
                    for first in (from..to).step_by(Tall::CAPACITY) {
                        let last = to.min(first + Tall::CAPACITY);
                        let x = &channel.x[first..last];
                        points.locate(&run, x, &channel.value[first..last])?;
                        batch.reset(last - first, run.columns());
                        points.fill(&run, x, None, &mut batch);
                        take(c, first, &band, &shares, &batch);
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }
}

/// What all tasks at a point share.
#[derive(Debug, Clone)]
pub struct Prepared {
    cubics: Vec<Vec<Cubic>>,
    attitudes: Vec<Attitude>,
    offsets: Vec<f64>,
    /// First reading whose probe point is at or beyond each break of the artefact's form.
    side_starts: Vec<Vec<usize>>,
    width: usize,
    /// Every reading in its own place, where there are effects.
    pub(super) placed: Option<Placed>,
}
