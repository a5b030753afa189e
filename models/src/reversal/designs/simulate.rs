//! Readings of a design with known truth. Nothing here is shared with the fit: waves in place of
//! splines, angles as they are, and the point of contact by bisection.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use super::channel::Design;
use super::readings::{DesignObservations, DesignReading};
use crate::reversal::Direction;

/// What to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignPlan {
    /// The channels.
    pub design: Design,
    /// α_h, α_v, γ_1, γ_2, τ, κ_c, κ_s, rad.
    pub slopes_rad: [f64; 7],
    /// Eccentricity e_1, e_2 and oval part o, µm, with zeros that are kept; `None`: zeros set anew for
    /// each trace.
    pub kept_um: Option<[f64; 3]>,
    /// Diameter of the artefact, mm.
    pub thickness_mm: f64,
    /// Travel from 0, mm.
    pub length_mm: f64,
    /// Positions of each trace, evenly spread.
    pub positions: usize,
    /// How often each trace is taken.
    pub repeats: u32,
    /// Standard deviation of a reading, µm.
    pub noise_um: f64,
    /// Root mean square of the slide's forms and of the sides', µm.
    pub forms_um: [f64; 2],
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Why nothing can be simulated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DesignPlanError {
    /// A number that makes no sense.
    #[error("{what} = {value}: it must be {must}")]
    NotUsable {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
}

/// A form as a sum of waves less a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveForm {
    /// Amplitude (µm), wave number (rad/mm), phase (rad).
    waves: Vec<[f64; 3]>,
    /// Height (µm) at 0 and slope (µm/mm) of the line taken out.
    line: [f64; 2],
}

/// What is true of simulated readings.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignTruth {
    /// α_h, α_v, γ_1, γ_2, τ, κ_c, κ_s, rad.
    pub slopes_rad: [f64; 7],
    /// M_h and M_v.
    pub slide: [WaveForm; 2],
    /// The forms of the sides, in the order of the design.
    pub sides: Vec<WaveForm>,
}

/// Waves in a form.
const WAVES: u32 = 4;

impl WaveForm {
    /// Random waves no shorter than two fifths of the length, without straight-line part over the
    /// positions.
    fn random(rng: &mut ChaCha8Rng, rms: f64, length: f64, x: &[f64]) -> Self {
        let share = rms * (2.0 / f64::from(WAVES)).sqrt();
        let waves = (0..WAVES)
            .map(|k| {
                let turns = 0.9 + 0.5 * f64::from(k) + 0.1 * rng.random::<f64>();
                [share, TAU * turns / length, TAU * rng.random::<f64>()]
            })
            .collect();
        let mut form = Self {
            waves,
            line: [0.0; 2],
        };
        let n = x.len() as f64;
        let y: Vec<f64> = x.iter().map(|x| form.at(*x)).collect();
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        let product: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
        let slope = product / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
        form.line = [my - slope * mx, slope];
        form
    }

    /// Its value, µm, at a position, mm.
    pub fn at(&self, x: f64) -> f64 {
        let waves = self
            .waves
            .iter()
            .map(|[a, k, phase]| a * (k * x + phase).sin());
        waves.sum::<f64>() - self.line[0] - self.line[1] * x
    }
}

impl DesignPlan {
    /// The positions of each trace, mm.
    pub fn x(&self) -> Vec<f64> {
        let step = self.length_mm / (self.positions.max(2) - 1) as f64;
        (0..self.positions).map(|k| k as f64 * step).collect()
    }

    fn check(&self) -> Result<(), DesignPlanError> {
        let at_least =
            |what, value: f64, least: f64, must| match value.is_finite() && value >= least {
                true => Ok(()),
                false => Err(DesignPlanError::NotUsable { what, value, must }),
            };
        at_least("positions", self.positions as f64, 3.0, "3 or more")?;
        at_least("repeats", f64::from(self.repeats), 1.0, "1 or more")?;
        at_least("length", self.length_mm, f64::MIN_POSITIVE, "above 0 mm")?;
        at_least("thickness", self.thickness_mm, 0.0, "0 mm or more")?;
        at_least("noise", self.noise_um, 0.0, "0 um or more")?;
        for rms in self.forms_um {
            at_least("forms", rms, 0.0, "0 um or more")?;
        }
        let total: f64 = self.slopes_rad.iter().map(|s| s.abs()).sum();
        match total < 0.5 {
            true => Ok(()),
            false => Err(DesignPlanError::NotUsable {
                what: "sum of slopes in rad",
                value: total,
                must: "below 0.5",
            }),
        }
    }
}

