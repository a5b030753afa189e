//! Heavy tails: single readings that stand out of their neighbours and of their own repeats.
//!
//! One such reading carries more weight than a hundred others, swells the noise and passes for dirt.
//! It is pulled in to the edge of what noise does (Huber's winsorising) before anything is tested,
//! so that noise, tests and sizes all see the same readings. Where such readings are too many for
//! normal noise with a few accidents, the noise itself has heavy tails: then the null law is drawn
//! with Student's law of as many degrees of freedom as make the same tails, pulled in likewise.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StudentT};

use crate::levels::{FEWEST_CONTRASTS, HEAVY_TAILS, KEPT, SPIKE, SPIKE_REPEATS, SPIKE_TRACE};
use crate::noise::by_fit::ByFit;
use crate::noise::contrasts::Contrasts;

/// Neighbours on one side.
const SIDE: usize = 7;
/// Degrees of freedom among which the tails are sought.
const FREEDOMS: [f64; 10] = [2.1, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0];
/// Readings of noise with which tails are compared, at least.
const DRAWN: usize = 3000;
/// Seed of the noise with which tails are compared.
const SEED: u64 = 0x7461_696c;

/// Student's law of the noise of single readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tails {
    /// Degrees of freedom.
    pub freedom: f64,
    /// Variance that is left of noise of unit scale when its spikes are pulled in.
    pub variance: f64,
    /// That over what differences of neighbours tell of it.
    pub by_neighbours: f64,
}

impl Tails {
    /// Noise of unit scale of all readings of a model.
    pub(crate) fn draw(&self, model: &AnyModel, random: &mut ChaCha8Rng) -> Option<DVector<f64>> {
        let law = StudentT::new(self.freedom).ok()?;
        Some(DVector::from_fn(model.places().len(), |_, _| {
            law.sample(random)
        }))
    }
}

/// What a fit leaves of readings whose noise is white.
pub(crate) struct Residual {
    pub of: Box<dyn Fn(&DVector<f64>) -> DVector<f64> + Send + Sync>,
    /// Its degrees of freedom.
    pub freedom: usize,
}

/// Where spikes are looked for.
pub(crate) struct Spikes {
    piles: Vec<Pile>,
    by_fit: Option<ByFit>,
}

/// Traces of one channel on the same cells: of one direction, or of both where one alone has too few.
pub(crate) struct Pile {
    /// The rows of each trace, in the order of the cells.
    pub traces: Vec<Vec<usize>>,
    backward: Vec<bool>,
}

/// Deviations along a trace, and their heights over the neighbours.
pub(crate) type Heights = (Vec<f64>, Vec<f64>);

pub(crate) struct Group {
    pub starts: Vec<usize>,
    pub length: usize,
}

/// Traces on the same cells in the same direction.
pub(crate) fn groups(model: &AnyModel) -> impl Iterator<Item = Group> {
    let mut groups: BTreeMap<(Vec<usize>, bool), Group> = BTreeMap::new();
    for trace in model.traces() {
        let places = &model.places()[trace.clone()];
        let cells = places.iter().map(|p| p.cell).collect();
        let backward = places.first().is_some_and(|p| p.direction < 0.0);
        groups
            .entry((cells, backward))
            .or_insert_with(|| Group {
                starts: Vec::new(),
                length: trace.len(),
            })
            .starts
            .push(trace.start);
    }
    groups.into_values()
}

/// Readings with single spikes pulled in.
pub(crate) struct Calmed {
    pub readings: DVector<f64>,
    /// Number of readings that were pulled in.
    pub count: usize,
    /// The law of the single readings where it has heavy tails.
    pub tails: Option<Tails>,
}

/// What tells how heavy tails are: the part of the readings beyond three standard deviations, and
/// the 99th percentile of their heights over the median.
struct Weight {
    beyond: f64,
    ratio: f64,
}

