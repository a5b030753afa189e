//! Curves fitted to readings.

use super::{Standard, standard};
use crate::dual::Scalar;

pub(super) fn problems() -> Vec<Standard> {
    vec![
        standard!(
            "08 Bard",
            bard,
            [1.0, 1.0, 1.0],
            [8.21487e-3],
            infinite[17.4286]
        ),
        standard!("09 Gaussian", gaussian, [0.4, 1.0, 0.0], [1.12793e-8]),
        standard!("10 Meyer", meyer, [0.02, 4000.0, 250.0], [87.9458]),
        standard!("11 Gulf", gulf, [5.0, 2.5, 0.15], [0.0], infinite [0.038, 6.6]),
        standard!(
            "15 Kowalik-Osborne",
            kowalik_osborne,
            [0.25, 0.39, 0.415, 0.39],
            [3.07505e-4],
            infinite[1.02734e-3]
        ),
        standard!(
            "17 Osborne 1",
            osborne_one,
            [0.5, 1.5, -1.0, 0.01, 0.02],
            [5.46489e-5]
        ),
        standard!(
            "19 Osborne 2",
            osborne_two,
            [1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
            [4.01377e-2]
        ),
    ]
}

fn bard<T: Scalar>(x: &[T]) -> Vec<T> {
    const Y: [f64; 15] = [
        0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39,
    ];
    Y.iter()
        .zip(1..)
        .map(|(&y, i)| {
            let u = f64::from(i);
            let v = 16.0 - u;
            let w = u.min(v);
            -(x[0] + (x[1] * v + x[2] * w).powi(-1) * u) + y
        })
        .collect()
}

fn gaussian<T: Scalar>(x: &[T]) -> Vec<T> {
    const HALF: [f64; 8] = [
        0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989,
    ];
    (1..=15)
        .map(|i: usize| {
            let y = HALF[(i - 1).min(15 - i)];
            let t = (8.0 - i as f64) / 2.0;
            x[0] * (x[1] * (-x[2] + t).square() * -0.5).exp() - y
        })
        .collect()
}

fn meyer<T: Scalar>(x: &[T]) -> Vec<T> {
    const Y: [f64; 16] = [
        34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0,
        6005.0, 5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
    ];
    Y.iter()
        .zip(1..)
        .map(|(&y, i)| x[0] * (x[1] / (x[2] + (45.0 + 5.0 * f64::from(i)))).exp() - y)
        .collect()
}

fn gulf<T: Scalar>(x: &[T]) -> Vec<T> {
    (1..=99)
        .map(|i| {
            let t = f64::from(i) / 100.0;
            let y = 25.0 + (-50.0 * t.ln()).powf(2.0 / 3.0);
            let distance = (-x[1] + y).abs();
            (-((distance.ln() * x[2]).exp() / x[0])).exp() - t
        })
        .collect()
}

fn kowalik_osborne<T: Scalar>(x: &[T]) -> Vec<T> {
    const Y: [f64; 11] = [
        0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246,
    ];
    const U: [f64; 11] = [
        4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625,
    ];
    Y.iter()
        .zip(U)
        .map(|(&y, u)| {
            let square = u * u;
            -(x[0] * (x[1] * u + square) / (x[2] * u + square + x[3])) + y
        })
        .collect()
}

fn osborne_one<T: Scalar>(x: &[T]) -> Vec<T> {
    const Y: [f64; 33] = [
        0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.850, 0.818, 0.784, 0.751, 0.718, 0.685,
        0.658, 0.628, 0.603, 0.580, 0.558, 0.538, 0.522, 0.506, 0.490, 0.478, 0.467, 0.457, 0.448,
        0.438, 0.431, 0.424, 0.420, 0.414, 0.411, 0.406,
    ];
    Y.iter()
        .zip(0..)
        .map(|(&y, i)| {
            let t = 10.0 * f64::from(i);
            -(x[0] + x[1] * (-x[3] * t).exp() + x[2] * (-x[4] * t).exp()) + y
        })
        .collect()
}

fn osborne_two<T: Scalar>(x: &[T]) -> Vec<T> {
    const Y: [f64; 65] = [
        1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608,
        0.655, 0.616, 0.606, 0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661,
        0.612, 0.558, 0.533, 0.495, 0.500, 0.423, 0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428,
        0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668, 0.645, 0.632, 0.591, 0.559,
        0.597, 0.625, 0.739, 0.710, 0.729, 0.720, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098, 0.054,
    ];
    Y.iter()
        .zip(0..)
        .map(|(&y, i)| {
            let t = f64::from(i) / 10.0;
            let bell =
                |height: T, width: T, centre: T| height * (-((-centre + t).square() * width)).exp();
            -(x[0] * (-x[4] * t).exp()
                + bell(x[1], x[5], x[8])
                + bell(x[2], x[6], x[9])
                + bell(x[3], x[7], x[10]))
                + y
        })
        .collect()
}
