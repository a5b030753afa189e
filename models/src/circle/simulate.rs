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

/// The points of one seed, in mm.
///
/// # Errors
/// [`CircleError::RadiusNotPositive`], [`CircleError::SimulationNotFinite`] and, for fewer than three
/// points, [`CircleError::TooFewPoints`].
pub fn simulate(what: &CircleSimulation, seed: u64) -> Result<Vec<Point>, CircleError> {
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
            let r = radius + 1e-3 * form_um;
            Point::new(
                what.centre.x + r * angle.cos() + noise.sample(&mut rng),
                what.centre.y + r * angle.sin() + noise.sample(&mut rng),
            )
        })
        .collect())
}
