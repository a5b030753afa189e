//! A run as a structured least-squares problem: splines in a band, the bar in the border.
//!
//! ```text
//!     reading = F(x) + (e + γ₁ξ) cos ψ + γ₂ξ sin ψ + Σ_k [(a_k + a'_k ξ) cos kψ + (b_k + b'_k ξ) sin kψ]
//!     ψ = φ − θ,   θ = θ_b(t) + θ₀ + ω'τ   or   θ_b(t) + u(t)
//! ```
//!
//! F and u are cubic splines, θ_b the recorded or a steady turn, τ runs from −1 to 1 over the time and
//! ξ = (x − x_r)/(half the travel). F holds the constant and the slope of the bar, u holds θ₀ and ω':
//! both are taken out of the splines afterwards, as their least-squares lines.
//!
//! Coefficients of both splines stand in the order in which the run comes to them, so that a row sees
//! neighbours only, whatever the number of cells of either.

mod frame;
mod order;
mod tasks;

use std::ops::Range;

pub use frame::Frame;
use order::{in_order, values_in};

use errsep_solvers::linear::bordered::Constraints;
use errsep_solvers::structured::{Parameters, StructuredProblem};

use super::error::TurningError;
use super::run::Run;
use super::setting::{Along, Setting, Wave};
use crate::basis::bspline::CubicBSpline;

/// Places of the unknowns in the border; those of the harmonics follow.
pub const THETA: usize = 0;
/// See [`THETA`].
pub const SPEED: usize = 1;
/// See [`THETA`].
pub const ECCENTRICITY: usize = 2;
/// See [`THETA`].
pub const ALONG_E: usize = 3;
/// See [`THETA`].
pub const ACROSS_E: usize = 4;
/// See [`THETA`].
pub const HARMONICS: usize = 5;

/// What is held beside what the setting holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// γ across e is zero.
    pub across: bool,
    /// The speed is that of the base.
    pub speed: bool,
}

/// Readings that see the same coefficients.
#[derive(Debug, Clone)]
struct Piece {
    readings: Range<usize>,
    form_cell: usize,
    wave_cell: usize,
    /// Unknowns of the band, growing, and which of the local columns each is.
    band: Vec<(usize, usize)>,
}

/// Readings, unknowns and bases.
#[derive(Debug, Clone)]
pub struct TurningProblem<'a> {
    pub(super) run: &'a Run,
    pub(super) setting: Setting,
    pub(super) frame: &'a Frame,
    pub(super) form: CubicBSpline,
    /// In time of an unsteady turn, along the bar of a bent one.
    pub(super) wave: Option<CubicBSpline>,
    /// The unknown of each coefficient of F.
    pub(super) form_unknowns: Vec<usize>,
    /// Those of u, or of the amplitudes of cos ψ and sin ψ.
    pub(super) wave_unknowns: Vec<Vec<usize>>,
    held: Vec<bool>,
    /// Border unknowns that are free.
    free: Vec<usize>,
    pieces: Vec<Piece>,
    width: usize,
    constraints: Constraints,
}

impl<'a> TurningProblem<'a> {
    /// The problem of a run.
    ///
    /// # Errors
    /// Splines that these readings cannot carry.
    pub fn new(
        run: &'a Run,
        setting: &Setting,
        frame: &'a Frame,
        hold: Held,
    ) -> Result<Self, TurningError> {
        let ((low, high), (first, last)) = (frame.range, frame.times);
        let form = CubicBSpline::uniform(low, high, setting.form_cells.max(1))?;
        let (wave, splines) = match setting.wave {
            Wave::Steady => (None, 0),
            Wave::Unsteady { cells } => {
                (Some(CubicBSpline::uniform(first, last, cells.max(1))?), 1)
            }
            Wave::Bent { cells } => (Some(CubicBSpline::uniform(low, high, cells.max(1))?), 2),
        };
        let border = HARMONICS + setting.per_harmonic() * setting.harmonics.len();
        let mut held = vec![false; border];
        let bent = matches!(setting.wave, Wave::Bent { .. });
        held[THETA] = !matches!(setting.wave, Wave::Steady);
        held[SPEED] = held[THETA] || run.angle.is_some() || hold.speed;
        held[ECCENTRICITY] = bent;
        held[ALONG_E] = bent || !setting.growing;
        held[ACROSS_E] = held[ALONG_E] || hold.across;
        let free: Vec<usize> = (0..border).filter(|j| !held[*j]).collect();
        let (form_unknowns, wave_unknowns) = in_order(run, setting, &form, wave.as_ref(), splines);
        let mut problem = Self {
            run,
            setting: setting.clone(),
            frame,
            form,
            wave,
            form_unknowns,
            wave_unknowns,
            held,
            free,
            pieces: Vec::new(),
            width: 0,
            constraints: Constraints::none(border),
        };
        problem.cut();
        let unknowns = problem.free_count();
        if run.len() < unknowns + FEWEST_FREE {
            return Err(TurningError::TooManyUnknowns {
                readings: run.len(),
                unknowns,
            });
        }
        Ok(problem)
    }

