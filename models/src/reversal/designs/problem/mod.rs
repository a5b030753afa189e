//! A design as a structured least-squares problem: the exact geometry of every channel in the plane of
//! its indicator, over splines.
//!
//! A channel's tilt is the sum of the slopes that it sees; its probe rides on the side it sees as in
//! [`forward`](crate::reversal::forward), and the slide brings M_h cos φ + M_v sin φ. A task is one cell
//! and one channel, as in the four-channel fit.

mod rows;
mod tasks;

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::{Constraints, Share};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredProblem};
use nalgebra::{DMatrix, DVector};

use super::layout::{FormOf, Layout};
use super::readings::Trace;
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::cells::Union;
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::gauge::line_of_spline;
use crate::reversal::simultaneous::rows::{CellForm, Points, Run};
use crate::reversal::simultaneous::starts::starts;

/// Traces, unknowns and bases.
#[derive(Debug, Clone)]
pub struct DesignProblem<'a> {
    pub(super) traces: &'a [Trace],
    pub(super) layout: Layout,
    /// By form, all of the same number of cells; those of the slide are one.
    pub(super) bases: Vec<CubicBSpline>,
    pub(super) axis: Axis,
    /// Half the thickness of the artefact, mm.
    pub(super) half_mm: f64,
    /// 1/σ of a reading of each channel, 1/µm.
    pub(super) weights: Vec<f64>,
    /// The coefficients of ξ in each basis.
    xi: Vec<Vec<f64>>,
    constraints: Constraints,
    held: Vec<bool>,
    /// By channel the first reading at or beyond each break of the slide's forms.
    slide_starts: Vec<Vec<usize>>,
}

impl<'a> DesignProblem<'a> {
    /// The problem over these traces.
    pub(super) fn new(
        traces: &'a [Trace],
        layout: Layout,
        bases: Vec<CubicBSpline>,
        axis: Axis,
        half_mm: f64,
        weights: Vec<f64>,
    ) -> Self {
        let xi = bases
            .iter()
            .map(|basis| basis.line(axis.xi(0.0), 1.0 / axis.scale))
            .collect();
        let slide_starts = match layout.forms.first() {
            Some(FormOf::Slide(_)) => {
                let breaks = bases[0].breaks();
                traces.iter().map(|t| starts(&t.x, breaks)).collect()
            }
            _ => Vec::new(),
        };
        let closures = layout.closures();
        Self {
            constraints: gauge(&layout, &bases, traces, axis),
            held: (0..layout.border_count())
                .map(|j| closures.contains(&j))
                .collect(),
            traces,
            layout,
            bases,
            axis,
            half_mm,
            weights,
            xi,
            slide_starts,
        }
    }

    /// Number of cells of every form.
    pub(super) fn cell_count(&self) -> usize {
        self.bases.first().map_or(0, CubicBSpline::cell_count)
    }

    /// The forms, less their lines, as polynomials of their cells, µm.
    pub(super) fn cubics(&self, at: &Parameters) -> Vec<Vec<Cubic>> {
        self.bases
            .iter()
            .enumerate()
            .map(|(form, basis)| {
                let coefficients = self.layout.coefficients_of(form, &at.band);
                let [height, slope] = self.layout.line(form).map(|j| at.border[j]);
                (0..basis.cell_count())
                    .map(|k| {
                        let (left, width) = basis.cell(k);
                        let mut cubic = basis.cubic(&coefficients, k);
                        cubic[0] -= height + slope * self.axis.xi(left);
                        cubic[1] -= slope * width / self.axis.scale;
                        cubic
                    })
                    .collect()
            })
            .collect()
    }

