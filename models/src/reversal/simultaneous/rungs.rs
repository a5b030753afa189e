//! The rungs of the ladder of knots, from the moments of the readings in their cells.
//!
//! Where the fit begins the forms are zero. A probe of channel c touches the artefact at
//! u = (x + h sin ψ)/cos ψ then, and the linear model of its reading is
//!
//! ```text
//!     r = r₀ ± M(x) + S(u)/cos ψ + a straight line in x,
//! ```
//!
//! whose line the unknowns y of the border make up: tilts, offsets, the lines of the forms. On the stretch
//! between two breaks every function is a cubic, so that the sums Σ tᵖ (p ≤ 6) and Σ tᵖ r₀ (p ≤ 3) of its
//! readings are all that the normal equations want of them. With N = LLᵀ those of the coefficients c and
//! x = L⁻¹(…) what stands beside them, the least sum of squares under the gauge Wᵀc = Ey is the least over
//! y of
//!
//! ```text
//!     s + 2 bᵀy + yᵀSy + dᵀ(WᵀN⁻¹W)⁻¹d,    d = (E + WᵀN⁻¹N_cy) y + WᵀN⁻¹n_r.
//! ```
//!
//! Normal equations lose twice the digits of an orthogonal factorisation: the caller hears how far to
//! trust the sum. A perturbation δN of them moves it by cᵀδN c, at most a few roundings of the squares
//! over the least share that a pivot keeps of its diagonal.

mod moments;
mod normal;

use nalgebra::{DMatrix, DVector};

use super::gauge::{self, Axis};
use super::readings::ChannelReadings;
use super::unknowns::{Form, Unknowns};
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::forward::Attitude;
use crate::units::UM_PER_MM;
use moments::{Stretch, gather};
use normal::{DETERMINED, Functions, Normal};

/// Rounding of a sum of squares, relative to that of the readings less their lines, where no pivot loses
/// anything: some hundred roundings.
const ROUNDING: f64 = 400.0 * f64::EPSILON;

/// A channel where the fit begins.
struct Begun<'a> {
    readings: &'a ChannelReadings,
    attitude: Attitude,
    /// Readings' model less themselves, µm.
    left: Vec<f64>,
    /// Square of the weight, 1/µm².
    weight: f64,
}

/// The readings where the fit begins, for any number of cells.
pub struct Rungs<'a> {
    channels: Vec<Begun<'a>>,
    axis: Axis,
    places: Vec<f64>,
    /// Weighted squares of what the lines leave.
    whole: f64,
    /// What rounding of the readings and of their model, of which the lines leave little, may do to a sum of
    /// these squares.
    of_readings: f64,
}

/// A sum of squares and by how much it may be off.
#[derive(Debug, Clone, Copy)]
pub struct Squares {
    pub left: f64,
    pub rounding: f64,
}

/// A linear fit by normal equations.
pub struct Linear {
    normal: Normal,
    least: Least,
}

impl Linear {
    /// The steps of band and border to the least sum of squares: the first step of Gauss and Newton from
    /// where the fit begins, but for the rounding of normal equations.
    pub fn step(&self) -> (Vec<f64>, Vec<f64>) {
        let Self { normal, least } = self;
        let mut beside: Vec<f64> = least.lines.iter().map(|y| -y).collect();
        beside.push(-1.0);
        beside.extend(least.multipliers.iter());
        (normal.back(&beside), least.border.as_slice().to_vec())
    }
}

/// The least over the unknowns of the border.
struct Least {
    /// Sum of squares.
    left: f64,
    /// The least share that a pivot keeps.
    kept: f64,
    /// The steps of the border's unknowns.
    border: DVector<f64>,
    /// What they make of the channels' lines.
    lines: DVector<f64>,
    /// The multipliers of the gauge, (WᵀN⁻¹W)⁻¹d.
    multipliers: DVector<f64>,
}

