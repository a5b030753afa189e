//! A design as a structured least-squares problem: the exact geometry of every channel in the plane of
//! its indicator, over splines.
//!
//! A channel's tilt is the sum of the slopes that it sees; its probe rides on the side it sees as in
//! [`forward`](crate::reversal::forward), and the slide brings M_h cos φ + M_v sin φ. Where the crest of a
//! bar is a term, the reading loses what a stylus beside it loses ([`crest`]). A task is one slab, a cell of
//! the finest form, and one channel; its readings run through the cells of all forms that the channel sees.

mod columns;
pub(super) mod crest;
mod jacobian;
mod rows;
mod tasks;

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Constraints;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;
use nalgebra::{DMatrix, DVector};

use self::columns::Batch;
use self::crest::{Beside, CrestTerm};
use super::layout::{FormOf, Layout};
use super::readings::Trace;
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::cells::Union;
use crate::reversal::finer_forms::less_line;
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::gauge::line_of_spline;
use crate::reversal::simultaneous::starts::starts;

/// The splines of the forms.
#[derive(Debug, Clone)]
pub struct Splines {
    /// By form: break points on the slide's axis, mm.
    pub breaks: Vec<Vec<f64>>,
    /// By form: the basis, a side's on the artefact's own axis.
    pub bases: Vec<CubicBSpline>,
}

impl Splines {
    /// The breaks of the form with most cells.
    pub fn finest(&self) -> &[f64] {
        let longest = self.breaks.iter().max_by_key(|b| b.len());
        longest.map_or(&[], |b| &b[..])
    }
}

/// What is known of the artefact.
#[derive(Debug, Clone)]
pub struct Body {
    /// Half the thickness, mm; where the thickness is unknown, half its first guess.
    pub half_mm: f64,
    /// The crest, where it is a term.
    pub crest: Option<CrestTerm>,
}

/// Traces, unknowns and splines.
#[derive(Debug, Clone)]
pub struct DesignProblem<'a> {
    pub(super) traces: &'a [Trace],
    pub(super) layout: Layout,
    pub(super) splines: Splines,
    pub(super) axis: Axis,
    pub(super) body: Body,
    /// 1/σ of a reading of each channel, 1/µm.
    pub(super) weights: Vec<f64>,
    /// The coefficients of ξ in each basis.
    xi: Vec<Vec<f64>>,
    constraints: Constraints,
    held: Vec<bool>,
    /// By form of the slide and channel the first reading at or beyond each break.
    slide_starts: Vec<Vec<Vec<usize>>>,
    /// By channel the first reading of each slab.
    slabs: Vec<Vec<usize>>,
}

/// The cells of a run: of the side and of the forms of the slide that the channel sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cells {
    side: usize,
    slides: [usize; 2],
}

impl<'a> DesignProblem<'a> {
    /// The problem over these traces.
    pub(super) fn new(
        traces: &'a [Trace],
        layout: Layout,
        splines: Splines,
        axis: Axis,
        body: Body,
        weights: Vec<f64>,
    ) -> Self {
        let xi = splines
            .bases
            .iter()
            .map(|basis| basis.line(axis.xi(0.0), 1.0 / axis.scale))
            .collect();
        let cut = |breaks: &[f64]| traces.iter().map(|t| starts(&t.x, breaks)).collect();
        let slides = layout.forms.iter().zip(&splines.breaks);
        let slide_starts = slides
            .filter(|(form, _)| matches!(form, FormOf::Slide(_)))
            .map(|(_, breaks)| cut(breaks))
            .collect();
        let closures = layout.closures();
        Self {
            constraints: gauge(&layout, &splines.bases, traces, axis),
            held: (0..layout.border_count())
                .map(|j| closures.contains(&j))
                .collect(),
            slabs: cut(splines.finest()),
            slide_starts,
            traces,
            layout,
            splines,
            axis,
            body,
            weights,
            xi,
        }
    }

    /// Holds a border unknown at its value, or lets it go.
    pub(super) fn hold(&mut self, index: usize, held: bool) {
        self.held[index] = held;
    }

    /// Number of slabs.
    fn slab_count(&self) -> usize {
        self.splines.finest().len().saturating_sub(1)
    }

    /// Half the thickness at a point, mm.
    pub(super) fn half_mm(&self, at: &Parameters) -> f64 {
        let fitted = self.layout.thickness_index();
        fitted.map_or(self.body.half_mm, |j| 0.5 * at.border[j])
    }

    /// The forms, less their lines, as polynomials of their cells, µm.
    pub(super) fn cubics(&self, at: &Parameters) -> Vec<Vec<Cubic>> {
        let of = |(form, basis): (usize, &CubicBSpline)| {
            let line = self.layout.line(form).map(|j| at.border[j]);
            let coefficients = self.layout.coefficients_of(form, &at.band);
            less_line(basis, &coefficients, line, self.axis)
        };
        self.splines.bases.iter().enumerate().map(of).collect()
    }

