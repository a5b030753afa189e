//! The slide runs on another line forward than backward.
//!
//! It leans to the other side of its guide when it turns round: towards the indicator as the slide's
//! form is (the sign of M), with the sign of the direction of travel. The two lines are parallel, or
//! askew, or each has a form of its own; or the slide leans over some way after it has turned round.
//! Where the tilts outweigh the slopes of the forms, a play of the indicators (`hysteresis`) looks the
//! same. Free: the shift at mid travel and the turn; the form of the difference; the way to lean over.

use nalgebra::DMatrix;

use super::{FirstOrder, part_of_travel, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape, each};

/// See the head of the file. Variants: askew lines, [`FORMS`], [`LEANING`].
pub(super) struct LateralBacklash;

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
        let names: &[&'static str] = match shape.variant {
            LEANING => &["step", "step-at-turn"],
            0 => &["step", "step-of-turn"],
            _ => &["step", "step-of-turn", "step-of-form"],
        };
        let name = |k: usize| names[k.min(names.len() - 1)];
        let size = |k| Parameter::symmetric(name(k), "um", 100.0);
        (0..terms(shape)).map(size).collect()
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("log-way", "ln mm", -5.0, 12.0)]
    }

    fn relatives(&self, model: &FirstOrder, shape: &Shape) -> Vec<Shape> {
        let plain = |variant: usize| Shape::variant(variant);
        let leaning = |part: f64| Shape {
            variant: LEANING,
            values: vec![(part * model.travel()).ln()],
            steps: vec![0.3],
        };
        match shape.variant {
            0 => FORMS.map(plain).chain([0.05, 0.2].map(leaning)).collect(),
            LEANING => vec![plain(0)],
            _ => vec![plain(0), leaning(0.1)],
        }
    }

    fn columns(&self, model: &FirstOrder, shape: &Shape) -> Vec<Column> {
        let with = |along: &(dyn Fn(f64, f64) -> f64 + Sync)| {
            Column::from_places(model.places(), |_, place| {
                let sign = model.channel(place).indicator_sign() * place.direction;
                let part = part_of_travel(model, place.x);
                0.5 * sign * along(part, place.direction)
            })
        };
        if let (LEANING, Some(log_way)) = (shape.variant, shape.values.first()) {
            let way = 2.0 * log_way.exp() / model.travel();
            let since = |part: f64, direction: f64| (1.0 + direction * part).max(0.0);
            let gone = |part: f64, direction: f64| (-since(part, direction) / way).exp();
            return vec![with(&|_, _| 1.0), with(&gone)];
        }
        (0..terms(shape))
            .map(|k| with(&|part, _| legendre(k, part)))
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
        let mut told = each(
            parameters.chain(self.shape_parameters()),
            values,
            covariance,
        );
        if FORMS.contains(&shape.variant) {
            told.truncate(2);
            let weight = |k: usize| 1.0 / (2.0 * k as f64 + 1.0);
            let form = amplitudes.iter().enumerate().skip(2);
            let variance = |k: usize| covariance.get((k, k)).copied().unwrap_or(f64::NAN);
            let own = |(k, a): (usize, &f64)| (a * a - variance(k)) * weight(k);
            let square: f64 = form.clone().map(own).sum();
            let size = square.max(0.0).sqrt().max(f64::MIN_POSITIVE);
            let along: Vec<(usize, f64)> = form.map(|(k, a)| (k, a * weight(k) / size)).collect();
            told.push(Estimate {
                name: "rms-of-form".to_owned(),
                value: size,
                std: spread(covariance, &along),
                unit: "um".to_owned(),
            });
        }
        told
    }

    fn variant_name(&self, _model: &FirstOrder, shape: &Shape) -> Option<String> {
        match shape.variant {
            0 => None,
            LEANING => Some(LEANS.to_owned()),
            _ => Some(OWN_FORMS.to_owned()),
        }
    }
}

fn terms(shape: &Shape) -> usize {
    TERMS.get(shape.variant).copied().unwrap_or(2)
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