impl Spikes {
    /// `residual`: what the model's fit leaves, asked for where repeats are too few.
    pub fn new(model: &AnyModel, residual: impl FnOnce() -> Residual) -> Self {
        if model.names_single_readings() {
            return Self {
                piles: Vec::new(),
                by_fit: None,
            };
        }
        let mut piles = Vec::new();
        let mut few: BTreeMap<Vec<usize>, Pile> = BTreeMap::new();
        for group in groups(model).filter(|g| g.length >= SPIKE_TRACE) {
            let pile = Pile::of(model, &group);
            if group.starts.len() >= SPIKE_REPEATS {
                piles.push(pile);
                continue;
            }
            let cells = pile.traces[0].iter().map(|row| model.places()[*row].cell);
            match few.entry(cells.collect()) {
                Entry::Vacant(place) => {
                    place.insert(pile);
                }
                Entry::Occupied(mut known) => {
                    known.get_mut().traces.extend(pile.traces);
                    known.get_mut().backward.extend(pile.backward);
                }
            }
        }
        let (enough, few): (Vec<Pile>, Vec<Pile>) = few
            .into_values()
            .partition(|p| p.traces.len() >= SPIKE_REPEATS);
        piles.extend(enough);
        let by_fit = (!few.is_empty()).then(|| ByFit::new(model, few, residual()));
        Self { piles, by_fit }
    }

    /// The readings with their spikes pulled in, and the law of heavy tails if they have them.
    pub fn calmed(&self, model: &AnyModel, readings: &DVector<f64>) -> Calmed {
        let mut calmed = readings.clone();
        let count = self.pull_in(&mut calmed);
        let tails = self
            .weight(readings)
            .filter(|w| w.beyond > HEAVY_TAILS)
            .and_then(|weight| {
                FREEDOMS
                    .iter()
                    .filter_map(|freedom| self.compared(model, *freedom, &weight))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
            })
            .map(|(_, tails)| tails);
        Calmed {
            readings: calmed,
            count,
            tails,
        }
    }

    /// How far Student's law is from the tails seen, and what it leaves when pulled in.
    fn compared(&self, model: &AnyModel, freedom: f64, seen: &Weight) -> Option<(f64, Tails)> {
        let law = StudentT::new(freedom).ok()?;
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let count = model.places().len();
        let sets = DRAWN.div_ceil(count.max(1));
        let (mut ratio, mut variance) = (0.0, 0.0);
        for _ in 0..sets {
            let mut noise = DVector::from_fn(count, |_, _| law.sample(&mut random));
            ratio += self.weight(&noise)?.ratio / sets as f64;
            self.pull_in(&mut noise);
            let contrasts = Contrasts::of(model, &noise);
            let (own, _) = contrasts.scatter();
            let by_fit = self.by_fit.as_ref();
            let by_fit = by_fit.filter(|_| contrasts.count() < FEWEST_CONTRASTS);
            variance += by_fit.map_or(own, |b| b.variance(&noise)) / sets as f64;
        }
        let tails = Tails {
            freedom,
            variance,
            by_neighbours: 1.0,
        };
        Some(((ratio / seen.ratio).ln().abs(), tails))
    }

    fn weight(&self, readings: &DVector<f64>) -> Option<Weight> {
        let mut heights: Vec<(f64, bool)> = Vec::new();
        let mut add = |away: &[f64], near: &[f64]| {
            let own = near.iter().enumerate();
            heights.extend(own.map(|(k, h)| (h.abs(), alone(away, k, *h))));
        };
        for pile in &self.piles {
            for (away, near) in pile.heights(readings) {
                add(&away, &near);
            }
        }
        if self.piles.is_empty()
            && let Some(by_fit) = &self.by_fit
        {
            let residual = (by_fit.residual.of)(readings);
            for (away, near) in by_fit.heights(&residual).iter().flatten() {
                add(away, near);
            }
        }
        if heights.is_empty() {
            return None;
        }
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = heights[heights.len() / 2].0;
        // Steps and bumps are no tails.
        let usual = |(size, alone): &(f64, bool)| *alone || *size <= 3.0 * SIGMA * middle;
        let sizes: Vec<f64> = heights.into_iter().filter(usual).map(|h| h.0).collect();
        let n = sizes.len();
        // Of readings that are not finite none is usual.
        if n == 0 {
            return None;
        }
        let far = sizes.partition_point(|s| *s <= 3.0 * SIGMA * middle);
        Some(Weight {
            beyond: (n - far) as f64 / n as f64,
            ratio: sizes[n * 99 / 100] / middle.max(f64::MIN_POSITIVE),
        })
    }

    /// Pulls single spikes in, and counts them.
    pub fn pull_in(&self, readings: &mut DVector<f64>) -> usize {
        let by_fit = self.by_fit.as_ref();
        self.pull_in_by_repeats(readings) + by_fit.map_or(0, |by_fit| by_fit.pull_in(readings))
    }

