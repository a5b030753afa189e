//! When the heights of repeats are unknowns of a fit, each by itself.
//!
//! An indicator that is set to zero anew before every repeat shifts the repeat as a whole, by far more than its readings
//! scatter. As noise such a shift would be the greatest of all by far and known from a few repeats only, and whatever is
//! looked for would be looked for beside it. As an unknown of the fit it takes nothing from what a trace shows along itself.
//! What shows in heights alone, a lost motion between directions or a drift from repeat to repeat, is then not seen; so heights
//! are left to noise and effects unless nearly all channels have them, and they follow no course. Where channels are read each way,
//! see [`passes`](super::passes).

use std::collections::BTreeMap;

use super::alike::lines;
use super::survey::Survey;
use super::traces;

/// Standard deviation of heights, in that of a reading from what its repeats have in common, from which on they stand apart.
const APART: f64 = 3.0;
/// Least share of the channels that have repeats in which these stand apart.
const SHARE: f64 = 0.75;
/// Fewest heights of a channel that show whether they follow a course.
const FEWEST: usize = 3;

/// Least sum of the squared steps from one of n heights to the next, in the sum of the squared heights: 2 is expected where
/// they are independent, 12/(n(n + 1)) where they rise evenly.
fn least_steps(heights: usize) -> f64 {
    0.4 + 2.4 / heights as f64
}

/// The traces of one channel in one direction beside what they have in common.
pub struct Repeats {
    pub channel: usize,
    /// The number of each repeat and how far it lies above the others, µm.
    pub heights: Vec<Height>,
    /// Standard deviation of a reading beside its height, µm, the median of the traces'.
    pub scatter: f64,
}

