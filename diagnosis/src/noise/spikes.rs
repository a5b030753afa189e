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
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::levels::{FEWEST_CONTRASTS, HEAVY_BY_CHANCE, HEAVY_TAILS, SPIKE_REPEATS, SPIKE_TRACE};
use crate::noise::by_fit::ByFit;
use crate::noise::contrasts::Contrasts;
use crate::noise::piles::{Heights, NEAR, Pile, SIGMA, alone, edge, groups, stands_out};

/// Degrees of freedom among which the tails are sought.
const FREEDOMS: [f64; 10] = [2.1, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0];
/// Readings of noise with which tails are compared, at least.
const DRAWN: usize = 3000;
/// Part of normal noise that is beyond three standard deviations.
const BEYOND: f64 = 0.0027;
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

/// What is left of readings.
type Left = dyn Fn(&DVector<f64>) -> DVector<f64> + Send + Sync;

/// What a fit leaves of readings whose noise is white.
pub(crate) struct Residual {
    pub of: Box<Left>,
    /// Its degrees of freedom.
    pub freedom: usize,
}

/// Where spikes are looked for.
pub(crate) struct Spikes {
    piles: Vec<Pile>,
    by_fit: Option<ByFit>,
    /// Standard deviation of the difference of two readings from their rounding alone.
    least: f64,
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
    /// Heights that are independent of each other, about.
    independent: usize,
}

impl Weight {
    /// Whether normal noise hardly has such tails.
    fn is_heavy(&self) -> bool {
        let beyond = (self.beyond * self.independent as f64).round() as u64;
        let by_chance = Binomial::new(BEYOND, self.independent as u64);
        let by_chance = by_chance.map_or(1.0, |law| law.sf(beyond.saturating_sub(1)));
        self.beyond > HEAVY_TAILS && beyond > 0 && by_chance < HEAVY_BY_CHANCE
    }
}

impl Spikes {
    /// `residual`: what the model's fit leaves, asked for where repeats are too few.
    pub fn new(model: &AnyModel, residual: impl FnOnce() -> Residual) -> Self {
        if model.names_single_readings() {
            return Self {
                piles: Vec::new(),
                by_fit: None,
                least: 0.0,
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
        Self {
            piles,
            by_fit,
            least: 2f64.sqrt() * model.rounding(),
        }
    }

    /// The readings with their spikes pulled in, and the law of heavy tails if they have them.
    pub fn calmed(&self, model: &AnyModel, readings: &DVector<f64>) -> Calmed {
        let mut calmed = readings.clone();
        let count = self.pull_in(&mut calmed);
        let tails = self
            .weight(readings)
            .filter(Weight::is_heavy)
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
            let within = NEAR..near.len() - NEAR;
            let own = near.iter().enumerate().filter(|(k, _)| within.contains(k));
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
        let by_fit = self.by_fit.as_ref().filter(|_| self.piles.is_empty());
        let independent = by_fit.map_or(heights.len(), |by_fit| by_fit.residual.freedom);
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = heights[heights.len() / 2].0.max(self.least / SIGMA);
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
            independent: independent.min(n),
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
        let Some(edge) = edge(&heights, self.least) else {
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
