//! Classical discrete ill-posed problems, from their published integral equations.
//!
//! Each is a Fredholm or Volterra equation of the first kind ∫K(s,t)f(t)dt = g(s), discretised by
//! the midpoint rule with n points a side (Hansen's own collection uses Galerkin rules for some, so
//! entries differ from his by the discretisation error). The right-hand side is A·x, free of
//! discretisation error, so that the error of a solution is the method's alone.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

/// A discrete ill-posed problem with its exact solution and data.
#[derive(Debug, Clone)]
pub struct TestProblem {
    /// Its name in the literature.
    pub name: &'static str,
    /// A, n × n.
    pub matrix: DMatrix<f64>,
    /// The exact solution x.
    pub solution: DVector<f64>,
    /// A·x.
    pub data: DVector<f64>,
}

/// All six, with n unknowns each.
pub fn all(n: usize) -> Vec<TestProblem> {
    vec![
        shaw(n),
        phillips(n),
        deriv2(n),
        baart(n),
        heat(n),
        gravity(n),
    ]
}

/// One-dimensional image restoration (Shaw 1972): diffraction at a slit, s and t on [−π/2, π/2].
pub fn shaw(n: usize) -> TestProblem {
    let kernel = |s: f64, t: f64| {
        let u = PI * (s.sin() + t.sin());
        let sinc = if u.abs() < 1e-12 { 1.0 } else { u.sin() / u };
        ((s.cos() + t.cos()) * sinc).powi(2)
    };
    let truth = |t: f64| 2.0 * (-6.0 * (t - 0.8).powi(2)).exp() + (-2.0 * (t + 0.5).powi(2)).exp();
    let side = (-PI / 2.0, PI / 2.0);
    discretise("shaw", n, side, side, kernel, truth)
}

/// Phillips' problem (1962): f and K both φ(x) = 1 + cos(πx/3) on |x| < 3, s and t on [−6, 6].
pub fn phillips(n: usize) -> TestProblem {
    let phi = |x: f64| {
        if x.abs() < 3.0 {
            1.0 + (PI * x / 3.0).cos()
        } else {
            0.0
        }
    };
    let side = (-6.0, 6.0);
    discretise("phillips", n, side, side, move |s, t| phi(s - t), phi)
}

/// The second derivative: K is Green's function on [0, 1], f(t) = t.
pub fn deriv2(n: usize) -> TestProblem {
    let kernel = |s: f64, t: f64| if s < t { s * (t - 1.0) } else { t * (s - 1.0) };
    discretise("deriv2", n, (0.0, 1.0), (0.0, 1.0), kernel, |t| t)
}

/// Baart's problem (1982): K = exp(s cos t), s on [0, π/2], t on [0, π], f(t) = sin t.
pub fn baart(n: usize) -> TestProblem {
    let kernel = |s: f64, t: f64| (s * t.cos()).exp();
    discretise("baart", n, (0.0, PI / 2.0), (0.0, PI), kernel, f64::sin)
}

/// The inverse heat equation (Carasso 1982, Eldén 1995), κ = 1, a Volterra kernel on [0, 1].
pub fn heat(n: usize) -> TestProblem {
    let impulse = |t: f64| {
        if t > 0.0 {
            t.powf(-1.5) / (2.0 * PI.sqrt()) * (-1.0 / (4.0 * t)).exp()
        } else {
            0.0
        }
    };
    let truth = |t: f64| {
        let u = 20.0 * t;
        if t > 0.5 {
            0.0
        } else if u < 2.0 {
            0.75 * u * u / 4.0
        } else if u < 3.0 {
            0.75 + (u - 2.0) * (3.0 - u)
        } else {
            0.75 * (-2.0 * (u - 3.0)).exp()
        }
    };
    // The receiving points lie at the cells' ends, half a cell after the sources' midpoints.
    let half = 0.5 / n as f64;
    let kernel = move |s: f64, t: f64| impulse(s + half - t);
    discretise("heat", n, (0.0, 1.0), (0.0, 1.0), kernel, truth)
}

/// Gravity surveying (Wing and Zahrt 1991): a mass distribution at depth d = 0.25.
pub fn gravity(n: usize) -> TestProblem {
    const DEPTH: f64 = 0.25;
    let kernel = |s: f64, t: f64| DEPTH * (DEPTH * DEPTH + (s - t).powi(2)).powf(-1.5);
    let truth = |t: f64| (PI * t).sin() + 0.5 * (2.0 * PI * t).sin();
    discretise("gravity", n, (0.0, 1.0), (0.0, 1.0), kernel, truth)
}

fn discretise(
    name: &'static str,
    n: usize,
    (s_from, s_to): (f64, f64),
    (t_from, t_to): (f64, f64),
    kernel: impl Fn(f64, f64) -> f64,
    truth: impl Fn(f64) -> f64,
) -> TestProblem {
    let midpoint =
        |from: f64, to: f64, index: usize| from + (to - from) * (index as f64 + 0.5) / n as f64;
    let weight = (t_to - t_from) / n as f64;
    let matrix = DMatrix::from_fn(n, n, |row, column| {
        weight * kernel(midpoint(s_from, s_to, row), midpoint(t_from, t_to, column))
    });
    let solution = DVector::from_fn(n, |index, _| truth(midpoint(t_from, t_to, index)));
    let data = &matrix * &solution;
    TestProblem {
        name,
        matrix,
        solution,
        data,
    }
}
