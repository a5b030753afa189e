//! What errors that nobody has listed may be functions of.

use errsep_models::model::{Course, Covariate, FittedModel};
use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::attribution::context::Context;
use crate::detection::fitted::without_misfit;

/// Cosines that make a smooth function: their sum is a Gaussian process but for its fourth moments,
/// which are off by 1/16 of themselves.
const COSINES: usize = 24;
/// Points a length at which it is reckoned, straight between them.
const FINENESS: f64 = 8.0;
/// Greatest length, in ranges, of functions that may be as good as straight.
const STRAIGHT: f64 = 4.0;
/// Part of the range by which values of the same place may differ by rounding.
const ROUNDING: f64 = 1e-9;

/// What smooth rivals may be functions of.
pub(crate) struct Grounds {
    pub position: Ground,
    pub time: Ground,
    pub reading: Ground,
    /// Position and time of the products.
    pub both: (Ground, Ground),
    pub covariates: Vec<Along>,
}

/// A covariate of the model.
pub(crate) struct Along {
    pub name: String,
    pub ground: Ground,
    /// How errors change along it.
    pub course: Course,
}

impl Grounds {
    /// Those of a context.
    pub fn of(context: &Context<'_>) -> Self {
        let places = context.model.places();
        // What the model reads: a gap is no function of itself, nor of the noise.
        let reading = Ground::new(without_misfit(context.model).iter().copied().collect());
        // What reads the same all along, but for noise, carries no function of the reading.
        let varies = reading.range > context.law.sigma();
        let position = Ground::new(places.iter().map(|p| p.x).collect());
        let time = Ground::new(places.iter().map(|p| p.time).collect());
        Self {
            both: (
                position.clone().with_straight(),
                time.clone().with_straight(),
            ),
            position,
            time,
            reading: if varies {
                reading
            } else {
                Ground::new(Vec::new())
            },
            covariates: context
                .model
                .covariates()
                .into_iter()
                .map(Ground::of)
                .collect(),
        }
    }
}

/// That of which a smooth rival is a function.
#[derive(Clone)]
pub(crate) struct Ground {
    values: Vec<f64>,
    from: f64,
    pub range: f64,
    spacing: f64,
    /// The greatest length of its smooth functions.
    longest: f64,
    /// What the function is multiplied by, each with a weight of its own.
    factors: Vec<Vec<f64>>,
    /// For every reading the group that has weights of its own.
    groups: Option<Vec<usize>>,
}

impl Ground {
    /// Functions that are as good as straight are drawn only where all readings are one group: with values of its own,
    /// every group may be straight in its own way.
    fn of(covariate: Covariate) -> Along {
        let ground = Self {
            factors: covariate.factors,
            ..Self::new(covariate.values)
        };
        let ground = match covariate.groups {
            None => ground.with_straight(),
            groups => Self { groups, ..ground },
        };
        Along {
            name: covariate.name,
            ground,
            course: covariate.course,
        }
    }

    fn new(values: Vec<f64>) -> Self {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let from = sorted.first().copied().unwrap_or(0.0);
        let range = sorted.last().copied().unwrap_or(0.0) - from;
        sorted.dedup_by(|later, earlier| *later - *earlier <= ROUNDING * range);
        Self {
            values,
            from,
            range,
            spacing: range / sorted.len().saturating_sub(1).max(1) as f64,
            longest: range,
            factors: Vec::new(),
            groups: None,
        }
    }

    /// Whether it has values between which a function can be smooth.
    pub fn may_be_smooth(&self) -> bool {
        self.longest > 2.0 * self.spacing
    }

    /// The same with functions that are as good as straight.
    fn with_straight(self) -> Self {
        Self {
            longest: STRAIGHT * self.range,
            ..self
        }
    }

    /// A smooth function times a normal weight for each channel, factor and group, or for one channel and factor alone.
    pub fn smooth(&self, context: &Context<'_>, random: &mut ChaCha8Rng) -> DVector<f64> {
        let course = self.course(random);
        self.weighted(context, course, random)
    }

    /// Nothing up to some value and then such weights.
    pub fn step(&self, context: &Context<'_>, random: &mut ChaCha8Rng) -> DVector<f64> {
        let from = self.from + self.range * random.random::<f64>();
        let after = self
            .values
            .iter()
            .map(|v| if *v > from { 1.0 } else { 0.0 });
        let course = DVector::from_iterator(self.values.len(), after);
        self.weighted(context, course, random)
    }

    /// In proportion to its factors, with such weights.
    pub fn proportional(&self, context: &Context<'_>, random: &mut ChaCha8Rng) -> DVector<f64> {
        let course = DVector::from_element(self.values.len(), 1.0);
        self.weighted(context, course, random)
    }

    fn weighted(
        &self,
        context: &Context<'_>,
        mut course: DVector<f64>,
        random: &mut ChaCha8Rng,
    ) -> DVector<f64> {
        let channels = context.model.channel_names().len().max(1);
        let group = |k: usize| self.groups.as_ref().map_or(0, |groups| groups[k]);
        let last = self.groups.iter().flatten().max();
        let groups = last.map_or(1, |last| last + 1);
        // Half of them are errors of one channel only, by one factor.
        let strands = channels * self.factors.len().max(1);
        let only = (random.random::<f64>() < 0.5).then(|| random.random_range(0..strands));
        let weights: Vec<f64> = (0..groups * strands)
            .map(|k| {
                let weight: f64 = StandardNormal.sample(random);
                match only {
                    Some(strand) if k % strands != strand => 0.0,
                    _ => weight,
                }
            })
            .collect();
        let weight = |group: usize, factor: usize, channel: usize| {
            let weight = weights.get(group * strands + factor * channels + channel);
            weight.copied().unwrap_or(1.0)
        };
        for (k, place) in context.model.places().iter().enumerate() {
            let of = |factor: usize| weight(group(k), factor, place.channel);
            let factors = self.factors.iter().enumerate();
            course[k] *= if self.factors.is_empty() {
                of(0)
            } else {
                factors.map(|(j, values)| of(j) * values[k]).sum()
            };
        }
        course
    }

    /// A smooth function.
    pub fn course(&self, random: &mut ChaCha8Rng) -> DVector<f64> {
        let shortest = 2.0 * self.spacing;
        let length = shortest * (self.longest / shortest).powf(random.random::<f64>());
        let cosines: Vec<(f64, f64)> = (0..COSINES)
            .map(|_| {
                let frequency: f64 = StandardNormal.sample(random);
                (
                    frequency / length,
                    random.random::<f64>() * std::f64::consts::TAU,
                )
            })
            .collect();
        let step = length / FINENESS;
        let points = (self.range / step).ceil() as usize + 2;
        let grid: Vec<f64> = (0..points)
            .map(|k| {
                let u = k as f64 * step;
                cosines.iter().map(|(w, phase)| (w * u + phase).cos()).sum()
            })
            .collect();
        DVector::from_fn(self.values.len(), |k, _| {
            let at = (self.values[k] - self.from) / step;
            let low = (at as usize).min(points - 2);
            let part = at - low as f64;
            (1.0 - part) * grid[low] + part * grid[low + 1]
        })
    }
}