impl Repeats {
    /// From traces of a channel: the number of each repeat, its height, and by how much its readings lie above what all
    /// have in common and their height.
    pub fn new(channel: usize, traces: &[(u32, f64, Vec<f64>)]) -> Self {
        // A mean over m traces has taken 1/m of the variance, the height one of n.
        let kept = 1.0 - 1.0 / traces.len().max(2) as f64;
        let scatter = |left: &Vec<f64>| {
            let squares: f64 = left.iter().map(|l| l * l).sum();
            (squares / (kept * (left.len() as f64 - 1.0).max(1.0))).sqrt()
        };
        let mut scatters: Vec<f64> = traces.iter().map(|(_, _, left)| scatter(left)).collect();
        scatters.sort_by(f64::total_cmp);
        Self {
            channel,
            heights: traces.iter().map(|(r, height, _)| (*r, *height)).collect(),
            scatter: scatters.get(scatters.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

/// A trace's repeat and its height, µm.
pub type Height = (u32, f64);

/// The heights of all traces of a channel in the order of their times.
pub struct Course {
    /// Which indicator reads the channel.
    pub indicator: usize,
    pub heights: Vec<Height>,
}

/// Whether heights are unknowns, and if so whether both directions of a repeat have heights of their own.
pub fn are_free(repeats: &[Repeats], courses: &[Course]) -> Option<bool> {
    let by_pass = are_by_pass(repeats);
    (stand_apart(repeats) && follow_none(courses, by_pass)).then_some(by_pass)
}

/// Whether the heights stand apart in nearly all channels.
fn stand_apart(repeats: &[Repeats]) -> bool {
    // Squares of heights and of scatter, each as often as heights are free.
    let mut channels: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for own in repeats.iter().filter(|own| own.heights.len() > 1) {
        let squares = own.heights.iter().map(|(_, h)| h * h).sum::<f64>();
        let sums = channels.entry(own.channel).or_default();
        sums.0 += squares;
        sums.1 += (own.heights.len() - 1) as f64 * own.scatter * own.scatter;
    }
    let apart = channels.values().filter(|(h, s)| *h > APART * APART * s);
    !channels.is_empty() && apart.count() as f64 >= SHARE * channels.len() as f64
}

/// Whether heights jump from each to the next as independent ones do, where enough of them follow each other; of two a
/// channel, whether an indicator's rise in one channel and fall in another.
fn follow_none(courses: &[Course], by_pass: bool) -> bool {
    let (mut steps, mut least) = (0.0, 0.0);
    let mut rises: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
    for course in courses {
        let of_one = |a: &Height, b: &Height| !by_pass && a.0 == b.0;
        let mean = |own: &[Height]| own.iter().map(|(_, h)| h).sum::<f64>() / own.len() as f64;
        let own: Vec<f64> = course.heights.chunk_by(of_one).map(mean).collect();
        if let [first, second] = own[..] {
            rises.entry(course.indicator).or_default()[usize::from(second > first)] = true;
        }
        let middle = own.iter().sum::<f64>() / own.len().max(1) as f64;
        let squares: f64 = own.iter().map(|h| (h - middle).powi(2)).sum();
        if own.len() >= FEWEST && squares > 0.0 {
            let to_next = own.windows(2).map(|w| (w[1] - w[0]).powi(2));
            steps += to_next.sum::<f64>() / squares;
            least += least_steps(own.len());
        }
    }
    if least > 0.0 {
        steps >= least
    } else {
        rises.values().any(|both| *both == [true; 2])
    }
}

/// Whether the two directions of a repeat stand apart from each other too, by other amounts in each repeat.
fn are_by_pass(repeats: &[Repeats]) -> bool {
    let mut both: BTreeMap<(usize, u32), Vec<f64>> = BTreeMap::new();
    let mut scatter = 0.0_f64;
    for own in repeats {
        scatter = scatter.max(own.scatter);
        for (repeat, height) in &own.heights {
            both.entry((own.channel, *repeat))
                .or_default()
                .push(*height);
        }
    }
    let pairs: Vec<f64> = (both.values())
        .filter(|heights| heights.len() == 2)
        .map(|heights| (heights[1] - heights[0]).powi(2) / 2.0)
        .collect();
    let mean = pairs.iter().sum::<f64>() / pairs.len().max(1) as f64;
    pairs.is_empty() || mean > APART * APART * scatter * scatter
}

impl Survey<'_> {
    /// Whether the heights of the repeats are unknowns, and if so whether both directions of a repeat have heights of their
    /// own; `time` is that of one of a channel's readings.
    pub fn free_heights(&self, time: impl Fn(usize, usize) -> f64) -> Option<bool> {
        if self.passes_are_zeroed() {
            return Some(true);
        }
        let repeats: Vec<Repeats> = (self.repeats.iter())
            .map(|group| {
                let traces = &self.traces[group.channel];
                let means = group.means(traces, self.x[group.channel], self.values[group.channel]);
                let found = lines(group, None, &means);
                let (mut common, mut count) = (vec![0.0; group.positions.len()], 0.0);
                let known = || {
                    let pairs = means.iter().zip(&found).zip(&group.traces);
                    pairs.filter_map(|((own, line), t)| Some((own, line.as_ref()?[0], *t)))
                };
                let mut of_cell = vec![0.0; group.positions.len()];
                for (own, height, _) in known() {
                    count += 1.0;
                    for (cell, mean) in own {
                        common[*cell] += mean - height;
                        of_cell[*cell] += 1.0;
                    }
                }
                let left = |(own, height, t): (&Vec<(usize, f64)>, f64, usize)| {
                    let all = own.iter().filter(|(cell, _)| of_cell[*cell] >= 0.5 * count);
                    let left =
                        all.map(|(cell, mean)| mean - height - common[*cell] / of_cell[*cell]);
                    (traces[t].repeat, height, left.collect())
                };
                Repeats::new(group.channel, &known().map(left).collect::<Vec<_>>())
            })
            .collect();
        let courses: Vec<Course> = (0..self.channels())
            .map(|c| Course {
                indicator: self.indicator(c),
                heights: self.course(c, |row| time(c, row)),
            })
            .collect();
        are_free(&repeats, &courses)
    }

    /// The heights of a channel's traces in the order of their times.
    fn course(&self, channel: usize, time: impl Fn(usize) -> f64) -> Vec<Height> {
        let traces = &self.traces[channel];
        let group = traces::of_channel(channel, self.x[channel], traces);
        let means = group.means(traces, self.x[channel], self.values[channel]);
        let at = |t: usize| {
            let all = (0..traces[t].len()).map(|k| time(traces[t].row(k)));
            all.sum::<f64>() / traces[t].len() as f64
        };
        let found = lines(&group, None, &means);
        let mut course: Vec<(f64, Height)> = (group.traces.iter().zip(found))
            .filter_map(|(t, line)| Some((at(*t), (traces[*t].repeat, line?[0]))))
            .collect();
        course.sort_by(|a, b| a.0.total_cmp(&b.0));
        course.into_iter().map(|(_, height)| height).collect()
    }
}