    /// The same where repeats tell.
    ///
    /// The deviation of a reading from the median of its other repeats holds no form; less the
    /// median of its four neighbours it holds no drift and nothing wider than a reading or two. Beside
    /// a step it stands out of one side only, and in a bump the nearer neighbours have their part.
    fn pull_in_by_repeats(&self, readings: &mut DVector<f64>) -> usize {
        let heights: Vec<Vec<Heights>> = self.piles.iter().map(|p| p.heights(readings)).collect();
        let Some(edge) = edge(&heights) else {
            return 0;
        };
        let mut pulled = Vec::new();
        for (pile, heights) in self.piles.iter().zip(&heights) {
            for (own, (away, near)) in heights.iter().enumerate() {
                for (k, height) in near.iter().enumerate() {
                    let spike = || {
                        stands_out(away, k, *height)
                            && pile.farthest(readings, own, k)
                            && pile.is_of_one(heights, own, k)
                    };
                    if height.abs() > edge && spike() {
                        pulled.push((pile.traces[own][k], height - edge.copysign(*height)));
                    }
                }
            }
        }
        for (row, excess) in &pulled {
            readings[*row] -= excess;
        }
        pulled.len()
    }
}

/// Deviations along a trace with their heights over the median of four neighbours.
pub(crate) fn over_neighbours(away: Vec<f64>) -> Heights {
    let near = (0..away.len())
        .map(|k| away[k] - around(&away, k, 2))
        .collect();
    (away, near)
}

/// How high a spike may stand: by the median of all heights; none where there are no heights.
pub(crate) fn edge(heights: &[Vec<Heights>]) -> Option<f64> {
    let all = heights.iter().flatten().flat_map(|(_, near)| near);
    let mut sizes: Vec<f64> = all.map(|h| h.abs()).collect();
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    Some(SPIKE * SIGMA * *median)
}

/// The standard deviation of normal numbers over the median of their absolute values.
pub(crate) const SIGMA: f64 = 1.4826;

impl Group {
    /// For each trace the deviations from the median of the other repeats.
    pub fn away(&self, readings: &DVector<f64>) -> Vec<Vec<f64>> {
        let traces = self.starts.iter().map(|s| (*s..s + self.length).collect());
        away(&traces.collect::<Vec<Vec<usize>>>(), readings)
    }
}

/// For each of some traces the deviations from the median of the others.
fn away(traces: &[Vec<usize>], readings: &DVector<f64>) -> Vec<Vec<f64>> {
    let mut others = Vec::with_capacity(traces.len());
    (0..traces.len())
        .map(|own| {
            (0..traces[own].len())
                .map(|k| {
                    others.clear();
                    let rest = traces.iter().enumerate().filter(|(j, _)| *j != own);
                    others.extend(rest.map(|(_, rows)| readings[rows[k]]));
                    readings[traces[own][k]] - median(&mut others)
                })
                .collect()
        })
        .collect()
}

impl Pile {
    /// The traces of a group, in the order of their cells.
    fn of(model: &AnyModel, group: &Group) -> Self {
        let places = model.places();
        let rows = |start: &usize| {
            let mut rows: Vec<usize> = (*start..start + group.length).collect();
            rows.sort_by_key(|row| places[*row].cell);
            rows
        };
        let backward = |start: &usize| places[*start].direction < 0.0;
        Self {
            traces: group.starts.iter().map(rows).collect(),
            backward: group.starts.iter().map(backward).collect(),
        }
    }

    /// For each trace the deviations from the median of the others, and their heights over the neighbours.
    fn heights(&self, readings: &DVector<f64>) -> Vec<Heights> {
        let away = away(&self.traces, readings);
        away.into_iter().map(over_neighbours).collect()
    }

    /// Whether no other repeat is farther from the median of all.
    fn farthest(&self, readings: &DVector<f64>, own: usize, k: usize) -> bool {
        let all: Vec<f64> = self.traces.iter().map(|t| readings[t[k]]).collect();
        let usual = median(&mut all.clone());
        let distance = |value: &f64| (value - usual).abs();
        all.iter().all(|v| distance(v) <= distance(&all[own]))
    }

    /// Whether the other traces of its direction do not show a height, where the pile is of both directions: what
    /// differs between these is no spike.
    fn is_of_one(&self, heights: &[Heights], own: usize, k: usize) -> bool {
        if self.backward.iter().all(|b| *b == self.backward[0]) {
            return true;
        }
        let height = heights[own].1[k];
        let alike = |j: &usize| *j != own && self.backward[*j] == self.backward[own];
        let mut others = (0..self.traces.len()).filter(alike).peekable();
        others.peek().is_some()
            && others.all(|j| (height - heights[j].1[k]) * height.signum() > KEPT * height.abs())
    }
}