impl<'a> Rungs<'a> {
    /// The readings at these tilts and offsets of the channels; `None` where the model is not defined.
    pub fn new(
        all: &'a [ChannelReadings],
        begin: impl Iterator<Item = (f64, f64)>,
        weights: &[f64],
        (axis, thickness_mm): (Axis, f64),
    ) -> Option<Self> {
        let begun = all.iter().zip(begin).zip(weights);
        let channels: Vec<Begun> = begun
            .map(|((readings, (tilt, offset)), weight)| {
                let attitude = Attitude::new(tilt, thickness_mm / 2.0).ok()?;
                let [from, per] = contact(&attitude);
                let pairs = readings.x.iter().zip(&readings.value);
                let left = pairs.map(|(x, value)| {
                    UM_PER_MM * attitude.reading_mm(from + per * x, 0.0) + offset - value
                });
                Some(Begun {
                    readings,
                    attitude,
                    left: left.collect(),
                    weight: weight * weight,
                })
            })
            .collect::<Option<_>>()?;
        let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let of = |c: &Begun| c.weight * squares(&c.left);
        let whole = channels.iter().map(of).sum::<f64>();
        let of = |c: &Begun| c.weight * squares(&c.readings.value);
        let readings = channels.iter().map(of).sum::<f64>();
        Some(Self {
            whole,
            of_readings: 16.0 * f64::EPSILON * (whole * readings).sqrt(),
            places: gauge::places(all),
            channels,
            axis,
        })
    }

    /// The least sum of squares of a linear fit; `None` where it is only rounding.
    pub fn squares(&self, linear: &Linear) -> Option<Squares> {
        let Linear { normal, least } = linear;
        let left = least.left;
        let rounding = ROUNDING * self.whole / normal.kept.min(least.kept) + self.of_readings;
        (left > rounding).then_some(Squares { left, rounding })
    }

    /// The linear fit with these unknowns on these bases; `None` where the normal equations determine
    /// none.
    pub fn solve(&self, unknowns: &Unknowns, bases: &[CubicBSpline]) -> Option<Linear> {
        let gathered: Vec<Vec<Stretch>> = (0..self.channels.len())
            .map(|c| self.stretches(c, unknowns, bases))
            .collect();
        let mut normal = self.normal(unknowns, bases, &gathered);
        let constraints = gauge::constraints_at(unknowns, bases, &self.places, self.axis);
        let lines = 2 * self.channels.len();
        normal.corner[(lines, lines)] = self.whole;
        for (l, column) in constraints.band.iter().enumerate() {
            for (row, value) in normal.beside.chunks_exact_mut(normal.columns).zip(column) {
                row[lines + 1 + l] = *value;
            }
        }
        normal.factorise();
        if !(normal.kept > DETERMINED) {
            return None;
        }
        let least = self.least(unknowns, &constraints.border, &normal)?;
        Some(Linear { normal, least })
    }

    /// The readings of a channel, stretch by stretch.
    fn stretches(
        &self,
        channel: usize,
        unknowns: &Unknowns,
        bases: &[CubicBSpline],
    ) -> Vec<Stretch> {
        let Begun {
            readings,
            attitude,
            left,
            ..
        } = &self.channels[channel];
        let side = &bases[unknowns.side_of(readings.channel)];
        let slide = unknowns.place(Form::Slide).map(|form| &bases[form]);
        let [from, per] = contact(attitude);
        let on_slide = |u: f64| (u - from) / per;
        let cells = side.cell_count();
        let (mut stretches, mut at) = (Vec::with_capacity(2 * cells), 0);
        let (mut k_side, mut k_slide) = (0, 0);
        while at < readings.len() {
            let x = readings.x[at];
            while k_side + 1 < cells && on_slide(side.breaks()[k_side + 1]) <= x {
                k_side += 1;
            }
            let mut end = if k_side + 1 < cells {
                on_slide(side.breaks()[k_side + 1])
            } else {
                f64::INFINITY
            };
            let (start, width) = match slide {
                Some(slide) => {
                    while k_slide + 1 < cells && slide.breaks()[k_slide + 1] <= x {
                        k_slide += 1;
                    }
                    if k_slide + 1 < cells {
                        end = end.min(slide.breaks()[k_slide + 1]);
                    }
                    slide.cell(k_slide)
                }
                None => {
                    let (start, width) = side.cell(k_side);
                    (on_slide(start), width / per)
                }
            };
            let mut stretch = Stretch {
                start,
                width,
                slide: k_slide,
                side: k_side,
                powers: [0.0; 7],
                left: [0.0; 4],
            };
            let count = readings.x[at..].partition_point(|x| *x < end);
            let here = at..at + count;
            gather(&mut stretch, &readings.x[here.clone()], &left[here]);
            at += count;
            stretches.push(stretch);
        }
        stretches
    }

