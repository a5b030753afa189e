//! Rivals: what else could have made a gap of the same visible size.

use errsep_models::model::FittedModel;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::diagnosis::attribution::context::Context;
use crate::diagnosis::detection::dictionary::{Entry, Meaning};
use crate::diagnosis::detection::fitted::without_misfit;
use crate::diagnosis::detection::null::{BATCH, seen, statistics};
use crate::diagnosis::levels::{INVISIBLE, SAME};
use crate::diagnosis::noise::law::draw_scatter;
use crate::diagnosis::noise::spikes::Spikes;
use crate::diagnosis::severity::stage::Name;

/// Cosines that make a smooth function: their sum is a Gaussian process but for its fourth moments,
/// which are off by 1/16 of themselves.
const COSINES: usize = 24;
/// Points a length at which it is reckoned, straight between them.
const FINENESS: f64 = 8.0;
/// Rounds of drawing smooth functions until a batch is full: fewer rivals are taken where most are like
/// the effect.
const ROUNDS: usize = 6;
/// Effects tried for each that is wanted: few of a family may be possible at the size of the gap.
const TRIES: usize = 64;
/// Part of the range by which values of the same place may differ by rounding.
const ROUNDING: f64 = 1e-9;

/// A family of rivals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::diagnosis) enum Family {
    /// An effect of the catalogue.
    Effect(usize),
    /// Smooth functions of the position.
    Position,
    /// Of the time.
    Time,
    /// Of the reading.
    Reading,
}

impl Family {
    /// All families but the effects of a group.
    pub fn beside(context: &Context<'_>, members: &[usize]) -> Vec<Self> {
        let others = (0..context.catalogue.len()).filter(|k| !members.contains(k));
        others
            .map(Self::Effect)
            .chain([Self::Position, Self::Time, Self::Reading])
            .collect()
    }

    pub fn name(self, context: &Context<'_>) -> String {
        match self {
            Self::Effect(k) => context.catalogue[k].name().to_owned(),
            Self::Position => "smooth in position".to_owned(),
            Self::Time => "smooth in time".to_owned(),
            Self::Reading => "smooth in reading".to_owned(),
        }
    }

    /// The stream of random numbers that is its own, whatever else is in the catalogue.
    fn stream(self, context: &Context<'_>) -> u64 {
        let name = self.name(context);
        // FNV-1a.
        name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }
}

/// Rivals with their noise, one a column; those beyond `count` are zero.
pub(in crate::diagnosis) struct Drawn {
    pub readings: DMatrix<f64>,
    pub count: usize,
    /// The family of the dictionary that they were drawn from.
    pub family: Option<usize>,
}

impl Drawn {
    /// At most `most` rivals of a family, each of the visible size of the gap.
    pub fn of(
        context: &Context<'_>,
        name: &Name,
        (family, grounds): (Family, &Grounds),
        (seed, batch): (u64, usize),
        most: usize,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ family.stream(context));
        random.set_stream(batch as u64 + 1);
        let most = most.min(BATCH);
        let gaps = match family {
            Family::Effect(k) => effects(context, name, k, most, &mut random),
            Family::Position => smooth(context, name, &grounds.position, most, &mut random),
            Family::Time => smooth(context, name, &grounds.time, most, &mut random),
            Family::Reading => smooth(context, name, &grounds.reading, most, &mut random),
        };
        let spikes = Spikes::new(context.model);
        let mut readings = DMatrix::zeros(context.space.readings(), BATCH);
        for (k, gap) in gaps.iter().enumerate() {
            let draw = batch * BATCH + k;
            let noise = context
                .law
                .draw_possible(context.model, &spikes, draw, &mut random)
                + draw_scatter(context.model, &mut random);
            readings.column_mut(k).copy_from(&(gap + noise));
        }
        let family = match family {
            Family::Effect(k) => context.family_of(k),
            _ => None,
        };
        Self {
            readings,
            count: gaps.len(),
            family,
        }
    }
}

/// Gaps that an effect makes at sizes that it could have, without noise.
fn effects(
    context: &Context<'_>,
    name: &Name,
    effect: usize,
    most: usize,
    random: &mut ChaCha8Rng,
) -> Vec<DVector<f64>> {
    let families = &context.dictionary.families;
    let Some(entries) = context.family_of(effect).map(|f| &families[f].entries) else {
        return Vec::new();
    };
    if entries.is_empty() {
        return Vec::new();
    }
    let mut possible = Vec::new();
    for _ in 0..TRIES * most {
        let entry = &context.dictionary.entries[random.random_range(entries.clone())];
        let mut sizes = amplitudes(entry, random);
        sizes *= name.size / sizes.dot(&(&entry.gram * &sizes)).sqrt();
        if could_be(context, effect, entry, &sizes) {
            possible.push((entry, sizes));
        }
        if possible.len() == most {
            break;
        }
    }
    let gap = |(entry, sizes): (&Entry, DVector<f64>)| {
        let mut sum = DVector::zeros(context.space.readings());
        let columns = context.dictionary.columns(entry);
        for (signature, size) in columns.iter().zip(sizes.iter()) {
            for (&row, value) in signature.rows.iter().zip(&signature.values) {
                sum[row] += size * value;
            }
        }
        sum
    };
    possible.into_iter().map(gap).collect()
}

