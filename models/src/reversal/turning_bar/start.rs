//! Where a fit begins: about how fast the spindle turns, the once-per-turn wave of each turn by itself,
//! and what these tell of bar and turn. No search here depends on a guess.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::error::TurningError;
use super::nearest::{TurnSample, turn_near};
use super::problem::Frame;
use super::run::{FEWEST_TURNS, Run, enough};
use crate::basis::bspline::CubicBSpline;

/// Degree of the polynomial that stands for all that is slow while the speed is sought.
const BACKGROUND_DEGREE: usize = 8;
/// Readings of a turn at the highest speed that is sought.
const SOUGHT_PER_TURN: f64 = 20.0;
/// Part by which the steady speed may differ from that of the highest wave.
const SPEED_RANGE: f64 = 0.1;
/// A wave stands out where it exceeds so many standard deviations of what noise alone would show.
const STANDS_OUT: f64 = 4.0;

/// Below this share of the largest reading a wave is rounding.
const ROUNDING: f64 = 1e-9;

/// The once-per-turn wave of one turn: reading = c cos ψ_b + d sin ψ_b, z = c + i d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnWave {
    /// Mean time.
    pub time: f64,
    /// Mean position, mm.
    pub x: f64,
    /// z, µm.
    pub z: Complex<f64>,
}

/// What a run tells before any fit.
#[derive(Debug, Clone)]
pub struct Survey {
    /// Axes and base angle.
    pub frame: Frame,
    /// Turns of the spindle.
    pub turns: f64,
    /// Turns in a second of the base angle, with its sign; 0 where it was recorded.
    pub base_hz: f64,
    /// Turn by turn.
    pub waves: Vec<TurnWave>,
    /// Where a steady turn begins.
    pub steady: BarStart,
    /// e, γ₁ξ and |γ₂ξ| of a straight bar whose turn may be anything.
    pub bar: [f64; 3],
}

/// Bar and turn at the start: z = (e + γ₁ξ + iγ₂ξ) exp i(θ₀ + ω'τ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarStart {
    /// θ₀, rad.
    pub theta: f64,
    /// ω', rad.
    pub speed: f64,
    /// e, γ₁, γ₂, µm.
    pub bar: [f64; 3],
}

impl Survey {
    /// Surveys a run. `about_hz`: turns in a second, if they are known; `handed` as in the setting.
    ///
    /// # Errors
    /// Too few turns or readings, or nothing that turns.
    pub fn new(
        run: &Run,
        indicator_rad: f64,
        handed: f64,
        about_hz: Option<f64>,
    ) -> Result<Self, TurningError> {
        let middle = f64::midpoint(run.times().0, run.times().1);
        let (base, base_hz): (Vec<f64>, f64) = match &run.angle {
            Some(angle) => (angle.iter().map(|a| handed * a).collect(), 0.0),
            None => {
                let hz = handed * coarse_speed(run, about_hz)?;
                let turned = run.time.iter().map(|t| TAU * hz * (t - middle));
                (turned.collect(), hz)
            }
        };
        let turns = (base[base.len() - 1] - base[0]).abs() / TAU;
        enough(turns, run.len())?;
        let (low, high) = run.range();
        let mut frame = Frame::new(run, base, low);
        let (waves, sigma) = turn_waves(run, &frame, indicator_rad);
        if waves.len() < FEWEST_TURNS as usize - 1 {
            return Err(TurningError::TooFewTurns { turns });
        }
        // The end where the bar runs out most is where its direction is known best.
        if square(&waves, &frame).1 > square(&waves, &frame).0 {
            frame.reference_mm = high;
        }
        let recorded = run.angle.is_some();
        let steady = steady(&waves, &frame, if recorded { 0.0 } else { turns });
        let coherent = steady.bar[0].hypot(steady.bar[1]).hypot(steady.bar[2]);
        let noise = STANDS_OUT * sigma * (2.0 / run.len() as f64).sqrt();
        let largest = run.value.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if !(coherent > noise.max(ROUNDING * largest)) {
            return Err(TurningError::NoWave);
        }
        let bar = straight(&waves, &frame);
        Ok(Self {
            frame,
            turns,
            base_hz,
            waves,
            steady,
            bar,
        })
    }

    /// The same with the once-per-turn wave as another fit has it.
    pub fn with_waves(&self, waves: Vec<TurnWave>) -> Self {
        Self {
            bar: straight(&waves, &self.frame),
            waves,
            ..self.clone()
        }
    }

