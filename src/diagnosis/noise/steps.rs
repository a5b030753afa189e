//! Steps of single repeats: a zero that jumps once makes the repeats differ over half a trace, and if
//! it stays, the traces before from those after. It is an effect and no noise; from the readings of
//! which the noise is learnt it is taken out.

use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;

use crate::diagnosis::levels::{KEPT, MOST_STEPS, STAYS, STAYS_FREEDOM, STEP};
use crate::diagnosis::noise::spikes::{Group, SIGMA, groups, median};

/// Readings on either side that tell its height.
const SIDE: usize = 8;

/// A part of a trace beyond a step.
struct Lifted {
    rows: Range<usize>,
    height: f64,
}

/// Readings without steps of single repeats.
pub(in crate::diagnosis) fn levelled(model: &AnyModel, readings: &DVector<f64>) -> DVector<f64> {
    let mut level = readings.clone();
    for group in groups(model).filter(|g| g.starts.len() > 1) {
        for _ in 0..MOST_STEPS {
            let Some(Lifted { rows, height }) = greatest(&group, &level) else {
                break;
            };
            level
                .rows_mut(rows.start, rows.len())
                .add_scalar_mut(-height);
        }
    }
    if !model.zero_may_jump() {
        return level;
    }
    let all: Vec<Group> = groups(model).filter(|g| g.starts.len() > 1).collect();
    for channel in 0..model.channel_names().len() {
        let own: Vec<&Group> = all
            .iter()
            .filter(|g| model.places()[g.starts[0]].channel == channel)
            .collect();
        for lifted in later(model, &own, &level)
            .into_iter()
            .flat_map(Stayed::raised)
        {
            level
                .rows_mut(lifted.rows.start, lifted.rows.len())
                .add_scalar_mut(-lifted.height);
        }
    }
    level
}

/// Traces of a channel from a step on.
struct Stayed {
    traces: Vec<Range<usize>>,
    height: f64,
}

impl Stayed {
    fn raised(self) -> impl Iterator<Item = Lifted> {
        let height = self.height;
        let traces = self.traces.into_iter();
        traces.map(move |rows| Lifted { rows, height })
    }
}

/// The step between the traces of a channel, in the order of time and each against the others of its
/// direction, beside which next to nothing differs.
fn later(model: &AnyModel, own: &[&Group], readings: &DVector<f64>) -> Option<Stayed> {
    let mut traces: Vec<(f64, usize, Range<usize>)> = Vec::new();
    for (k, group) in own.iter().enumerate() {
        for start in &group.starts {
            let rows = *start..*start + group.length;
            let time = model.places()[rows.start].time;
            traces.push((time.min(model.places()[rows.end - 1].time), k, rows));
        }
    }
    let freedom = traces.len().checked_sub(own.len() + 1)?;
    if freedom < STAYS_FREEDOM {
        return None;
    }
    traces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let against = |values: Vec<f64>| {
        let mut sums = vec![(0.0, 0.0); own.len()];
        for (value, trace) in values.iter().zip(&traces) {
            sums[trace.1].0 += value;
            sums[trace.1].1 += 1.0;
        }
        let groups = traces.iter().map(|trace| sums[trace.1].0 / sums[trace.1].1);
        let away = values.iter().zip(groups).map(|(value, mean)| value - mean);
        DVector::from_vec(away.collect())
    };
    let rows = traces.iter().map(|t| t.2.clone());
    let means = against(
        rows.map(|r| readings.rows(r.start, r.len()).mean())
            .collect(),
    );
    let step = |from: usize| {
        let shape = against((0..traces.len()).map(|k| f64::from(k >= from)).collect());
        let square = shape.norm_squared();
        let height = shape.dot(&means) / square.max(f64::MIN_POSITIVE);
        (from, height, height * height * square)
    };
    let (from, height, square) = (1..traces.len())
        .map(step)
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let rest = (means.norm_squared() - square).max(0.0) / freedom as f64;
    (square > STAYS * STAYS * rest && square > 0.0).then(|| Stayed {
        traces: traces[from..].iter().map(|t| t.2.clone()).collect(),
        height,
    })
}

