//! Steps of single repeats: a zero that jumps once makes the repeats differ over half a trace, and if
//! it stays, the traces before from those after. It is an effect and no noise; from the readings of
//! which the noise is learnt it is taken out.

use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::levels::{AS_BESIDE, KEPT, LASTING_STEP, MOST_STEPS, STAYS, STAYS_FREEDOM, STEP};
use crate::noise::piles::{Group, SIGMA, groups, median};

/// Readings on either side that tell its height.
const SIDE: usize = 8;

/// Differences of medians that tell how far they scatter, at least: sixteen that are independent.
const ELSEWHERE: usize = 16 * SIDE;
/// Standard deviation of the difference of two medians of [`SIDE`] independent readings over that of two readings.
const OF_MEDIANS: f64 = 0.42;

/// Readings without steps of single repeats.
pub(crate) fn levelled(model: &AnyModel, readings: &DVector<f64>) -> DVector<f64> {
    let mut level = readings.clone();
    let zero = DMatrix::from_element(readings.len(), 1, 1.0);
    let jumps = model.jumps();
    for channel in 0..model.channel_names().len() {
        let all = groups(model).filter(|g| g.starts.len() > 1);
        let own: Vec<Group> = all
            .filter(|g| model.places()[g.starts[0]].channel == channel)
            .collect();
        let traces = in_time(model, &own);
        for (k, group) in own.iter().enumerate() {
            for _ in 0..MOST_STEPS {
                let Some((place, height)) = greatest(group, &level) else {
                    break;
                };
                let of_group = || traces.iter().enumerate().filter(|(_, t)| t.group == k);
                let one = of_group().flat_map(|(_, trace)| {
                    let sides = [trace.before(place), trace.after(place)];
                    sides.map(|rows| Lifted::by(&zero, &[rows], Some(height), (&own, &level)))
                });
                let stays = of_group().flat_map(|(from, trace)| {
                    let mut rows = vec![trace.later(place)];
                    rows.extend(traces[from + 1..].iter().map(|t| t.rows.clone()));
                    let (own, level) = (&own, &level);
                    jumps.iter().map(move |jump| {
                        let height = (jump.ncols() == 1).then_some(height);
                        Lifted::by(jump, &rows, height, (own, level))
                    })
                });
                let best = one
                    .chain(stays)
                    .flatten()
                    .filter(|lifted| lifted.gain > 0.0);
                let Some(best) = best.max_by(|a, b| a.gain.total_cmp(&b.gain)) else {
                    break;
                };
                level -= best.change;
            }
        }
        if !jumps.is_empty()
            && let Some((rows, height)) = later(&traces, own.len(), &level)
        {
            for part in rows {
                level
                    .rows_mut(part.start, part.len())
                    .add_scalar_mut(-height);
            }
        }
    }
    level
}

/// What may have been lifted beyond a step. A step is seen, from the other side, in the repeats that its own is
/// compared with too; the one that leaves all repeats nearest to each other is taken.
struct Lifted {
    change: DVector<f64>,
    /// Squares that it takes from what the repeats differ by.
    gain: f64,
}

impl Lifted {
    /// Rows of a channel, lifted by what a jump adds; a jump of one amplitude by about the height, where that is known.
    fn by(
        jump: &DMatrix<f64>,
        rows: &[Range<usize>],
        height: Option<f64>,
        (own, readings): (&[Group], &DVector<f64>),
    ) -> Option<Self> {
        let mut shape = DMatrix::zeros(jump.nrows(), jump.ncols());
        for rows in rows {
            let part = jump.rows(rows.start, rows.len());
            shape.rows_mut(rows.start, rows.len()).copy_from(&part);
        }
        // With P the projector that takes off the means of repeats, |P(y − S a)|² is least where SᵀPS a = SᵀPy.
        let projected = from_means(own, &shape);
        let (normal, along) = (projected.tr_mul(&shape), projected.tr_mul(readings));
        let mut sizes = normal.clone().cholesky()?.solve(&along);
        if let Some(height) = height {
            let clamp = |a: f64| a.signum() * a.abs().clamp(height * AS_BESIDE, height / AS_BESIDE);
            sizes.apply(|a| *a = clamp(*a));
        }
        let gain = 2.0 * sizes.dot(&along) - sizes.dot(&(&normal * &sizes));
        let change = shape * sizes;
        Some(Self { change, gain })
    }
}

/// Values of a channel less their means over the repeats.
fn from_means(own: &[Group], values: &DMatrix<f64>) -> DMatrix<f64> {
    let mut away = DMatrix::zeros(values.nrows(), values.ncols());
    for group in own {
        for k in 0..group.length {
            let of = || group.starts.iter().map(|start| start + k);
            for column in 0..values.ncols() {
                let sum: f64 = of().map(|row| values[(row, column)]).sum();
                let mean = sum / group.starts.len() as f64;
                of().for_each(|row| away[(row, column)] = values[(row, column)] - mean);
            }
        }
    }
    away
}

/// A trace of a channel.
struct Trace {
    /// When it began.
    time: f64,
    /// Its group.
    group: usize,
    rows: Range<usize>,
    /// Whether its rows are in the order of time.
    forward: bool,
}

impl Trace {
    fn before(&self, place: usize) -> Range<usize> {
        self.rows.start..self.rows.start + place
    }

    fn after(&self, place: usize) -> Range<usize> {
        self.rows.start + place..self.rows.end
    }

    /// What of it is later in time than a place.
    fn later(&self, place: usize) -> Range<usize> {
        if self.forward {
            self.after(place)
        } else {
            self.before(place)
        }
    }
}

