//! Readings with known truth: the exact geometry, computed otherwise than the fit does.
//!
//! Each reading is made by looking for the point of contact by bisection on the form itself, with
//! no derivative and no polynomial of the fit. A [`Disturbance`] may change the situation before the
//! contact is found and the reading after.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StandardNormal};
use thiserror::Error;

use super::forward::LARGEST_TILT_RAD;
use super::{Channel, Direction, Observations, Reading};
use crate::basis::bspline::CubicBSpline;
use crate::units::{mm_from_um, um_from_mm};

/// A true form, µm over mm.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum TrueForm {
    /// Straight.
    #[default]
    Straight,
    /// A sum of waves.
    Waves(Vec<Wave>),
    /// A cubic spline.
    Spline {
        /// The basis.
        basis: CubicBSpline,
        /// Its coefficients, µm.
        coefficients: Vec<f64>,
    },
}

/// One wave of a form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Amplitude, µm.
    pub amplitude: f64,
    /// Wavelength, mm.
    pub wavelength: f64,
    /// Phase at position zero, rad.
    pub phase_rad: f64,
}

impl TrueForm {
    /// Height at a position, µm.
    pub fn at(&self, x: f64) -> f64 {
        match self {
            Self::Straight => 0.0,
            Self::Waves(waves) => waves
                .iter()
                .map(|w| {
                    w.amplitude * (std::f64::consts::TAU * x / w.wavelength + w.phase_rad).sin()
                })
                .sum(),
            Self::Spline {
                basis,
                coefficients,
            } => basis.evaluate(coefficients, x).0,
        }
    }

    /// Random waves whose amplitudes fall with their wavelength, scaled to a root mean square.
    pub fn random_waves(rng: &mut impl Rng, rms: f64, longest: f64, count: usize) -> Self {
        let waves: Vec<Wave> = (1..=count)
            .map(|k| {
                let size: f64 = StandardNormal.sample(rng);
                Wave {
                    amplitude: size / (k * k) as f64,
                    wavelength: longest / k as f64,
                    phase_rad: rng.random_range(0.0..std::f64::consts::TAU),
                }
            })
            .collect();
        let own = (waves.iter().map(|w| w.amplitude.powi(2) / 2.0).sum::<f64>()).sqrt();
        let scale = if own > 0.0 { rms / own } else { 0.0 };
        Self::Waves(
            waves
                .into_iter()
                .map(|w| Wave {
                    amplitude: w.amplitude * scale,
                    ..w
                })
                .collect(),
        )
    }

    /// A spline with independent normal coefficients of a standard deviation, µm.
    pub fn random_spline(rng: &mut impl Rng, basis: CubicBSpline, deviation: f64) -> Self {
        let coefficients = (0..basis.coefficient_count())
            .map(|_| {
                let size: f64 = StandardNormal.sample(rng);
                deviation * size
            })
            .collect();
        Self::Spline {
            basis,
            coefficients,
        }
    }
}

/// A form less its least-squares line over the measured positions, each weighted by the width of its
/// cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GaugedForm {
    form: TrueForm,
    height: f64,
    slope: f64,
}

impl GaugedForm {
    /// Takes the line over the different ones of these positions out of a form: the line of the
    /// trapezoidal rule, with half an interval more at either end.
    pub fn over(form: TrueForm, positions: &[f64]) -> Self {
        let mut places = positions.to_vec();
        places.sort_by(f64::total_cmp);
        let range = places.last().unwrap_or(&0.0) - places.first().unwrap_or(&0.0);
        places.dedup_by(|b, a| *b - *a <= 1e-9 * range);
        let mut points: Vec<(f64, f64)> = Vec::with_capacity(4 * places.len());
        for pair in places.windows(2) {
            let half = (pair[1] - pair[0]) / 2.0;
            points.extend([(pair[0], half), (pair[1], half)]);
        }
        // The outer halves of the end cells; a single position has weight all the same.
        let alone = (places.first().copied().unwrap_or(0.0), 1.0);
        points.extend([points.first(), points.last()].map(|p| *p.unwrap_or(&alone)));
        let total = points.iter().map(|(_, w)| w).sum::<f64>();
        let center = points.iter().map(|(x, w)| w * x).sum::<f64>() / total;
        let mean = points.iter().map(|(x, w)| w * form.at(*x)).sum::<f64>() / total;
        let (product, spread) = points.iter().fold((0.0, 0.0), |(p, s), (x, w)| {
            let d = x - center;
            (p + w * d * (form.at(*x) - mean), s + w * d * d)
        });
        let slope = if spread > 0.0 { product / spread } else { 0.0 };
        Self {
            form,
            height: mean - slope * center,
            slope,
        }
    }

    /// Height at a position, µm.
    pub fn at(&self, x: f64) -> f64 {
        self.form.at(x) - self.height - self.slope * x
    }
}

