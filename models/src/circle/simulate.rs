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
    /// Which pass this is, from 0, and of how many.
    #[serde(skip, default = "only_pass")]
    pub pass: (usize, usize),
}

fn only_pass() -> (usize, usize) {
    (0, 1)
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
            pass: only_pass(),
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
    /// The y axis leans towards x by this angle, rad.
    Squareness(f64),
    /// The centre moves along x by so much over all passes, µm.
    CentreDrift(f64),
    /// The radius grows by so much over all passes, µm.
    RadiusGrowth(f64),
    /// The x axis loses so much motion where it reverses, µm.
    AxisBacklash(f64),
    /// A wave of a period that is no whole part of a turn.
    AsynchronousMotion {
        /// Undulations per revolution.
        undulations: f64,
        /// Amplitude, µm.
        amplitude: f64,
    },
    /// The part lies so far along x in the last pass, µm.
    PartMoved(f64),
    /// The zero of the probe jumps by so much after 0.55 of all passes, µm.
    ZeroJump(f64),
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 12] = [
        "asynchronous-motion",
        "axis-backlash",
        "centre-drift",
        "lobes",
        "outlier",
        "ovality",
        "part-moved",
        "radius-growth",
        "scale",
        "scale-mismatch",
        "squareness",
        "zero-jump",
    ];

    /// A disturbance by the name of its effect and its size, µm, rad or a share; what these leave open is
    /// usual: three lobes, the first at 20°, the point after a third of the way round, 2.4 waves a turn.
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
            "squareness" => Self::Squareness(size),
            "centre-drift" => Self::CentreDrift(size),
            "radius-growth" => Self::RadiusGrowth(size),
            "axis-backlash" => Self::AxisBacklash(size),
            "asynchronous-motion" => Self::AsynchronousMotion {
                undulations: 2.4,
                amplitude: size,
            },
            "part-moved" => Self::PartMoved(size),
            "zero-jump" => Self::ZeroJump(size),
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
            let (mut along_x, mut leans): (f64, f64) = (0.0, 0.0);
            let (pass, passes) = what.pass;
            let taken = (pass * what.count + i) as f64;
            let moment = taken / (passes * what.count).saturating_sub(1).max(1) as f64;
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
                    Disturbance::Squareness(angle) => leans += angle,
                    Disturbance::CentreDrift(size) => along_x += 1e-3 * size * moment,
                    Disturbance::RadiusGrowth(size) => r += 1e-3 * size * moment,
                    Disturbance::AxisBacklash(lost) => {
                        // In the upper half x falls.
                        let falls = (angle.sin() > 0.0) == (what.arc > 0.0);
                        along_x += if falls { 0.5e-3 * lost } else { -0.5e-3 * lost };
                    }
                    Disturbance::AsynchronousMotion {
                        undulations,
                        amplitude,
                    } => {
                        let turned = angle + what.arc * pass as f64;
                        r += 1e-3 * amplitude * (undulations * turned).cos();
                    }
                    Disturbance::PartMoved(size) if pass + 1 == passes => along_x += 1e-3 * size,
                    Disturbance::ZeroJump(size) if moment > 0.55 => r += 1e-3 * size,
                    Disturbance::PartMoved(_) | Disturbance::ZeroJump(_) => {}
                }
            }
            let (x, y) = (
                what.centre.x + r * angle.cos(),
                what.centre.y + r * angle.sin(),
            );
            Point::new(
                of_x * (x + y * leans.sin()) + along_x + noise.sample(&mut rng),
                of_y * y * leans.cos() + noise.sample(&mut rng),
            )
        })
        .collect())
}
