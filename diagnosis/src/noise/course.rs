//! Whether what differs between repeats goes on from one trace to the next.
//!
//! Noise begins anew with each trace, drifts, cycles and jumps go on. Of each trace what it differs by from its repeats
//! is averaged over its first and its last readings in time; the end of each trace is
//! multiplied with the beginning of the next one of its channel. Repeats of independent noise may be exchanged, and any
//! rotation of them is as probable: that gives the law of the sum of the products.

use std::collections::BTreeMap;
use std::ops::Range;

use errsep_models::model::Place;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::noise::contrasts::repeated;

/// Part of a trace that is its beginning, and its end.
const PART: usize = 4;
/// Rotations of the repeats: first so many, and all where the first tell that it may be rare.
const DRAWS: [usize; 2] = [200, 10_000];
/// See [`DRAWS`].
const RARE: f64 = 0.05;
/// Repeats of which there are exchanges enough (40 320), and rotations take long.
const MANY: usize = 8;
/// Contrasts without which rotations are too few to tell what is rare.
const FEWEST: usize = 2;

/// How what differs between repeats goes on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    /// Correlation of the ends of traces with the beginnings of the next ones.
    pub correlation: f64,
    /// Probability of as much in noise that is independent from trace to trace.
    pub p_value: f64,
}

/// Repeats of one trace: how they begin and end.
struct Repeats {
    /// Contrasts, contrast × repeat.
    contrasts: DMatrix<f64>,
    /// Of the beginnings and of the ends.
    begin: DVector<f64>,
    end: DVector<f64>,
}

/// What ends in one group of repeats and begins in another, contrast × contrast, by the groups.
type Between = BTreeMap<(usize, usize), DMatrix<f64>>;

/// Of readings free of causes; nothing where too few repeats are alike or times do not tell which came first.
pub(crate) fn course(
    places: &[Place],
    traces: &[Range<usize>],
    readings: &DVector<f64>,
) -> Option<Course> {
    let (repeats, of_trace) = repeats(places, traces, readings);
    let mut between = Between::new();
    let (mut ends, mut begins) = (0.0, 0.0);
    let mut told = false;
    for ((from, i), (to, j)) in links(places, traces, &of_trace) {
        let (one, other) = (&repeats[from], &repeats[to]);
        let (left, right) = (one.contrasts.column(i), other.contrasts.column(j));
        let own = between.entry((from, to));
        let none = || DMatrix::zeros(left.nrows(), right.nrows());
        *own.or_insert_with(none) += left * right.transpose();
        ends += left.dot(&one.end).powi(2);
        begins += right.dot(&other.begin).powi(2);
        told |= left.nrows() >= FEWEST && right.nrows() >= FEWEST;
    }
    let own: Vec<Ends> = repeats
        .iter()
        .map(|r| (r.end.clone(), r.begin.clone()))
        .collect();
    let seen = sum(&between, &own);
    (told && ends * begins > 0.0).then(|| Course {
        correlation: seen / (ends * begins).sqrt(),
        p_value: chance(&between, &repeats, seen),
    })
}

/// Contrasts of the ends of a group's repeats, and of their beginnings.
type Ends = (DVector<f64>, DVector<f64>);

/// Sum of the products of ends and beginnings, of each group its own.
fn sum(between: &Between, ends: &[Ends]) -> f64 {
    let products = between.iter().map(|((from, to), between)| {
        let (end, begin) = (&ends[*from].0, &ends[*to].1);
        between.tr_mul(end).dot(begin)
    });
    products.sum()
}

/// Part of the rotations of the repeats, each group by its own, in which the sum is as great.
fn chance(between: &Between, repeats: &[Repeats], seen: f64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut as_much = 0;
    let mut drawn = 0;
    let mut p_value = 1.0;
    for draws in DRAWS {
        for _ in drawn..draws {
            let turned: Vec<Ends> = repeats.iter().map(|r| r.turned(&mut random)).collect();
            as_much += usize::from(sum(between, &turned) >= seen);
        }
        drawn = draws;
        p_value = (as_much as f64 + 1.0) / (drawn as f64 + 1.0);
        if p_value > RARE {
            break;
        }
    }
    p_value
}

