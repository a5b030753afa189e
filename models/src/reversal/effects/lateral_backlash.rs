//! The slide runs on another line forward than backward.
//!
//! It leans to the other side of its guide when it turns round: towards the indicator as the slide's
//! form is (as M_h and M_v are seen), with the sign of the direction of travel. The two lines are parallel, or
//! askew, or each has a form of its own; or the slide leans over some way after it has turned round.
//! Where the tilts outweigh the slopes of the forms, a play of the indicators (`hysteresis`) looks the
//! same. Free: the shift at mid travel and the turn; the form of the difference; the way to lean over;
//! where channels see both, each horizontally and vertically, or one of them alone.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::{FirstOrder, part_of_travel, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape, each};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: askew lines, [`FORMS`], [`LEANING`], and multiples of [`KINDS`]
/// for the directions: all that channels see, horizontal alone, vertical alone.
pub(super) struct LateralBacklash {
    /// Horizontal (0), vertical (1), as far as channels see them.
    axes: Vec<usize>,
}

/// Number of variants in the same directions.
const KINDS: usize = 5;
/// Names of the directions.
const AXES: [&str; 2] = ["horizontal", "vertical"];

impl LateralBacklash {
    pub fn new(channels: &Arrangement) -> Self {
        let sees = |axis: &usize| channels.seats().iter().any(|s| s.phi[*axis] != 0.0);
        Self {
            axes: (0..2).filter(sees).collect(),
        }
    }

    /// The directions of a variant.
    fn axes(&self, shape: &Shape) -> &[usize] {
        match shape.variant / KINDS {
            0 => &self.axes,
            one => &self.axes[one - 1..one],
        }
    }

    /// The directions that can be told, by multiples of [`KINDS`].
    fn scopes(&self) -> std::ops::Range<usize> {
        0..if self.axes.len() > 1 { 3 } else { 1 }
    }
}

/// Terms of the difference of both lines, Legendre polynomials, by variant.
const TERMS: [usize; 4] = [2, 5, 9, 15];
/// First and last variant of lines with a form of their own.
const FORMS: std::ops::RangeInclusive<usize> = 1..=3;
/// Variant of a slide that leans over some way after it has turned round.
const LEANING: usize = 4;

/// The variants in words.
pub(super) const OWN_FORMS: &str = "each direction with a form of its own";
/// See [`OWN_FORMS`].
pub(super) const LEANS: &str = "leaning over after it has turned round";

