//! Outputs with known truth, after the simulation of Zhao et al., section 3.

use std::f64::consts::PI;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{FourSensorError, Geometry, Outputs};
use crate::units::{UM_PER_MM, mm_from_um};

/// What is true of the surface, the slide and the sensors. Positions run from 0 in mm.
pub trait Truth {
    /// Surface f(x), µm.
    fn surface(&self, x: f64) -> f64;
    /// Straightness S(x) of the slide, µm.
    fn straightness(&self, x: f64) -> f64;
    /// Tilt γ(x) of the slide, rad.
    fn tilt(&self, x: f64) -> f64;
    /// Zero-adjustment e of each sensor, µm; that of sensor 1 is zero by definition.
    fn zero_adjustment(&self) -> [f64; 4];
}

/// The first example of Zhao et al. on a surface of length L0 and a travel of length L.
///
/// The surface is their equation (24), 5 sin(2πkx/L0) + 5 sin(20πx/L0) µm. Their S(x) and γ(x),
/// (21) and (22), are not legible in the copies known; these are smooth curves of the size their
/// figures show, tens of µm and hundredths of a degree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// L0, mm.
    pub surface_length: f64,
    /// L, mm.
    pub travel: f64,
    /// k, the harmonic order of the surface.
    pub harmonic: f64,
    /// e of each sensor, µm.
    pub zero_adjustment: [f64; 4],
}

impl Example {
    /// The example on a geometry, with harmonic 5 and zero-adjustments of a few µm.
    pub fn of(geometry: &Geometry) -> Self {
        Self {
            surface_length: (geometry.point_count() - 1) as f64 * geometry.step(),
            travel: (geometry.output_count() - 1) as f64 * geometry.step(),
            harmonic: 5.0,
            zero_adjustment: [0.0, 3.0, -2.0, 4.0],
        }
    }
}

impl Truth for Example {
    fn surface(&self, x: f64) -> f64 {
        let turn = 2.0 * PI * x / self.surface_length;
        5.0 * (self.harmonic * turn).sin() + 5.0 * (10.0 * turn).sin()
    }

    fn straightness(&self, x: f64) -> f64 {
        let turn = 2.0 * PI * x / self.travel;
        20.0 * (0.5 * turn).sin() + 6.0 * (1.5 * turn + 0.4).cos() - 3.0 * (3.0 * turn).sin()
    }

    fn tilt(&self, x: f64) -> f64 {
        let turn = 2.0 * PI * x / self.travel;
        (0.012 * (0.5 * turn + 0.3).cos() + 0.004 * (2.0 * turn).sin()).to_radians()
    }

    fn zero_adjustment(&self) -> [f64; 4] {
        self.zero_adjustment
    }
}

/// What disturbs the outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbances {
    /// Standard deviation of one reading, µm.
    pub noise: f64,
    /// True place of each sensor less the place the analysis assumes, mm.
    pub sensor_position: [f64; 4],
    /// Amplitude of the slide's positioning error (20) of Zhao et al.; 1 is theirs.
    pub slide_position: f64,
    /// Drift of all sensors alike over the travel, µm.
    pub drift: f64,
    /// Relative gain error of each sensor.
    pub gain: [f64; 4],
    /// Drift of each sensor over the travel, µm.
    pub sensor_drift: [f64; 4],
    /// What sensor 3 settles by over all travels, µm, with a time constant of a quarter of them.
    pub settling: f64,
    /// Jump of the zero of sensor 3 after 0.55 of all travels, µm.
    pub jump: f64,
    /// What sensor 3 reads too much at 30 µm, µm, by the square of its reading.
    pub bent: f64,
    /// How far sensor 3 lags behind, mm.
    pub lag: f64,
    /// Which travel this is, from 0, and of how many.
    pub pass: (usize, usize),
}

