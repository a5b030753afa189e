//! Whether what differs between repeats is noise as the law has it: of each channel by itself, without a period, anew in
//! each trace and alike in all channels.
//!
//! What an unknown cause does anew in every pass (a slide that sticks somewhere else each time) has no mean over the
//! repeats, and goes into the law of the noise. Two channels that are read in one pass are correlated by it, and what comes
//! back after a length stands out of the spectrum; independent noise does neither. Nor does it go on from one trace to the
//! next (`course.rs`), or shift the traces of some channels only (`uneven.rs`).

use std::f64::consts::PI;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use crate::levels::DEPENDENT;
use crate::noise::contrasts::{Contrasts, Row};
use crate::noise::course::{Course, course};
use crate::noise::law::{NoiseLaw, NoiseSource};
use crate::noise::uneven::{Uneven, uneven};

/// Products of readings that are summed to one: what the law leaves correlated among neighbours is within it.
const BLOCK: usize = 10;
/// Sums without which their scatter does not tell how sure their mean is.
const FEWEST_BLOCKS: usize = 20;
/// Most periods, twice, over the travel that are looked for.
const MOST_PERIODS: usize = 512;
/// Neighbouring frequencies of a spectrum from which on, and up to which, its level about a frequency is taken.
const ABOUT: std::ops::RangeInclusive<usize> = 4..=20;

/// A correlation of two channels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BetweenChannels {
    /// The channels.
    pub channels: [usize; 2],
    /// Correlation of what differs from repeat to repeat, whitened by the law of the noise.
    pub correlation: f64,
    /// Probability of as much between any two channels of independent noise.
    pub p_value: f64,
}

/// A period in what differs from repeat to repeat.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Period {
    /// Its length, in the unit of the positions.
    pub length: f64,
    /// Probability of as much at any length in noise of the law.
    pub p_value: f64,
}

/// In what the differences between repeats are not independent noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Dependence {
    pub between_channels: Option<BetweenChannels>,
    pub period: Option<Period>,
    pub course: Option<Course>,
    pub uneven: Option<Uneven>,
}

impl Dependence {
    /// Of readings free of causes, where repeats tell the noise and nothing else: read at other places they show forms too.
    /// `show_whole`: whether no unknown of the model takes up part of what differs between repeats, of which readings then
    /// hold what is not noise and is not seen.
    pub fn of(
        model: &AnyModel,
        law: &NoiseLaw,
        clean: &DVector<f64>,
        show_whole: impl FnOnce() -> bool,
    ) -> Self {
        if law.source != NoiseSource::Repeats || !model.repeats_are_alike() {
            return Self::default();
        }
        let contrasts = Contrasts::of(model, clean);
        let course = course(model.places(), model.traces(), &model.levelled(clean));
        let course = course.filter(|found| is_told(found.p_value));
        let uneven = uneven(&contrasts).filter(|found| is_told(found.p_value));
        let lasting = (course.is_some() || uneven.is_some()) && show_whole();
        Self {
            course: course.filter(|_| lasting),
            uneven: uneven.filter(|_| lasting),
            ..Self::in_white(&contrasts.whitened(law))
        }
    }

    /// Of contrasts that are white if the noise is what the law says.
    fn in_white(contrasts: &Contrasts) -> Self {
        let between_channels = between_channels(contrasts).filter(|found| is_told(found.p_value));
        // Of correlated channels one tells no more than the other.
        let times = if between_channels.is_some() { 2 } else { 1 };
        let period = period(contrasts, times).filter(|found| is_told(found.p_value));
        Self {
            between_channels,
            period,
            course: None,
            uneven: None,
        }
    }

    /// Whether anything is told.
    pub fn is_seen(&self) -> bool {
        self.between_channels.is_some() || self.is_no_noise()
    }

    /// Whether it is something else: noise may come to two channels at once, but neither comes back nor goes on nor
    /// shifts the traces of some channels only.
    pub fn is_no_noise(&self) -> bool {
        self.p_value_of_no_noise() < 1.0
    }

    /// Probability of what tells that it is something else, the least; one where nothing does.
    pub fn p_value_of_no_noise(&self) -> f64 {
        let all = [
            self.period.as_ref().map(|period| period.p_value),
            self.course.as_ref().map(|course| course.p_value),
            self.uneven.as_ref().map(|uneven| uneven.p_value),
        ];
        all.into_iter().flatten().fold(1.0, f64::min)
    }
}

fn is_told(p_value: f64) -> bool {
    p_value < DEPENDENT
}

