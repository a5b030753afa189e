//! Problems of any size, at the sizes whose minima are published.

use super::{Standard, standard};
use crate::dual::Scalar;

pub(super) fn problems() -> Vec<Standard> {
    let trigonometric_start = [0.1; 10];
    vec![
        standard!("20 Watson (6)", watson, [0.0; 6], [2.28767e-3]),
        standard!("20 Watson (9)", watson, [0.0; 9], [1.39976e-6]),
        standard!("20 Watson (12)", watson, [0.0; 12], [4.72238e-10]),
        standard!(
            "23 penalty I (4)",
            penalty_one,
            [1.0, 2.0, 3.0, 4.0],
            [2.24997e-5]
        ),
        standard!("24 penalty II (4)", penalty_two, [0.5; 4], [9.37629e-6]),
        standard!(
            "25 variably dimensioned (10)",
            variably_dimensioned,
            even_start(),
            [0.0]
        ),
        standard!(
            "26 trigonometric (10)",
            trigonometric,
            trigonometric_start,
            [0.0, 2.79506e-5]
        ),
        standard!(
            "27 Brown almost linear (10)",
            brown_almost_linear,
            [0.5; 10],
            [0.0, 1.0]
        ),
        standard!(
            "28 discrete boundary value (10)",
            boundary_value,
            boundary_start(),
            [0.0]
        ),
        standard!(
            "30 Broyden tridiagonal (10)",
            broyden_tridiagonal,
            [-1.0; 10],
            [0.0]
        ),
        standard!("32 linear, full rank (5)", linear_full, [1.0; 5], [5.0]),
        // m (m − 1) / (2 (2m + 1)) at m = 10.
        standard!(
            "33 linear, rank one (5)",
            linear_one,
            [1.0; 5],
            [90.0 / 42.0]
        ),
        // (m² + 3m − 6) / (2 (2m − 3)) at m = 10.
        standard!(
            "34 linear, rank one, zeros (5)",
            linear_zeros,
            [1.0; 5],
            [124.0 / 34.0]
        ),
        standard!(
            "35 Chebyquad (8)",
            chebyquad,
            chebyquad_start(),
            [3.51687e-3]
        ),
    ]
}

fn even_start() -> [f64; 10] {
    std::array::from_fn(|j| 1.0 - (j + 1) as f64 / 10.0)
}

fn boundary_start() -> [f64; 10] {
    std::array::from_fn(|j| {
        let t = (j + 1) as f64 / 11.0;
        t * (t - 1.0)
    })
}

fn chebyquad_start() -> [f64; 8] {
    std::array::from_fn(|j| (j + 1) as f64 / 9.0)
}

fn sum<T: Scalar>(terms: impl Iterator<Item = T>) -> T {
    terms.fold(T::constant(0.0), |total, term| total + term)
}

fn watson<T: Scalar>(x: &[T]) -> Vec<T> {
    let mut residuals: Vec<T> = (1..=29)
        .map(|i| {
            let t = f64::from(i) / 29.0;
            let slope = sum((1..x.len()).map(|j| x[j] * (j as f64 * t.powi(j as i32 - 1))));
            let value = sum((0..x.len()).map(|j| x[j] * t.powi(j as i32)));
            slope - value.square() - 1.0
        })
        .collect();
    residuals.push(x[0]);
    residuals.push(x[1] - x[0].square() - 1.0);
    residuals
}

fn penalty_one<T: Scalar>(x: &[T]) -> Vec<T> {
    let small = 1e-5_f64.sqrt();
    let mut residuals: Vec<T> = x.iter().map(|&v| (v - 1.0) * small).collect();
    residuals.push(sum(x.iter().map(|v| v.square())) - 0.25);
    residuals
}

fn penalty_two<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len();
    let small = 1e-5_f64.sqrt();
    let mut residuals = vec![x[0] - 0.2];
    for i in 1..n {
        let y = ((i + 1) as f64 / 10.0).exp() + (i as f64 / 10.0).exp();
        residuals.push(((x[i] / 10.0).exp() + (x[i - 1] / 10.0).exp() - y) * small);
    }
    for &v in &x[1..] {
        residuals.push(((v / 10.0).exp() - (-0.1_f64).exp()) * small);
    }
    residuals.push(sum((0..n).map(|j| x[j].square() * (n - j) as f64)) - 1.0);
    residuals
}

