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

use super::{Linearised, part_of_travel, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape, each};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: askew lines, [`FORMS`], [`LEANING`], and multiples of [`KINDS`]
/// for the directions: all that channels see, horizontal alone, vertical alone.
pub(super) struct LateralBacklash {
    /// Horizontal (0), vertical (1), as far as channels see them.
    axes: Vec<usize>,
}

/// Number of variants in the same directions.
const KINDS: usize = 6;
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

/// Terms of the difference of both lines by variant: Legendre polynomials, or from [`FINE`] on a line and
/// half waves over the travel.
const TERMS: [usize; 5] = [2, 5, 9, 15, 30];
/// First and last variant of lines with a form of their own.
const FORMS: std::ops::RangeInclusive<usize> = 1..=4;
/// First variant of half waves.
const FINE: usize = 4;
/// Variant of a slide that leans over some way after it has turned round.
const LEANING: usize = 5;

/// The variants in words.
pub(super) const OWN_FORMS: &str = "each direction with a form of its own";
/// See [`OWN_FORMS`].
pub(super) const LEANS: &str = "leaning over after it has turned round";

impl Effect<Linearised> for LateralBacklash {
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

    fn link(&self, _shape: &Shape) -> Link {
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

    /// Askew lines, and lines with a form of their own, which need not be askew at all.
    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        let kinds = [0, FINE - 1].into_iter();
        kinds
            .flat_map(|kind| self.scopes().map(move |s| Shape::variant(KINDS * s + kind)))
            .collect()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let scope = shape.variant - shape.variant % KINDS;
        let plain = |variant: usize| Shape::variant(scope + variant);
        let leaning = |part: f64| Shape {
            variant: scope + LEANING,
            values: vec![(part * model.travel()).ln()],
            steps: vec![0.3],
        };
        let mut others: Vec<Shape> = match shape.variant % KINDS {
            0 => [0.05, 0.2].map(leaning).to_vec(),
            LEANING => vec![plain(0)],
            _ => vec![plain(0), leaning(0.1)],
        };
        // Every term is told by two positions at least.
        let forms = FORMS.filter(|kind| 2 * TERMS[*kind] <= model.positions().len().max(30));
        // From the askew lines all; from a form its neighbours.
        let own = shape.variant % KINDS;
        let near = |kind: &usize| *kind != own && (own == 0 || kind.abs_diff(own) == 1);
        let forms = forms.filter(near);
        others.extend(forms.map(plain));
        let turned = self.scopes().filter(|s| KINDS * s != scope);
        others.extend(turned.map(|s| Shape {
            variant: KINDS * s + shape.variant % KINDS,
            ..shape.clone()
        }));
        others
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
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
        // A term once a position: many readings are at each.
        let positions = model.positions();
        let kind = shape.variant % KINDS;
        let along: Vec<Vec<f64>> = (0..terms(shape))
            .map(|k| {
                let at = |x: &f64| term(kind, k, part_of_travel(model, *x));
                positions.iter().map(at).collect()
            })
            .collect();
        axes.flat_map(|axis| along.iter().map(|along| (*axis, along)))
            .map(|(axis, along)| {
                Column::from_places(model.places(), |_, place| {
                    let sign = model.seat(place).phi[axis] * place.direction;
                    0.5 * sign * along[place.cell % positions.len()]
                })
            })
            .collect()
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let part = |log_way: &f64| log_way.exp() / model.travel();
        shape.values.iter().all(|v| (0.01..1.0).contains(&part(v)))
    }

