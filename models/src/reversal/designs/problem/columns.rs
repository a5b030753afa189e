//! The local columns of a channel's rows.
//!
//! A channel that sees one form of the slide and no crest has its functions and those of its side side by
//! side, and constants as combinations of the former, as in the four-channel fit. Any other has the functions
//! of its side, those of each form of the slide, and columns of its own for the constant and, where the crest
//! is a term, for how the bar stands across.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::Share;
use errsep_solvers::problem::NoValue;

use super::{Cells, DesignProblem, Prepared};
use crate::basis::bspline::{Cubic, horner};
use crate::reversal::designs::layout::SlideSeen;
use crate::reversal::simultaneous::rows::{CellForm, Points, Run};
use crate::units::mm_from_um;

const CAPACITY: usize = Tall::CAPACITY;

/// What is worked out once a reading of a batch.
pub(super) struct Batch {
    pub points: Box<Points>,
    /// Place in the cell of each form of the slide.
    t: [[f64; CAPACITY]; 2],
    /// Readings less what slide and crest bring, µm.
    rest: [f64; CAPACITY],
    /// Derivatives of the reading by the bar's place across and by its radius, µm/mm.
    per_across: [f64; CAPACITY],
    per_radius: [f64; CAPACITY],
    scratch: Tall,
}

impl Default for Batch {
    fn default() -> Self {
        Self {
            points: Box::default(),
            t: [[0.0; CAPACITY]; 2],
            rest: [0.0; CAPACITY],
            per_across: [0.0; CAPACITY],
            per_radius: [0.0; CAPACITY],
            scratch: Tall::new(8),
        }
    }
}