/// The greatest step; the side that is further from the other repeats is the lifted one.
fn greatest(group: &Group, readings: &DVector<f64>) -> Option<Lifted> {
    let away = group.away(readings);
    let steps: Vec<(usize, usize, f64)> = away
        .iter()
        .enumerate()
        .flat_map(|(own, a)| (1..a.len()).map(move |k| (own, k, a[k] - a[k - 1])))
        .collect();
    let mut sizes: Vec<f64> = steps.iter().map(|s| s.2.abs()).collect();
    let edge = STEP * SIGMA * median(&mut sizes);
    let lasting = |own: usize, k: usize, step: f64| {
        let a = &away[own];
        let height = middle(&a[k..(k + SIDE).min(a.len())]) - middle(&a[k.saturating_sub(SIDE)..k]);
        (height * step.signum() > KEPT * step.abs()).then_some(height)
    };
    let (own, k, height) = steps
        .into_iter()
        .filter(|(_, _, step)| step.abs() > edge)
        .filter_map(|(own, k, step)| Some((own, k, lasting(own, k, step)?)))
        .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))?;
    let (before, after) = away[own].split_at(k);
    let start = group.starts[own];
    Some(if middle(before).abs() > middle(after).abs() {
        Lifted {
            rows: start..start + k,
            height: -height,
        }
    } else {
        Lifted {
            rows: start + k..start + group.length,
            height,
        }
    })
}

fn middle(values: &[f64]) -> f64 {
    median(&mut values.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn readings(repeats: u32, correlated: f64, seed: u64) -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = SceneNoise {
            white: 0.1,
            correlated,
            length: 20.0,
            shift: correlated,
        };
        let scene = Scene::random(80, repeats, 1e-5, 2.0, noise, &mut random);
        AnyModel::new(&Linearised::new(&scene.measured(seed), Assumptions::default()).unwrap())
    }

    /// k·u: two medians of eight differences from another repeat know a step to
    /// 0.1 √(2 · 2 · π/2/8) = 0.09 µm; four times that, of a step of 3 µm.
    #[test]
    fn a_step_is_taken_out_and_nothing_else() {
        for repeats in [2, 3, 5] {
            for seed in 0..5 {
                let model = readings(repeats, 0.0, seed);
                let plain = model.observed().clone();
                assert_eq!(levelled(&model, &plain), plain);
                let mut stepped = plain.clone();
                stepped.rows_mut(30, 50).add_scalar_mut(3.0);
                let group = groups(&model).find(|g| g.starts.contains(&0)).unwrap();
                // Of two repeats either may be brought to the other.
                let left = |readings: &DVector<f64>| {
                    let away = &group.away(readings)[0];
                    (middle(&away[30..]) - middle(&away[..30])).abs()
                };
                assert!(left(&stepped) > 2.6, "{repeats} {seed}");
                let level = levelled(&model, &stepped);
                assert!(left(&level) < 0.36, "{repeats} {seed}: {}", left(&level));
            }
        }
    }

    /// A zero that stays where it jumped is taken out of all traces after it: k·u, the means of eight
    /// traces of 80 readings know a step to 0.1/√80/√2 = 0.008 µm; five times that, of a step of 1 µm.
    #[test]
    fn a_step_that_stays_is_taken_out_of_the_later_traces() {
        for seed in 0..5 {
            let model = readings(4, 0.0, seed);
            let mut stepped = model.observed().clone();
            let own: Vec<Range<usize>> = model
                .traces()
                .iter()
                .filter(|t| model.places()[t.start].channel == 1)
                .cloned()
                .collect();
            let began = |t: &Range<usize>| {
                let times = t.clone().map(|k| model.places()[k].time);
                times.fold(f64::INFINITY, f64::min)
            };
            let mut starts: Vec<f64> = own.iter().map(began).collect();
            starts.sort_by(f64::total_cmp);
            let middle = starts[starts.len() / 2] - 0.1;
            for k in own.iter().flat_map(Clone::clone) {
                if model.places()[k].time > middle {
                    stepped[k] += 1.0;
                }
            }
            assert_ne!(stepped, *model.observed(), "{seed}");
            let level = levelled(&model, &stepped);
            let mean = |t: &Range<usize>| {
                let away = &level - model.observed();
                away.rows(t.start, t.len()).mean()
            };
            let (low, high) = own
                .iter()
                .map(mean)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), m| {
                    (a.min(m), b.max(m))
                });
            assert!(high - low < 0.04, "{seed}: {low} {high}");
        }
    }

    /// Correlated noise and shifts have no steps.
    #[test]
    fn noise_is_left() {
        for seed in 0..20 {
            let model = readings(4, 0.2, seed);
            let plain = model.observed().clone();
            assert_eq!(levelled(&model, &plain), plain, "{seed}");
        }
    }
}
