//! Rivals: what else could have made a gap of the same visible size.

use errsep_models::model::Course;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::attribution::context::Context;
use crate::detection::calm::spikes_of_draws;
use crate::detection::dictionary::{Entry, Meaning};
use crate::detection::null::{BATCH, seen, statistics};
use crate::levels::{INVISIBLE, SAME};
use crate::noise::law::draw_scatter;
use crate::search::Reach;
use crate::severity::grounds::{Ground, Grounds};
use crate::severity::stage::Name;

/// Rounds of drawing smooth functions until a batch is full: fewer rivals are taken where most are like
/// the effect.
const ROUNDS: usize = 6;
/// Effects tried for each that is wanted: few of a family may be possible at the size of the gap.
const TRIES: usize = 64;
/// Cosine to the nearest shape of the dictionary from which on what is sharp may be one of the shapes between.
const UNLIKE: f64 = 0.5;

/// A family of rivals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    /// An effect of the catalogue.
    Effect(usize),
    /// Smooth functions of the position.
    Position,
    /// Of the time.
    Time,
    /// Of the reading.
    Reading,
    /// Of the position times one of the time: what grows, fades or swings while it is measured.
    PositionAndTime,
    /// Nothing up to some time, then the same.
    Step,
    /// Functions of a covariate of the model.
    Covariate(usize),
}

impl Family {
    /// All families but the effects of a group.
    pub fn beside(context: &Context<'_>, grounds: &Grounds, members: &[usize]) -> Vec<Self> {
        let others = (0..context.catalogue.len()).filter(|k| !members.contains(k));
        others
            .map(Self::Effect)
            .chain([Self::Position, Self::Time, Self::Reading])
            .chain([Self::PositionAndTime, Self::Step])
            .chain((0..grounds.covariates.len()).map(Self::Covariate))
            .collect()
    }

    pub fn name(self, context: &Context<'_>, grounds: &Grounds) -> String {
        match self {
            Self::Effect(k) => context.catalogue[k].name().to_owned(),
            Self::Position => "smooth in position".to_owned(),
            Self::Time => "smooth in time".to_owned(),
            Self::Reading => "smooth in reading".to_owned(),
            Self::PositionAndTime => "smooth in position and time".to_owned(),
            Self::Step => "step in time".to_owned(),
            Self::Covariate(k) => {
                let along = &grounds.covariates[k];
                let course = match along.course {
                    Course::Smooth => "smooth in",
                    Course::Step => "step in",
                    Course::Proportional => "proportional to",
                };
                format!("{course} {}", along.name)
            }
        }
    }

    /// The stream of random numbers that is its own, whatever else is in the catalogue.
    fn stream(self, context: &Context<'_>, grounds: &Grounds) -> u64 {
        let name = self.name(context, grounds);
        // FNV-1a.
        name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }
}

/// Rivals with their noise, one a column; those beyond `count` are zero.
pub(crate) struct Drawn {
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
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ family.stream(context, grounds));
        random.set_stream(batch as u64 + 1);
        let most = most.min(BATCH);
        let gaps = match family {
            Family::Effect(k) => effects(context, name, k, most, &mut random),
            family => of_no_effect(grounds, context, name, family, most, &mut random),
        };
        let spikes = spikes_of_draws(context.model, &context.law);
        let mut readings = DMatrix::zeros(context.space.readings(), BATCH);
        for (k, gap) in gaps.iter().enumerate() {
            let draw = batch * BATCH + k;
            let noise =
                context
                    .law
                    .draw_possible(context.model, spikes.as_ref(), draw, &mut random)
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

/// Gaps of a family that is no effect.
fn of_no_effect(
    grounds: &Grounds,
    context: &Context<'_>,
    name: &Name,
    family: Family,
    most: usize,
    random: &mut ChaCha8Rng,
) -> Vec<DVector<f64>> {
    let (position, time) = (&grounds.position, &grounds.time);
    let (along, meanwhile) = &grounds.both;
    let mut steps = |ground: &Ground| {
        if ground.range <= 0.0 {
            return Vec::new();
        }
        let step = |random: &mut ChaCha8Rng| ground.step(context, random);
        unlisted(context, name, (step, true), most, random)
    };
    let ground = match family {
        Family::Effect(_) => return Vec::new(),
        Family::Step => return steps(time),
        Family::Covariate(k) if grounds.covariates[k].course == Course::Step => {
            return steps(&grounds.covariates[k].ground);
        }
        Family::Covariate(k) if grounds.covariates[k].course == Course::Proportional => {
            let ground = &grounds.covariates[k].ground;
            let gap = |random: &mut ChaCha8Rng| ground.proportional(context, random);
            return unlisted(context, name, (gap, true), most, random);
        }
        Family::PositionAndTime if meanwhile.may_be_smooth() => along,
        Family::PositionAndTime => return Vec::new(),
        Family::Position => position,
        Family::Time => time,
        Family::Reading => &grounds.reading,
        Family::Covariate(k) => &grounds.covariates[k].ground,
    };
    if !ground.may_be_smooth() {
        return Vec::new();
    }
    let gap = |random: &mut ChaCha8Rng| {
        let smooth = ground.smooth(context, random);
        match family {
            Family::PositionAndTime => smooth.component_mul(&meanwhile.course(random)),
            _ => smooth,
        }
    };
    unlisted(context, name, (gap, false), most, random)
}

/// Gaps that are none of the effects of a group, without noise.
fn unlisted(
    context: &Context<'_>,
    name: &Name,
    (gap, sharp): (impl Fn(&mut ChaCha8Rng) -> DVector<f64>, bool),
    most: usize,
    random: &mut ChaCha8Rng,
) -> Vec<DVector<f64>> {
    let mut gaps = Vec::new();
    for _ in 0..ROUNDS {
        let mut raw = DMatrix::zeros(context.space.readings(), BATCH);
        for mut column in raw.column_iter_mut() {
            column.copy_from(&gap(random));
        }
        let (left, whole) = context.space.forward(raw.clone());
        let sizes: Vec<f64> = left.column_iter().map(|c| c.norm()).collect();
        let alike = cosines(context, name, left);
        let usable = (0..BATCH)
            .filter(|k| sizes[*k] * sizes[*k] > INVISIBLE * whole[*k] * whole[*k])
            .filter(|k| alike[*k] < SAME)
            .map(|k| (alike[k], raw.column(k) * (name.size / sizes[k])))
            // Shapes of the dictionary lie too far apart for what is sharp.
            .filter(|(alike, gap)| !sharp || *alike < UNLIKE || searched(context, name, gap) < SAME)
            .map(|(_, gap)| gap);
        gaps.extend(usable.take(most - gaps.len()));
        if gaps.len() >= most {
            break;
        }
    }
    gaps
}

/// Cosine of a gap to the nearest member of the group, whose shape is searched.
fn searched(context: &Context<'_>, name: &Name, gap: &DVector<f64>) -> f64 {
    let first = context.remainder(gap, &[]);
    let alone = context.beside(context.model, gap, &[]);
    let nearest = name.members.iter().filter_map(|member| {
        let start = context.start(&first, *member)?;
        Some(alone.refine_alone(*member, (start, Reach::WIDE)).1)
    });
    nearest.fold(0.0, f64::max).sqrt() / name.size
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