impl DesignProblem<'_> {
    /// The form of the slide whose functions carry the constants too.
    fn joined(&self, channel: usize) -> Option<SlideSeen> {
        match (&self.layout.slides[channel][..], &self.body.crest) {
            ([one], None) => Some(*one),
            _ => None,
        }
    }

    fn cell(&self, prepared: &Prepared, form: usize, k: usize) -> CellForm<'_> {
        let basis = &self.splines.bases[form];
        let (left, width) = basis.cell(k);
        CellForm {
            left,
            width,
            form: prepared.cubics[form][k],
            basis: basis.polynomials(k),
        }
    }

    /// What the readings of a run share.
    pub(super) fn run<'b>(&'b self, prepared: &Prepared, channel: usize, cells: Cells) -> Run<'b> {
        let slide = self.joined(channel).map(|seen| {
            let cell = self.cell(prepared, seen.form, cells.slides[0]);
            (cell, seen.along)
        });
        Run {
            attitude: prepared.attitudes[channel],
            side: self.cell(prepared, self.layout.side[channel], cells.side),
            slide,
            offset: prepared.constants[channel],
            weight: self.weights[channel],
            thickness: self.layout.thickness,
        }
    }

    /// Points of contact and residuals of some readings of a run.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub(super) fn locate(
        &self,
        prepared: &Prepared,
        (channel, cells): (usize, Cells),
        run: &Run,
        (x, value): (&[f64], &[f64]),
        batch: &mut Batch,
    ) -> Result<(), NoValue> {
        if self.joined(channel).is_some() {
            return batch.points.locate(run, x, value);
        }
        let n = x.len();
        batch.rest[..n].copy_from_slice(value);
        let mut wander = [0.0; CAPACITY];
        for (s, seen) in self.layout.slides[channel].iter().enumerate() {
            let (left, width) = self.splines.bases[seen.form].cell(cells.slides[s]);
            let cubic: &Cubic = &prepared.cubics[seen.form][cells.slides[s]];
            for i in 0..n {
                let t = (x[i] - left) / width;
                let height = horner(cubic, t);
                batch.t[s][i] = t;
                batch.rest[i] -= seen.along * height;
                wander[i] += seen.across * height;
            }
        }
        if let Some(beside) = prepared.beside.get(channel) {
            for i in 0..n {
                let loss = beside.loss(x[i], wander[i])?;
                batch.rest[i] += loss.um;
                batch.per_across[i] = loss.per_across;
                batch.per_radius[i] = loss.per_radius;
            }
        }
        batch.points.locate(run, x, &batch.rest[..n])
    }

    /// Fills the columns of some located readings of a run.
    pub(super) fn fill(
        &self,
        prepared: &Prepared,
        channel: usize,
        (run, cells): (&Run, Cells),
        x: &[f64],
        batch: &mut Batch,
        out: &mut Tall,
    ) {
        let Batch {
            points, scratch, ..
        } = batch;
        if self.joined(channel).is_some() {
            points.fill(run, x, None, out);
            return;
        }
        scratch.reset(x.len(), run.columns());
        points.fill(run, x, None, scratch);
        for k in 0..4 {
            out.column_mut(k).copy_from_slice(scratch.column(k));
        }
        let slides = &self.layout.slides[channel];
        let beside = prepared.beside.get(channel);
        for (s, seen) in slides.iter().enumerate() {
            let basis = self.splines.bases[seen.form].polynomials(cells.slides[s]);
            for (k, function) in basis.iter().enumerate() {
                let column = out.column_mut(4 + 4 * s + k);
                for (i, own) in column.iter_mut().enumerate() {
                    let across = match beside {
                        Some(_) => seen.across * mm_from_um(batch.per_across[i]),
                        None => 0.0,
                    };
                    *own = run.weight * (seen.along + across) * horner(function, batch.t[s][i]);
                }
            }
        }
        let tilt = 4 + 4 * slides.len();
        // Tilt, constant and thickness as they come.
        let taken = run.columns() - 5;
        for j in 0..taken {
            out.column_mut(tilt + j)
                .copy_from_slice(scratch.column(4 + j));
        }
        let mut next = tilt + taken;
        if let Some(beside) = beside {
            if run.thickness {
                let by_radius = out.column_mut(next - 1).iter_mut().zip(&batch.per_radius);
                by_radius.for_each(|(own, d)| *own += 0.5 * run.weight * d);
            }
            let per_across = batch.per_across.iter().zip(x);
            let slope = out.column_mut(next).iter_mut().zip(per_across.clone());
            slope.for_each(|(own, (d, x))| *own = run.weight * d * beside.lever(*x));
            let shift = out.column_mut(next + 1).iter_mut().zip(per_across);
            shift.for_each(|(own, (d, _))| *own = run.weight * d);
            next += 2;
        }
        out.column_mut(next)
            .copy_from_slice(scratch.column(run.columns() - 1));
    }

    /// Local columns of a channel's runs, the residual included.
    pub(super) fn columns(&self, channel: usize) -> usize {
        let thickness = usize::from(self.layout.thickness);
        match self.joined(channel) {
            Some(_) => 10 + thickness,
            None => {
                let crest = if self.body.crest.is_some() { 2 } else { 0 };
                4 * (self.layout.slides[channel].len() + 1) + 3 + thickness + crest
            }
        }
    }

    /// The band unknowns of the local columns.
    pub(super) fn band_columns(&self, channel: usize, cells: Cells) -> Vec<Option<usize>> {
        let layout = &self.layout;
        let side = |k: usize| layout.coefficient(layout.side[channel], cells.side + k);
        if let Some(seen) = self.joined(channel) {
            let slide = |k: usize| layout.coefficient(seen.form, cells.slides[0] + k);
            return (0..4).flat_map(|k| [slide(k), side(k)]).collect();
        }
        let mut band: Vec<Option<usize>> = (0..4).map(side).collect();
        for (seen, cell) in layout.slides[channel].iter().zip(cells.slides) {
            band.extend((0..4).map(|k| layout.coefficient(seen.form, cell + k)));
        }
        band
    }

    /// What the local columns are to the border. A constant and ξ are combinations of the functions of
    /// a cell: the lines of the forms have no column of their own, nor have constants beside the functions
    /// of a single form of the slide.
    pub(super) fn shares(&self, channel: usize, cells: Cells) -> Vec<Share> {
        let layout = &self.layout;
        let mut shares = Shares(Vec::with_capacity(48));
        let slides = &layout.slides[channel];
        let side = layout.side[channel];
        let joined = self.joined(channel);
        let line = |shares: &mut Shares, column: usize, form: usize, coefficient: usize| {
            let [height, slope] = layout.line(form);
            shares.push(column, height, -1.0);
            shares.push(column, slope, -self.xi[form][coefficient]);
        };
        for k in 0..4 {
            let columns = |s: usize| match joined {
                Some(_) => 2 * k,
                None => 4 + 4 * s + k,
            };
            for (s, seen) in slides.iter().enumerate() {
                line(&mut shares, columns(s), seen.form, cells.slides[s] + k);
                if joined.is_some() {
                    for (j, share) in layout.constants[channel].iter().enumerate() {
                        shares.push(columns(s), layout.constants_from() + j, share / seen.along);
                    }
                }
            }
            let own = if joined.is_some() { 2 * k + 1 } else { k };
            line(&mut shares, own, side, cells.side + k);
        }
        let mut next = 4 * (slides.len() + 1);
        shares.all(next, 0, &layout.slopes[channel]);
        next += 1;
        if joined.is_none() {
            shares.all(next, layout.constants_from(), &layout.constants[channel]);
            next += 1;
        }
        if let Some(thickness) = layout.thickness_index() {
            shares.push(next, thickness, 1.0);
            next += 1;
        }
        if let Some(crest) = &self.body.crest {
            let across = &layout.across[channel];
            shares.all(next, 0, &across.slopes);
            if crest.kept {
                for (j, share) in across.artefact.iter().enumerate() {
                    shares.push(next + 1, j, crest.middle * share);
                }
                for (j, share) in across.constants.iter().enumerate() {
                    shares.push(next + 1, layout.constants_from() + j, mm_from_um(*share));
                }
            }
        }
        shares.0
    }
}

/// Shares that are being gathered.
struct Shares(Vec<Share>);

impl Shares {
    fn push(&mut self, column: usize, unknown: usize, weight: f64) {
        if weight != 0.0 {
            self.0.push(Share {
                column: column as u32,
                unknown: unknown as u32,
                weight,
            });
        }
    }

    fn all(&mut self, column: usize, from: usize, weights: &[f64]) {
        for (j, weight) in weights.iter().enumerate() {
            self.push(column, from + j, *weight);
        }
    }
}