    /// Unknowns that are not held.
    pub fn free_count(&self) -> usize {
        self.band_count() + self.free.len()
    }

    /// Cuts the readings where a row sees other coefficients than the row before.
    fn cut(&mut self) {
        let cells = |i: usize| {
            let wave = self
                .wave
                .as_ref()
                .map_or(0, |basis| basis.cell_of(self.wave_at(i)));
            (self.form.cell_of(self.run.x[i]), wave)
        };
        let mut pieces: Vec<Piece> = Vec::new();
        let mut from = 0;
        for i in 1..=self.run.len() {
            if i < self.run.len() && cells(i) == cells(from) {
                continue;
            }
            let (form_cell, wave_cell) = cells(from);
            let local = (0..4).map(|k| self.form_unknowns[form_cell + k]).chain(
                self.wave_unknowns
                    .iter()
                    .flat_map(|of| (0..4).map(move |k| of[wave_cell + k])),
            );
            let mut band: Vec<(usize, usize)> =
                local.enumerate().map(|(l, unknown)| (unknown, l)).collect();
            band.sort_unstable();
            pieces.push(Piece {
                readings: from..i,
                form_cell,
                wave_cell,
                band,
            });
            from = i;
        }
        let mut highest = 0;
        for piece in &pieces {
            let (Some(low), Some(high)) = (piece.band.first(), piece.band.last()) else {
                continue;
            };
            highest = highest.max(high.0);
            self.width = self.width.max(highest + 1 - low.0);
        }
        self.pieces = pieces;
    }

    /// What the spline of the wave is over, at a reading.
    fn wave_at(&self, i: usize) -> f64 {
        match self.setting.wave {
            Wave::Bent { .. } => self.run.x[i],
            _ => self.run.time[i],
        }
    }

    /// The unknowns of another problem of the same unknowns, whose band may be in another order.
    pub fn taken_over(&self, other: &Self, at: &Parameters) -> Parameters {
        let mut own = Parameters::zeros(self.band_count(), self.border_count());
        own.border.clone_from(&at.border);
        let mut put = |to: &[usize], from: &[usize]| {
            for (to, from) in to.iter().zip(from) {
                own.band[*to] = at.band[*from];
            }
        };
        put(&self.form_unknowns, &other.form_unknowns);
        for (to, from) in self.wave_unknowns.iter().zip(&other.wave_unknowns) {
            put(to, from);
        }
        own
    }

    /// Coefficients of a spline of the wave: of u in rad.
    pub fn wave_of(&self, at: &Parameters, which: usize) -> Vec<f64> {
        let of = self.wave_unknowns.get(which);
        of.map_or_else(Vec::new, |of| of.iter().map(|j| at.band[*j]).collect())
    }

    /// ψ of every reading, rad.
    pub fn seen(&self, at: &Parameters) -> Vec<f64> {
        let turn = self.wave_of(at, 0);
        (0..self.run.len())
            .map(|i| {
                let stray = match (&self.wave, self.setting.wave) {
                    (Some(basis), Wave::Unsteady { .. }) => {
                        basis.evaluate(&turn, self.run.time[i]).0
                    }
                    _ => at.border[THETA] + at.border[SPEED] * self.frame.tau(self.run.time[i]),
                };
                self.setting.indicator_rad - self.frame.base[i] - stray
            })
            .collect()
    }

    /// Reading less model, µm, of every reading.
    pub fn residuals(&self, at: &Parameters) -> Vec<f64> {
        let mut row = vec![0.0; self.columns()];
        let mut residuals = Vec::with_capacity(self.run.len());
        for piece in &self.pieces {
            for i in piece.readings.clone() {
                self.local(i, piece, at, &mut row);
                residuals.push(-row[row.len() - 1]);
            }
        }
        residuals
    }

    /// Hands out the derivatives of the model at every reading by the unknowns that it sees: the band's
    /// numbers first, those of the border after all of the band's.
    pub fn rows(&self, at: &Parameters, take: impl FnMut(usize, &[(usize, f64)])) {
        self.rows_of(&(0..self.run.len()), at, take);
    }

    /// As [`rows`](Self::rows), of some readings.
    pub fn rows_of(
        &self,
        readings: &Range<usize>,
        at: &Parameters,
        mut take: impl FnMut(usize, &[(usize, f64)]),
    ) {
        let mut row = vec![0.0; self.columns()];
        let mut sparse = Vec::new();
        let (band, n) = (4 * (1 + self.wave_unknowns.len()), self.band_count());
        for piece in self.pieces_of(readings) {
            let (start, end) = (piece.readings.start, piece.readings.end);
            for i in start.max(readings.start)..end.min(readings.end) {
                self.local(i, piece, at, &mut row);
                sparse.clear();
                sparse.extend(piece.band.iter().map(|(j, l)| (*j, row[*l])));
                let border = self.free.iter().enumerate();
                sparse.extend(border.map(|(l, j)| (n + j, row[band + l])));
                take(i, &sparse);
            }
        }
    }

