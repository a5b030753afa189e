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

use nalgebra::DMatrix;

use super::gauge::{self, Axis};
use super::readings::ChannelReadings;
use super::unknowns::{Form, Unknowns};
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::forward::Attitude;
use crate::units::UM_PER_MM;

/// A diagonal that is left with less than this share of itself is determined by nothing.
const DETERMINED: f64 = 1e-10;

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

/// A stretch of a channel between two breaks: its readings in moments of t = (x − start)/width.
struct Stretch {
    start: f64,
    width: f64,
    slide: usize,
    side: usize,
    powers: [f64; 7],
    left: [f64; 4],
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

    /// The least sum of squares with these unknowns on these bases; `None` where the normal equations
    /// determine none, or leave only rounding.
    pub fn squares(&self, unknowns: &Unknowns, bases: &[CubicBSpline]) -> Option<Squares> {
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
        let kept = normal.factorise()?;
        let (left, kept_beside) = self.least(unknowns, &constraints.border, &normal)?;
        let rounding = ROUNDING * self.whole / kept.min(kept_beside) + self.of_readings;
        (left > rounding).then_some(Squares { left, rounding })
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
            let per_width = 1.0 / width;
            while at < readings.len() && readings.x[at] < end {
                stretch.add((readings.x[at] - start) * per_width, left[at]);
                at += 1;
            }
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
                let mut functions = [[0.0; 4]; 8];
                let mut places = [None; 8];
                // What t is in the artefact's cell.
                let (left, width) = bases[side].cell(stretch.side);
                let shift = (from + per * stretch.start - left) / width;
                let scale = per * stretch.width / width;
                let per_cos = 1.0 / begun.attitude.cos;
                for (k, polynomial) in bases[side].polynomials(stretch.side).iter().enumerate() {
                    functions[k] = moved(polynomial, shift, scale, per_cos);
                    places[k] = unknowns.coefficient(side, stretch.side + k);
                }
                if let Some(form) = slide {
                    let sign = begun.readings.channel.indicator_sign();
                    for (k, polynomial) in bases[form].polynomials(stretch.slide).iter().enumerate()
                    {
                        functions[4 + k] = moved(polynomial, 0.0, 1.0, sign);
                        places[4 + k] = unknowns.coefficient(form, stretch.slide + k);
                    }
                }
                let xi = [self.axis.xi(stretch.start), stretch.width / self.axis.scale];
                normal.add(stretch, (&functions, &places), c, xi, begun.weight);
            }
        }
        normal
    }

    /// The least sum of squares over the unknowns of the border, and the least share that a pivot of
    /// theirs keeps.
    fn least(
        &self,
        unknowns: &Unknowns,
        gauge: &DMatrix<f64>,
        normal: &Normal,
    ) -> Option<(f64, f64)> {
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
        for j in 0..free.len() {
            let scale = 1.0 / made.column(j).dot(&whole.column(j)).sqrt();
            if !scale.is_finite() {
                return None;
            }
            matrix.row_mut(j).scale_mut(scale);
            matrix.column_mut(j).scale_mut(scale);
            value[j] *= scale;
        }
        let root = matrix.cholesky()?;
        let pivots = root.l_dirty().diagonal();
        let kept = pivots.iter().fold(1.0, |m: f64, p| m.min(p * p));
        let taken = value.dot(&root.solve(&value));
        let left = left[(lines, lines)] + d_left.dot(&pulled) - taken;
        (kept > DETERMINED).then_some((left, kept))
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
            for (j, sign) in unknowns.slope_signs(c).into_iter().enumerate() {
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

impl Stretch {
    fn add(&mut self, t: f64, left: f64) {
        let t2 = t * t;
        let t3 = t2 * t;
        let powers = [1.0, t, t2, t3, t2 * t2, t2 * t3, t3 * t3];
        for p in 0..7 {
            self.powers[p] += powers[p];
        }
        for p in 0..4 {
            self.left[p] += powers[p] * left;
        }
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

/// Banded normal equations, and columns beside them.
struct Normal {
    /// Row i: columns i + 1 − width to i, the diagonal last.
    band: Vec<f64>,
    width: usize,
    /// Row by row: the two functions of each channel's line, the readings, the gauge.
    beside: Vec<f64>,
    columns: usize,
    /// Products of lines and readings among themselves.
    corner: DMatrix<f64>,
}

impl Normal {
    fn new(unknowns: usize, width: usize, columns: usize, lines: usize) -> Self {
        Self {
            band: vec![0.0; unknowns * width],
            width,
            beside: vec![0.0; unknowns * columns],
            columns,
            corner: DMatrix::zeros(lines + 1, lines + 1),
        }
    }

    /// Adds a stretch of a channel with its functions and their places among the coefficients; ξ is
    /// `xi[0]` + `xi[1]`·t.
    fn add(
        &mut self,
        stretch: &Stretch,
        (functions, places): (&[Cubic; 8], &[Option<usize>; 8]),
        channel: usize,
        xi: [f64; 2],
        weight: f64,
    ) {
        let m = &stretch.powers;
        let lines = self.corner.nrows() - 1;
        for k in 0..8 {
            let Some(i) = places[k] else { continue };
            let f = &functions[k];
            // Σ f tᵖ.
            let mut with = [0.0; 4];
            for (p, sum) in with.iter_mut().enumerate() {
                let product = f[0] * m[p] + f[1] * m[p + 1] + f[2] * m[p + 2] + f[3] * m[p + 3];
                *sum = weight * product;
            }
            let band = &mut self.band[i * self.width..(i + 1) * self.width];
            for l in 0..8 {
                if let Some(j) = places[l]
                    && j <= i
                {
                    let g = &functions[l];
                    let sum = with[0] * g[0] + with[1] * g[1] + with[2] * g[2] + with[3] * g[3];
                    band[self.width - 1 - (i - j)] += sum;
                }
            }
            let left = &stretch.left;
            let row = &mut self.beside[i * self.columns..(i + 1) * self.columns];
            row[2 * channel] += with[0];
            row[2 * channel + 1] += xi[0] * with[0] + xi[1] * with[1];
            row[lines] +=
                weight * (f[0] * left[0] + f[1] * left[1] + f[2] * left[2] + f[3] * left[3]);
        }
        let (a, b) = (2 * channel, 2 * channel + 1);
        let ones = weight * m[0];
        let along = weight * (xi[0] * m[0] + xi[1] * m[1]);
        let squares =
            weight * (xi[0] * xi[0] * m[0] + 2.0 * xi[0] * xi[1] * m[1] + xi[1] * xi[1] * m[2]);
        self.corner[(a, a)] += ones;
        self.corner[(a, b)] += along;
        self.corner[(b, a)] += along;
        self.corner[(b, b)] += squares;
        let [left, left_along] = [
            weight * stretch.left[0],
            weight * (xi[0] * stretch.left[0] + xi[1] * stretch.left[1]),
        ];
        for (row, value) in [(a, left), (b, left_along)] {
            self.corner[(row, lines)] += value;
            self.corner[(lines, row)] += value;
        }
    }

    /// Brings in L⁻¹ before the columns beside. The least share that a pivot keeps of its diagonal;
    /// `None` where a coefficient is determined by nothing.
    fn factorise(&mut self) -> Option<f64> {
        let (width, columns) = (self.width, self.columns);
        let mut kept = 1.0_f64;
        let count = self.band.len() / width;
        for i in 0..count {
            let reach = (width - 1).min(i);
            let (above, rest) = self.band.split_at_mut(i * width);
            let row = &mut rest[..width];
            let whole = row[width - 1];
            let (done, own) = self.beside.split_at_mut(i * columns);
            let own = &mut own[..columns];
            for j in i - reach..i {
                let other = &above[j * width..(j + 1) * width];
                // Where column j stands, and so many columns before it that both rows have.
                let at = width - 1 - (i - j);
                let before = &other[width - 1 - at..width - 1];
                let mut l = row[at];
                for (a, b) in row[..at].iter().zip(before) {
                    l -= a * b;
                }
                l /= other[width - 1];
                row[at] = l;
                add(own, -l, &done[j * columns..(j + 1) * columns]);
            }
            let squares: f64 = row[..width - 1].iter().map(|l| l * l).sum();
            let pivot = whole - squares;
            if !(pivot > DETERMINED * whole) {
                return None;
            }
            kept = kept.min(pivot / whole);
            let root = pivot.sqrt();
            row[width - 1] = root;
            own.iter_mut().for_each(|value| *value /= root);
        }
        Some(kept)
    }

    /// Products of the columns beside.
    fn gram(&self) -> DMatrix<f64> {
        let n = self.columns;
        let mut gram = DMatrix::zeros(n, n);
        let sums = gram.as_mut_slice();
        for row in self.beside.chunks_exact(n) {
            for (a, factor) in row.iter().enumerate() {
                add(&mut sums[a * n..(a + 1) * n], *factor, row);
            }
        }
        gram
    }
}

/// Adds a multiple of a row.
#[inline]
fn add(sums: &mut [f64], factor: f64, row: &[f64]) {
    let n = sums.len().min(row.len());
    let (sums, row) = (&mut sums[..n], &row[..n]);
    for k in 0..n {
        sums[k] += factor * row[k];
    }
}