/// Readings of a plan, and what is true of them.
///
/// # Errors
/// [`DesignPlanError`]: a number of the plan that makes no sense.
pub fn simulate(plan: &DesignPlan) -> Result<(DesignObservations, DesignTruth), DesignPlanError> {
    plan.check()?;
    let x = plan.x();
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let [of_slide, of_side] = plan.forms_um;
    let mut form = |rms| WaveForm::random(&mut rng, rms, plan.length_mm, &x);
    let truth = DesignTruth {
        slopes_rad: plan.slopes_rad,
        slide: [form(of_slide), form(of_slide)],
        sides: plan.design.sides().iter().map(|_| form(of_side)).collect(),
    };
    let zeros: Vec<f64> = plan
        .design
        .channels()
        .iter()
        .map(|_| 40.0 * rng.random::<f64>())
        .collect();
    let indicators = plan.design.indicators();
    let mut readings = Vec::new();
    let mut time = 0.0;
    for (c, channel) in plan.design.channels().iter().enumerate() {
        let (phi, psi) = (
            channel.indicator.to_radians(),
            (channel.indicator - channel.spindle).to_radians(),
        );
        let [alpha_h, alpha_v, gamma_1, gamma_2, cone, kappa_c, kappa_s] = plan.slopes_rad;
        let tilt = alpha_h * phi.cos()
            + alpha_v * phi.sin()
            + gamma_1 * psi.cos()
            + gamma_2 * psi.sin()
            + cone
            + kappa_c * (2.0 * psi).cos()
            + kappa_s * (2.0 * psi).sin();
        let zero = match plan.kept_um {
            None => zeros[c],
            Some([e_1, e_2, o]) => {
                let apart =
                    |a: &f64| ((a - channel.indicator + 180.0).rem_euclid(360.0) - 180.0).abs();
                let own = (0..indicators.len())
                    .min_by(|a, b| apart(&indicators[*a]).total_cmp(&apart(&indicators[*b])));
                zeros[own.unwrap_or(0)] + e_1 * psi.cos() + e_2 * psi.sin() + o * (2.0 * psi).cos()
            }
        };
        let side = &truth.sides[plan.design.side_of(c)];
        for repeat in 1..=plan.repeats {
            for position in &x {
                let seen = touched(*position, tilt, plan.thickness_mm / 2.0, |u| side.at(u));
                let slide = phi.cos() * truth.slide[0].at(*position)
                    + phi.sin() * truth.slide[1].at(*position);
                let noise: f64 = StandardNormal.sample(&mut rng);
                readings.push(DesignReading {
                    channel: c,
                    repeat,
                    direction: Direction::Forward,
                    time: Some(time),
                    x: *position,
                    value: 1e3 * seen + slide + zero + plan.noise_um * noise,
                });
                time += 0.5;
            }
        }
    }
    let design = plan.design.clone();
    Ok((DesignObservations { design, readings }, truth))
}

/// What an indicator at slide position x reads, mm, of a bar of half thickness h whose surface, h and its
/// form (µm) above an axis, is turned by the tilt about the origin: the height of the surface above h
/// where it crosses the line of the indicator.
fn touched(x: f64, tilt: f64, h: f64, form_um: impl Fn(f64) -> f64) -> f64 {
    let (sin, cos) = tilt.sin_cos();
    let height = |u: f64| h + form_um(u) / 1e3;
    let along = |u: f64| u * cos - height(u) * sin;
    let reach = 1.0 + (x.abs() + h) * (tilt.abs() + tilt * tilt);
    let (mut low, mut high) = (x - reach, x + reach);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if along(middle) < x {
            low = middle;
        } else {
            high = middle;
        }
    }
    let u = 0.5 * (low + high);
    u * sin + height(u) * cos - h
}
