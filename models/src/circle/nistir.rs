//! The circle fit of NISTIR 6868, appendix F, step by step and with its flaws, so that figures made
//! with it can be compared.
//!
//! It minimises the algebraic residual (x − a)² + (y − b)² − r² and so ends at the Kåsa fit. What
//! differs from a Levenberg–Marquardt iteration, and is kept: H = JᵀJ omits the second derivatives
//! that (F15) has; a step is never rejected, the damping grows only when Cholesky fails, and Cholesky
//! cannot fail here; the gradient test (F26) depends on the unit of length; the radius may come out
//! negative, because only r² enters.

use super::points::{Circle, CircleError, Point, check_points};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

const FIRST_LAMBDA: f64 = 1e-4;
const LAMBDA_DECREASE: f64 = 0.04;
const PHI: f64 = 0.5;
const MAX_ITERATIONS: usize = 20;
/// Damping increases tried before the matrix is called singular.
const MAX_AUGMENTATIONS: usize = 40;

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NistirEnding {
    /// The relative gradient test, (F26) first line.
    Gradient,
    /// The relative step test, (F26) second line.
    Step,
    /// Twenty iterations without either: the result is not a minimum.
    IterationLimit,
}

/// What the iteration of appendix F returned.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NistirFit {
    /// The circle with |r| as its radius, mm.
    pub circle: Circle,
    /// The radius as iterated, mm; its sign has no meaning.
    pub signed_radius: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Why it stopped.
    pub ending: NistirEnding,
}

/// Appendix F of NISTIR 6868 from a start circle, all lengths in mm.
///
/// # Errors
/// Those of [`check_points`]; [`CircleError::RadiusNotPositive`] for a start with r = 0, which the
/// iteration cannot leave because ∂R/∂r = −2r.
pub fn nistir_fit(points: &[Point], start: Circle) -> Result<NistirFit, CircleError> {
    check_points(points)?;
    if start.radius == 0.0 || !start.radius.is_finite() {
        return Err(CircleError::RadiusNotPositive {
            radius: start.radius,
        });
    }
    let mut p = Vector3::new(start.centre.x, start.centre.y, start.radius);
    let mut previous: Option<Vector3<f64>> = None;
    let mut lambda = FIRST_LAMBDA;
    let mut iterations = 0;
    let ending = loop {
        if iterations >= MAX_ITERATIONS {
            break NistirEnding::IterationLimit;
        }
        if iterations > 0 {
            lambda *= LAMBDA_DECREASE;
        }
        let (f, gradient, hessian) = normal_equations(points, &p);
        if relative_gradient(&gradient, &p, f) <= f64::EPSILON.cbrt() {
            break NistirEnding::Gradient;
        }
        if previous.is_some_and(|old| relative_step(&p, &old) <= f64::EPSILON.powf(2.0 / 3.0)) {
            break NistirEnding::Step;
        }
        let Some(step) = damped_step(&hessian, &gradient, &mut lambda) else {
            return Err(CircleError::NotConverged {
                reason: "the damped normal equations of appendix F stay singular".to_owned(),
                reached: None,
            });
        };
        previous = Some(p);
        p += step;
        iterations += 1;
    };
    Ok(NistirFit {
        circle: Circle {
            centre: Point::new(p[0], p[1]),
            radius: p[2].abs(),
        },
        signed_radius: p[2],
        iterations,
        ending,
    })
}

/// Σ R², (F8); g = JᵀR, (F12); JᵀJ, (F17).
fn normal_equations(points: &[Point], p: &Vector3<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let mut f = 0.0;
    let mut gradient = Vector3::zeros();
    let mut hessian = Matrix3::zeros();
    for q in points {
        let (dx, dy) = (q.x - p[0], q.y - p[1]);
        let residual = dx * dx + dy * dy - p[2] * p[2];
        let row = Vector3::new(-2.0 * dx, -2.0 * dy, -2.0 * p[2]);
        f += residual * residual;
        gradient += row * residual;
        hessian += row * row.transpose();
    }
    (f, gradient, hessian)
}

/// (H + λ D) dp = −g with D = diag H + φ, (F24) and (F25).
fn damped_step(
    hessian: &Matrix3<f64>,
    gradient: &Vector3<f64>,
    lambda: &mut f64,
) -> Option<Vector3<f64>> {
    for attempt in 0..MAX_AUGMENTATIONS {
        if attempt > 0 {
            *lambda *= 10.0;
        }
        let mut augmented = *hessian;
        for i in 0..3 {
            augmented[(i, i)] += *lambda * (hessian[(i, i)] + PHI);
        }
        if let Some(factor) = augmented.cholesky() {
            return Some(factor.solve(&-gradient));
        }
    }
    None
}

fn relative_gradient(gradient: &Vector3<f64>, p: &Vector3<f64>, f: f64) -> f64 {
    (0..3)
        .map(|i| (gradient[i] * p[i].abs().max(1.0) / f.max(1.0)).abs())
        .fold(0.0, f64::max)
}

fn relative_step(p: &Vector3<f64>, old: &Vector3<f64>) -> f64 {
    (0..3)
        .map(|i| ((p[i] - old[i]) / old[i].abs().max(1.0)).abs())
        .fold(0.0, f64::max)
}