impl Effect<FirstOrder> for LateralBacklash {
    fn name(&self) -> &str {
        "lateral-backlash"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide runs on another line forward than backward: it leans to the other side of its guide, and may swing",
            confirm: "reverse the axis under an indicator that looks across the travel and read the step",
            source: "ISO 230-1 straightness in both directions; half the difference, with the sign of M",
        }
    }

    fn link(&self) -> Link {
        Link::Slide
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        // The turn is told by what it makes at the ends of the travel.
        let names: &[&'static str] = match shape.variant % KINDS {
            LEANING => &["step", "step-at-turn"],
            0 => &["step", "step-of-turn"],
            _ => &["step", "step-of-turn", "step-of-form"],
        };
        let axes = self.axes(shape);
        let of = |axis: &usize| {
            let name = |k: usize| match (names[k.min(names.len() - 1)], axes.len()) {
                (own, 1) => Cow::Borrowed(own),
                (own, _) => Cow::Owned(format!("{}-{own}", AXES[*axis])),
            };
            let size = move |k| Parameter {
                name: name(k),
                ..Parameter::symmetric("", "um", 100.0)
            };
            (0..terms(shape)).map(size).collect::<Vec<_>>()
        };
        axes.iter().flat_map(of).collect()
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("log-way", "ln mm", -5.0, 12.0)]
    }

    fn grid(&self, _model: &FirstOrder) -> Vec<Shape> {
        self.scopes().map(|s| Shape::variant(KINDS * s)).collect()
    }

    fn relatives(&self, model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let scope = shape.variant - shape.variant % KINDS;
        let plain = |variant: usize| Shape::variant(scope + variant);
        let leaning = |part: f64| Shape {
            variant: scope + LEANING,
            values: vec![(part * model.travel()).ln()],
            steps: vec![0.3],
        };
        let mut others: Vec<Shape> = match shape.variant % KINDS {
            0 => FORMS.map(plain).chain([0.05, 0.2].map(leaning)).collect(),
            LEANING => vec![plain(0)],
            _ => vec![plain(0), leaning(0.1)],
        };
        let turned = self.scopes().filter(|s| KINDS * s != scope);
        others.extend(turned.map(|s| Shape {
            variant: KINDS * s + shape.variant % KINDS,
            ..shape.clone()
        }));
        others
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let with = |axis: usize, along: &(dyn Fn(f64, f64) -> f64 + Sync)| {
            Column::from_places(model.places(), |_, place| {
                let sign = model.seat(place).phi[axis] * place.direction;
                let part = part_of_travel(model, place.x);
                0.5 * sign * along(part, place.direction)
            })
        };
        let axes = self.axes(shape).iter();
        if let (LEANING, Some(log_way)) = (shape.variant % KINDS, shape.values.first()) {
            let way = 2.0 * log_way.exp() / model.travel();
            let since = |part: f64, direction: f64| (1.0 + direction * part).max(0.0);
            let gone = |part: f64, direction: f64| (-since(part, direction) / way).exp();
            let of = |axis: &usize| [with(*axis, &|_, _| 1.0), with(*axis, &gone)];
            return axes.flat_map(of).collect();
        }
        axes.flat_map(|axis| (0..terms(shape)).map(|k| (*axis, k)))
            .map(|(axis, k)| with(axis, &|part, _| legendre(k, part)))
            .collect()
    }

    fn allowed(&self, model: &FirstOrder, shape: &Shape) -> bool {
        let part = |log_way: &f64| log_way.exp() / model.travel();
        shape.values.iter().all(|v| (0.01..1.0).contains(&part(v)))
    }

    /// Of forms their root mean square over the travel in place of each term, the mean of Pₖ² being
    /// 1/(2k + 1), less what the noise of the terms adds to its square.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let parameters = self.amplitudes_at(shape).into_iter();
        let values = amplitudes.iter().chain(&shape.values);
        let told = each(
            parameters.chain(self.shape_parameters()),
            values,
            covariance,
        );
        if !FORMS.contains(&(shape.variant % KINDS)) {
            return told;
        }
        let (count, axes) = (terms(shape), self.axes(shape));
        let of = |(own, axis): (usize, &usize)| {
            let first = own * count;
            let weight = |k: usize| 1.0 / (2.0 * (k - first) as f64 + 1.0);
            let form = amplitudes
                .iter()
                .enumerate()
                .take(first + count)
                .skip(first + 2);
            let variance = |k: usize| covariance.get((k, k)).copied().unwrap_or(f64::NAN);
            let own = |(k, a): (usize, &f64)| (a * a - variance(k)) * weight(k);
            let square: f64 = form.clone().map(own).sum();
            let size = square.max(0.0).sqrt().max(f64::MIN_POSITIVE);
            let along: Vec<(usize, f64)> = form.map(|(k, a)| (k, a * weight(k) / size)).collect();
            let rms = Estimate {
                name: match axes.len() {
                    1 => "rms-of-form".to_owned(),
                    _ => format!("{}-rms-of-form", AXES[*axis]),
                },
                value: size,
                std: spread(covariance, &along),
                unit: "um".to_owned(),
            };
            let line = told.iter().skip(first).take(2).cloned();
            line.chain([rms]).collect::<Vec<_>>()
        };
        axes.iter().enumerate().flat_map(of).collect()
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        let kind = match shape.variant % KINDS {
            0 => None,
            LEANING => Some(LEANS),
            _ => Some(OWN_FORMS),
        };
        let along = match self.axes(shape) {
            [axis] if self.axes.len() > 1 => Some(AXES[*axis]),
            _ => None,
        };
        let words: Vec<&str> = kind.into_iter().chain(along).collect();
        (!words.is_empty()).then(|| words.join(", "))
    }
}

fn terms(shape: &Shape) -> usize {
    TERMS.get(shape.variant % KINDS).copied().unwrap_or(2)
}

/// Legendre polynomial of a degree, by its recurrence (Abramowitz and Stegun 8.5.3).
fn legendre(degree: usize, t: f64) -> f64 {
    let (mut before, mut here) = (0.0, 1.0);
    for k in 0..degree {
        let n = k as f64;
        (before, here) = (here, ((2.0 * n + 1.0) * t * here - n * before) / (n + 1.0));
    }
    here
}
