//! The circle of least squared orthogonal distances.

use super::algebraic::{AlgebraicFit, algebraic};
use super::passes::PassScatter;
use super::points::{Circle, CircleError, FLAT, Frame, Point, ReachedCircle, check_points};
use crate::uncertainty::{DegreesOfFreedom, Disagreement, Quantity, UncertaintyError};
use errsep_solvers::{Fit, NoValue, Options, Problem};
use nalgebra::{DMatrix, DVector, Matrix3};

/// The least-squares problem: residual |pᵢ − c| − r, parameters (a, b, r), every length in the same
/// unit. ∂/∂(a, b, r) = (−u, −v, −1) with (u, v) the unit vector from the centre to the point.
#[derive(Debug, Clone)]
pub struct OrthogonalCircle {
    points: Vec<Point>,
}

impl OrthogonalCircle {
    /// The problem of these points.
    pub fn new(points: Vec<Point>) -> Self {
        Self { points }
    }
}

impl Problem for OrthogonalCircle {
    fn parameter_count(&self) -> usize {
        3
    }

    fn residual_count(&self) -> usize {
        self.points.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let centre = Point::new(p[0], p[1]);
        Ok(DVector::from_iterator(
            self.points.len(),
            self.points.iter().map(|q| q.distance(centre) - p[2]),
        ))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let centre = Point::new(p[0], p[1]);
        let mut jacobian = DMatrix::from_element(self.points.len(), 3, -1.0);
        for (i, q) in self.points.iter().enumerate() {
            let distance = q.distance(centre);
            if distance == 0.0 {
                return Err(NoValue::new("a point lies at the centre of the circle"));
            }
            jacobian[(i, 0)] = (centre.x - q.x) / distance;
            jacobian[(i, 1)] = (centre.y - q.y) / distance;
        }
        Ok(jacobian)
    }

    fn parameter_name(&self, index: usize) -> String {
        ["centre x", "centre y", "radius"]
            .get(index)
            .map_or_else(|| format!("p{index}"), |&name| name.to_owned())
    }
}

/// The fitted circle, its uncertainty and the residuals.
#[derive(Debug, Clone)]
pub struct CircleFit {
    /// The circle, mm.
    pub circle: Circle,
    /// Covariance of (centre x, centre y, radius), mm².
    pub covariance: Matrix3<f64>,
    /// Standard deviation of the radial deviations, µm: given, or estimated from the residuals.
    pub noise_um: f64,
    /// Whether that was given.
    pub noise_given: bool,
    /// Points less three.
    pub degrees_of_freedom: usize,
    /// Radial deviations, µm, positive outside, in the order of the points.
    pub residuals_um: Vec<f64>,
    /// ∂(deviation)/∂(centre x, centre y, radius), points × 3, mm per mm.
    pub jacobian: DMatrix<f64>,
    /// By how much passes differ beyond the scatter of their points, where that was [counted](Self::count_passes).
    pub scatter: Option<PassScatter>,
    /// The circle from which the iteration started.
    pub seed: Circle,
    /// How the iteration ended, in words.
    pub ending: String,
    /// Iterations made.
    pub iterations: u64,
}

impl CircleFit {
    /// Standard uncertainties of centre x, centre y and radius, mm.
    pub fn standard_uncertainties(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }

    /// Where the deviations refute the noise that was given.
    pub fn disagreement(&self) -> Option<Disagreement> {
        let squares: f64 = self.residuals_um.iter().map(|r| r * r).sum();
        let freedom = self.degrees_of_freedom as f64;
        let test = || Disagreement::of(squares, freedom, self.noise_um, DegreesOfFreedom::Infinite);
        self.noise_given.then(test).flatten()
    }

    /// Radius, centre x and centre y, mm. Degrees of freedom are those of the residuals, infinite for
    /// a given noise, and those of the passes where these were [counted](Self::count_passes).
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn quantities(&self) -> Result<[Quantity; 3], UncertaintyError> {
        let degrees = if let Some(scatter) = self.scatter {
            scatter.degrees
        } else if self.noise_given {
            DegreesOfFreedom::Infinite
        } else {
            DegreesOfFreedom::new(self.degrees_of_freedom as f64)?
        };
        let [x, y, radius] = self.standard_uncertainties();
        let quantity = |label: &str, value: f64, std: f64| {
            Ok(Quantity::new(label, value, std, "mm")?.with_degrees_of_freedom(degrees))
        };
        Ok([
            quantity("radius", self.circle.radius, radius)?,
            quantity("centre x", self.circle.centre.x, x)?,
            quantity("centre y", self.circle.centre.y, y)?,
        ])
    }
}