fn variably_dimensioned<T: Scalar>(x: &[T]) -> Vec<T> {
    let moment = sum(x.iter().zip(1..).map(|(&v, j)| (v - 1.0) * f64::from(j)));
    let mut residuals: Vec<T> = x.iter().map(|&v| v - 1.0).collect();
    residuals.push(moment);
    residuals.push(moment.square());
    residuals
}

fn trigonometric<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len() as f64;
    let cosines = sum(x.iter().map(|v| v.cos()));
    x.iter()
        .zip(1..)
        .map(|(&v, i)| -cosines + (-v.cos() + 1.0) * f64::from(i) - v.sin() + n)
        .collect()
}

fn brown_almost_linear<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len();
    let total = sum(x.iter().copied());
    let mut residuals: Vec<T> = x[..n - 1]
        .iter()
        .map(|&v| v + total - (n + 1) as f64)
        .collect();
    let product = x.iter().fold(T::constant(1.0), |p, &v| p * v);
    residuals.push(product - 1.0);
    residuals
}

fn boundary_value<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len();
    let h = 1.0 / (n + 1) as f64;
    (0..n)
        .map(|i| {
            let t = (i + 1) as f64 * h;
            let left = if i > 0 { x[i - 1] } else { T::constant(0.0) };
            let right = if i + 1 < n {
                x[i + 1]
            } else {
                T::constant(0.0)
            };
            x[i] * 2.0 - left - right + (x[i] + (t + 1.0)).powi(3) * (h * h / 2.0)
        })
        .collect()
}

fn broyden_tridiagonal<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len();
    (0..n)
        .map(|i| {
            let left = if i > 0 { x[i - 1] } else { T::constant(0.0) };
            let right = if i + 1 < n {
                x[i + 1]
            } else {
                T::constant(0.0)
            };
            (-(x[i] * 2.0) + 3.0) * x[i] - left - right * 2.0 + 1.0
        })
        .collect()
}

/// Rows of the linear problems, m.
const LINEAR_ROWS: usize = 10;

fn linear_full<T: Scalar>(x: &[T]) -> Vec<T> {
    let mean = sum(x.iter().copied()) * (2.0 / LINEAR_ROWS as f64);
    (0..LINEAR_ROWS)
        .map(|i| {
            let rest = -mean - 1.0;
            if i < x.len() { rest + x[i] } else { rest }
        })
        .collect()
}

fn linear_one<T: Scalar>(x: &[T]) -> Vec<T> {
    let moment = sum(x.iter().zip(1..).map(|(&v, j)| v * f64::from(j)));
    (1..=LINEAR_ROWS).map(|i| moment * i as f64 - 1.0).collect()
}

fn linear_zeros<T: Scalar>(x: &[T]) -> Vec<T> {
    let last = x.len() - 1;
    let moment = sum(x[1..last].iter().zip(2..).map(|(&v, j)| v * f64::from(j)));
    (1..=LINEAR_ROWS)
        .map(|i| {
            if i == 1 || i == LINEAR_ROWS {
                T::constant(-1.0)
            } else {
                moment * (i - 1) as f64 - 1.0
            }
        })
        .collect()
}

fn chebyquad<T: Scalar>(x: &[T]) -> Vec<T> {
    let n = x.len();
    // Shifted Chebyshev polynomials by their recurrence.
    let mut before = vec![T::constant(1.0); n];
    let mut now: Vec<T> = x.iter().map(|&v| v * 2.0 - 1.0).collect();
    (1..=n)
        .map(|i| {
            let mean = sum(now.iter().copied()) / n as f64;
            let integral = if i % 2 == 0 {
                -1.0 / ((i * i - 1) as f64)
            } else {
                0.0
            };
            let next: Vec<T> = (0..n)
                .map(|j| (x[j] * 2.0 - 1.0) * 2.0 * now[j] - before[j])
                .collect();
            before = std::mem::replace(&mut now, next);
            mean - integral
        })
        .collect()
}