/// What to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// α, rad.
    pub alpha_rad: f64,
    /// β, rad.
    pub beta_rad: f64,
    /// γ, rad.
    pub gamma_rad: f64,
    /// Fourth contrast of the slopes, + + + + (a taper), rad; zero for an untapered artefact.
    pub tau_rad: f64,
    /// Thickness of the artefact, mm.
    pub thickness_mm: f64,
    /// Form of the slide.
    pub m: TrueForm,
    /// Form of side A.
    pub s_a: TrueForm,
    /// Form of side B.
    pub s_b: TrueForm,
    /// The traces.
    pub traces: Vec<TracePlan>,
    /// How often each trace is taken.
    pub repeats: u32,
    /// Whether each repeat goes forward and backward.
    pub both_directions: bool,
    /// Seconds from one position to the next.
    pub seconds_a_reading: f64,
    /// Share of readings that are outliers.
    pub outlier_share: f64,
    /// Standard deviation of an outlier in units of the channel's noise.
    pub outlier_size: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// One channel of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct TracePlan {
    /// Which channel.
    pub channel: Channel,
    /// Positions, mm, in growing order.
    pub positions: Vec<f64>,
    /// Standard deviation of a reading, µm.
    pub noise: f64,
    /// Offset, µm.
    pub offset: f64,
}

impl Plan {
    /// Four channels on one even grid of n positions, straight forms, no tilt, equal noise (µm).
    pub fn even(from: f64, to: f64, n: usize, noise: f64) -> Self {
        let positions = even_grid(from, to, n);
        let traces = Channel::ALL
            .into_iter()
            .map(|channel| TracePlan {
                channel,
                positions: positions.clone(),
                noise,
                offset: 0.0,
            })
            .collect();
        Self {
            alpha_rad: 0.0,
            beta_rad: 0.0,
            gamma_rad: 0.0,
            tau_rad: 0.0,
            thickness_mm: 0.0,
            m: TrueForm::Straight,
            s_a: TrueForm::Straight,
            s_b: TrueForm::Straight,
            traces,
            repeats: 1,
            both_directions: false,
            seconds_a_reading: 0.5,
            outlier_share: 0.0,
            outlier_size: 20.0,
            seed: 1,
        }
    }
}

/// n positions from `from` to `to`, mm.
pub fn even_grid(from: f64, to: f64, n: usize) -> Vec<f64> {
    let last = n.saturating_sub(1).max(1) as f64;
    (0..n)
        .map(|i| from + (to - from) * (i as f64 / last))
        .collect()
}

/// Why a plan cannot be carried out.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PlanError {
    /// A number that is not finite or out of its range.
    #[error("{what} is {value}: it must be {must}")]
    NotUsable {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// No point of contact.
    #[error("channel {channel} has no point of contact at {x} mm: the form is too steep")]
    NoContact {
        /// The channel.
        channel: &'static str,
        /// The position, mm.
        x: f64,
    },
}

/// What the simulated readings hide.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// α, rad.
    pub alpha_rad: f64,
    /// β, rad.
    pub beta_rad: f64,
    /// γ, rad.
    pub gamma_rad: f64,
    /// Form of the slide, in the gauge.
    pub m: GaugedForm,
    /// Form of side A, in the gauge.
    pub s_a: GaugedForm,
    /// Form of side B, in the gauge.
    pub s_b: GaugedForm,
    /// Which readings are outliers.
    pub outliers: Vec<usize>,
}

/// Everything that decides a reading, open to a [`Disturbance`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Situation {
    /// Which channel.
    pub channel: Channel,
    /// Repeat, from 1.
    pub repeat: u32,
    /// Direction of travel.
    pub direction: Direction,
    /// Seconds since the first reading.
    pub time: f64,
    /// Commanded position, mm.
    pub commanded: f64,
    /// Position at which the slide really stands, mm.
    pub slide: f64,
    /// Shift of the artefact along its axis, mm.
    pub artefact_shift: f64,
    /// Tilt of the channel's trace, rad.
    pub tilt_rad: f64,
    /// Thickness, mm.
    pub thickness_mm: f64,
}

/// An effect that the model of the reversal does not have.
pub trait Disturbance {
    /// Changes the situation before the contact is found.
    fn before(&self, situation: &mut Situation) {
        let _ = situation;
    }

    /// Changes the reading, µm, before noise is added.
    fn after(&self, situation: &Situation, reading: f64) -> f64 {
        let _ = situation;
        reading
    }
}

