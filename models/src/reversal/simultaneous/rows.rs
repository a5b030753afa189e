//! The rows of a run of readings whose probe points lie in one cell of the slide's form and one of
//! the artefact's: residual and derivatives, column by column.

use errsep_solvers::by_processor;
use errsep_solvers::linear::banded::Tall;
use errsep_solvers::problem::NoValue;

use crate::basis::bspline::{Cubic, horner, horner_slope};
use crate::reversal::forward::{Attitude, no_contact};
use crate::units::UM_PER_MM;

/// A cell of a form: where it lies, the form in it and the basis functions in it.
#[derive(Debug, Clone, Copy)]
pub struct CellForm<'a> {
    /// Left end, mm.
    pub left: f64,
    /// Width, mm.
    pub width: f64,
    /// The form less its line, µm, as polynomial in t.
    pub form: Cubic,
    /// The four basis functions.
    pub basis: &'a [Cubic; 4],
}

/// What the readings of a run share.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The tilted artefact.
    pub attitude: Attitude,
    /// The cell of the artefact's form.
    pub side: CellForm<'a>,
    /// The cell of the slide's form and its sign, where that is fitted.
    pub slide: Option<(CellForm<'a>, f64)>,
    /// Offset of the channel, µm.
    pub offset: f64,
    /// 1/σ of a reading, 1/µm.
    pub weight: f64,
    /// Whether ∂/∂thickness is wanted.
    pub thickness: bool,
}

impl Run<'_> {
    /// Local columns, the residual included.
    pub fn columns(&self) -> usize {
        let forms = if self.slide.is_some() { 9 } else { 6 };
        forms + 1 + usize::from(self.thickness)
    }
}

const CAPACITY: usize = Tall::CAPACITY;

/// What is computed once a reading.
pub struct Points {
    t_slide: [f64; CAPACITY],
    u: [f64; CAPACITY],
    t_side: [f64; CAPACITY],
    height: [f64; CAPACITY],
    slope: [f64; CAPACITY],
    q: [f64; CAPACITY],
    /// Weighted residuals.
    pub residual: [f64; CAPACITY],
    largest_step: f64,
    flattest: f64,
}

impl Default for Points {
    fn default() -> Self {
        Self {
            t_slide: [0.0; CAPACITY],
            u: [0.0; CAPACITY],
            t_side: [0.0; CAPACITY],
            height: [0.0; CAPACITY],
            slope: [0.0; CAPACITY],
            q: [0.0; CAPACITY],
            residual: [0.0; CAPACITY],
            largest_step: 0.0,
            flattest: 0.0,
        }
    }
}

/// Most Newton steps for the points of contact of a run; one or two are the rule.
const MOST_STEPS: usize = 50;

impl Points {
    /// Points of contact and residuals of the readings at `x` (at most [`Tall::CAPACITY`]).
    ///
    /// # Errors
    /// [`NoValue`] where a probe would touch the form in two places.
    pub fn locate(&mut self, run: &Run, x: &[f64], value: &[f64]) -> Result<(), NoValue> {
        let n = x.len();
        let attitude = &run.attitude;
        let middle = horner(&run.side.form, 0.5) / UM_PER_MM;
        let lift = (attitude.half_mm + middle) * attitude.sin;
        for (u, x) in self.u[..n].iter_mut().zip(x) {
            *u = (x + lift) / attitude.cos;
        }
        // After a Newton step Δ the error is at most S″ sin ψ Δ²/(2 steepness).
        let bend = (2.0 * run.side.form[2].abs() + 6.0 * run.side.form[3].abs())
            / (run.side.width * run.side.width * UM_PER_MM);
        let extent = x.iter().fold(attitude.half_mm.abs(), |m, x| m.max(x.abs()));
        let mut settled = false;
        for _ in 0..MOST_STEPS {
            newton(self, run, x);
            if !(self.flattest > 0.0) {
                break;
            }
            let error =
                bend * attitude.sin.abs() * self.largest_step.powi(2) / (2.0 * self.flattest);
            if error <= 0.25 * f64::EPSILON * extent || self.largest_step <= f64::EPSILON * extent {
                settled = true;
                break;
            }
        }
        if !settled {
            return Err(no_contact(x.first().copied().unwrap_or(0.0)));
        }
        residuals(self, run, x, value);
        Ok(())
    }

    /// Fills the columns of a batch; the derivatives of each row, not its residual, times `scale`
    /// where that is given.
    pub fn fill(&self, run: &Run, x: &[f64], scale: Option<&[f64]>, batch: &mut Tall) {
        columns(self, run, x, scale, batch);
    }
}

by_processor! {
    fn newton(points: &mut Points, run: &Run, x: &[f64]) from newton_generic
}

