//! Readings that single traces lack at places which the others have, put in so that the places stay.
//!
//! A trace is taken as the profile of its channel and direction, a line of its own that changes slowly along
//! the travel, what its noise has in common with the neighbours, and a remainder. For a reading that is
//! lacking the remainder is drawn from the trace's own, so that the scatter of the readings stays what it is
//! (imputation by a hot deck: Little and Rubin, Statistical Analysis with Missing Data, chapter 4).

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::sorting::TraceKey;

/// Most of the places of a trace that may lack a reading.
const LACKING: f64 = 0.25;
/// Most places one after the other that may lack one.
const STRETCH: usize = 6;
/// Least part of a channel's traces with a reading at each place.
const READ: f64 = 0.25;
/// Fewest traces that tell each other's profile.
const FEWEST_TRACES: usize = 4;
/// Places to either side that a line is fitted over.
const NEAR: usize = 10;
/// Rounds of offsets, then of lines, in which profile and traces are told apart.
const ROUNDS: (usize, usize) = (20, 10);
/// Parameters of a line.
const LINE: f64 = 2.0;

/// A trace by its key, with a value at each place where it has one.
pub(super) type Lane = (TraceKey, Vec<Option<f64>>);

/// Whether what the traces lack can be told from the others: by trace, whether it has a reading at each place.
pub(super) fn can_be_told(traces: &[(TraceKey, Vec<bool>)]) -> bool {
    let few = |present: &[bool]| {
        let lacking = present.iter().filter(|p| !**p).count();
        let longest = present.split(|p| *p).map(<[bool]>::len).max().unwrap_or(0);
        lacking as f64 <= LACKING * present.len() as f64 && longest <= STRETCH
    };
    let mut channels: BTreeMap<usize, Vec<&[bool]>> = BTreeMap::new();
    for ((channel, _, _), present) in traces {
        channels.entry(*channel).or_default().push(present);
    }
    traces.iter().all(|(_, present)| few(present))
        && channels
            .values()
            .all(|own| own.len() >= FEWEST_TRACES && is_covered(own))
}

/// Whether at every place enough of a channel's traces have a reading.
fn is_covered(traces: &[&[bool]]) -> bool {
    (0..traces.first().map_or(0, |t| t.len()))
        .all(|k| traces.iter().filter(|t| t[k]).count() as f64 >= READ * traces.len() as f64)
}

/// The values of every trace, those that were lacking put in.
pub(super) fn filled(lanes: &[Lane]) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut full: Vec<Vec<f64>> = vec![Vec::new(); lanes.len()];
    for group in groups(lanes) {
        let whole = |t: &usize| lanes[*t].1.iter().all(Option::is_some);
        if group.iter().all(whole) {
            for t in group {
                full[t] = lanes[t].1.iter().flatten().copied().collect();
            }
            continue;
        }
        let own: Vec<&[Option<f64>]> = group.iter().map(|t| lanes[*t].1.as_slice()).collect();
        let (profile, lines) = told_apart(&own);
        for (t, line) in group.iter().zip(&lines) {
            full[*t] = completed(&lanes[*t].1, &profile, line, own.len(), &mut random);
        }
    }
    full
}

/// The traces of each channel and direction where they suffice, else those of each channel.
fn groups(lanes: &[Lane]) -> Vec<Vec<usize>> {
    let mut channels: BTreeMap<usize, [Vec<usize>; 2]> = BTreeMap::new();
    for (t, ((channel, _, backward), _)) in lanes.iter().enumerate() {
        channels.entry(*channel).or_default()[usize::from(*backward)].push(t);
    }
    let suffice = |own: &Vec<usize>| {
        let places = own.first().map_or(0, |t| lanes[*t].1.len());
        let read = |k: usize| own.iter().any(|t| lanes[*t].1[k].is_some());
        own.is_empty() || own.len() >= FEWEST_TRACES && (0..places).all(read)
    };
    let of = |[forward, backward]: [Vec<usize>; 2]| {
        if suffice(&forward) && suffice(&backward) {
            vec![forward, backward]
        } else {
            vec![[forward, backward].concat()]
        }
    };
    let all = channels.into_values().flat_map(of);
    all.filter(|group| !group.is_empty()).collect()
}

/// The profile that traces have in common, and by trace what it adds to that at each place: offsets first, then
/// lines over the neighbouring places, fitted in turn with the profile.
fn told_apart(traces: &[&[Option<f64>]]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let places = traces.first().map_or(0, |t| t.len());
    let mut lines = vec![vec![0.0; places]; traces.len()];
    let mut profile = vec![0.0; places];
    for round in 0..ROUNDS.0 + ROUNDS.1 {
        for (k, value) in profile.iter_mut().enumerate() {
            let own = traces.iter().zip(&lines);
            let (sum, count) = own
                .filter_map(|(trace, line)| Some(trace[k]? - line[k]))
                .fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
            *value = sum / f64::max(count, 1.0);
        }
        for (trace, line) in traces.iter().zip(&mut lines) {
            let left: Vec<Option<f64>> = (trace.iter().zip(&profile))
                .map(|(v, m)| Some((*v)? - m))
                .collect();
            if round < ROUNDS.0 {
                line.fill(mean(&left));
            } else {
                for (k, height) in line.iter_mut().enumerate() {
                    *height = line_at(&left, k);
                }
            }
        }
        if round < ROUNDS.0 {
            continue;
        }
        // What all traces turn alike is the profile's.
        for k in 0..places {
            let common = lines.iter().map(|l| l[k]).sum::<f64>() / lines.len() as f64;
            lines.iter_mut().for_each(|line| line[k] -= common);
        }
    }
    (profile, lines)
}