/// Carries out a plan.
///
/// # Errors
/// [`PlanError`] where a number of the plan cannot be used.
pub fn simulate(
    plan: &Plan,
    disturbances: &[&dyn Disturbance],
) -> Result<(Observations, Truth), PlanError> {
    check(plan)?;
    let times = if plan.both_directions { 2 } else { 1 } * plan.repeats as usize;
    let all: Vec<f64> = plan
        .traces
        .iter()
        .flat_map(|t| t.positions.iter().copied())
        .collect();
    let mut truth = Truth {
        alpha_rad: plan.alpha_rad,
        beta_rad: plan.beta_rad,
        gamma_rad: plan.gamma_rad,
        m: GaugedForm::over(plan.m.clone(), &all),
        s_a: GaugedForm::over(plan.s_a.clone(), &all),
        s_b: GaugedForm::over(plan.s_b.clone(), &all),
        outliers: Vec::new(),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let mut readings = Vec::with_capacity(all.len() * times);
    let mut clock = 0.0;
    // Both indicators read at once: the traces of one spindle position share their time.
    for spindle in [1.0, -1.0] {
        for repeat in 1..=plan.repeats {
            for direction in [Direction::Forward, Direction::Backward] {
                if direction == Direction::Backward && !plan.both_directions {
                    continue;
                }
                let mut longest = 0;
                for trace in &plan.traces {
                    if trace.channel.spindle_sign() != spindle {
                        continue;
                    }
                    longest = longest.max(trace.positions.len());
                    for i in 0..trace.positions.len() {
                        let x = match direction {
                            Direction::Forward => trace.positions[i],
                            Direction::Backward => trace.positions[trace.positions.len() - 1 - i],
                        };
                        let time = clock + plan.seconds_a_reading * i as f64;
                        let mut situation = Situation {
                            channel: trace.channel,
                            repeat,
                            direction,
                            time,
                            commanded: x,
                            slide: x,
                            artefact_shift: 0.0,
                            tilt_rad: channel_tilt(plan, trace.channel),
                            thickness_mm: plan.thickness_mm,
                        };
                        for d in disturbances {
                            d.before(&mut situation);
                        }
                        let mut value = exact_reading(&situation, &truth)? + trace.offset;
                        for d in disturbances {
                            value = d.after(&situation, value);
                        }
                        let outlier =
                            plan.outlier_share > 0.0 && rng.random::<f64>() < plan.outlier_share;
                        if outlier {
                            truth.outliers.push(readings.len());
                        }
                        let deviation = trace.noise * if outlier { plan.outlier_size } else { 1.0 };
                        if let Ok(normal) = Normal::new(0.0, deviation) {
                            value += normal.sample(&mut rng);
                        }
                        readings.push(Reading {
                            channel: trace.channel,
                            repeat,
                            direction,
                            time: Some(time),
                            x,
                            value,
                        });
                    }
                }
                clock += plan.seconds_a_reading * longest as f64;
            }
        }
    }
    Ok((Observations { readings }, truth))
}

fn check(plan: &Plan) -> Result<(), PlanError> {
    let refuse = |what, value, must| Err(PlanError::NotUsable { what, value, must });
    for channel in Channel::ALL {
        let tilt = channel_tilt(plan, channel);
        if !(tilt.abs() <= LARGEST_TILT_RAD) {
            return refuse("the tilt of a channel (rad)", tilt, "at most 45°");
        }
    }
    if !(plan.thickness_mm >= 0.0) || !plan.thickness_mm.is_finite() {
        return refuse("the thickness (mm)", plan.thickness_mm, "zero or more");
    }
    for trace in &plan.traces {
        if !(trace.noise >= 0.0) || !trace.noise.is_finite() {
            return refuse("the noise (um)", trace.noise, "zero or more");
        }
        if let Some(x) = trace.positions.iter().find(|x| !x.is_finite()) {
            return refuse("a position (mm)", *x, "finite");
        }
    }
    if !(0.0..=1.0).contains(&plan.outlier_share) {
        return refuse("the share of outliers", plan.outlier_share, "from 0 to 1");
    }
    if !(plan.outlier_size >= 0.0) || !plan.outlier_size.is_finite() {
        return refuse("the size of outliers", plan.outlier_size, "zero or more");
    }
    Ok(())
}

fn channel_tilt(plan: &Plan, channel: Channel) -> f64 {
    channel.indicator_sign() * plan.alpha_rad
        + channel.spindle_sign() * plan.beta_rad
        + channel.side_sign() * plan.gamma_rad
        + plan.tau_rad
}

/// The reading (µm) of a situation, without offset and noise: the artefact's profile in the
/// slide's frame, met at the slide's position.
fn exact_reading(situation: &Situation, truth: &Truth) -> Result<f64, PlanError> {
    let side = if situation.channel.is_side_a() {
        &truth.s_a
    } else {
        &truth.s_b
    };
    let half = situation.thickness_mm / 2.0;
    let (sin, cos) = situation.tilt_rad.sin_cos();
    let radius = |u: f64| half + mm_from_um(side.at(u - situation.artefact_shift));
    let along = |u: f64| u * cos - radius(u) * sin - situation.slide;
    let no_contact = PlanError::NoContact {
        channel: situation.channel.name(),
        x: situation.slide,
    };
    // Bracket the contact, then halve: as many times as a double has bits, and some.
    let guess = (situation.slide + half * sin) / cos;
    let mut reach = 1e-6 * (1.0 + guess.abs());
    while along(guess - reach) > 0.0 || along(guess + reach) < 0.0 {
        reach *= 2.0;
        if !(reach < 1e6 * (1.0 + guess.abs())) {
            return Err(no_contact);
        }
    }
    let (mut low, mut high) = (guess - reach, guess + reach);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if along(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let u = 0.5 * (low + high);
    let m = situation.channel.indicator_sign() * truth.m.at(situation.slide);
    Ok(um_from_mm(u * sin + radius(u) * cos - half) + m)
}