    /// The first readings of the cells that a channel sees: of its side, then of the slide's forms.
    fn cuts<'s>(
        &'s self,
        prepared: &'s Prepared,
        channel: usize,
    ) -> impl Iterator<Item = &'s [usize]> {
        let slides = self.layout.slides[channel].iter();
        std::iter::once(&prepared.side_starts[channel][..])
            .chain(slides.map(move |seen| &self.slide_starts[seen.form][channel][..]))
    }

    /// The cells in which a reading lies, and one past the last reading that shares them.
    fn cells_at(&self, prepared: &Prepared, channel: usize, reading: usize) -> (Cells, usize) {
        let mut cells = [0; 3];
        let mut end = self.traces[channel].len();
        for (cell, starts) in cells.iter_mut().zip(self.cuts(prepared, channel)) {
            let after = starts.partition_point(|first| *first <= reading);
            *cell = after.saturating_sub(1).min(starts.len() - 2);
            end = end.min(starts[*cell + 1]);
        }
        let [side, slides @ ..] = cells;
        (Cells { side, slides }, end)
    }

    /// Goes through the runs of a task: readings from..to, and their cells.
    fn runs(
        &self,
        prepared: &Prepared,
        channel: usize,
        slab: usize,
        mut run: impl FnMut(usize, usize, Cells) -> Result<(), NoValue>,
    ) -> Result<(), NoValue> {
        let (mut from, end) = (self.slabs[channel][slab], self.slabs[channel][slab + 1]);
        while from < end {
            let (cells, to) = self.cells_at(prepared, channel, from);
            let to = to.min(end);
            run(from, to, cells)?;
            from = to;
        }
        Ok(())
    }

    /// Reading less model, µm, of every reading: by channel, in the order of its trace.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(super) fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue> {
        let prepared = self.prepared(at)?;
        let mut batch = Batch::default();
        (0..self.traces.len())
            .map(|c| {
                let unit = -1.0 / self.weights[c];
                let trace = &self.traces[c];
                let mut residuals = Vec::with_capacity(trace.len());
                for slab in 0..self.slab_count() {
                    self.runs(&prepared, c, slab, |from, to, cells| {
                        let run = self.run(&prepared, c, cells);
                        for first in (from..to).step_by(Tall::CAPACITY) {
                            let last = to.min(first + Tall::CAPACITY);
                            let x = &trace.x[first..last];
                            let value = &trace.value[first..last];
                            self.locate(&prepared, (c, cells), &run, (x, value), &mut batch)?;
                            let own = &batch.points.residual[..x.len()];
                            residuals.extend(own.iter().map(|r| unit * r));
                        }
                        Ok(())
                    })?;
                }
                Ok(residuals)
            })
            .collect()
    }

    /// The state in which derivatives at a point are taken; the width of the band is not known yet.
    fn prepared(&self, at: &Parameters) -> Result<Prepared, NoValue> {
        let cubics = self.cubics(at);
        let half_mm = self.half_mm(at);
        let mut attitudes = Vec::with_capacity(self.traces.len());
        let mut side_starts = Vec::with_capacity(self.traces.len());
        for (c, trace) in self.traces.iter().enumerate() {
            let attitude = Attitude::new(self.layout.slope(c, &at.border), half_mm)?;
            side_starts.push(self.side_starts(&attitude, &cubics, c, &trace.x)?);
            attitudes.push(attitude);
        }
        Ok(Prepared {
            cubics,
            attitudes,
            constants: (0..self.traces.len())
                .map(|c| self.layout.constant(c, &at.border))
                .collect(),
            side_starts,
            beside: match &self.body.crest {
                None => Vec::new(),
                Some(crest) => (0..self.traces.len())
                    .map(|c| crest.beside(&self.layout, c, half_mm, &at.border))
                    .collect::<Result<_, NoValue>>()?,
            },
            width: 0,
        })
    }
}

/// The least-squares line of every form over the positions of all traces is zero, each position
/// weighted by the width of its cell.
fn gauge(layout: &Layout, bases: &[CubicBSpline], traces: &[Trace], axis: Axis) -> Constraints {
    let places: Vec<f64> = Union::of(traces.iter().map(|t| &t.x[..])).collect();
    let mut band = Vec::with_capacity(2 * bases.len());
    let mut border = DMatrix::zeros(2 * bases.len(), layout.border_count());
    for (form, basis) in bases.iter().enumerate() {
        for (l, row) in line_of_spline(basis, &places, axis).iter().enumerate() {
            let mut column = vec![0.0; layout.band_count()];
            for (k, value) in row.iter().enumerate() {
                if let Some(j) = layout.coefficient(form, k) {
                    column[j] = *value;
                }
            }
            band.push(column);
            border[(2 * form + l, layout.line(form)[l])] = 1.0;
        }
    }
    Constraints {
        value: DVector::zeros(band.len()),
        band,
        border,
    }
}

/// What all tasks at a point share.
#[derive(Debug, Clone)]
pub struct Prepared {
    cubics: Vec<Vec<Cubic>>,
    attitudes: Vec<Attitude>,
    constants: Vec<f64>,
    /// First reading whose probe point is at or beyond each break of the side's form.
    side_starts: Vec<Vec<usize>>,
    /// By channel, where the crest is a term: how the artefact stands beside the stylus.
    beside: Vec<Beside>,
    width: usize,
}

impl Prepared {
    /// By channel, where the crest is a term: how the bar stands beside the stylus.
    pub(super) fn beside(self) -> Vec<Beside> {
        self.beside
    }
}
