//! Readings of a design with known truth. Nothing here is shared with the fit: waves in place of
//! splines, angles as they are, and the point of contact by bisection.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use super::channel::Design;
pub use super::disturbance::{
    DESIGN_EFFECTS, DesignEffect, DesignEffectKind, DesignFrame, DesignPlace,
};
use super::options::Crest;
use super::readings::{DesignObservations, DesignReading};
use super::rig::Rig;
pub use super::wave_form::WaveForm;
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
    /// Stylus and bar, where the bar is round and its axis stands beside the styluses; `None`: a flat
    /// artefact.
    pub crest: Option<Crest>,
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
    /// Whether each repeat is taken forward and backward.
    pub both_directions: bool,
    /// Whether the spindle is turned in every repeat; otherwise a position has all its repeats first.
    pub turned_each_repeat: bool,
    /// Seconds from one reading to the next; all indicators are read at once.
    pub interval_s: f64,
    /// Effects that the fit leaves out.
    pub effects: Vec<DesignEffect>,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl DesignPlan {
    /// Traces of 61 positions over 300 mm, once and forward, without thickness, slopes, noise and forms.
    pub fn of(design: Design) -> Self {
        Self {
            design,
            slopes_rad: [0.0; 7],
            kept_um: None,
            thickness_mm: 0.0,
            crest: None,
            length_mm: 300.0,
            positions: 61,
            repeats: 1,
            noise_um: 0.0,
            forms_um: [0.0; 2],
            both_directions: false,
            turned_each_repeat: false,
            interval_s: 0.5,
            effects: Vec::new(),
            seed: 0,
        }
    }
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
        at_least("interval", self.interval_s, f64::MIN_POSITIVE, "above 0 s")?;
        for effect in &self.effects {
            let finite = if effect.size.is_finite() { 0.0 } else { -1.0 };
            at_least("the size of an effect", finite, 0.0, "finite")?;
        }
        for rms in self.forms_um {
            at_least("forms", rms, 0.0, "0 um or more")?;
        }
        if let Some(crest) = &self.crest {
            at_least(
                "the radius of the stylus",
                crest.tip_mm,
                0.0,
                "0 mm or more",
            )?;
            let count = crest.offset_mm.len() == self.design.channels().len();
            let count = if count { 0.0 } else { -1.0 };
            at_least("offsets beside the crest", count, 0.0, "one a channel")?;
            let radius = 0.5 * self.thickness_mm + crest.tip_mm;
            for offset in &crest.offset_mm {
                let left = radius - offset.abs();
                at_least(
                    "radius less the offset beside the crest",
                    left,
                    0.1,
                    "0.1 mm or more",
                )?;
            }
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
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let rig = Rig::new(plan, &mut rng);
    let frame = match plan.effects.is_empty() {
        true => None,
        false => Some(rig.frame()),
    };
    let mut readings = Vec::new();
    for trace in rig.traces() {
        let shown = rig.shown(&trace, frame.as_ref());
        for (m, value) in trace.iter().zip(shown) {
            let noise: f64 = StandardNormal.sample(&mut rng);
            readings.push(DesignReading {
                channel: m.channel,
                repeat: m.repeat,
                direction: match m.way > 0.0 {
                    true => Direction::Forward,
                    false => Direction::Backward,
                },
                time: Some(m.time),
                x: m.x,
                value: value + plan.noise_um * noise,
            });
        }
    }
    let design = plan.design.clone();
    Ok((DesignObservations { design, readings }, rig.truth))
}

/// What effects are drawn from: the plan carried out without noise and effects.
///
/// # Errors
/// As [`simulate`].
pub fn frame(plan: &DesignPlan) -> Result<DesignFrame, DesignPlanError> {
    plan.check()?;
    Ok(Rig::new(plan, &mut ChaCha8Rng::seed_from_u64(plan.seed)).frame())
}