/// Whether a height is that of a single value.
pub(crate) fn stands_out(values: &[f64], k: usize, height: f64) -> bool {
    let far = values[k] - around(values, k, SIDE);
    height.abs() > KEPT * far.abs() && alone(values, k, height)
}

/// Whether a value stands out of its neighbours on either side by a part of its height.
fn alone(values: &[f64], k: usize, height: f64) -> bool {
    let before = &values[k.saturating_sub(SIDE)..k];
    let after = &values[k + 1..(k + 1 + SIDE).min(values.len())];
    let stands_out = |side: &[f64]| {
        let mut sorted = [0.0; SIDE];
        let sorted = &mut sorted[..side.len()];
        sorted.copy_from_slice(side);
        (values[k] - median(sorted)) * height.signum() > KEPT * height.abs()
    };
    [before, after]
        .into_iter()
        .all(|side| side.is_empty() || stands_out(side))
}

/// The median of the neighbours up to a distance on either side.
fn around(values: &[f64], k: usize, reach: usize) -> f64 {
    let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(values.len()));
    let mut others = [0.0; 2 * SIDE];
    let left = k - from;
    let count = left + to - k - 1;
    others[..left].copy_from_slice(&values[from..k]);
    others[left..count].copy_from_slice(&values[k + 1..to]);
    median(&mut others[..count])
}

pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        0.0
    } else if n % 2 == 1 {
        values[n / 2]
    } else {
        0.5 * (values[n / 2 - 1] + values[n / 2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::calm::spikes as sought;
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand_distr::StandardNormal;

    fn model() -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let scene = Scene::random(100, 4, 1e-5, 2.0, SceneNoise::default(), &mut random);
        let fitted = Linearised::new(&scene.exact(), Assumptions::default()).unwrap();
        AnyModel::new(&fitted)
    }

    /// Student's noise with three degrees of freedom is taken for 2.5 to 4, with 3200 readings, and
    /// normal noise for normal, whatever its seed.
    #[test]
    fn heavy_tails_are_told_from_normal_ones() {
        let model = model();
        let spikes = sought(&model);
        let n = model.observed().len();
        for seed in 0..10 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let student = StudentT::new(3.0).unwrap();
            let heavy = DVector::from_fn(n, |_, _| student.sample(&mut random));
            let tails = spikes.calmed(&model, &heavy).tails.expect("heavy tails");
            assert!((2.5..=4.0).contains(&tails.freedom), "{tails:?}");
            let normal = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
            let calmed = spikes.calmed(&model, &normal);
            assert_eq!(calmed.tails, None);
            // 3200 normal readings hold 0.2 beyond four standard deviations.
            assert!(calmed.count < 5, "{}", calmed.count);
        }
    }

    /// A step is no spike, of whatever size, and makes no tails.
    #[test]
    fn a_step_is_left() {
        let model = model();
        let spikes = sought(&model);
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let n = model.observed().len();
        let noise = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
        for height in [3.0, 10.0, 30.0, 1000.0] {
            let mut stepped = noise.clone();
            for k in 40..100 {
                stepped[k] += height;
            }
            let calmed = spikes.calmed(&model, &stepped);
            assert!(
                (0..100).all(|k| calmed.readings[k] == stepped[k]),
                "{height}"
            );
            assert_eq!(calmed.tails, None, "{height}");
        }
    }

    /// A bump three readings wide in one repeat is no spike; one reading is, and is pulled in.
    #[test]
    fn a_bump_is_left_and_a_spike_is_pulled_in() {
        let model = model();
        let spikes = sought(&model);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let n = model.observed().len();
        let noise = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
        let mut bumped = noise.clone();
        for k in 0..100 {
            let away = (k as f64 - 40.3) / 1.5;
            bumped[k] += 60.0 * (-0.5 * away * away).exp();
        }
        let mut calmed = bumped.clone();
        spikes.pull_in(&mut calmed);
        assert!((30..50).all(|k| calmed[k] == bumped[k]));
        let mut spiked = noise;
        spiked[1040] += 30.0;
        assert!(spikes.pull_in(&mut spiked) >= 1);
        // Four standard deviations of the deviation, 1.3 of the reading's, and the reading's own.
        assert!(spiked[1040] < 10.0, "{}", spiked[1040]);
    }
}
