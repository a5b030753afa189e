//! The plunger of an indicator sticks: the pointer stays where it is until the stylus is off by the hold, and
//! then goes all the way to it.
//!
//! What is seen of it is a sawtooth of the reading, which begins in every trace where the plunger stood. Friction
//! is not the same each time: it lets go between [`LOOSE`] less and more than the hold, and where it did is
//! told by the readings themselves (`followed.rs`). It is found by its mean over where the plunger may have
//! stood, a lag behind the direction in which the reading changes, and followed from there. Free: a hold for each
//! indicator, where the plunger stands when a trace begins, when it lets go. It lets go where it is read, as where
//! the slide stops for each reading: on the way between readings that differ by much of a hold it is not followed.

mod followed;
mod traces;
mod track;

use nalgebra::{DMatrix, DVector};

use super::indicators::{ALL, Indicators};
use super::{Linearised, spread};
use crate::model::{About, Column, Effect, Estimate, Link, Parameter, Shape};
use followed::mean_lag;
use traces::{Shown, between, followed_by, traces_of};
use track::{Hold, Track};

/// See the head of the file. Variants: the indicators.
pub(super) struct StickingPlunger(pub Indicators);

/// Part of the hold by which it lets go sooner or later.
const LOOSE: f64 = 0.3;
/// Parts of the span of the readings at which the search begins.
const PARTS: [f64; 6] = [1e-3, 3e-3, 1e-2, 3e-2, 6e-2, 1e-1];

impl Effect<Linearised> for StickingPlunger {
    fn name(&self) -> &str {
        "sticking-plunger"
    }

    fn about(&self) -> About {
        About {
            physics: "the plunger of an indicator sticks: its pointer stays until it is off by the hold and then goes all the way",
            confirm: "tap the indicator lightly and see whether its pointer moves; clean the plunger and repeat",
            source: "stick and slip of a plunger in its bushing; Armstrong-Helouvry, Control of Machines with Friction (1991)",
        }
    }

