//! What a fit says of slide, bar and spindle, in the gauge: e along side 0 at mid travel, the form
//! without its least-squares line, and the stray of the turn without its own.

use std::f64::consts::TAU;

use errsep_solvers::structured::StructuredProblem;
use nalgebra::{Complex, DVector, RowVector3};

use super::fit::TurningFit;
use super::problem::{ACROSS_E, ALONG_E, ECCENTRICITY, HARMONICS, SPEED};
use super::setting::{Along, Wave};
use super::spread::Spread;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::gauge::line_of_spline;

/// A value with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Told {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty.
    pub std: f64,
}

/// The axis of the bar about that of the spindle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// |e| at mid travel, µm: half of what the bar runs out there.
    pub eccentricity_um: Told,
    /// γ along e, rad.
    pub along_rad: Told,
    /// γ across e, rad.
    pub across_rad: Told,
    /// The angle between bar and spindle, |γ|, rad.
    pub inclination_rad: Told,
    /// By how much the direction of e + γx turns along the travel, rad.
    pub turned_rad: Told,
}

/// The turn of the spindle against a steady one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TurnCurve {
    /// Times.
    pub time: Vec<f64>,
    /// Positions of the slide, mm.
    pub x: Vec<f64>,
    /// By how much the spindle is behind the steady turn, rad.
    pub lag_rad: Vec<f64>,
    /// Standard uncertainty, rad.
    pub lag_std: Vec<f64>,
    /// Turns in a unit of time.
    pub speed: Vec<f64>,
    /// The largest of |lag|: its place in the lists.
    pub greatest: usize,
}

impl TurnCurve {
    /// Puts `greatest` where |lag| is largest.
    pub(super) fn seek_greatest(&mut self) {
        let lags = self.lag_rad.iter().enumerate();
        self.greatest = lags
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .map_or(0, |(k, _)| k);
    }
}

/// A harmonic of the section at mid travel: a cos kψ + b sin kψ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// k.
    pub k: usize,
    /// a + i b at mid travel, µm.
    pub middle: Complex<f64>,
    /// Its change over half the travel, µm.
    pub change: Complex<f64>,
    /// Standard uncertainty of its amplitude at mid travel, µm.
    pub std: f64,
}

