//! Points of a circle with known centre, radius, form and noise.

use super::points::{CircleError, Point};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde::{Deserialize, Serialize};

/// What to simulate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CircleSimulation {
    /// Centre, mm.
    pub centre: Point,
    /// Radius, mm.
    pub radius: f64,
    /// Number of points.
    pub count: usize,
    /// Angle of the first point, rad.
    pub start: f64,
    /// Angle covered, rad; 2π is a full circle whose last point does not repeat the first.
    pub arc: f64,
    /// Standard deviation of each coordinate, µm.
    pub noise_um: f64,
    /// Lobes of the form: (undulations per revolution, amplitude in µm, phase in rad).
    pub lobes: Vec<(u32, f64, f64)>,
}

impl Default for CircleSimulation {
    fn default() -> Self {
        Self {
            centre: Point::new(0.0, 0.0),
            radius: 50.0,
            count: 36,
            start: 0.0,
            arc: std::f64::consts::TAU,
            noise_um: 1.0,
            lobes: Vec::new(),
        }
    }
}

/// What disturbs the points beside form and noise, in exact form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// A wave of the form, µm, with its undulations per revolution and the angle of its first
    /// maximum, rad.
    Lobes {
        /// Undulations per revolution; 2 is an oval.
        undulations: u32,
        /// Amplitude, µm.
        amplitude: f64,
        /// Angle of a maximum, rad.
        maximum: f64,
    },
    /// One point of the first pass lies off along its radius, µm.
    Outlier {
        /// Place of the point, from 0.
        point: usize,
        /// Deviation, µm.
        deviation: f64,
    },
    /// Both axes read too much by this share.
    Scale(f64),
    /// x reads too much by this share.
    ScaleMismatch(f64),
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 5] = ["lobes", "outlier", "ovality", "scale", "scale-mismatch"];

    /// A disturbance by the name of its effect and its size, µm or a share; what these leave open is
    /// usual: three lobes, the first at 20°, the point after a third of the way round.
    pub fn named(name: &str, size: f64, points: usize) -> Option<Self> {
        let lobes = |undulations| Self::Lobes {
            undulations,
            amplitude: size,
            maximum: 20f64.to_radians(),
        };
        Some(match name {
            "ovality" => lobes(2),
            "lobes" => lobes(3),
            "outlier" => Self::Outlier {
                point: points / 3,
                deviation: size,
            },
            "scale" => Self::Scale(size),
            "scale-mismatch" => Self::ScaleMismatch(size),
            _ => return None,
        })
    }
}

/// The points of one seed, in mm.
///
/// # Errors
/// [`CircleError::RadiusNotPositive`], [`CircleError::SimulationNotFinite`] and, for fewer than three
/// points, [`CircleError::TooFewPoints`].
pub fn simulate(what: &CircleSimulation, seed: u64) -> Result<Vec<Point>, CircleError> {
    simulate_disturbed(what, &[], seed)
}

/// The points of one seed with disturbances, in mm.
///
/// # Errors
/// Those of [`simulate`].
pub fn simulate_disturbed(
    what: &CircleSimulation,
    disturbances: &[Disturbance],
    seed: u64,
) -> Result<Vec<Point>, CircleError> {
    let radius = what.radius;
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(CircleError::RadiusNotPositive { radius });
    }
    if what.count < 3 {
        return Err(CircleError::TooFewPoints {
            count: what.count,
            distinct: what.count,
        });
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let finite = [what.centre.x, what.centre.y, what.start, what.arc]
        .into_iter()
        .chain(what.lobes.iter().flat_map(|lobe| [lobe.1, lobe.2]))
        .all(f64::is_finite);
    if !finite {
        return Err(CircleError::SimulationNotFinite { what: "geometry" });
    }
    let noise = Normal::new(0.0, what.noise_um.abs() * 1e-3)
        .map_err(|_| CircleError::SimulationNotFinite { what: "noise" })?;
    let full = (what.arc.abs() - std::f64::consts::TAU).abs() < 1e-9;
    let intervals = if full { what.count } else { what.count - 1 } as f64;
    Ok((0..what.count)
        .map(|i| {
            let angle = what.start + what.arc * i as f64 / intervals;
            let form_um: f64 = what
                .lobes
                .iter()
                .map(|&(order, amplitude, phase)| {
                    amplitude * (f64::from(order) * angle + phase).cos()
                })
                .sum();
            let mut r = radius + 1e-3 * form_um;
            let (mut of_x, mut of_y) = (1.0, 1.0);
            for disturbance in disturbances {
                match *disturbance {
                    Disturbance::Lobes {
                        undulations,
                        amplitude,
                        maximum,
                    } => r += 1e-3 * amplitude * (f64::from(undulations) * (angle - maximum)).cos(),
                    Disturbance::Outlier { point, deviation } if point == i => {
                        r += 1e-3 * deviation;
                    }
                    Disturbance::Outlier { .. } => {}
                    Disturbance::Scale(share) => {
                        of_x *= 1.0 + share;
                        of_y *= 1.0 + share;
                    }
                    Disturbance::ScaleMismatch(share) => of_x *= 1.0 + share,
                }
            }
            Point::new(
                of_x * (what.centre.x + r * angle.cos()) + noise.sample(&mut rng),
                of_y * (what.centre.y + r * angle.sin()) + noise.sample(&mut rng),
            )
        })
        .collect())
}
