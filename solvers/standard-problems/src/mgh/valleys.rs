//! Small systems with curved valleys, bad scaling and singular Jacobians.

use std::f64::consts::PI;

use super::{Standard, standard};
use crate::dual::Scalar;

pub(super) fn problems() -> Vec<Standard> {
    vec![
        standard!("01 Rosenbrock", rosenbrock, [-1.2, 1.0], [0.0]),
        standard!(
            "02 Freudenstein-Roth",
            freudenstein_roth,
            [0.5, -2.0],
            [0.0, 48.9842]
        ),
        standard!(
            "03 Powell badly scaled",
            powell_badly_scaled,
            [0.0, 1.0],
            [0.0]
        ),
        standard!(
            "04 Brown badly scaled",
            brown_badly_scaled,
            [1.0, 1.0],
            [0.0]
        ),
        standard!("05 Beale", beale, [1.0, 1.0], [0.0], infinite[0.4520]),
        standard!(
            "06 Jennrich-Sampson",
            jennrich_sampson,
            [0.3, 0.4],
            [124.362],
            infinite[259.58]
        ),
        standard!("07 helical valley", helical_valley, [-1.0, 0.0, 0.0], [0.0]),
        standard!(
            "12 Box",
            box_three,
            [0.0, 10.0, 20.0],
            [0.0],
            infinite[0.07558]
        ),
        standard!(
            "13 Powell singular",
            powell_singular,
            [3.0, -1.0, 0.0, 1.0],
            [0.0]
        ),
        standard!("14 Wood", wood, [-3.0, -1.0, -3.0, -1.0], [0.0]),
        standard!(
            "16 Brown-Dennis",
            brown_dennis,
            [25.0, 5.0, -5.0, -1.0],
            [85822.2]
        ),
        standard!(
            "18 Biggs EXP6",
            biggs,
            [1.0, 2.0, 1.0, 1.0, 1.0, 1.0],
            [0.0, 5.65565e-3],
            infinite[0.306367]
        ),
    ]
}

fn rosenbrock<T: Scalar>(x: &[T]) -> Vec<T> {
    vec![(x[1] - x[0].square()) * 10.0, -x[0] + 1.0]
}

fn freudenstein_roth<T: Scalar>(x: &[T]) -> Vec<T> {
    let y = x[1];
    vec![
        x[0] + ((-y + 5.0) * y - 2.0) * y - 13.0,
        x[0] + ((y + 1.0) * y - 14.0) * y - 29.0,
    ]
}

fn powell_badly_scaled<T: Scalar>(x: &[T]) -> Vec<T> {
    vec![
        x[0] * x[1] * 1e4 - 1.0,
        (-x[0]).exp() + (-x[1]).exp() - 1.0001,
    ]
}

fn brown_badly_scaled<T: Scalar>(x: &[T]) -> Vec<T> {
    vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0]
}

fn beale<T: Scalar>(x: &[T]) -> Vec<T> {
    [1.5, 2.25, 2.625]
        .into_iter()
        .zip(1..)
        .map(|(y, i)| -(x[0] * (-x[1].powi(i) + 1.0)) + y)
        .collect()
}

fn jennrich_sampson<T: Scalar>(x: &[T]) -> Vec<T> {
    (1..=10)
        .map(|i| {
            let i = f64::from(i);
            -((x[0] * i).exp() + (x[1] * i).exp()) + (2.0 + 2.0 * i)
        })
        .collect()
}

fn helical_valley<T: Scalar>(x: &[T]) -> Vec<T> {
    let turn = (x[1] / x[0]).atan() / (2.0 * PI);
    let angle = if x[0].value() > 0.0 { turn } else { turn + 0.5 };
    let radius = (x[0].square() + x[1].square()).sqrt();
    vec![(x[2] - angle * 10.0) * 10.0, (radius - 1.0) * 10.0, x[2]]
}

fn box_three<T: Scalar>(x: &[T]) -> Vec<T> {
    (1..=10)
        .map(|i| {
            let t = 0.1 * f64::from(i);
            let last = (-t).exp() - (-10.0 * t).exp();
            (-x[0] * t).exp() - (-x[1] * t).exp() - x[2] * last
        })
        .collect()
}

fn powell_singular<T: Scalar>(x: &[T]) -> Vec<T> {
    vec![
        x[0] + x[1] * 10.0,
        (x[2] - x[3]) * 5.0_f64.sqrt(),
        (x[1] - x[2] * 2.0).square(),
        (x[0] - x[3]).square() * 10.0_f64.sqrt(),
    ]
}

fn wood<T: Scalar>(x: &[T]) -> Vec<T> {
    vec![
        (x[1] - x[0].square()) * 10.0,
        -x[0] + 1.0,
        (x[3] - x[2].square()) * 90.0_f64.sqrt(),
        -x[2] + 1.0,
        (x[1] + x[3] - 2.0) * 10.0_f64.sqrt(),
        (x[1] - x[3]) / 10.0_f64.sqrt(),
    ]
}

fn brown_dennis<T: Scalar>(x: &[T]) -> Vec<T> {
    (1..=20)
        .map(|i| {
            let t = f64::from(i) / 5.0;
            let first = x[0] + x[1] * t - t.exp();
            let second = x[2] + x[3] * t.sin() - t.cos();
            first.square() + second.square()
        })
        .collect()
}

fn biggs<T: Scalar>(x: &[T]) -> Vec<T> {
    (1..=13)
        .map(|i| {
            let t = 0.1 * f64::from(i);
            let y = (-t).exp() - 5.0 * (-10.0 * t).exp() + 3.0 * (-4.0 * t).exp();
            x[2] * (-x[0] * t).exp() - x[3] * (-x[1] * t).exp() + x[5] * (-x[4] * t).exp() - y
        })
        .collect()
}