/// The traces of a channel in the order of time.
fn in_time(model: &AnyModel, own: &[Group]) -> Vec<Trace> {
    let mut traces: Vec<Trace> = Vec::new();
    for (group, of) in own.iter().enumerate() {
        for start in &of.starts {
            let rows = *start..*start + of.length;
            let first = model.places()[rows.start].time;
            let last = model.places()[rows.end - 1].time;
            traces.push(Trace {
                time: first.min(last),
                group,
                rows,
                forward: first <= last,
            });
        }
    }
    traces.sort_by(|a, b| a.time.total_cmp(&b.time));
    traces
}

/// The step between the traces of a channel, in the order of time and each against the others of its
/// direction, beside which next to nothing differs.
fn later(
    traces: &[Trace],
    groups: usize,
    readings: &DVector<f64>,
) -> Option<(Vec<Range<usize>>, f64)> {
    let freedom = traces.len().checked_sub(groups + 1)?;
    if freedom < STAYS_FREEDOM {
        return None;
    }
    let against = |values: Vec<f64>| {
        let mut sums = vec![(0.0, 0.0); groups];
        for (value, trace) in values.iter().zip(traces) {
            sums[trace.group].0 += value;
            sums[trace.group].1 += 1.0;
        }
        let mean = |trace: &Trace| sums[trace.group].0 / sums[trace.group].1;
        let groups = traces.iter().map(mean);
        let away = values.iter().zip(groups).map(|(value, mean)| value - mean);
        DVector::from_vec(away.collect())
    };
    let rows = traces.iter().map(|t| t.rows.clone());
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
    (square > STAYS * STAYS * rest && square > 0.0).then(|| {
        let rows = traces[from..].iter().map(|t| t.rows.clone());
        (rows.collect(), height)
    })
}

/// Place and height of the greatest step of a group.
fn greatest(group: &Group, readings: &DVector<f64>) -> Option<(usize, f64)> {
    let away = group.away(readings);
    let all = sudden(&away).into_iter().chain(lasting(&away));
    let (_, place, height) = all.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))?;
    Some((place, height.abs()))
}

/// Steps from one reading to the next, of which enough lasts: trace, reading, height.
fn sudden(away: &[Vec<f64>]) -> Vec<(usize, usize, f64)> {
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
    let far = steps.into_iter().filter(|(_, _, step)| step.abs() > edge);
    far.filter_map(|(own, k, step)| Some((own, k, lasting(own, k, step)?)))
        .collect()
}

/// The greatest step that single readings do not show: the medians of those on either side differ by more than
/// such medians do elsewhere. It is where two means fit best.
fn lasting(away: &[Vec<f64>]) -> Option<(usize, usize, f64)> {
    let of = |(own, a): (usize, &Vec<f64>)| {
        let places = SIDE..(a.len() + 1).saturating_sub(SIDE);
        let height = |k: usize| middle(&a[k..k + SIDE]) - middle(&a[k - SIDE..k]);
        places
            .map(|k| (own, k, height(k)))
            .collect::<Vec<(usize, usize, f64)>>()
    };
    let all: Vec<(usize, usize, f64)> = away.iter().enumerate().flat_map(of).collect();
    let greatest = all.iter().max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))?;
    let (own, about, height) = *greatest;
    // A step is seen in its trace and, from the other side, in those it is compared with.
    let elsewhere = all.iter().filter(|s| s.1.abs_diff(about) >= SIDE);
    let mut sizes: Vec<f64> = elsewhere.map(|s| s.2.abs()).collect();
    if sizes.len() < ELSEWHERE {
        return None;
    }
    // Few independent medians may happen to lie close: they scatter no less than those of white noise.
    let differences = away
        .iter()
        .flat_map(|a| a.windows(2).map(|w| (w[1] - w[0]).abs()));
    let white = median(&mut differences.collect::<Vec<f64>>()) * OF_MEDIANS;
    if height.abs() <= LASTING_STEP * SIGMA * median(&mut sizes).max(white) {
        return None;
    }
    let near = &away[own][about - SIDE..about + SIDE];
    let fits = |k: &usize| {
        let square = |part: &[f64]| {
            let mean = part.iter().sum::<f64>() / part.len() as f64;
            part.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
        };
        square(&near[..*k]) + square(&near[*k..])
    };
    let place = (1..near.len()).min_by(|a, b| fits(a).total_cmp(&fits(b)))?;
    Some((own, about - SIDE + place, height))
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

    /// A zero that jumps within a trace and stays, by a step that no single difference shows (6 standard
    /// deviations of one reading, under five of a difference of neighbours from other repeats). k·u: the mean of what is beyond it in
    /// eight traces is known to 0.1/√40/√2 = 0.011 µm beside those of sixteen readings that place it; four times that.
    #[test]
    fn a_step_that_stays_within_a_trace_is_taken_out_from_there_on() {
        for seed in 0..5 {
            let model = readings(4, 0.0, seed);
            let places = model.places();
            let of_channel = |k: &usize| places[*k].channel == 1;
            let mut times: Vec<f64> = (0..places.len())
                .filter(of_channel)
                .map(|k| places[k].time)
                .collect();
            times.sort_by(f64::total_cmp);
            // Within the second repeat of the four.
            let moment = times[times.len() * 7 / 16];
            let mut stepped = model.observed().clone();
            let beyond = (0..places.len()).filter(of_channel);
            let beyond: Vec<usize> = beyond.filter(|k| places[*k].time > moment).collect();
            beyond.iter().for_each(|k| stepped[*k] += 0.6);
            let level = levelled(&model, &stepped);
            let away = &level - model.observed();
            let own: Vec<f64> = (0..places.len())
                .filter(of_channel)
                .map(|k| away[k])
                .collect();
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            let rms = own.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / own.len() as f64;
            assert!(rms.sqrt() < 0.05, "{seed}: {}", rms.sqrt());
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
