//! The laws that are put in, by formulas of their own.

use std::f64::consts::TAU;

/// What a law may ask of a reading: position and time over their ranges (0 to 1), the reading over half its range
/// about zero, the direction, the channel.
pub struct At {
    pub x: f64,
    pub t: f64,
    pub r: f64,
    pub d: f64,
    pub c: usize,
}

/// Classes and coordinates of the terms that are right, the law with four parameters of chance in 0 to 1, and the
/// parameter by which its uncertainty is judged: its name in the answer and the truth over the coordinate's range.
pub type Listed = (
    &'static [(&'static str, &'static str)],
    fn(&At, &[f64; 4]) -> f64,
    Option<(&'static str, fn(&[f64; 4]) -> f64)>,
);

fn one(a: &At, channel: usize) -> f64 {
    f64::from(u8::from(a.c == channel))
}

fn from(value: f64, place: f64) -> f64 {
    f64::from(u8::from(value >= place))
}

pub const REVERSAL: [Listed; 14] = [
    (
        &[("power 2", "position")],
        |a, _| one(a, 0) * a.x * a.x,
        None,
    ),
    (
        &[("power 3", "position")],
        |a, _| one(a, 3) * (a.x - 0.5).powi(3),
        None,
    ),
    (
        &[("absolute value", "position")],
        |a, p| one(a, 1) * (a.x - 0.25 - 0.5 * p[0]).abs(),
        Some(("origin", |p| 0.25 + 0.5 * p[0])),
    ),
    (
        &[("step", "position")],
        |a, p| one(a, 2) * from(a.x, 0.2 + 0.6 * p[0]),
        None,
    ),
    (
        &[("cosine", "position")],
        |a, p| one(a, 0) * (TAU * a.x * (1.5 + 8.0 * p[0]) + TAU * p[1]).cos(),
        Some(("period", |p| 1.0 / (1.5 + 8.0 * p[0]))),
    ),
    (&[("power 2", "position")], |a, _| a.d * a.x * a.x, None),
    (
        &[("cosine", "position")],
        |a, p| a.d * one(a, 1) * (TAU * a.x * (2.0 + 18.0 * p[0]) + TAU * p[1]).cos(),
        Some(("period", |p| 1.0 / (2.0 + 18.0 * p[0]))),
    ),
    (
        &[("saturating exponential", "time")],
        |a, p| 1.0 - (-a.t / (0.1 + 0.5 * p[0])).exp(),
        Some(("constant", |p| 0.1 + 0.5 * p[0])),
    ),
    (
        &[("growing exponential", "time")],
        |a, p| one(a, 0) * ((a.t / (0.2 + 0.3 * p[0])).exp() - 1.0),
        Some(("constant", |p| 0.2 + 0.3 * p[0])),
    ),
    (
        &[("cosine", "time")],
        |a, p| (TAU * a.t * (1.2 + 4.0 * p[0]) + TAU * p[1]).cos(),
        Some(("period", |p| 1.0 / (1.2 + 4.0 * p[0]))),
    ),
    (
        &[("step", "time")],
        |a, p| one(a, 1) * from(a.t, 0.1 + 0.3 * p[0]),
        None,
    ),
    (&[("power 2", "time")], |a, _| a.t * a.t, None),
    (
        &[("cosine", "time"), ("power 2", "position")],
        |a, p| 4.0 * one(a, 0) * a.x * a.x + (TAU * a.t * (1.2 + 3.0 * p[0]) + TAU * p[1]).cos(),
        Some(("period", |p| 1.0 / (1.2 + 3.0 * p[0]))),
    ),
    (
        &[("constant", ""), ("step", "time")],
        |a, p| 0.5 * a.d + one(a, 2) * from(a.t, 0.6 + 0.3 * p[0]),
        None,
    ),
];

/// Along the reading: readings are large here beside what the law changes.
pub const READING: [Listed; 3] = [
    (
        &[("power 2", "reading")],
        |a, _| one(a, 0) * a.r * a.r,
        None,
    ),
    (&[("power 3", "reading")], |a, _| a.r.powi(3), None),
    (&[("absolute value", "reading")], |a, _| a.r.abs(), None),
];

pub const LINE: [Listed; 2] = [
    (
        &[("cosine", "position")],
        |a, p| (TAU * a.x * (1.3 + 5.0 * p[0]) + TAU * p[1]).cos(),
        Some(("period", |p| 1.0 / (1.3 + 5.0 * p[0]))),
    ),
    (
        &[("growing exponential", "position")],
        |a, p| (a.x / (0.2 + 0.1 * p[0])).exp() - 1.0,
        Some(("constant", |p| 0.2 + 0.1 * p[0])),
    ),
];

pub const CIRCLE: [Listed; 1] = [(
    &[("step", "time")],
    |a, p| from(a.t, 0.2 + 0.6 * p[0]),
    None,
)];