    /// The normal equations of the coefficients, with the lines of the channels, the readings and room
    /// for the gauge beside them.
    fn normal(
        &self,
        unknowns: &Unknowns,
        bases: &[CubicBSpline],
        gathered: &[Vec<Stretch>],
    ) -> Normal {
        let slide = unknowns.place(Form::Slide);
        let forms = unknowns.forms.len();
        let apart = gathered.iter().flatten().map(|s| s.slide.abs_diff(s.side));
        let apart = apart.max().filter(|_| slide.is_some()).unwrap_or(0);
        let lines = 2 * self.channels.len();
        let columns = lines + 1 + 2 * forms;
        let mut normal = Normal::new(unknowns.band_count(), forms * (4 + apart), columns, lines);
        for (c, (begun, stretches)) in self.channels.iter().zip(gathered).enumerate() {
            let side = unknowns.side_of(begun.readings.channel);
            let [from, per] = contact(&begun.attitude);
            for stretch in stretches {
                let mut functions = Functions::default();
                let mut places = [None; 8];
                // What t is in the artefact's cell.
                let (left, width) = bases[side].cell(stretch.side);
                let shift = (from + per * stretch.start - left) / width;
                let scale = per * stretch.width / width;
                let per_cos = 1.0 / begun.attitude.cos;
                for (k, polynomial) in bases[side].polynomials(stretch.side).iter().enumerate() {
                    functions.put(k, moved(polynomial, shift, scale, per_cos));
                    places[k] = unknowns.coefficient(side, stretch.side + k);
                }
                if let Some(form) = slide {
                    let sign = begun.readings.channel.indicator_sign();
                    for (k, polynomial) in bases[form].polynomials(stretch.slide).iter().enumerate()
                    {
                        functions.put(4 + k, polynomial.map(|p| sign * p));
                        places[4 + k] = unknowns.coefficient(form, stretch.slide + k);
                    }
                }
                let xi = [self.axis.xi(stretch.start), stretch.width / self.axis.scale];
                normal.add(stretch, (&functions, &places), c, xi, begun.weight);
            }
        }
        normal
    }