    /// By how much the waves of single turns stray from those of a straight bar that turns steadily, rad, each counted by the
    /// square of its amplitude, without what noise of this variance of a reading makes; a quarter of a turn where nothing is
    /// left of a common direction.
    pub(super) fn unsteadiness(&self, variance: f64, readings: usize) -> f64 {
        let BarStart { theta, speed, bar } = self.steady;
        let (mut left, mut whole) = (0.0, 0.0);
        for wave in &self.waves {
            let xi = self.frame.xi(wave.x);
            let own = Complex::new(bar[0] + bar[1] * xi, bar[2] * xi);
            let turned = Complex::from_polar(1.0, theta + speed * self.frame.tau(wave.time));
            left += (wave.z - own * turned).norm_sqr();
            whole += wave.z.norm_sqr();
        }
        let turns = self.waves.len() as f64;
        // Each amplitude of a turn of m readings has 2σ²/m.
        let of_noise = 4.0 * variance * turns * turns / readings as f64;
        let part = ((left - of_noise) / whole.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        part.sqrt().asin()
    }

    /// Coefficients of a spline in time that the angle of the spindle follows where the bar has these
    /// e, γ₁, γ₂, rad.
    pub fn turn(&self, basis: &CubicBSpline, bar: [f64; 3]) -> Vec<f64> {
        let mut strays: Vec<f64> = Vec::with_capacity(self.waves.len());
        for wave in &self.waves {
            let xi = self.frame.xi(wave.x);
            let own = Complex::new(bar[0] + bar[1] * xi, bar[2] * xi);
            let here = (wave.z * own.conj()).arg();
            let before = strays.last().copied().unwrap_or(here);
            strays.push(here + TAU * ((before - here) / TAU).round());
        }
        let whole: f64 = self.waves.iter().map(|w| w.z.norm_sqr()).sum();
        let weighed = |(wave, stray): (&TurnWave, &f64)| TurnSample {
            time: wave.time,
            stray: *stray,
            weight: wave.z.norm_sqr() / whole,
        };
        let samples: Vec<TurnSample> = self.waves.iter().zip(&strays).map(weighed).collect();
        turn_near(basis, &samples).unwrap_or_else(|| basis.line(self.steady.theta, 0.0))
    }
}

/// Turns in a second at which a wave on a slow background is highest.
///
/// # Errors
/// [`TurningError`] where the run is too short for any.
pub fn coarse_speed(run: &Run, about: Option<f64>) -> Result<f64, TurningError> {
    let n = run.len();
    let (first, last) = run.times();
    let span = last - first;
    let step = 1.0 / (2.0 * span);
    let (from, to) = match about {
        Some(f) => {
            enough(1.05 * f * span, n)?;
            (0.95 * f, 1.05 * f)
        }
        None => (FEWEST_TURNS / span, n as f64 / (SOUGHT_PER_TURN * span)),
    };
    if !(from < to) {
        return Err(TurningError::TooFew { readings: n });
    }
    let rest = without_background(run).ok_or(TurningError::NoWave)?;
    let power = |f: f64| {
        let pairs = run.time.iter().zip(&rest);
        let (c, s) = pairs.fold((0.0, 0.0), |(c, s), (t, r)| {
            let (sin, cos) = (TAU * f * (t - first)).sin_cos();
            (c + r * cos, s + r * sin)
        });
        c * c + s * s
    };
    (0..=((to - from) / step).ceil() as usize)
        .into_par_iter()
        .map(|k| from + k as f64 * step)
        .map(|f| (power(f), f))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|best| best.1)
        .ok_or(TurningError::NoWave)
}

/// The readings less a least-squares polynomial in time.
fn without_background(run: &Run) -> Option<Vec<f64>> {
    let (first, last) = run.times();
    let (middle, half) = (f64::midpoint(first, last), 0.5 * (last - first));
    let columns = BACKGROUND_DEGREE + 1;
    let fill = |time: f64| {
        let t = (time - middle) / half;
        let mut row = DVector::zeros(columns);
        row[0] = 1.0;
        row[1] = t;
        for k in 2..columns {
            row[k] = 2.0 * t * row[k - 1] - row[k - 2];
        }
        row
    };
    // Chebyshev polynomials are near orthogonal: normal equations lose few digits.
    let mut normal = DMatrix::zeros(columns, columns);
    let mut right = DVector::zeros(columns);
    for (t, y) in run.time.iter().zip(&run.value) {
        let row = fill(*t);
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(*y, &row, 1.0);
    }
    let solution = normal.cholesky()?.solve(&right);
    let pairs = run.time.iter().zip(&run.value);
    Some(pairs.map(|(t, y)| y - fill(*t).dot(&solution)).collect())
}

