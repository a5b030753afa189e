//! The zero of one indicator jumps once and stays there.
//!
//! It stays in every trace that the indicator reads from then on, in both spindle positions; or,
//! where the indicator is set to zero anew when the spindle is turned, in the channel being read. If
//! all traces of the first spindle position are taken before those of the second, the two are the
//! same: the zero of a whole channel is free; where zeros are kept it lasts in any case. Free: the jump,
//! its time, the indicator or channel.

use super::Linearised;
use super::indicators::Indicators;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use crate::reversal::designs::Zero;

/// See the head of the file. Variants: the channels, then the indicators.
pub(super) struct ZeroJump(pub Indicators);

/// Readings about a jump that was found at which it is looked for again.
const NEARBY: usize = 6;

/// Readings between neighbouring starts of the search.
const STRIDE: usize = 8;

impl Effect<Linearised> for ZeroJump {
    fn name(&self) -> &str {
        "zero-jump"
    }

    fn about(&self) -> About {
        About {
            physics: "the zero of one indicator jumps at one moment and stays there: a knock, a slip in its clamp",
            confirm: "check the clamp, and read a fixed point before and after every trace",
            source: "step function of time in one indicator",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("jump", "um", 1000.0)]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("time", "s", 0.0, 1e9)]
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let mut shapes = Vec::new();
        let channels = model.present().len();
        for variant in 0..channels + self.0.count() {
            if variant >= channels && !alternating(model, variant) {
                continue;
            }
            let times = times_of(model, variant);
            let stride = STRIDE * read_channels(model, variant).count();
            for (k, pair) in times.windows(2).enumerate().step_by(stride) {
                let next = times[(k + stride).min(times.len() - 1)];
                shapes.push(Shape {
                    variant,
                    values: vec![0.5 * (pair[0] + pair[1])],
                    steps: vec![0.5 * (next - pair[0])],
                });
            }
        }
        shapes
    }

    /// The same jump some readings sooner or later: the score climbs to its time in steps, which halve the
    /// way of a search too soon.
    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let Some(&time) = shape.values.first() else {
            return Vec::new();
        };
        let times = times_of(model, shape.variant);
        let here = times.partition_point(|t| *t <= time);
        let between = |k: usize| Some(0.5 * (times.get(k.checked_sub(1)?)? + times.get(k)?));
        let near = (here.saturating_sub(NEARBY)..=here + NEARBY).filter(|k| *k != here);
        near.filter_map(between)
            .map(|moved| Shape {
                values: vec![moved],
                ..shape.clone()
            })
            .collect()
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let time = shape.values.first().copied().unwrap_or(f64::INFINITY);
        let mut column = Column::default();
        for trace in model.traces() {
            if read_by(model, shape.variant, model.places()[trace.start].channel) {
                for k in trace.clone() {
                    let share = model.share_after(k, time);
                    if share > 0.0 {
                        column.rows.push(k);
                        column.values.push(share);
                    }
                }
            }
        }
        vec![column]
    }

    fn moments(&self, model: &Linearised, shape: &Shape) -> Vec<f64> {
        times_of(model, shape.variant)
    }

    fn variant_name(&self, model: &Linearised, shape: &Shape) -> Option<String> {
        let channels = model.present();
        Some(match channels.get(shape.variant) {
            Some(channel) => format!("channel {}", channel.name),
            None => format!("{} indicator", self.0.name(shape.variant - channels.len())),
        })
    }
}

/// Whether a channel is one in which a variant's jump lasts.
fn read_by(model: &Linearised, variant: usize, channel: usize) -> bool {
    let channels = model.present();
    if variant < channels.len() {
        return channel == variant;
    }
    channels[channel].indicator == variant - channels.len()
}

/// The channels of a variant.
fn read_channels(model: &Linearised, variant: usize) -> impl Iterator<Item = usize> {
    let all = 0..model.present().len();
    all.filter(move |channel| read_by(model, variant, *channel))
}

/// Whether a jump of an indicator is another than one of a channel: it goes back to a spindle position
/// after it has read in another, or zeros are kept.
fn alternating(model: &Linearised, variant: usize) -> bool {
    let ranges: Vec<(f64, f64)> = read_channels(model, variant)
        .filter_map(|channel| {
            let times = times_of(model, channel);
            Some((*times.first()?, *times.last()?))
        })
        .collect();
    let meet = |one: &(f64, f64), two: &(f64, f64)| one.0 < two.1 && two.0 < one.1;
    let mut pairs = (0..ranges.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let kept = model.arrangement().zero() == Zero::Kept && ranges.len() > 1;
    kept || pairs.any(|(a, b)| meet(&ranges[a], &ranges[b]))
}

/// The times of a variant's readings, in order.
fn times_of(model: &Linearised, variant: usize) -> Vec<f64> {
    let mut times: Vec<f64> = model
        .places()
        .iter()
        .filter(|p| read_by(model, variant, p.channel))
        .map(|p| p.time)
        .collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}