impl TurningFit<'_> {
    fn border(&self, place: usize) -> usize {
        self.problem.band_count() + place
    }

    /// Slope of the least-squares line of the form, rad: of slide and bar together (α + τ).
    pub fn slope(&self, spread: &Spread) -> Told {
        let (row, axis) = self.line_row(1);
        let value = self.dot(&row) / axis.scale * 1e-3;
        Told {
            value,
            std: spread.variance(&row).sqrt() / axis.scale * 1e-3,
        }
    }

    /// What the coefficients of the form are to height (0) or slope (1) of its line.
    fn line_row(&self, which: usize) -> (DVector<f64>, Axis) {
        let mut places = self.problem.run.x.clone();
        places.sort_unstable_by(f64::total_cmp);
        places.dedup();
        let axis = axis_of(&places);
        let rows = line_of_spline(&self.problem.form, &places, axis);
        let mut all = DVector::zeros(self.count());
        for (j, value) in self.problem.form_unknowns.iter().zip(&rows[which]) {
            all[*j] = *value;
        }
        (all, axis)
    }

    /// The form without its line at places, µm, each with its standard uncertainty.
    pub fn form(&self, places: &[f64], spread: &Spread) -> Vec<Told> {
        let told = |row: DVector<f64>| Told {
            value: self.dot(&row),
            std: spread.variance(&row).sqrt(),
        };
        self.form_rows(places).map(told).collect()
    }

    /// The form without its line at places, µm.
    pub(super) fn form_values(&self, places: &[f64]) -> Vec<f64> {
        self.form_rows(places).map(|row| self.dot(&row)).collect()
    }

    /// The form without its line at places, as combinations of the unknowns.
    fn form_rows(&self, places: &[f64]) -> impl Iterator<Item = DVector<f64>> {
        let (height, axis) = self.line_row(0);
        let (slope, _) = self.line_row(1);
        places.iter().map(move |x| {
            let mut row = -&height - &slope * axis.xi(*x);
            let (first, values) = self.problem.form.values(*x);
            for (k, value) in values.into_iter().enumerate() {
                row[self.problem.form_unknowns[first + k]] += value;
            }
            row
        })
    }

    fn dot(&self, weights: &DVector<f64>) -> f64 {
        let band = self.at.band.iter().zip(weights.iter());
        let own: f64 = band.map(|(v, w)| v * w).sum();
        let border = self
            .at
            .border
            .iter()
            .zip(weights.iter().skip(self.at.band.len()));
        own + border.map(|(v, w)| v * w).sum::<f64>()
    }

    /// A(ξ) = e + γ₁ξ + iγ₂ξ at a position, µm, in the frame of the fit.
    fn offset(&self, x: f64) -> Complex<f64> {
        let xi = self.problem.frame.xi(x);
        let of = |j: usize| self.at.border[j];
        Complex::new(of(ECCENTRICITY) + of(ALONG_E) * xi, of(ACROSS_E) * xi)
    }

    /// Direction of the bar's offset at a position, rad, in the frame of the fit.
    pub(super) fn axis_direction(&self, x: f64) -> f64 {
        self.offset(x).arg()
    }

    /// Amplitude of the once-per-turn wave at a position, µm.
    pub(super) fn amplitude(&self, x: f64) -> f64 {
        self.offset(x).norm()
    }

    /// The middle of the travel, mm.
    pub fn middle_mm(&self) -> f64 {
        let (low, high) = self.problem.run.range();
        f64::midpoint(low, high)
    }

    /// The axis of the bar; `None` where the model has none.
    pub fn bar(&self, spread: &Spread) -> Option<Bar> {
        if matches!(self.problem.setting.wave, Wave::Bent { .. }) {
            return None;
        }
        let middle = self.middle_mm();
        let frame = self.problem.frame;
        let (low, high) = self.problem.run.range();
        let a = self.offset(middle);
        let gamma = Complex::new(self.at.border[ALONG_E], self.at.border[ACROSS_E]);
        let unit = if a.norm() > 0.0 {
            a / a.norm()
        } else {
            Complex::new(1.0, 0.0)
        };
        let turned = gamma * unit.conj();
        let rad = 1e-3 / frame.half_mm;
        let xi = frame.xi(middle);
        // By e, γ₁, γ₂: of |A|, and of γ·ê and γ×ê, in which ê turns by δA×ê/|A|.
        let by_a = [
            Complex::new(1.0, 0.0),
            Complex::new(xi, 0.0),
            Complex::new(0.0, xi),
        ];
        let by_gamma = [
            Complex::new(0.0, 0.0),
            Complex::new(1.0, 0.0),
            Complex::new(0.0, 1.0),
        ];
        let size = a.norm().max(f64::MIN_POSITIVE);
        let row = |of: &dyn Fn(usize) -> f64| RowVector3::new(of(0), of(1), of(2));
        let swing = |k: usize| (by_a[k] * unit.conj()).im / size;
        let rows = [
            row(&|k| (by_a[k] * unit.conj()).re),
            row(&|k| (by_gamma[k] * unit.conj()).re + turned.im * swing(k)),
            row(&|k| (by_gamma[k] * unit.conj()).im - turned.re * swing(k)),
            row(&|k| {
                let size = gamma.norm().max(f64::MIN_POSITIVE);
                (by_gamma[k] * gamma.conj()).re / size
            }),
            row(&|k| self.swings(high)[k] - self.swings(low)[k]),
        ];
        let std = |row: &RowVector3<f64>| {
            let mut all = DVector::zeros(self.count());
            for (k, j) in [ECCENTRICITY, ALONG_E, ACROSS_E].into_iter().enumerate() {
                all[self.border(j)] = row[k];
            }
            spread.variance(&all).sqrt()
        };
        let told = |value: f64, row: &RowVector3<f64>, unit: f64| Told {
            value: value * unit,
            std: std(row) * unit,
        };
        let (from, to) = (self.offset(low), self.offset(high));
        Some(Bar {
            eccentricity_um: told(a.norm(), &rows[0], 1.0),
            along_rad: told(turned.re, &rows[1], rad),
            across_rad: told(turned.im, &rows[2], rad),
            inclination_rad: told(gamma.norm(), &rows[3], rad),
            turned_rad: told((to * from.conj()).arg(), &rows[4], 1.0),
        })
    }

    /// What e, γ₁, γ₂ are to the direction of the offset at a position.
    fn swings(&self, x: f64) -> [f64; 3] {
        let (a, xi) = (self.offset(x), self.problem.frame.xi(x));
        let square = a.norm_sqr().max(f64::MIN_POSITIVE);
        let by = [
            Complex::new(1.0, 0.0),
            Complex::new(xi, 0.0),
            Complex::new(0.0, xi),
        ];
        by.map(|d| (d * a.conj()).im / square)
    }

    /// The axis of the bar at positions, µm, as e₁ (along side 0, the side that runs out at mid travel)
    /// and e₂.
    pub fn axis(&self, places: &[f64]) -> Vec<(f64, f64)> {
        let a = self.offset(self.middle_mm());
        let back = Complex::from_polar(1.0, -a.arg());
        let at = places.iter().map(|x| self.offset(*x) * back);
        at.map(|z| (z.re, z.im)).collect()
    }

    /// Harmonics in the gauge: side 0 lies along e at mid travel.
    pub fn harmonics(&self, spread: &Spread) -> Vec<Harmonic> {
        let setting = &self.problem.setting;
        let per = setting.per_harmonic();
        let middle = self.middle_mm();
        let xi = self.problem.frame.xi(middle);
        let side = match setting.wave {
            Wave::Bent { .. } => 0.0,
            _ => self.offset(middle).arg(),
        };
        let of = |h: usize, k: usize| {
            let from = HARMONICS + per * h;
            let value = |l: usize| self.at.border[from + l];
            // ψ in the gauge is less by the direction of e: a cos kψ + b sin kψ = Re (a + ib)* e^{ikψ}.
            let turn = Complex::from_polar(1.0, -(k as f64) * side);
            let at_reference = Complex::new(value(0), value(1)) * turn;
            let change = match setting.along {
                Along::Constant => Complex::new(0.0, 0.0),
                Along::Linear => Complex::new(value(2), value(3)) * turn,
            };
            let here = at_reference + change * xi;
            let size = here.norm().max(f64::MIN_POSITIVE);
            let mut row = DVector::zeros(self.count());
            for l in 0..per {
                let axis = [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0)][l % 2] * turn;
                let by = if l < 2 { axis } else { axis * xi };
                row[self.border(from + l)] = (by * here.conj()).re / size;
            }
            Harmonic {
                k,
                middle: here,
                change,
                std: spread.variance(&row).sqrt(),
            }
        };
        let numbered = setting.harmonics.iter().enumerate();
        numbered.map(|(h, k)| of(h, *k)).collect()
    }

    /// Mean speed, turns in a unit of time, counted as positive.
    pub fn speed(&self, base_hz: f64, spread: &Spread) -> Told {
        let frame = self.problem.frame;
        let run = self.problem.run;
        let onward = (frame.base[run.len() - 1] - frame.base[0]).signum();
        if run.angle.is_some() {
            let turned = (frame.base[run.len() - 1] - frame.base[0]).abs() / TAU;
            return Told {
                value: turned / (run.times().1 - run.times().0),
                std: 0.0,
            };
        }
        let mut row = DVector::zeros(self.count());
        match self.turn_line() {
            Some((_, slope)) => row = slope / frame.half_time,
            None => row[self.border(SPEED)] = 1.0 / frame.half_time,
        }
        Told {
            value: onward * (base_hz + self.dot(&row) / TAU),
            std: spread.variance(&row).sqrt() / TAU,
        }
    }

    /// Height and slope (over half the time) of the stray's line, as combinations of the unknowns.
    pub(super) fn turn_line(&self) -> Option<(DVector<f64>, DVector<f64>)> {
        let basis = self.turn_basis()?;
        let frame = self.problem.frame;
        let axis = Axis {
            center: frame.middle,
            scale: frame.half_time,
        };
        let rows = line_of_spline(basis, &self.problem.run.time, axis);
        let all = rows.map(|row| {
            let mut all = DVector::zeros(self.count());
            for (j, value) in self.problem.wave_unknowns[0].iter().zip(row) {
                all[*j] = value;
            }
            all
        });
        let [height, slope] = all;
        Some((height, slope))
    }

    pub(super) fn turn_basis(&self) -> Option<&CubicBSpline> {
        match self.problem.setting.wave {
            Wave::Unsteady { .. } => self.problem.wave.as_ref(),
            _ => None,
        }
    }

    /// The turn against a steady one at so many times; `None` of a model without.
    pub fn curve(&self, points: usize, base_hz: f64, spread: &Spread) -> Option<TurnCurve> {
        let basis = self.turn_basis()?;
        let (height, slope) = self.turn_line()?;
        let (run, frame) = (self.problem.run, self.problem.frame);
        let onward = (frame.base[run.len() - 1] - frame.base[0]).signum();
        let coefficients = self.problem.wave_of(&self.at, 0);
        let (first, last) = run.times();
        let mut curve = TurnCurve::default();
        for k in 0..points.max(2) {
            let share = k as f64 / (points.max(2) - 1) as f64;
            let time = first + share * (last - first);
            let mut row = -&height - &slope * frame.tau(time);
            let (from, values) = basis.values(time);
            for (l, value) in values.into_iter().enumerate() {
                row[self.problem.wave_unknowns[0][from + l]] += value;
            }
            let (_, rate) = basis.evaluate(&coefficients, time);
            let i = run.time.partition_point(|t| *t < time).min(run.len() - 1);
            let base = match (i, &run.angle) {
                (_, None) => base_hz,
                (i, Some(_)) => {
                    let (a, b) = (i.saturating_sub(8), (i + 8).min(run.len() - 1));
                    (frame.base[b] - frame.base[a]) / (run.time[b] - run.time[a]) / TAU
                }
            };
            curve.time.push(time);
            curve.x.push(run.x[i]);
            curve.lag_rad.push(-onward * self.dot(&row));
            curve.lag_std.push(spread.variance(&row).sqrt());
            curve.speed.push(onward * (base + rate / TAU));
        }
        curve.seek_greatest();
        Some(curve)
    }

    /// The lags of [`curve`](Self::curve) alone, rad.
    pub(super) fn lags(&self, points: usize) -> Option<Vec<f64>> {
        let none = Spread::none(self);
        self.curve(points, 0.0, &none).map(|curve| curve.lag_rad)
    }
}

/// The axis of growing places.
fn axis_of(places: &[f64]) -> Axis {
    let (low, high) = (places[0], places[places.len() - 1]);
    Axis {
        center: places.iter().sum::<f64>() / places.len() as f64,
        scale: 0.5 * (high - low),
    }
}