    fn link(&self, _shape: &Shape) -> Link {
        Link::Pointer
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(ALL))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let hold = Parameter::between("hold", "um", 0.0, 50.0);
        self.0.sizes(shape.variant, &hold, "hold")
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let span = model.reading_span();
        let of = |scope: usize| {
            let holds = PARTS.into_iter().map(move |part| part * span);
            holds.map(move |hold| {
                let own = self.0.of(scope);
                let begun = Track::begun(own.map(|indicator| (indicator, hold)));
                begun.written(scope)
            })
        };
        self.0.scopes().flat_map(of).collect()
    }

    /// Others with what is known of the indicators that they have too.
    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let usual = track.holds.first().map_or(0.0, |hold| hold.size);
        let other = |variant: usize| {
            let own = self.0.of(variant);
            track.of_indicators(own, usual).written(variant)
        };
        self.0.others(shape.variant).map(other).collect()
    }

    fn allowed(&self, _model: &Linearised, shape: &Shape) -> bool {
        Track::read(shape).is_some_and(|track| {
            let known = track.holds.iter().map(|hold| hold.indicator);
            known.eq(self.0.of(shape.variant))
        })
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let of = |hold: &Hold| {
            let mut column = Column::default();
            let size = hold.size.max(1e-9 * model.reading_span());
            for (number, own) in traces_of(model, hold.indicator) {
                let seen: Vec<f64> = own.iter().map(|k| model.smooth_reading(*k)).collect();
                let lag = match track.ways.iter().find(|way| way.trace == number) {
                    Some(way) => way.lag(&seen, size),
                    None => mean_lag(&seen, size),
                };
                column.rows.extend(own);
                column.values.extend(lag.iter().map(|lag| lag / size));
            }
            column
        };
        track.holds.iter().map(of).collect()
    }

    fn traced(
        &self,
        model: &Linearised,
        readings: &dyn Fn() -> Option<DVector<f64>>,
        shape: &Shape,
    ) -> Option<Shape> {
        let mut track = Track::read(shape)?;
        let readings = readings()?;
        let beside_others = track.holds.len() > 1;
        let known = std::mem::take(&mut track.ways);
        for hold in &mut track.holds {
            let is_known = known.iter().any(|way| way.indicator == hold.indicator);
            let own = followed_by(model, &readings, hold, is_known, beside_others)?;
            track.ways.extend(own);
        }
        Some(track.written(shape.variant))
    }

    /// While the pointer stands still it shows what was seen where it let go, and nothing of what the stylus has
    /// passed since.
    fn restored(
        &self,
        model: &Linearised,
        shape: &Shape,
        readings: &DVector<f64>,
        clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let track = Track::read(shape)?;
        let n = model.positions().len();
        let mut restored = clean.clone();
        for channel in 0..model.present().len() {
            let shown = Shown::of(model, &track, channel);
            let rows = |k: usize| shown.traces.iter().map(move |trace| trace.start + k);
            let off = (0..n).map(|k| {
                let own = &shown.readings[k];
                let seen = own.iter().map(|row| readings[*row]).sum::<f64>() / own.len() as f64;
                let mean = rows(k).map(|row| clean[row]).sum::<f64>() / shown.traces.len() as f64;
                (!own.is_empty()).then_some(seen - mean)
            });
            let off: Vec<Option<f64>> = off.collect();
            for (k, off) in between(&off, model.positions()).into_iter().enumerate() {
                rows(k).for_each(|row| restored[row] += off);
            }
        }
        Some(restored)
    }

    /// What the stylus has passed while the pointer stood still in all traces of a channel is known to the hold.
    fn open(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(track) = Track::read(shape) else {
            return Vec::new();
        };
        let n = model.positions().len();
        let mut columns = Vec::new();
        for channel in 0..model.present().len() {
            let indicator = model.present()[channel].indicator;
            let shown = Shown::of(model, &track, channel);
            let Some(hold) = track.holds.iter().find(|h| h.indicator == indicator) else {
                continue;
            };
            let known: Vec<usize> = (0..n).filter(|k| !shown.readings[*k].is_empty()).collect();
            let (Some(first), Some(last)) = (known.first(), known.last()) else {
                continue;
            };
            let inside = known
                .windows(2)
                .map(|pair| (pair[0] as f64, pair[1] as f64));
            // Beyond the ends it is least known at the end.
            let (first, last, end) = (*first as f64, *last as f64, n as f64 - 1.0);
            let all = inside.chain([(-first, first), (last, 2.0 * end - last)]);
            for (from, to) in all.filter(|(from, to)| to - from > 1.0) {
                let within = (0..n).filter(|k| (from..to).contains(&(*k as f64)));
                let mut column = Column::default();
                for k in within {
                    let part = (k as f64 - from) / (to - from);
                    let arch = 4.0 * part * (1.0 - part);
                    for trace in &shown.traces {
                        column.rows.push(trace.start + k);
                        column.values.push(0.5 * hold.size * arch);
                    }
                }
                columns.push(column);
            }
        }
        columns
    }

    /// Where the plunger stands and when it lets go, by the readings.
    fn choices(&self, shape: &Shape) -> usize {
        Track::read(shape).map_or(0, |track| {
            let own = track.ways.iter().map(|way| way.path.choices);
            own.sum::<usize>() + track.holds.len()
        })
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        Some(self.0.words(shape.variant))
    }

    /// Where traces are followed the hold is told by when it was let go, not by how far.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let holds = Track::read(shape).map_or_else(Vec::new, |track| track.holds);
        let names = self.amplitudes_at(shape).into_iter().zip(amplitudes);
        let told = names.zip(holds).enumerate();
        told.map(|(k, ((parameter, amplitude), hold))| {
            let (value, std) = if hold.std > 0.0 {
                (hold.size, hold.std)
            } else {
                (*amplitude, spread(covariance, &[(k, 1.0)]))
            };
            Estimate {
                name: parameter.name.into_owned(),
                value,
                std,
                unit: parameter.unit.to_owned(),
            }
        })
        .collect()
    }
}