/// Groups of traces that repeat each other, and for each trace its group and its place there.
fn repeats(
    places: &[Place],
    traces: &[Range<usize>],
    readings: &DVector<f64>,
) -> (Vec<Repeats>, Vec<Option<(usize, usize)>>) {
    let mut of_trace = vec![None; traces.len()];
    let mut repeats = Vec::new();
    let alike = repeated(places, traces).into_iter();
    for members in alike.filter(|m| m.len() > 1 && !traces[m[0]].is_empty()) {
        let contrasts = against_their_mean(members.len());
        let (begin, end): (Vec<f64>, Vec<f64>) = (members.iter())
            .map(|k| begin_and_end(places, traces[*k].clone(), readings))
            .unzip();
        for (j, k) in members.iter().enumerate() {
            of_trace[*k] = Some((repeats.len(), j));
        }
        repeats.push(Repeats {
            begin: &contrasts * DVector::from_vec(begin),
            end: &contrasts * DVector::from_vec(end),
            contrasts,
        });
    }
    (repeats, of_trace)
}

/// Orthonormal contrasts of repeats, contrast × repeat: each against the mean of those before it (Helmert).
fn against_their_mean(repeats: usize) -> DMatrix<f64> {
    DMatrix::from_fn(repeats - 1, repeats, |i, j| {
        let before = (i + 1) as f64;
        let size = (before * (before + 1.0)).sqrt();
        match j.cmp(&(i + 1)) {
            std::cmp::Ordering::Less => 1.0 / size,
            std::cmp::Ordering::Equal => -before / size,
            std::cmp::Ordering::Greater => 0.0,
        }
    })
}

/// Means over the first and the last readings of a trace in time.
fn begin_and_end(places: &[Place], trace: Range<usize>, readings: &DVector<f64>) -> (f64, f64) {
    let mut order: Vec<usize> = trace.collect();
    order.sort_by(|a, b| places[*a].time.total_cmp(&places[*b].time));
    let part = order.len().div_ceil(PART);
    let of = |own: &[usize]| mean(own.iter().map(|i| readings[*i]));
    (of(&order[..part]), of(&order[order.len() - part..]))
}

/// Group and place of a trace, and those of the next one of its channel.
type Link = ((usize, usize), (usize, usize));

fn links(
    places: &[Place],
    traces: &[Range<usize>],
    of_trace: &[Option<(usize, usize)>],
) -> Vec<Link> {
    let mut by_channel: BTreeMap<usize, Vec<(f64, f64, usize)>> = BTreeMap::new();
    for (k, trace) in traces.iter().enumerate().filter(|(_, t)| !t.is_empty()) {
        let times = || trace.clone().map(|i| places[i].time);
        let (first, last) = (
            times().fold(f64::INFINITY, f64::min),
            times().fold(f64::NEG_INFINITY, f64::max),
        );
        let own = by_channel.entry(places[trace.start].channel).or_default();
        own.push((first, last, k));
    }
    let mut links = Vec::new();
    for own in by_channel.values_mut() {
        own.sort_by(|a, b| a.0.total_cmp(&b.0));
        for pair in own.windows(2) {
            let after = pair[0].1 < pair[1].0;
            if let (true, Some(from), Some(to)) = (after, of_trace[pair[0].2], of_trace[pair[1].2])
            {
                links.push((from, to));
            }
        }
    }
    links
}