/// Smooth gaps that are none of the effects of a group, without noise.
fn smooth(
    context: &Context<'_>,
    name: &Name,
    ground: &Ground,
    most: usize,
    random: &mut ChaCha8Rng,
) -> Vec<DVector<f64>> {
    let mut gaps = Vec::new();
    if !(ground.range > 2.0 * ground.spacing) {
        return gaps;
    }
    for _ in 0..ROUNDS {
        let mut raw = DMatrix::zeros(context.space.readings(), BATCH);
        for mut column in raw.column_iter_mut() {
            column.copy_from(&ground.smooth(context, random));
        }
        let (left, whole) = context.space.forward(raw.clone());
        let sizes: Vec<f64> = left.column_iter().map(|c| c.norm()).collect();
        let alike = cosines(context, name, left);
        let usable = (0..BATCH)
            .filter(|k| sizes[*k] * sizes[*k] > INVISIBLE * whole[*k] * whole[*k])
            .filter(|k| alike[*k] < SAME);
        gaps.extend(usable.map(|k| raw.column(k) * (name.size / sizes[k])));
        if gaps.len() >= most {
            break;
        }
    }
    gaps.truncate(most);
    gaps
}

/// Amplitudes of which all visible directions are as probable.
fn amplitudes(entry: &Entry, random: &mut ChaCha8Rng) -> DVector<f64> {
    let n = entry.order();
    let normal = DVector::from_fn(n, |_, _| StandardNormal.sample(random));
    if n == 1 {
        let sign: f64 = normal[0];
        return DVector::from_element(1, if entry.positive { 1.0 } else { sign.signum() });
    }
    let lifted = &entry.gram + DMatrix::identity(n, n) * (1e-9 * entry.gram.trace());
    let root = lifted.cholesky().map(|factor| factor.l().transpose());
    root.and_then(|root| root.solve_upper_triangular(&normal))
        .unwrap_or(normal)
}

/// Whether an effect could be of these sizes.
fn could_be(context: &Context<'_>, effect: usize, entry: &Entry, sizes: &DVector<f64>) -> bool {
    let Meaning::Effect(shape) = &entry.meaning else {
        return false;
    };
    let known = vec![0.0; sizes.len()];
    context.plausible(effect, shape, sizes.as_slice(), &known)
}

/// Cosine of each smooth rival to the nearest member of the group.
fn cosines(context: &Context<'_>, name: &Name, left: DMatrix<f64>) -> Vec<f64> {
    let squares: Vec<f64> = left.column_iter().map(|c| c.norm_squared()).collect();
    let adjoint = seen(&context.dictionary, &context.space, left);
    let mut greatest = vec![0.0f64; BATCH];
    for family in name.members.iter().filter_map(|k| context.family_of(*k)) {
        let family = &context.dictionary.families[family];
        for most in statistics(&context.dictionary, family, &adjoint).values() {
            for (greatest, t) in greatest.iter_mut().zip(most) {
                *greatest = greatest.max(*t);
            }
        }
    }
    let pairs = greatest.iter().zip(squares);
    pairs
        .map(|(t, square)| (t / square.max(f64::MIN_POSITIVE)).sqrt())
        .collect()
}

/// What smooth rivals may be functions of.
pub(in crate::diagnosis) struct Grounds {
    position: Ground,
    time: Ground,
    reading: Ground,
}

impl Grounds {
    /// Those of a context.
    pub fn of(context: &Context<'_>) -> Self {
        let places = context.model.places();
        // What the model reads: a gap is no function of itself, nor of the noise.
        let reading = Ground::new(without_misfit(context.model).iter().copied().collect());
        // What reads the same all along, but for noise, carries no function of the reading.
        let varies = reading.range > context.law.sigma();
        Self {
            position: Ground::new(places.iter().map(|p| p.x).collect()),
            time: Ground::new(places.iter().map(|p| p.time).collect()),
            reading: if varies {
                reading
            } else {
                Ground::new(Vec::new())
            },
        }
    }
}

/// That of which a smooth rival is a function.
struct Ground {
    values: Vec<f64>,
    from: f64,
    range: f64,
    spacing: f64,
}

impl Ground {
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
        }
    }

    /// A smooth function times a normal weight for each channel.
    fn smooth(&self, context: &Context<'_>, random: &mut ChaCha8Rng) -> DVector<f64> {
        let shortest = 2.0 * self.spacing;
        let length = shortest * (self.range / shortest).powf(random.random::<f64>());
        let cosines: Vec<(f64, f64)> = (0..COSINES)
            .map(|_| {
                let frequency: f64 = StandardNormal.sample(random);
                (
                    frequency / length,
                    random.random::<f64>() * std::f64::consts::TAU,
                )
            })
            .collect();
        let channels = context.model.channel_names().len();
        let weights: Vec<f64> = (0..channels.max(1))
            .map(|_| StandardNormal.sample(random))
            .collect();
        let step = length / FINENESS;
        let points = (self.range / step).ceil() as usize + 2;
        let grid: Vec<f64> = (0..points)
            .map(|k| {
                let u = k as f64 * step;
                cosines.iter().map(|(w, phase)| (w * u + phase).cos()).sum()
            })
            .collect();
        let places = context.model.places();
        DVector::from_fn(self.values.len(), |k, _| {
            let at = (self.values[k] - self.from) / step;
            let low = (at as usize).min(points - 2);
            let part = at - low as f64;
            let value = (1.0 - part) * grid[low] + part * grid[low + 1];
            value * weights.get(places[k].channel).copied().unwrap_or(1.0)
        })
    }
}
