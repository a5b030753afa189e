//! The 27 models, each as its data file states it.

use std::f64::consts::{PI, TAU};

use super::{Duals, Values, polynomial};
use crate::dual::{Dual, Scalar};

/// The data sets in NIST's order of difficulty: lower, average, higher.
pub const NAMES: [&str; 27] = [
    "Misra1a", "Chwirut2", "Chwirut1", "Lanczos3", "Gauss1", "Gauss2", "DanWood", "Misra1b",
    "Kirby2", "Hahn1", "Nelson", "MGH17", "Lanczos1", "Lanczos2", "Gauss3", "Misra1c", "Misra1d",
    "Roszman1", "ENSO", "MGH09", "Thurber", "BoxBOD", "Rat42", "MGH10", "Eckerle4", "Rat43",
    "Bennett5",
];

/// The model of a data set, over plain and over dual numbers.
pub fn model(name: &str) -> Option<(Values, Duals)> {
    macro_rules! both {
        ($model:ident) => {
            ($model::<f64> as Values, $model::<Dual> as Duals)
        };
    }
    Some(match name {
        "Misra1a" | "BoxBOD" => both!(saturation),
        "Misra1b" => both!(misra1b),
        "Misra1c" => both!(misra1c),
        "Misra1d" => both!(misra1d),
        "Chwirut1" | "Chwirut2" => both!(chwirut),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => both!(lanczos),
        "Gauss1" | "Gauss2" | "Gauss3" => both!(gauss),
        "DanWood" => both!(dan_wood),
        "Kirby2" => both!(kirby2),
        "Hahn1" | "Thurber" => both!(cubic_ratio),
        "Nelson" => both!(nelson),
        "MGH09" => both!(kowalik_osborne),
        "MGH10" => both!(meyer),
        "MGH17" => both!(osborne),
        "Roszman1" => both!(roszman),
        "ENSO" => both!(enso),
        "Rat42" => both!(rat42),
        "Rat43" => both!(rat43),
        "Eckerle4" => both!(eckerle),
        "Bennett5" => both!(bennett),
        _ => return None,
    })
}

fn saturation<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-(-b[1] * x[0]).exp() + 1.0)
}

fn misra1b<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-(b[1] * x[0] / 2.0 + 1.0).powi(-2) + 1.0)
}

fn misra1c<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-(b[1] * (2.0 * x[0]) + 1.0).sqrt().powi(-1) + 1.0)
}

fn misra1d<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let bx = b[1] * x[0];
    b[0] * bx / (bx + 1.0)
}

fn chwirut<T: Scalar>(b: &[T], x: &[f64]) -> T {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

fn lanczos<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-b[1] * x[0]).exp() + b[2] * (-b[3] * x[0]).exp() + b[4] * (-b[5] * x[0]).exp()
}

fn bell<T: Scalar>(x: f64, centre: T, width: T) -> T {
    let z = (-centre + x) / width;
    (-(z * z)).exp()
}

fn gauss<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-b[1] * x[0]).exp() + b[2] * bell(x[0], b[3], b[4]) + b[5] * bell(x[0], b[6], b[7])
}

fn dan_wood<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (b[1] * x[0].ln()).exp()
}

fn kirby2<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let below = [T::constant(1.0), b[3], b[4]];
    polynomial(&b[..3], x[0]) / polynomial(&below, x[0])
}

fn cubic_ratio<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let below = [T::constant(1.0), b[4], b[5], b[6]];
    polynomial(&b[..4], x[0]) / polynomial(&below, x[0])
}

/// Predicts the logarithm of the response.
fn nelson<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()
}

fn kowalik_osborne<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let square = x[0] * x[0];
    b[0] * (b[1] * x[0] + square) / (b[2] * x[0] + square + b[3])
}

fn meyer<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (b[1] / (b[2] + x[0])).exp()
}

fn osborne<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()
}

fn roszman<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / PI
}

fn enso<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let year = TAU * x[0] / 12.0;
    let (first, second) = (b[3].powi(-1) * (TAU * x[0]), b[6].powi(-1) * (TAU * x[0]));
    b[0] + b[1] * year.cos()
        + b[2] * year.sin()
        + b[4] * first.cos()
        + b[5] * first.sin()
        + b[7] * second.cos()
        + b[8] * second.sin()
}

fn rat42<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0)
}

fn rat43<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-((b[1] - b[2] * x[0]).exp() + 1.0).ln() / b[3]).exp()
}

fn eckerle<T: Scalar>(b: &[T], x: &[f64]) -> T {
    let z = (-b[2] + x[0]) / b[1];
    b[0] / b[1] * (z * z * -0.5).exp()
}

fn bennett<T: Scalar>(b: &[T], x: &[f64]) -> T {
    b[0] * (-(b[1] + x[0]).ln() / b[2]).exp()
}