/// The wave of each whole turn beside a level and a slope, and the standard deviation of what they leave.
fn turn_waves(run: &Run, frame: &Frame, indicator_rad: f64) -> (Vec<TurnWave>, f64) {
    let onward = (frame.base[run.len() - 1] - frame.base[0]).signum();
    let turned = |i: usize| onward * (frame.base[i] - frame.base[0]) / TAU;
    let mut waves = Vec::new();
    let (mut squares, mut freedom) = (0.0, 0.0);
    let mut from = 0;
    while from < run.len() {
        let turn = turned(from).floor() + 1.0;
        let to = (from..run.len())
            .find(|i| turned(*i) >= turn)
            .unwrap_or(run.len());
        // Half a turn does not tell its wave from its level.
        if to - from >= 8 && turned(to - 1) - turned(from) > 0.7 {
            let n = (to - from) as f64;
            let mean = |of: &[f64]| of[from..to].iter().sum::<f64>() / n;
            let (time, x) = (mean(&run.time), mean(&run.x));
            let half = 0.5 * (run.time[to - 1] - run.time[from]);
            let design = DMatrix::from_fn(to - from, 4, |r, c| {
                let (sin, cos) = (indicator_rad - frame.base[from + r]).sin_cos();
                [1.0, (run.time[from + r] - time) / half, cos, sin][c]
            });
            let values = DVector::from_column_slice(&run.value[from..to]);
            let normal = design.tr_mul(&design).cholesky();
            if let Some(solution) = normal.map(|n| n.solve(&design.tr_mul(&values))) {
                squares += (values - design * &solution).norm_squared();
                freedom += n - 4.0;
                let z = Complex::new(solution[2], solution[3]);
                waves.push(TurnWave { time, x, z });
            }
        }
        from = to;
    }
    (waves, (squares / f64::max(freedom, 1.0)).sqrt())
}

/// The square of the amplitude, a parabola in x, at both ends of the travel.
fn square(waves: &[TurnWave], frame: &Frame) -> (f64, f64) {
    let q = parabola(waves, frame);
    let far = 2.0;
    (q[0], q[0] + q[1] * far + q[2] * far * far)
}

/// |z|² as a parabola in ξ, each turn weighted by the certainty of its square, 1/|z|².
fn parabola(waves: &[TurnWave], frame: &Frame) -> Vector3<f64> {
    let least = waves.iter().map(|w| w.z.norm_sqr()).sum::<f64>() / waves.len() as f64 * 1e-3;
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for wave in waves {
        let xi = frame.xi(wave.x);
        let row = Vector3::new(1.0, xi, xi * xi);
        let square = wave.z.norm_sqr();
        let weight = 1.0 / f64::max(square, least).max(f64::MIN_POSITIVE);
        normal += row * row.transpose() * weight;
        right += row * (weight * square);
    }
    let found = normal.cholesky().map(|n| n.solve(&right));
    found.unwrap_or_else(|| Vector3::new(least * 1e3, 0.0, 0.0))
}

/// e, γ₁ and |γ₂| of a straight bar: |e + γ₁ξ + iγ₂ξ|² is that parabola.
fn straight(waves: &[TurnWave], frame: &Frame) -> [f64; 3] {
    let q = parabola(waves, frame);
    let e = q[0].max(0.0).sqrt();
    if e == 0.0 {
        return [0.0, 0.0, q[2].max(0.0).sqrt()];
    }
    let along = q[1] / (2.0 * e);
    [e, along, (q[2] - along * along).max(0.0).sqrt()]
}

/// The steady turn that the waves allow best; its speed is sought where `turns` are not 0.
fn steady(waves: &[TurnWave], frame: &Frame, turns: f64) -> BarStart {
    let range = SPEED_RANGE * PI * turns;
    // The wave of a run goes out of step with itself within two of these steps.
    let step = 0.25;
    let count = (range / step).ceil() as i64;
    let best = (-count..=count)
        .map(|k| {
            let speed = step * k as f64;
            (line(waves, frame, speed), speed)
        })
        .min_by(|a, b| a.0.2.total_cmp(&b.0.2));
    let Some(((e, g, _), speed)) = best else {
        return BarStart {
            theta: 0.0,
            speed: 0.0,
            bar: [0.0; 3],
        };
    };
    let theta = e.arg();
    let turned = g * Complex::from_polar(1.0, -theta);
    BarStart {
        theta,
        speed,
        bar: [e.norm(), turned.re, turned.im],
    }
}

/// Least squares of z exp(−iω'τ) = E + Gξ, and what they leave.
fn line(waves: &[TurnWave], frame: &Frame, speed: f64) -> (Complex<f64>, Complex<f64>, f64) {
    let back = |w: &TurnWave| w.z * Complex::from_polar(1.0, -speed * frame.tau(w.time));
    let mut normal = Matrix2::zeros();
    let (mut re, mut im) = (Vector2::zeros(), Vector2::zeros());
    for wave in waves {
        let row = Vector2::new(1.0, frame.xi(wave.x));
        let z = back(wave);
        normal += row * row.transpose();
        re += row * z.re;
        im += row * z.im;
    }
    let inverse = normal.try_inverse().unwrap_or_else(Matrix2::zeros);
    let (re, im) = (inverse * re, inverse * im);
    let (e, g) = (Complex::new(re[0], im[0]), Complex::new(re[1], im[1]));
    let left = waves
        .iter()
        .map(|w| (back(w) - e - g * frame.xi(w.x)).norm_sqr())
        .sum();
    (e, g, left)
}