    /// The least over the unknowns of the border.
    fn least(&self, unknowns: &Unknowns, gauge: &DMatrix<f64>, normal: &Normal) -> Option<Least> {
        let lines = 2 * self.channels.len();
        let gauges = gauge.nrows();
        // What is left of lines and readings beside the coefficients, and the gauge among these.
        let gram = normal.gram();
        let left = &normal.corner - gram.view((0, 0), (lines + 1, lines + 1));
        let pull = gram.view((lines + 1, lines + 1), (gauges, gauges));
        let pull = pull.clone_owned().cholesky()?;
        let held = [unknowns.closure_index(), unknowns.thickness_index()];
        let free: Vec<usize> = (0..unknowns.border_count())
            .filter(|j| !held.contains(&Some(*j)))
            .collect();
        let made = self.made_of(unknowns).select_columns(&free);
        let beside = gram.view((lines + 1, 0), (gauges, lines));
        let d = gauge.select_columns(&free) + beside * &made;
        let d_left = gram.view((lines + 1, lines), (gauges, 1));
        let pulled = pull.solve(&d_left);
        let inner = left.view((0, 0), (lines, lines));
        let mut matrix = made.tr_mul(&(inner * &made)) + d.tr_mul(&pull.solve(&d));
        let mut value = made.tr_mul(&left.view((0, lines), (lines, 1))) + d.tr_mul(&pulled);
        let whole = normal.corner.view((0, 0), (lines, lines)) * &made;
        let mut scales = DVector::zeros(free.len());
        for j in 0..free.len() {
            let scale = 1.0 / made.column(j).dot(&whole.column(j)).sqrt();
            if !scale.is_finite() {
                return None;
            }
            matrix.row_mut(j).scale_mut(scale);
            matrix.column_mut(j).scale_mut(scale);
            value[j] *= scale;
            scales[j] = scale;
        }
        let root = matrix.cholesky()?;
        let pivots = root.l_dirty().diagonal();
        let kept = pivots.iter().fold(1.0, |m: f64, p| m.min(p * p));
        let found = root.solve(&value);
        let left = left[(lines, lines)] + d_left.dot(&pulled) - value.dot(&found);
        if !(kept > DETERMINED) {
            return None;
        }
        let step = DVector::from_fn(free.len(), |j, _| -scales[j] * found[j]);
        let mut border = DVector::zeros(unknowns.border_count());
        for (j, value) in free.iter().zip(&step) {
            border[*j] = *value;
        }
        Some(Least {
            left,
            kept,
            border,
            lines: &made * &step,
            multipliers: pull.solve(&(&d * &step + d_left)),
        })
    }

    /// What the unknowns of the border make of the line of each channel: at ξ = 0 and a unit of ξ.
    fn made_of(&self, unknowns: &Unknowns) -> DMatrix<f64> {
        let Axis { center, scale } = self.axis;
        let mut made = DMatrix::zeros(2 * self.channels.len(), unknowns.border_count());
        for (c, begun) in self.channels.iter().enumerate() {
            let mut add = |unknown: usize, [at_zero, per_mm]: [f64; 2]| {
                made[(2 * c, unknown)] += at_zero + per_mm * center;
                made[(2 * c + 1, unknown)] += per_mm * scale;
            };
            let Attitude {
                sin, cos, half_mm, ..
            } = begun.attitude;
            let [from, per] = contact(&begun.attitude);
            let across = sin * sin / cos;
            for (j, sign) in unknowns.slope_signs(c).enumerate() {
                let factor = sign * UM_PER_MM;
                add(
                    j,
                    [
                        factor * (half_mm * sin + across * from),
                        factor * (1.0 + across * per),
                    ],
                );
            }
            add(unknowns.offset(c), [1.0, 0.0]);
            let name = begun.readings.channel;
            if let Some(form) = unknowns.place(Form::Slide) {
                let [height, slope] = unknowns.line(form);
                let sign = name.indicator_sign();
                add(height, [-sign, 0.0]);
                add(slope, [sign * center / scale, -sign / scale]);
            }
            let [height, slope] = unknowns.line(unknowns.side_of(name));
            add(height, [-1.0 / cos, 0.0]);
            add(
                slope,
                [-(from - center) / (scale * cos), -per / (scale * cos)],
            );
        }
        made
    }
}

/// Where a straight artefact is touched: u = from + per·x.
fn contact(attitude: &Attitude) -> [f64; 2] {
    [
        attitude.half_mm * attitude.sin / attitude.cos,
        1.0 / attitude.cos,
    ]
}

/// The polynomial factor·p(shift + scale·t) in t.
fn moved(p: &Cubic, shift: f64, scale: f64, factor: f64) -> Cubic {
    let [a, b, c, d] = *p;
    let first = factor * scale;
    let second = first * scale;
    [
        factor * (((d * shift + c) * shift + b) * shift + a),
        first * ((3.0 * d * shift + 2.0 * c) * shift + b),
        second * (3.0 * d * shift + c),
        second * scale * d,
    ]
}