#[inline(always)]
fn newton_generic<const FMA: bool>(points: &mut Points, run: &Run, x: &[f64]) {
    let Attitude {
        sin, cos, half_mm, ..
    } = run.attitude;
    let CellForm {
        left, width, form, ..
    } = run.side;
    let per_width = 1.0 / width;
    let in_mm = form.map(|c| c / UM_PER_MM);
    let n = x.len();
    let (mut largest, mut flattest) = ([0.0_f64; 8], [f64::INFINITY; 8]);
    let rounded = n.next_multiple_of(8);
    let mut padded = [0.0; CAPACITY];
    padded[..n].copy_from_slice(x);
    padded[n..rounded].fill(x[n - 1]);
    let last = points.u[n - 1];
    points.u[n..rounded].fill(last);
    for (u, x) in points.u[..rounded]
        .as_chunks_mut::<8>()
        .0
        .iter_mut()
        .zip(padded[..rounded].as_chunks::<8>().0)
    {
        for l in 0..8 {
            let t = (u[l] - left) * per_width;
            let height = horner(&in_mm, t);
            let slope = horner_slope(&in_mm, t) * per_width;
            let steepness = cos - slope * sin;
            let step = (x[l] - (u[l] * cos - (half_mm + height) * sin)) / steepness;
            u[l] += step;
            largest[l] = largest[l].max(step.abs());
            flattest[l] = flattest[l].min(steepness);
        }
    }
    points.largest_step = largest.into_iter().fold(0.0, f64::max);
    points.flattest = flattest.into_iter().fold(f64::INFINITY, f64::min);
}

by_processor! {
    fn residuals(points: &mut Points, run: &Run, x: &[f64], value: &[f64]) from residuals_generic
}

#[inline(always)]
fn residuals_generic<const FMA: bool>(points: &mut Points, run: &Run, x: &[f64], value: &[f64]) {
    let n = x.len();
    let Attitude {
        sin,
        cos,
        versed,
        half_mm,
        ..
    } = run.attitude;
    let CellForm {
        left, width, form, ..
    } = run.side;
    let per_width = 1.0 / width;
    let in_mm = form.map(|c| c / UM_PER_MM);
    for i in 0..n {
        points.t_side[i] = (points.u[i] - left) * per_width;
    }
    for i in 0..n {
        points.height[i] = horner(&in_mm, points.t_side[i]);
        points.slope[i] = horner_slope(&in_mm, points.t_side[i]) * per_width;
    }
    for i in 0..n {
        points.q[i] = 1.0 / (cos - points.slope[i] * sin);
    }
    for i in 0..n {
        let reading = points.u[i] * sin + points.height[i] * cos - half_mm * versed;
        points.residual[i] = UM_PER_MM * reading + run.offset - value[i];
    }
    if let Some((slide, sign)) = &run.slide {
        let per_width = 1.0 / slide.width;
        for i in 0..n {
            points.t_slide[i] = (x[i] - slide.left) * per_width;
        }
        for i in 0..n {
            points.residual[i] += sign * horner(&slide.form, points.t_slide[i]);
        }
    }
    for residual in &mut points.residual[..n] {
        *residual *= run.weight;
    }
}

by_processor! {
    fn columns(
        points: &Points,
        run: &Run,
        x: &[f64],
        scale: Option<&[f64]>,
        batch: &mut Tall,
    ) from columns_generic
}

#[inline(always)]
fn columns_generic<const FMA: bool>(
    points: &Points,
    run: &Run,
    x: &[f64],
    scale: Option<&[f64]>,
    batch: &mut Tall,
) {
    let n = x.len();
    let Attitude {
        sin, cos, half_mm, ..
    } = run.attitude;
    let apart = if run.slide.is_some() { 2 } else { 1 };
    if let Some((slide, sign)) = &run.slide {
        let signed = sign * run.weight;
        for (k, function) in slide.basis.iter().enumerate() {
            for (out, t) in batch.column_mut(2 * k).iter_mut().zip(&points.t_slide) {
                *out = signed * horner(function, *t);
            }
        }
    }
    let mut weighted_q = [0.0; CAPACITY];
    for (out, q) in weighted_q[..n].iter_mut().zip(&points.q) {
        *out = run.weight * q;
    }
    for (k, function) in run.side.basis.iter().enumerate() {
        let points = points.t_side.iter().zip(&weighted_q);
        let column = batch.column_mut(apart * k + apart - 1);
        for (out, (t, q)) in column.iter_mut().zip(points) {
            *out = q * horner(function, *t);
        }
    }
    let mut next = 4 * apart;
    for (i, out) in batch.column_mut(next).iter_mut().enumerate() {
        let across = points.u[i] * sin + (half_mm + points.height[i]) * cos;
        *out =
            UM_PER_MM * run.weight * (x[i] + (sin + points.slope[i] * cos) * across * points.q[i]);
    }
    next += 1;
    if run.slide.is_none() {
        batch.column_mut(next).fill(run.weight);
        next += 1;
    }
    if run.thickness {
        for (out, q) in batch.column_mut(next).iter_mut().zip(&points.q) {
            *out = 0.5 * UM_PER_MM * run.weight * (q - 1.0);
        }
        next += 1;
    }
    batch
        .column_mut(next)
        .copy_from_slice(&points.residual[..n]);
    if let Some(scale) = scale {
        for j in 0..next {
            for (out, s) in batch.column_mut(j).iter_mut().zip(scale) {
                *out *= s;
            }
        }
    }
}