/// The mean of the values that are there.
fn mean(values: &[Option<f64>]) -> f64 {
    let there = values.iter().flatten();
    there.clone().sum::<f64>() / there.count().max(1) as f64
}

/// The height, at a place, of the line through the values of the places near it; level through a single one.
fn line_at(values: &[Option<f64>], at: usize) -> f64 {
    let from = at.saturating_sub(NEAR);
    let near = &values[from..(at + NEAR + 1).min(values.len())];
    let height = mean(near);
    let there = || (near.iter().zip(from..)).filter_map(|(v, k)| Some((k as f64, (*v)?)));
    let centre = there().map(|(k, _)| k).sum::<f64>() / there().count().max(1) as f64;
    let spread: f64 = there().map(|(k, _)| (k - centre).powi(2)).sum();
    if spread == 0.0 {
        return height;
    }
    let slope = there().map(|(k, v)| (k - centre) * v).sum::<f64>() / spread;
    height + slope * (at as f64 - centre)
}

/// A trace with what it lacks put in.
fn completed(
    trace: &[Option<f64>],
    profile: &[f64],
    line: &[f64],
    traces: usize,
    random: &mut ChaCha8Rng,
) -> Vec<f64> {
    let deviation: Vec<Option<f64>> = (trace.iter().zip(profile).zip(line))
        .map(|((v, m), l)| Some((*v)? - m - l))
        .collect();
    let beside = |k: usize| {
        let before = k.checked_sub(1).and_then(|k| deviation[k]).unwrap_or(0.0);
        before + deviation.get(k + 1).copied().flatten().unwrap_or(0.0)
    };
    let pairs = || (0..trace.len()).filter_map(|k| Some((deviation[k]?, beside(k))));
    let (product, square) = pairs().fold((0.0, 0.0), |(p, s), (d, b)| (p + d * b, s + b * b));
    let share = if square > 0.0 { product / square } else { 0.0 };
    // The fit of profile and line takes a part of what is left.
    let taken = (1.0 - 1.0 / traces as f64) * (1.0 - LINE / (2 * NEAR + 1) as f64);
    let remainders: Vec<f64> = pairs()
        .map(|(d, b)| (d - share * b) / taken.sqrt())
        .collect();
    let put_in = |k: usize, random: &mut ChaCha8Rng| {
        let drawn = if remainders.is_empty() {
            0.0
        } else {
            remainders[random.random_range(0..remainders.len())]
        };
        profile[k] + line[k] + share * beside(k) + drawn
    };
    (0..trace.len())
        .map(|k| trace[k].unwrap_or_else(|| put_in(k, random)))
        .collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};

    use super::*;

    const PLACES: usize = 150;
    const NOISE: f64 = 0.1;

    /// Eight traces of a channel, four a direction, on a wave with an offset each; every seventh reading lacks.
    fn lanes() -> (Vec<Lane>, Vec<Vec<f64>>) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let noise = Normal::new(0.0, NOISE).unwrap();
        let mut lanes = Vec::new();
        let mut truth = Vec::new();
        for t in 0..8 {
            let true_at = |k: usize| (0.2 * k as f64).sin() + 0.3 * f64::from(t);
            truth.push((0..PLACES).map(true_at).collect());
            let cells = (0..PLACES).map(|k| {
                let value = true_at(k) + noise.sample(&mut random);
                (!random.random_bool(1.0 / 7.0)).then_some(value)
            });
            lanes.push(((0, t as u32 / 2, t % 2 == 1), cells.collect()));
        }
        (lanes, truth)
    }

    #[test]
    fn what_is_there_stays_and_what_lacks_scatters_as_the_rest() {
        let (lanes, truth) = lanes();
        let full = filled(&lanes);
        let (mut square, mut count) = (0.0, 0.0);
        for ((lane, own), truth) in lanes.iter().zip(&full).zip(&truth) {
            for k in 0..PLACES {
                match lane.1[k] {
                    Some(value) => assert_eq!(value, own[k]),
                    None => {
                        square += (own[k] - truth[k]).powi(2);
                        count += 1.0;
                    }
                }
            }
        }
        // Statistical: a reading of its own, and the error of the profile of three or four readings: 1 to
        // √(1 + 1/3) noises, of some 170 readings to 6 %, three times that.
        let rms = f64::sqrt(square / count) / NOISE;
        assert!((0.85..1.4).contains(&rms), "{rms} of {count}");
    }

    #[test]
    fn too_much_is_not_put_in() {
        let (lanes, _) = lanes();
        let present = |lanes: &[Lane]| -> Vec<(TraceKey, Vec<bool>)> {
            let of = |(key, own): &Lane| (*key, own.iter().map(Option::is_some).collect());
            lanes.iter().map(of).collect()
        };
        assert!(can_be_told(&present(&lanes)));
        // Of three traces none tells another's profile.
        assert!(!can_be_told(&present(&lanes[..3])));
        let mut long = present(&lanes);
        long[0].1[40..47].fill(false);
        assert!(!can_be_told(&long));
        let mut most = present(&lanes);
        for k in (0..PLACES).step_by(3) {
            most[1].1[k] = false;
        }
        assert!(!can_be_told(&most));
    }
}