/// Fits the circle of least squared orthogonal distances to `points` (mm), from the hyper fit as its
/// seed, by Levenberg-Marquardt.
///
/// `noise_um` is the standard deviation of a point's radial deviation where it is known; otherwise
/// it is estimated from the residuals, which takes the form of the part for noise.
///
/// # Errors
/// Those of [`check_points`]; [`CircleError::StraighterThanAnyCircle`] where the best circle runs off
/// to a line; [`CircleError::NotConverged`]; [`CircleError::NoRedundancy`] for three points without a
/// given noise.
pub fn orthogonal_fit(points: &[Point], noise_um: Option<f64>) -> Result<CircleFit, CircleError> {
    fit_within(points, noise_um, &Options::default())
}

fn fit_within(
    points: &[Point],
    noise_um: Option<f64>,
    options: &Options,
) -> Result<CircleFit, CircleError> {
    check_points(points)?;
    let degrees_of_freedom = points.len() - 3;
    if degrees_of_freedom == 0 && noise_um.is_none() {
        return Err(CircleError::NoRedundancy);
    }
    let seed = algebraic(points, AlgebraicFit::Hyper)?;
    let frame = Frame::of(points);
    let local: Vec<Point> = points.iter().map(|&p| frame.to_local(p)).collect();
    let centre = frame.to_local(seed.centre);
    let start = DVector::from_vec(vec![centre.x, centre.y, seed.radius / frame.scale]);
    let fit = errsep_solvers::fit(&OrthogonalCircle::new(local), start, options).map_err(|e| {
        CircleError::NotConverged {
            reason: e.to_string(),
            reached: None,
        }
    })?;
    if fit.parameters[2].abs() > FLAT {
        return Err(CircleError::StraighterThanAnyCircle);
    }
    if !fit.ending.is_converged() {
        return Err(CircleError::NotConverged {
            reason: fit.ending.to_string(),
            reached: Some(reached(&fit, frame)),
        });
    }
    Ok(assemble(&fit, frame, seed, noise_um, degrees_of_freedom))
}

fn circle_of(p: &DVector<f64>, frame: Frame) -> Circle {
    frame.to_world(Circle {
        centre: Point::new(p[0], p[1]),
        radius: p[2].abs(),
    })
}

fn reached(fit: &Fit, frame: Frame) -> ReachedCircle {
    let mean_square = fit.residuals.norm_squared() / fit.residuals.len() as f64;
    ReachedCircle {
        circle: circle_of(&fit.parameters, frame),
        residual_rms_um: 1e3 * frame.scale * mean_square.sqrt(),
        iterations: fit.iterations,
    }
}

fn assemble(
    fit: &Fit,
    frame: Frame,
    seed: Circle,
    noise_um: Option<f64>,
    degrees_of_freedom: usize,
) -> CircleFit {
    let um = 1e3 * frame.scale;
    let estimated = um * (fit.residuals.norm_squared() / degrees_of_freedom.max(1) as f64).sqrt();
    let sigma = noise_um.unwrap_or(estimated);
    let unit = fit.covariance().matrix;
    CircleFit {
        circle: circle_of(&fit.parameters, frame),
        covariance: Matrix3::from_fn(|i, j| unit[(i, j)] * (1e-3 * sigma).powi(2)),
        noise_um: sigma,
        noise_given: noise_um.is_some(),
        degrees_of_freedom,
        residuals_um: fit.residuals.iter().map(|r| um * r).collect(),
        jacobian: fit.jacobian.clone(),
        scatter: None,
        seed,
        ending: fit.ending.to_string(),
        iterations: fit.iterations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An oval on a third of a turn, from which one step does not reach the minimum.
    #[test]
    fn a_fit_without_a_minimum_tells_how_far_it_got() {
        let points: Vec<Point> = (0..24)
            .map(|i| {
                let angle = f64::from(i) * 0.09;
                let radius = 20.0 + 0.4 * (2.0 * angle).sin();
                Point::new(5.0 + radius * angle.cos(), radius * angle.sin() - 3.0)
            })
            .collect();
        let best = orthogonal_fit(&points, None).expect("a circle");
        let options = Options {
            max_iterations: 1,
            ..Options::default()
        };
        let stopped = fit_within(&points, None, &options);
        let Err(CircleError::NotConverged {
            reason,
            reached: Some(reached),
        }) = stopped
        else {
            panic!("one step is no fit: {stopped:?}");
        };
        assert!(reason.contains("iteration"), "{reason}");
        assert_eq!(reached.iterations, 1);
        // Kind: limit. From the algebraic fit one step comes within 1 % of the radius.
        let apart = reached.circle.radius / best.circle.radius - 1.0;
        assert!(apart != 0.0 && apart.abs() < 0.01, "{apart}");
        let deviation = |p: &Point| p.distance(reached.circle.centre) - reached.circle.radius;
        let squares: f64 = points.iter().map(|p| deviation(p).powi(2)).sum();
        let rms_um = 1e3 * (squares / points.len() as f64).sqrt();
        // Kind: rounding.
        assert!((reached.residual_rms_um / rms_um - 1.0).abs() < 1e-10);
    }
}
