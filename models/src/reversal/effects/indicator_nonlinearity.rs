//! An indicator's reading is not proportional to its displacement.
//!
//! The calibration curve bends about the indicator's zero: quadratic (a lever at an angle), cubic
//! (a transducer near the end of its range) or both, as the deviation at the greatest reading of all.
//! One of the indicators is curved, or both, each by its own amount. A gain alone is `gain-mismatch`.
//! Where the zero was set by the display and not by the plunger, a channel is read about some other point of the curve: of a
//! quadratic one that is a gain of its own in each channel beside the curvature, for one indicator.
//! Free: a deviation for each indicator and power; a gain for each channel.

use std::borrow::Cow;

use super::Linearised;
use super::indicators::{ALL, Indicators};
use crate::model::{About, Column, Effect, FittedModel, Link, Parameter, Shape};
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: the indicators, quadratic, beyond the scopes cubic, beyond
/// twice as many both, beyond three times as many quadratic about another point in each channel.
pub(super) struct IndicatorNonlinearity {
    indicators: Indicators,
    /// By indicator, the channels that it reads: place and name.
    channels: Vec<Vec<(usize, String)>>,
}

/// Powers of the reading, by the kind of a variant.
const KINDS: [&[i32]; 4] = [&[2], &[3], &[2, 3], &[2]];
/// The kind that is read about another point in each channel.
const ELSEWHERE: usize = 3;

/// How far from its middle a curve is read at most, in the greatest reading of all: beyond, it is a gain.
const FARTHEST: f64 = 2.0;

/// Variants in words.
pub(super) const MIXED: &str = "quadratic and cubic";
/// See [`MIXED`].
pub(super) const ABOUT_ANOTHER: &str = "quadratic about another point in each channel";

impl Effect<Linearised> for IndicatorNonlinearity {
    fn name(&self) -> &str {
        "indicator-nonlinearity"
    }

    fn about(&self) -> About {
        About {
            physics: "an indicator reads a curved function of the displacement, so large and small readings are scaled differently",
            confirm: "calibrate the indicator over the span of the readings, or align so that the readings stay small",
            source: "second and third term of the calibration curve; cosine error of a lever-type indicator",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Sensor
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::only())
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let deviation = Parameter::symmetric("deviation", "um", 200.0);
        let of = |name| self.indicators.sizes(shape.variant, &deviation, name);
        if self.kind(shape) == ELSEWHERE {
            let gains = self.seen(shape).iter().map(|(_, name)| Parameter {
                name: Cow::Owned(format!("gain-in-{}", name.replace('°', "deg"))),
                ..Parameter::symmetric("", "1", 0.2)
            });
            return of("deviation").into_iter().chain(gains).collect();
        }
        if self.powers(shape).len() == 1 {
            return of("deviation");
        }
        [of("deviation-of-square"), of("deviation-of-cube")].concat()
    }

    fn grid(&self, _model: &Linearised) -> Vec<Shape> {
        let kinds = [0, self.indicators.scope_count()].into_iter();
        let mut all: Vec<Shape> = kinds
            .flat_map(|kind| {
                let scopes = self.indicators.scopes();
                scopes.map(move |scope| Shape::variant(kind + scope))
            })
            .collect();
        all.extend(self.about_another());
        all
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let kind = 2 * self.indicators.scope_count();
        let scopes = self.indicators.scopes();
        let mixed = scopes.map(|s| Shape::variant(kind + s));
        let mut all = self.grid(model);
        all.extend(mixed);
        all.retain(|other| other.variant != shape.variant);
        all
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let reach = model.reading_reach();
        let bend = |power: &i32| {
            let bend = model.of_reading(|reading| (reading / reach).powi(*power));
            self.indicators.apart(model, shape.variant, &bend)
        };
        let mut columns: Vec<Column> = self.powers(shape).iter().flat_map(bend).collect();
        if self.kind(shape) == ELSEWHERE {
            columns.extend(self.seen(shape).iter().map(|(channel, _)| {
                Column::from_places(model.places(), |k, place| match place.channel == *channel {
                    true => model.smooth_reading(k) - model.mid_reading(place),
                    false => 0.0,
                })
            }));
        }
        columns
    }