    /// Of forms the line and the root mean square about it over the travel in place of each term, less
    /// what the noise of the terms adds to its square.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let parameters = self.amplitudes_at(shape);
        let kind = shape.variant % KINDS;
        if !FORMS.contains(&kind) {
            let values = amplitudes.iter().chain(&shape.values);
            let all = parameters.into_iter().chain(self.shape_parameters());
            return each(all, values, covariance);
        }
        let (count, axes) = (terms(shape), self.axes(shape));
        let of = |(own, axis): (usize, &usize)| {
            let first = own * count;
            let own: Vec<f64> = amplitudes[first..first + count].to_vec();
            let within = |weights: Vec<(usize, f64)>| {
                let at = weights.into_iter().map(|(k, w)| (first + k, w));
                spread(covariance, &at.collect::<Vec<_>>())
            };
            let parts: Vec<[f64; 3]> = (0..count).map(|k| moments(kind, k)).collect();
            let along = |which: usize| -> Vec<(usize, f64)> {
                parts.iter().map(|p| p[which]).enumerate().collect()
            };
            let line = [0, 1].map(|which| {
                let parameter = &parameters[first + which];
                Estimate {
                    name: parameter.name.to_string(),
                    value: along(which).iter().map(|(k, w)| w * own[*k]).sum(),
                    std: within(along(which)),
                    unit: parameter.unit.to_owned(),
                }
            });
            // Mean square of the whole, less that of its line.
            let form = (2..count).map(|k| parts[k][2] * own[k] * own[k]);
            let line_of = |which: usize| -> f64 {
                let form = along(which).into_iter().skip(2);
                form.map(|(k, w)| w * own[k]).sum()
            };
            let (step, turn) = (line_of(0), line_of(1));
            let variance = |k: usize| {
                let own = first + k;
                covariance.get((own, own)).copied().unwrap_or(f64::NAN)
            };
            let weight = |k: usize| parts[k][2] - parts[k][0].powi(2) - parts[k][1].powi(2) / 3.0;
            let of_noise: f64 = (2..count).map(|k| weight(k) * variance(k)).sum();
            let square = form.sum::<f64>() - step * step - turn * turn / 3.0 - of_noise;
            let size = square.max(0.0).sqrt();
            let slope =
                |k: usize| parts[k][2] * own[k] - parts[k][0] * step - parts[k][1] * turn / 3.0;
            let rms = Estimate {
                name: match axes.len() {
                    1 => "rms-of-form".to_owned(),
                    _ => format!("{}-rms-of-form", AXES[*axis]),
                },
                value: size,
                // A form within its noise is none, known to that noise.
                std: if size > 0.0 {
                    within((2..count).map(|k| (k, slope(k) / size)).collect())
                } else {
                    of_noise.sqrt()
                },
                unit: "um".to_owned(),
            };
            line.into_iter().chain([rms])
        };
        axes.iter().enumerate().flat_map(of).collect()
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
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

/// A term of the difference at a part of the travel, −1 to 1: 1 and the part itself, then Legendre
/// polynomials or sin(π j u), j from one on, u from 0 to 1.
fn term(kind: usize, k: usize, part: f64) -> f64 {
    if kind < FINE || k < 2 {
        return legendre(k, part);
    }
    (std::f64::consts::FRAC_PI_2 * (k - 1) as f64 * (part + 1.0)).sin()
}

/// Of a term: its constant and its slope by least squares over the travel, and its mean square; of sin(π j u)
/// (1 − (−1)ʲ)/(π j), −3 (1 + (−1)ʲ)/(π j) and a half.
fn moments(kind: usize, k: usize) -> [f64; 3] {
    let unit = |at: usize| if k == at { 1.0 } else { 0.0 };
    if kind < FINE || k < 2 {
        return [unit(0), unit(1), 1.0 / (2.0 * k as f64 + 1.0)];
    }
    let j = (k - 1) as f64;
    let [odd, even] = if k.is_multiple_of(2) {
        [2.0, 0.0]
    } else {
        [0.0, 2.0]
    };
    let way = std::f64::consts::PI * j;
    [odd / way, -3.0 * even / way, 0.5]
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

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{FINE, TERMS};
    use crate::model::{FittedModel, Shape};
    use crate::reversal::diagnosable::{Assumptions, Linearised};
    use crate::reversal::exact_readings::{Scene, SceneNoise};

    /// *Limit*: a form that is no more than its noise is none, known to that noise.
    #[test]
    fn a_form_within_its_noise_is_none() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let scene = Scene::random(60, 2, 1e-5, 2.0, SceneNoise::default(), &mut random);
        let model = Linearised::new(&scene.measured(1), Assumptions::default()).unwrap();
        let effects = model.effects();
        let own = effects.iter().find(|e| e.name() == "lateral-backlash");
        let count = TERMS[FINE - 1];
        let covariance = DMatrix::identity(count, count) * 0.01;
        let told =
            own.unwrap()
                .estimates(&Shape::variant(FINE - 1), &vec![0.0; count], &covariance);
        let form = told.iter().find(|e| e.name == "rms-of-form").unwrap();
        assert_eq!(form.value, 0.0);
        assert!((0.05..0.5).contains(&form.std), "{}", form.std);
    }
}