    /// Goes through the runs of a task: readings from..to, cell of the side, cell of the slide.
    fn runs(
        &self,
        prepared: &Prepared,
        channel: usize,
        cell: usize,
        mut run: impl FnMut(usize, usize, usize, usize) -> Result<(), NoValue>,
    ) -> Result<(), NoValue> {
        let side = &prepared.side_starts[channel];
        // A channel that sees no form of the slide has the side's cells alone.
        let slide = match self.layout.slides[channel].is_empty() {
            true => side,
            false => &self.slide_starts[channel],
        };
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

    /// What the readings of a channel share in two cells. Forms of the slide that are seen together act
    /// as one, their sum.
    fn run<'b>(
        &'b self,
        prepared: &Prepared,
        channel: usize,
        side: usize,
        slide: usize,
    ) -> Run<'b> {
        let cell = |form: usize, k: usize, cubic: Cubic| {
            let (left, width) = self.bases[form].cell(k);
            CellForm {
                left,
                width,
                form: cubic,
                basis: self.bases[form].polynomials(k),
            }
        };
        let own = self.layout.side[channel];
        let slide = match self.layout.slides[channel][..] {
            [] => None,
            [(form, factor)] => Some((cell(form, slide, prepared.cubics[form][slide]), factor)),
            ref seen => {
                let mut sum = [0.0; 4];
                for (form, factor) in seen {
                    for (total, c) in sum.iter_mut().zip(prepared.cubics[*form][slide]) {
                        *total += factor * c;
                    }
                }
                Some((cell(seen[0].0, slide, sum), 1.0))
            }
        };
        Run {
            attitude: prepared.attitudes[channel],
            side: cell(own, side, prepared.cubics[own][side]),
            slide,
            offset: prepared.constants[channel],
            weight: self.weights[channel],
            thickness: false,
        }
    }

    /// Fills the columns of a run: where two forms of the slide are seen, each function of their basis
    /// stands twice.
    fn fill(
        &self,
        channel: usize,
        points: &Points,
        run: &Run,
        x: &[f64],
        scratch: &mut Tall,
        out: &mut Tall,
    ) {
        let slides = &self.layout.slides[channel];
        if slides.len() < 2 {
            points.fill(run, x, None, out);
            return;
        }
        scratch.reset(x.len(), run.columns());
        points.fill(run, x, None, scratch);
        let stride = slides.len() + 1;
        for k in 0..4 {
            for (s, (_, factor)) in slides.iter().enumerate() {
                let from = scratch.column(2 * k);
                for (o, v) in out.column_mut(stride * k + s).iter_mut().zip(from) {
                    *o = factor * v;
                }
            }
            out.column_mut(stride * k + stride - 1)
                .copy_from_slice(scratch.column(2 * k + 1));
        }
        for (j, from) in (8..scratch.columns()).enumerate() {
            out.column_mut(4 * stride + j)
                .copy_from_slice(scratch.column(from));
        }
    }

    /// Local columns of a channel's runs, the residual included.
    fn columns(&self, channel: usize) -> usize {
        match self.layout.slides[channel].len() {
            0 => 7,
            n => 4 * (n + 1) + 2,
        }
    }

    /// The band unknowns of the local columns: by coefficient, the slide's before the artefact's.
    fn band_columns(&self, channel: usize, side: usize, slide: usize) -> Vec<Option<usize>> {
        let slides = &self.layout.slides[channel];
        let mut band = Vec::with_capacity(12);
        for k in 0..4 {
            for (form, _) in slides {
                band.push(self.layout.coefficient(*form, slide + k));
            }
            band.push(self.layout.coefficient(self.layout.side[channel], side + k));
        }
        band
    }

    /// What the local columns are to the border. A constant and ξ are combinations of the functions of
    /// a cell: constants and lines have no column of their own beside a form of the slide.
    fn shares(&self, channel: usize, side: usize, slide: usize) -> Vec<Share> {
        let layout = &self.layout;
        let slides = &layout.slides[channel];
        let stride = slides.len() + 1;
        let mut shares = Vec::with_capacity(48);
        let mut push = |column: usize, unknown: usize, weight: f64| {
            if weight != 0.0 {
                shares.push(Share {
                    column: column as u32,
                    unknown: unknown as u32,
                    weight,
                });
            }
        };
        for k in 0..4 {
            for (s, (form, _)) in slides.iter().enumerate() {
                let [height, slope] = layout.line(*form);
                push(stride * k + s, height, -1.0);
                push(stride * k + s, slope, -self.xi[*form][slide + k]);
            }
            let own = layout.side[channel];
            let [height, slope] = layout.line(own);
            push(stride * k + stride - 1, height, -1.0);
            push(stride * k + stride - 1, slope, -self.xi[own][side + k]);
        }
        let tilt = 4 * stride;
        for (j, share) in layout.slopes[channel].iter().enumerate() {
            push(tilt, j, *share);
        }
        // The largest factor of a slide's form makes the constant with least rounding.
        let largest =
            (0..slides.len()).max_by(|a, b| slides[*a].1.abs().total_cmp(&slides[*b].1.abs()));
        for (j, share) in layout.constants[channel].iter().enumerate() {
            let unknown = layout.constants_from() + j;
            match largest {
                Some(s) => {
                    for k in 0..4 {
                        push(stride * k + s, unknown, share / slides[s].1);
                    }
                }
                None => push(tilt + 1, unknown, *share),
            }
        }
        shares
    }

    /// Reading less model, µm, of every reading: by channel, in the order of its trace.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(super) fn residuals(&self, at: &Parameters) -> Result<Vec<Vec<f64>>, NoValue> {
        let prepared = self.prepare(at)?;
        let mut points = Box::<Points>::default();
        (0..self.traces.len())
            .map(|c| {
                let unit = -1.0 / self.weights[c];
                let trace = &self.traces[c];
                let mut residuals = Vec::with_capacity(trace.len());
                for cell in 0..self.cell_count() {
                    self.runs(&prepared, c, cell, |from, to, side, slide| {
                        let run = self.run(&prepared, c, side, slide);
                        for first in (from..to).step_by(Tall::CAPACITY) {
                            let last = to.min(first + Tall::CAPACITY);
                            let (x, value) = (&trace.x[first..last], &trace.value[first..last]);
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
}

impl DesignProblem<'_> {
    /// Derivatives of the weighted residuals by every unknown, band first: one row a reading, channel by
    /// channel.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(super) fn jacobian(&self, at: &Parameters) -> Result<DMatrix<f64>, NoValue> {
        let prepared = self.prepare(at)?;
        let rows = self.traces.iter().map(Trace::len).sum();
        let n = self.layout.band_count();
        let mut jacobian = DMatrix::zeros(rows, n + self.layout.border_count());
        let mut points = Box::<Points>::default();
        let (mut scratch, mut batch) = (Tall::new(10), Tall::new(16));
        let mut above = 0;
        for (c, trace) in self.traces.iter().enumerate() {
            for cell in 0..self.cell_count() {
                self.runs(&prepared, c, cell, |from, to, side, slide| {
                    let run = self.run(&prepared, c, side, slide);
                    let (band, shares) = (
                        self.band_columns(c, side, slide),
                        self.shares(c, side, slide),
                    );
                    for first in (from..to).step_by(Tall::CAPACITY) {
                        let last = to.min(first + Tall::CAPACITY);
                        let x = &trace.x[first..last];
                        points.locate(&run, x, &trace.value[first..last])?;
                        batch.reset(last - first, self.columns(c));
                        self.fill(c, &points, &run, x, &mut scratch, &mut batch);
                        for row in 0..last - first {
                            let mut out = jacobian.row_mut(above + first + row);
                            for (l, j) in band.iter().enumerate() {
                                if let Some(j) = j {
                                    out[*j] += batch.column(l)[row];
                                }
                            }
                            for share in &shares {
                                let local = batch.column(share.column as usize)[row];
                                out[n + share.unknown as usize] += share.weight * local;
                            }
                        }
                    }
                    Ok(())
                })?;
            }
            above += trace.len();
        }
        Ok(jacobian)
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
    width: usize,
}
