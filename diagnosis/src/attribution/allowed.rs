//! Fits that the readings allow beside the best one: other shapes and other variants of its causes.
//!
//! A covariance describes the neighbourhood of the best fit. Where readings hardly bound a shape (the
//! time constant of a drift that is barely seen), sizes and answers far from the best fit as well, and
//! the interval is that of the profile likelihood: with D the rise of the weighted sum of squares, the
//! union over all shapes of value ± u √(k² − D), each value with the standard uncertainty u that it has
//! at that shape. What is told is the greater of the standard uncertainty by the covariance and
//! a k-th of the interval's longer arm.

use errsep_models::model::{Estimate, Shape};
use nalgebra::DVector;

use crate::attribution::bias::biases;
use crate::attribution::candidates::variants_alike;
use crate::attribution::context::{Cause, Context};
use crate::attribution::reported::Bias;
use crate::attribution::sizes::{Sizes, Unknown};

/// Coverage factor of a 95 % interval of the normal law.
const COVERAGE: f64 = 1.959_963_984_540_054;

/// Steps to either side of a shape's best value, in its standard uncertainties.
const STEPS: [f64; 9] = [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 12.0];

/// One step is at most this part of what a shape parameter may be.
const LONGEST: f64 = 0.1;

/// A shape parameter that is this part of its range from the end stands at the end.
const AT_THE_END: f64 = 1e-3;

/// Another fit.
pub(crate) struct Allowed {
    /// All causes, in the order of the best fit; the shape that differs is held.
    causes: Vec<Cause>,
    /// Which of them differs.
    which: usize,
    /// Whether it is another variant.
    variant: bool,
    /// Rise of the weighted sum of squares.
    rise: f64,
}

impl Allowed {
    /// What is left of the coverage factor.
    fn left(&self) -> f64 {
        (COVERAGE * COVERAGE - self.rise).max(0.0).sqrt()
    }
}

/// The fits that the readings allow, along each free shape parameter and over the variants.
pub(crate) fn allowed_fits(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    sizes: &Sizes,
) -> Vec<Allowed> {
    let least = context.misfit(readings, causes);
    let mut found = Vec::new();
    for which in 0..causes.len() {
        for parameter in 0..causes[which].shape.values.len() {
            for side in [-1.0, 1.0] {
                for shape in along(context, causes, sizes, (which, parameter), side) {
                    let mut other = causes.to_vec();
                    other[which] = context.cause(context.model, other[which].effect, shape);
                    let rise = context.misfit(readings, &other) - least;
                    if rise >= COVERAGE * COVERAGE {
                        break;
                    }
                    found.push(Allowed {
                        causes: other,
                        which,
                        variant: false,
                        rise: rise.max(0.0),
                    });
                }
            }
        }
        for (_, other) in variants_alike(context, readings, causes, which) {
            let rise = context.misfit(readings, &other) - least;
            found.push(Allowed {
                causes: other,
                which,
                variant: true,
                rise: rise.max(0.0),
            });
        }
    }
    found
}

/// Shapes of a cause to one side along a parameter, to the end of what it may be; none where it is
/// not free.
fn along(
    context: &Context<'_>,
    causes: &[Cause],
    sizes: &Sizes,
    (which, parameter): (usize, usize),
    side: f64,
) -> Vec<Shape> {
    let cause = &causes[which];
    let effect = &context.catalogue[cause.effect];
    let Some(range) = effect.shape_parameters().into_iter().nth(parameter) else {
        return Vec::new();
    };
    let place = Unknown::Shape(which, parameter);
    let Some(at) = sizes.parameters.iter().position(|p| *p == place) else {
        return Vec::new();
    };
    let longest = LONGEST * (range.high - range.low);
    let step = sizes.covariance[(at, at)].sqrt();
    let step = if step.is_finite() {
        step.min(longest)
    } else {
        longest
    };
    let value = cause.shape.values[parameter];
    let mut shapes = Vec::new();
    for part in STEPS {
        let mut shape = cause.shape.clone();
        shape.values[parameter] = (value + side * part * step).clamp(range.low, range.high);
        shape.steps[parameter] = 0.0;
        if !effect.allowed(context.model, &shape) {
            break;
        }
        let end = shape.values[parameter] != value + side * part * step;
        shapes.push(shape);
        if end {
            break;
        }
    }
    shapes
}

/// The estimates of a cause with standard uncertainties that hold over all fits of the same variant; a
/// shape parameter at an end of what it may be is not bounded.
pub(crate) fn widened(
    context: &Context<'_>,
    readings: &DVector<f64>,
    causes: &[Cause],
    which: usize,
    mut estimates: Vec<Estimate>,
    others: &[Allowed],
) -> Vec<Estimate> {
    for other in others.iter().filter(|o| o.which == which && !o.variant) {
        let Some(sizes) = Sizes::told(context, readings, &other.causes) else {
            continue;
        };
        let theirs = sizes.of(context, &other.causes, which);
        for (own, their) in estimates.iter_mut().zip(theirs) {
            let difference = apart(own, &their);
            let std = if their.std.is_finite() {
                their.std
            } else {
                0.0
            };
            own.std = own.std.max((difference + std * other.left()) / COVERAGE);
        }
    }
    let cause = &causes[which];
    let count = cause.projected.ncols();
    let ranges = context.catalogue[cause.effect].shape_parameters();
    let shapes = cause.shape.values.iter().zip(ranges);
    for (estimate, (value, range)) in estimates.iter_mut().skip(count).zip(shapes) {
        let near = AT_THE_END * (range.high - range.low);
        if *value < range.low + near || *value > range.high - near {
            estimate.std = f64::NAN;
        }
    }
    estimates
}

/// How far two values are apart; phases by the shorter way round.
fn apart(own: &Estimate, their: &Estimate) -> f64 {
    let difference = (own.value - their.value).abs();
    if own.unit == "deg" {
        difference.min((360.0 - difference).abs())
    } else {
        difference
    }
}

/// Answers with standard uncertainties that hold over all fits, those of other variants among them.
pub(crate) fn answers_widened(
    context: &Context<'_>,
    readings: &DVector<f64>,
    mut answers: Vec<Bias>,
    profiles: &[(String, Vec<f64>, Vec<f64>)],
    others: &[Allowed],
) -> Vec<Bias> {
    for other in others {
        let (theirs, their_profiles) = biases(context, readings, &other.causes);
        let scalars = answers.len() - profiles.len();
        for (k, (own, their)) in answers.iter_mut().zip(&theirs).enumerate() {
            let difference = match k.checked_sub(scalars) {
                None => (own.after - their.after).abs(),
                Some(profile) => distance(&profiles[profile].2, &their_profiles[profile].2),
            };
            let wide = |std: f64| (difference + std * other.left()) / COVERAGE;
            own.after_std = own.after_std.max(wide(their.after_std));
            own.moved_std = own.moved_std.max(wide(their.moved_std));
        }
    }
    answers
}

/// Root mean square of the difference of two profiles.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len().max(1) as f64).sqrt()
}