impl Disturbances {
    /// Nothing but noise, µm.
    pub fn noise(noise: f64) -> Self {
        Self {
            noise,
            sensor_position: [0.0; 4],
            slide_position: 0.0,
            drift: 0.0,
            gain: [0.0; 4],
            sensor_drift: [0.0; 4],
            settling: 0.0,
            jump: 0.0,
            bent: 0.0,
            lag: 0.0,
            pass: (0, 1),
        }
    }
}

impl Disturbances {
    /// The names that [`Self::add`] knows.
    pub const NAMES: [&'static str; 10] = [
        "common-drift",
        "common-gain",
        "drift",
        "gain",
        "lag",
        "nonlinearity",
        "sensor-position",
        "settling",
        "slide-position",
        "zero-jump",
    ];

    /// Adds an effect of the diagnosis's catalogue by its name at a size (µm, mm or a share), to
    /// sensor 3 where it is of one sensor; for `slide-position` the size is the amplitude of the
    /// first wave, mm. Says whether the name is known.
    pub fn add(&mut self, name: &str, size: f64) -> bool {
        match name {
            "common-drift" => self.drift += size,
            "common-gain" => self.gain = self.gain.map(|g| g + size),
            "drift" => self.sensor_drift[2] += size,
            "gain" => self.gain[2] += size,
            "lag" => self.lag += size,
            "nonlinearity" => self.bent += size,
            "settling" => self.settling += size,
            "zero-jump" => self.jump += size,
            "sensor-position" => self.sensor_position[2] += size,
            // Equation (20) of Zhao et al. begins with 10 µm.
            "slide-position" => self.slide_position += size / mm_from_um(10.0),
            _ => return false,
        }
        true
    }
}

/// The outputs that a truth gives; the same seed gives the same outputs.
///
/// # Errors
/// A disturbance that is not finite.
pub fn simulate(
    geometry: &Geometry,
    truth: &impl Truth,
    disturbances: &Disturbances,
    seed: u64,
) -> Result<Outputs, FourSensorError> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let travel = (geometry.output_count() - 1) as f64 * geometry.step();
    let places = geometry.positions();
    let zero = truth.zero_adjustment();
    let (pass, passes) = disturbances.pass;
    let count = geometry.output_count();
    let readings = (0..geometry.output_count())
        .map(|n| {
            let commanded = n as f64 * geometry.step();
            let share = commanded / travel;
            let x = commanded + disturbances.slide_position * slide_position_error(share);
            let taken = (pass * count + n) as f64;
            let moment = taken / (passes * count).saturating_sub(1).max(1) as f64;
            std::array::from_fn(|sensor| {
                let arm = places[sensor] + disturbances.sensor_position[sensor];
                let third = if sensor == 2 { 1.0 } else { 0.0 };
                let x = x - third * disturbances.lag;
                let own = disturbances.settling * (1.0 - (-4.0 * moment).exp())
                    + if moment > 0.55 {
                        disturbances.jump
                    } else {
                        0.0
                    };
                let sum = truth.surface(x + arm)
                    + truth.straightness(x)
                    + UM_PER_MM * arm * truth.tilt(x)
                    + zero[sensor]
                    + (disturbances.drift + disturbances.sensor_drift[sensor]) * share;
                let noise: f64 = StandardNormal.sample(&mut generator);
                let bent = third * disturbances.bent * (sum / 30.0).powi(2);
                (1.0 + disturbances.gain[sensor]) * sum
                    + bent
                    + third * own
                    + disturbances.noise * noise
            })
        })
        .collect();
    Outputs::new(*geometry, 0.0, readings)
}

/// Equation (20) of Zhao et al., mm, at a share of the travel.
fn slide_position_error(share: f64) -> f64 {
    let turn = 2.0 * PI * share;
    mm_from_um(
        -10.0 * (turn + PI / 12.0).sin() - 3.0 * (3.0 * turn + PI / 2.0).sin()
            + 4.5 * (turn + 5.0 * PI / 6.0).sin(),
    )
}