    /// The pieces that have any of these readings.
    fn pieces_of(&self, readings: &Range<usize>) -> &[Piece] {
        let from = self
            .pieces
            .partition_point(|p| p.readings.end <= readings.start);
        let to = self
            .pieces
            .partition_point(|p| p.readings.start < readings.end);
        &self.pieces[from..to]
    }

    /// From the lowest to the highest unknown of the band that these readings see.
    pub fn span(&self, readings: &Range<usize>) -> usize {
        let seen = || self.pieces_of(readings).iter().flat_map(|p| &p.band);
        let low = seen().map(|(j, _)| *j).min();
        let high = seen().map(|(j, _)| *j).max();
        high.zip(low).map_or(0, |(high, low)| high + 1 - low)
    }

    /// Local columns: band, free border, residual.
    fn columns(&self) -> usize {
        4 * (1 + self.wave_unknowns.len()) + self.free.len() + 1
    }

    /// The local columns of a reading: model less reading last.
    fn local(&self, i: usize, piece: &Piece, at: &Parameters, row: &mut [f64]) {
        let (x, time) = (self.run.x[i], self.run.time[i]);
        let (xi, tau) = (self.frame.xi(x), self.frame.tau(time));
        let mut model = 0.0;
        for (k, value) in values_in(&self.form, piece.form_cell, x)
            .into_iter()
            .enumerate()
        {
            row[k] = value;
            model += value * at.band[self.form_unknowns[piece.form_cell + k]];
        }
        let second = self
            .wave
            .as_ref()
            .map(|basis| values_in(basis, piece.wave_cell, self.wave_at(i)));
        let mut stray = at.border[THETA] + at.border[SPEED] * tau;
        if let (Some(values), Wave::Unsteady { .. }) = (second, self.setting.wave) {
            let own = &self.wave_unknowns[0][piece.wave_cell..];
            stray = values.iter().zip(own).map(|(v, j)| v * at.band[*j]).sum();
        }
        let psi = self.setting.indicator_rad - self.frame.base[i] - stray;
        let (sin, cos) = psi.sin_cos();
        let along = at.border[ECCENTRICITY] + at.border[ALONG_E] * xi;
        let across = at.border[ACROSS_E] * xi;
        model += along * cos + across * sin;
        // By ψ; the angle of the spindle counts against it.
        let mut by_psi = across * cos - along * sin;
        let border = 4 * (1 + self.wave_unknowns.len());
        let mut free = self.free.iter().enumerate();
        // Those before the harmonics are filled when the derivative by ψ is whole.
        for _ in 0..self.free.iter().filter(|j| **j < HARMONICS).count() {
            free.next();
        }
        let per = self.setting.per_harmonic();
        for (h, k) in self.setting.harmonics.iter().enumerate() {
            let k = *k as f64;
            let (s, c) = (k * psi).sin_cos();
            let harmonic = match self.setting.along {
                Along::Constant => [c, s, 0.0, 0.0],
                Along::Linear => [c, s, xi * c, xi * s],
            };
            let turned = [-k * s, k * c, -k * xi * s, k * xi * c];
            for l in 0..per {
                let value = at.border[HARMONICS + per * h + l];
                model += value * harmonic[l];
                by_psi += value * turned[l];
                if let Some((column, _)) = free.next() {
                    row[border + column] = harmonic[l];
                }
            }
        }
        match (second, self.setting.wave) {
            (Some(values), Wave::Unsteady { .. }) => {
                for k in 0..4 {
                    row[4 + k] = -by_psi * values[k];
                }
            }
            (Some(values), Wave::Bent { .. }) => {
                for (s, factor) in [cos, sin].into_iter().enumerate() {
                    for k in 0..4 {
                        let unknown = self.wave_unknowns[s][piece.wave_cell + k];
                        row[4 + 4 * s + k] = factor * values[k];
                        model += factor * values[k] * at.band[unknown];
                    }
                }
            }
            _ => {}
        }
        for (column, j) in self
            .free
            .iter()
            .enumerate()
            .take_while(|(_, j)| **j < HARMONICS)
        {
            row[border + column] = match *j {
                THETA => -by_psi,
                SPEED => -by_psi * tau,
                ECCENTRICITY => cos,
                ALONG_E => xi * cos,
                _ => xi * sin,
            };
        }
        let last = row.len() - 1;
        row[last] = model - self.run.value[i];
    }
}

/// Fewest readings beyond the unknowns.
const FEWEST_FREE: usize = 20;