    /// The reading rises with what the indicator sees: 1 + Σ p aₚ qᵖ⁻¹/R > 0 for q from −1 to 1. About another point, m from the
    /// middle of the curve, the gain is 2 a m/R².
    fn possible(&self, model: &Linearised, shape: &Shape, amplitudes: &[f64]) -> bool {
        let reach = model.reading_reach();
        let (count, gains) = self.counts(shape, amplitudes);
        let least = gains.iter().copied().fold(0.0, f64::min);
        let most = gains.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
        let reached = 2.0 * FARTHEST * amplitudes[..count].iter().fold(0.0, |a, b| b.abs().max(a));
        most * reach <= reached + f64::MIN_POSITIVE
            && (0..count).all(|own| {
                let terms = self
                    .powers(shape)
                    .iter()
                    .zip(amplitudes[own..].iter().step_by(count));
                let (mut square, mut cube) = (0.0, 0.0);
                for (power, a) in terms {
                    *(if *power == 2 { &mut square } else { &mut cube }) = *a;
                }
                let slope = |q: f64| 1.0 + least + (2.0 * square * q + 3.0 * cube * q * q) / reach;
                // The parabola's vertex, where it lies inside.
                let vertex = if cube > 0.0 {
                    (-square / (3.0 * cube)).clamp(-1.0, 1.0)
                } else {
                    1.0
                };
                [-1.0, vertex, 1.0].into_iter().all(|q| slope(q) > 0.0)
            })
    }

    /// The deviation is told at the greatest reading.
    fn carried(
        &self,
        from: &Linearised,
        to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let grown = to.reading_reach() / from.reading_reach();
        let (count, gains) = self.counts(shape, amplitudes);
        let powers = self
            .powers(shape)
            .iter()
            .flat_map(|p| std::iter::repeat_n(*p, count))
            .chain(gains.iter().map(|_| 0));
        let carried = amplitudes
            .iter()
            .zip(powers)
            .map(|(a, p)| a * grown.powi(p));
        (shape.clone(), carried.collect())
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        let kind = ["quadratic", "cubic", MIXED, ABOUT_ANOTHER][self.kind(shape)];
        Some(format!("{kind}, {}", self.indicators.words(shape.variant)))
    }
}

impl IndicatorNonlinearity {
    pub fn new(arrangement: &Arrangement) -> Self {
        let indicators = Indicators::new(arrangement);
        let read = |indicator: usize| {
            let seats = arrangement.seats().iter().enumerate();
            let own = seats.filter(|(_, seat)| seat.indicator == indicator);
            own.map(|(c, seat)| (c, seat.name.clone())).collect()
        };
        Self {
            channels: (0..indicators.count()).map(read).collect(),
            indicators,
        }
    }

    fn kind(&self, shape: &Shape) -> usize {
        (shape.variant / self.indicators.scope_count()).min(KINDS.len() - 1)
    }

    fn powers(&self, shape: &Shape) -> &'static [i32] {
        KINDS[self.kind(shape)]
    }

    /// The variants of single indicators that are read about another point in each channel.
    fn about_another(&self) -> impl Iterator<Item = Shape> {
        let kind = ELSEWHERE * self.indicators.scope_count();
        let single = self.indicators.scopes().filter(|scope| *scope != ALL);
        single.map(move |scope| Shape::variant(kind + scope))
    }

    /// The channels that the indicator of a single variant reads.
    fn seen(&self, shape: &Shape) -> &[(usize, String)] {
        let own = self.indicators.of(shape.variant);
        self.channels.get(own.start).map_or(&[], Vec::as_slice)
    }

    /// Number of deviations of each power, and the gains.
    fn counts<'a>(&self, shape: &Shape, amplitudes: &'a [f64]) -> (usize, &'a [f64]) {
        let of_gains = match self.kind(shape) {
            ELSEWHERE => self.seen(shape).len(),
            _ => 0,
        };
        let deviations = amplitudes.len().saturating_sub(of_gains);
        (
            deviations / self.powers(shape).len(),
            &amplitudes[deviations..],
        )
    }
}