impl Repeats {
    /// Ends and beginnings after a rotation or reflection, each as probable (Haar's measure: Gram and Schmidt's basis of
    /// normal numbers); of many repeats after an exchange of them, which is one too.
    fn turned(&self, random: &mut ChaCha8Rng) -> Ends {
        let (size, repeats) = self.contrasts.shape();
        if repeats >= MANY {
            let mut order: Vec<usize> = (0..repeats).collect();
            order.shuffle(random);
            let exchanged = |own: &DVector<f64>| {
                let each = self.contrasts.tr_mul(own);
                &self.contrasts * each.select_rows(&order)
            };
            return (exchanged(&self.end), exchanged(&self.begin));
        }
        let normal = DMatrix::from_fn(size, size, |_, _| StandardNormal.sample(random));
        let decomposed = normal.qr();
        let signs = decomposed.r().diagonal().map(f64::signum);
        let rotation = decomposed.q() * DMatrix::from_diagonal(&signs);
        (&rotation * &self.end, &rotation * &self.begin)
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::ops::Range;

    use errsep_models::model::Place;
    use nalgebra::DVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::course;

    const POSITIONS: usize = 40;

    /// Two channels read together, so many repeats, both directions, one reading a second; `reading` of channel, pass and
    /// time.
    fn measured(
        repeats: usize,
        reading: &mut dyn FnMut(usize, usize, f64) -> f64,
    ) -> (Vec<Place>, Vec<Range<usize>>, DVector<f64>) {
        let (mut places, mut values, mut traces) = (Vec::new(), Vec::new(), Vec::new());
        for pass in 0..2 * repeats {
            for channel in 0..2 {
                let from = places.len();
                for k in 0..POSITIONS {
                    let forward = pass % 2 == 0;
                    let run = if forward { k } else { POSITIONS - 1 - k };
                    let time = (pass * POSITIONS + run) as f64;
                    places.push(Place {
                        channel,
                        x: k as f64,
                        time,
                        repeat: (pass / 2) as u32,
                        direction: if forward { 1.0 } else { -1.0 },
                        cell: channel * POSITIONS + k,
                    });
                    values.push(reading(channel, pass, time));
                }
                traces.push(from..places.len());
            }
        }
        (places, traces, DVector::from_vec(values))
    }

    fn p_value(repeats: usize, reading: &mut dyn FnMut(usize, usize, f64) -> f64) -> f64 {
        let (places, traces, values) = measured(repeats, reading);
        course(&places, &traces, &values).unwrap().p_value
    }

    /// *Coverage*: traces that shift by themselves, each by five times what its readings scatter, are told as often as
    /// is said, by rotations of four repeats and by exchanges of ten: 5 % of 400 within 3.5 standard deviations (15 of 20).
    #[test]
    fn what_begins_anew_in_every_trace_is_noise() {
        for repeats in [4, 10] {
            let mut random = ChaCha8Rng::seed_from_u64(5);
            let mut told = 0;
            for _ in 0..400 {
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                let shifts: Vec<f64> = (0..4 * repeats).map(|_| 5.0 * normal()).collect();
                let mut one =
                    |channel: usize, pass: usize, _: f64| shifts[2 * pass + channel] + normal();
                told += usize::from(p_value(repeats, &mut one) < 0.05);
            }
            assert!((5..=35).contains(&told), "{repeats}: {told}");
        }
    }

    /// *Simulated truth*: a wave of two and a half traces, three times as high as the readings scatter, goes on from
    /// trace to trace; one whose phase is another in each trace does not.
    #[test]
    fn a_slow_wave_goes_on() {
        let period = 2.5 * POSITIONS as f64;
        for repeats in [4, 10] {
            let mut random = ChaCha8Rng::seed_from_u64(6);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let phases: Vec<f64> = (0..2 * repeats).map(|_| normal()).collect();
            let mut wave =
                |_: usize, _: usize, time: f64| 3.0 * (TAU * time / period).sin() + normal();
            assert!(p_value(repeats, &mut wave) < 1e-3, "{repeats}");
            let mut anew = |_: usize, pass: usize, time: f64| {
                3.0 * (TAU * (time / period + phases[pass])).sin() + normal()
            };
            assert!(p_value(repeats, &mut anew) > 0.01, "{repeats}");
        }
    }

    /// *Limit*: two repeats have one contrast, whose sign alone may turn.
    #[test]
    fn two_repeats_tell_nothing() {
        let (places, traces, values) = measured(4, &mut |_, pass, time| time + pass as f64);
        let few: Vec<Range<usize>> = traces[..8].to_vec();
        assert_eq!(course(&places, &few, &values), None);
    }
}