/// The two channels that are correlated most clearly: Student's t of the sums of products over blocks of neighbours.
fn between_channels(contrasts: &Contrasts) -> Option<BetweenChannels> {
    let groups: Vec<(&[f64], &[Row])> = contrasts.groups().collect();
    let channels = groups.iter().flat_map(|(_, rows)| rows.iter());
    let mut channels: Vec<usize> = channels.map(|row| row.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    let between = |a: usize, b: usize| -> Option<BetweenChannels> {
        let (mut sums, mut squares) = (Vec::new(), [0.0, 0.0]);
        for (_, rows) in &groups {
            for one in rows.iter().filter(|row| row.channel == a) {
                let Some(other) = rows.iter().find(|row| row.is_beside(one, b)) else {
                    continue;
                };
                squares[0] += one.values.norm_squared();
                squares[1] += other.values.norm_squared();
                let products = one.values.component_mul(&other.values);
                let blocks = products.as_slice().chunks(BLOCK);
                sums.extend(blocks.map(|block| block.iter().sum::<f64>()));
            }
        }
        let n = sums.len() as f64;
        let whole = sums.iter().sum::<f64>();
        let scatter = sums.iter().map(|s| (s - whole / n).powi(2)).sum::<f64>() / (n - 1.0);
        // Of a channel that never changes there is nothing to tell.
        if sums.len() < FEWEST_BLOCKS || scatter <= 0.0 {
            return None;
        }
        let t = whole / (n * scatter).sqrt();
        let law = StudentsT::new(0.0, 1.0, n - 1.0).ok()?;
        Some(BetweenChannels {
            channels: [a, b],
            correlation: whole / (squares[0] * squares[1]).sqrt(),
            p_value: 2.0 * law.cdf(-t.abs()),
        })
    };
    let pairs = (channels.iter().enumerate())
        .flat_map(|(k, a)| channels[k + 1..].iter().map(|b| between(*a, *b)));
    let found: Vec<BetweenChannels> = pairs.flatten().collect();
    let tried = found.len() as f64;
    let most = (found.into_iter()).min_by(|a, b| a.p_value.total_cmp(&b.p_value))?;
    Some(BetweenChannels {
        p_value: (tried * most.p_value).min(1.0),
        ..most
    })
}

/// The length that comes back most: a periodogram over all rows, against its level at the frequencies about and that of
/// white noise, whichever is more. `times`: of so many rows one tells what all of them do.
fn period(contrasts: &Contrasts, times: usize) -> Option<Period> {
    let long = contrasts.groups().max_by_key(|(x, _)| x.len())?.0;
    let (first, last) = (*long.first()?, *long.last()?);
    let travel = (last - first).abs();
    let count = long.len().min(MOST_PERIODS);
    // Near no period at all, and near two readings a period, sine and cosine are not two.
    let lowest = 2;
    if travel <= 0.0 || count <= lowest + 2 * ABOUT.end() {
        return None;
    }
    let mut power = vec![0.0; count];
    let mut rows = 0usize;
    for (positions, group) in contrasts.groups() {
        let turns = |x: &f64| PI * (x - first) / travel;
        let steps: Vec<(f64, f64)> = positions.iter().map(|x| turns(x).sin_cos()).collect();
        for row in group.iter().filter(|row| !row.values.is_empty()) {
            let mut waves: Vec<(f64, f64)> = row.values.iter().map(|v| (0.0, *v)).collect();
            rows += 1;
            for total in &mut power {
                let (mut sine, mut cosine) = (0.0, 0.0);
                for (wave, (s, c)) in waves.iter_mut().zip(&steps) {
                    sine += wave.0;
                    cosine += wave.1;
                    *wave = (wave.0 * c + wave.1 * s, wave.1 * c - wave.0 * s);
                }
                *total += (sine * sine + cosine * cosine) / row.values.len() as f64;
            }
        }
    }
    let independent = rows.div_ceil(times) as f64;
    let law = ChiSquared::new(2.0 * independent).ok()?;
    let middle = law.inverse_cdf(0.5) / (2.0 * independent);
    let mean: Vec<f64> = power.iter().map(|p| p / rows as f64).collect();
    let about = |k: usize| {
        let near = ABOUT.flat_map(|away| [k.checked_sub(away), Some(k + away)]);
        let near = near.flatten().filter(|j| (lowest..count - 1).contains(j));
        let mut near: Vec<f64> = near.map(|j| mean[j]).collect();
        near.sort_by(f64::total_cmp);
        (near[near.len() / 2] / middle).max(1.0)
    };
    let most = (lowest..count - 1)
        .map(|k| (k, mean[k] / about(k)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let tail = law.sf(2.0 * independent * most.1);
    Some(Period {
        length: 2.0 * travel / most.0 as f64,
        p_value: (tail * (count - lowest) as f64).min(1.0),
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use errsep_models::model::Place;
    use nalgebra::DVector;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal, StudentT};

    use super::{Contrasts, Dependence, between_channels, period};

    const POSITIONS: usize = 120;
    const REPEATS: usize = 4;

    /// Two channels, four repeats, both directions, 3 mm apart but for a tenth of that; `reading` of channel, pass and x.
    fn contrasts(
        random: &mut ChaCha8Rng,
        reading: &mut dyn FnMut(usize, usize, f64) -> f64,
    ) -> Contrasts {
        let x: Vec<f64> = (0..POSITIONS)
            .map(|k| 3.0 * (k as f64 + 0.1 * random.random::<f64>()))
            .collect();
        let (mut places, mut values, mut traces) = (Vec::new(), Vec::new(), Vec::new());
        for pass in 0..2 * REPEATS {
            for channel in 0..2 {
                let from = places.len();
                for (k, x) in x.iter().enumerate() {
                    places.push(Place {
                        channel,
                        x: *x,
                        time: pass as f64,
                        repeat: (pass / 2) as u32,
                        direction: if pass % 2 == 0 { 1.0 } else { -1.0 },
                        cell: channel * POSITIONS + k,
                    });
                    values.push(reading(channel, pass, *x));
                }
                traces.push(from..places.len());
            }
        }
        Contrasts::new(&places, &traces, &DVector::from_vec(values))
    }

    /// *Coverage*: of independent noise, normal or with heavy tails, either test rejects as often as it says. 5 % of 1000:
    /// within 3.5 standard deviations (0.7 % each); the period's Bonferroni and level make it rarer.
    #[test]
    fn independent_noise_is_told_as_such() {
        let student = StudentT::new(3.0).unwrap();
        for heavy in [false, true] {
            let mut random = ChaCha8Rng::seed_from_u64(7);
            let (mut by_channel, mut by_period) = (0, 0);
            for seed in 0..1000 {
                let mut noise = ChaCha8Rng::seed_from_u64(seed);
                let mut one = |_: usize, _: usize, _: f64| -> f64 {
                    if heavy {
                        // Pulled in as single readings that stand out are.
                        let value: f64 = student.sample(&mut noise);
                        value.clamp(-4.0, 4.0) / 1.5
                    } else {
                        StandardNormal.sample(&mut noise)
                    }
                };
                let made = contrasts(&mut random, &mut one);
                by_channel += usize::from(between_channels(&made).unwrap().p_value < 0.05);
                by_period += usize::from(period(&made, 1).unwrap().p_value < 0.05);
            }
            assert!((26..=74).contains(&by_channel), "{heavy} {by_channel}");
            assert!(by_period <= 74, "{heavy} {by_period}");
        }
    }

    /// *Simulated truth*: a wave of 33 mm that stands elsewhere in every pass, seen by two channels with opposite signs, is
    /// told, with its length to a resolution of the travel (33²/360 mm); of its height in noise an eighth hides it.
    #[test]
    fn what_acts_anew_in_every_pass_is_told() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let begins: Vec<f64> = (0..2 * REPEATS).map(|_| random.random::<f64>()).collect();
        let mut noise = ChaCha8Rng::seed_from_u64(4);
        let mut found = |height: f64| {
            let mut reading = |channel: usize, pass: usize, x: f64| {
                let wave = (TAU * (x / 33.0 + begins[pass])).cos();
                let white: f64 = StandardNormal.sample(&mut noise);
                white
                    + if channel == 0 {
                        height * wave
                    } else {
                        -height * wave
                    }
            };
            Dependence::in_white(&contrasts(&mut random, &mut reading))
        };
        let clear = found(0.8);
        let both = clear.between_channels.unwrap();
        assert_eq!(both.channels, [0, 1]);
        // The wave's variance over that of a reading, 0.32/1.32, but for the scatter of 480 products.
        assert!((both.correlation + 0.24).abs() < 0.15, "{both:?}");
        let length = clear.period.unwrap().length;
        assert!((length - 33.0).abs() < 3.0, "{length}");
        assert!(!found(0.1).is_seen());
    }
}
