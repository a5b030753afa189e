//! Whether what differs between repeats differs in some channels only.
//!
//! Noise shifts the traces of every channel, each as its readings scatter. What acts in one channel, or while some of them
//! were read, shifts the traces of these: the mean square of the shifts, over that of neighbouring readings' differences,
//! is compared between every choice of channels and the others (Fisher's F), or what the scatter of the readings alone
//! makes of it, if that is more.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::noise::contrasts::Contrasts;

/// With more channels single ones are compared with all others, not every choice of them.
const EVERY_CHOICE: usize = 8;
/// Shifts without which a mean square tells too little.
const FEWEST: usize = 2;

/// Channels whose traces shift more than those of the others.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Uneven {
    /// The channels.
    pub channels: Vec<usize>,
    /// Standard deviation of their shifts over that of the others.
    pub times: f64,
    /// Probability of as much for any choice of channels, in noise alike in all.
    pub p_value: f64,
}

/// Of one channel: its shifts' mean square in units of its scatter, that of scatter alone, and their number.
struct Shifts {
    channel: usize,
    square: f64,
    of_scatter: f64,
    count: f64,
}

/// The choice of channels that shift most clearly more than the others; nothing where there is one channel, or too
/// few repeats.
pub(crate) fn uneven(contrasts: &Contrasts) -> Option<Uneven> {
    let shifts = shifts(contrasts);
    let n = shifts.len();
    let choices: Vec<u64> = match n {
        0 | 1 => return None,
        n if n <= EVERY_CHOICE => (1..(1 << n) - 1).collect(),
        n => (0..n.min(64)).map(|k| 1 << k).collect(),
    };
    let compared = choices.iter().filter_map(|choice| {
        let sum = |own: bool| {
            let of = shifts.iter().enumerate();
            let of = of.filter(move |(k, _)| (choice >> k & 1 == 1) == own);
            of.fold((0.0, 0.0, 0.0), |(square, least, count), (_, s)| {
                let (own, of_scatter) = (s.count * s.square, s.count * s.of_scatter);
                (square + own, least + of_scatter, count + s.count)
            })
        };
        let ((own, _, more), (other, least, less)) = (sum(true), sum(false));
        let ratio = (own / more) / (other.max(least) / less);
        let law = FisherSnedecor::new(more, less).ok()?;
        ratio.is_finite().then(|| (*choice, ratio, law.sf(ratio)))
    });
    let (choice, ratio, tail) = compared.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let of = shifts.iter().enumerate();
    Some(Uneven {
        channels: of
            .filter(|(k, _)| choice >> k & 1 == 1)
            .map(|(_, s)| s.channel)
            .collect(),
        times: ratio.sqrt(),
        p_value: (tail * choices.len() as f64).min(1.0),
    })
}

fn shifts(contrasts: &Contrasts) -> Vec<Shifts> {
    let rows = || contrasts.groups().flat_map(|(_, rows)| rows);
    let mut channels: Vec<usize> = rows().map(|row| row.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    let of = |channel: usize| {
        let (mut square, mut of_scatter, mut count) = (0.0, 0.0, 0.0);
        let (mut steps, mut neighbours) = (0.0, 0.0);
        for row in rows().filter(|row| row.channel == channel && row.values.len() > 1) {
            square += row.values.mean().powi(2);
            of_scatter += 1.0 / row.values.len() as f64;
            count += 1.0;
            let values = row.values.as_slice();
            steps += values
                .windows(2)
                .map(|v| (v[1] - v[0]).powi(2))
                .sum::<f64>();
            neighbours += 2.0 * (values.len() - 1) as f64;
        }
        let scatter = steps / neighbours;
        (count >= FEWEST as f64 && scatter > 0.0).then(|| Shifts {
            channel,
            square: square / count / scatter,
            of_scatter: of_scatter / count,
            count,
        })
    };
    channels.into_iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use errsep_models::model::Place;
    use nalgebra::DVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::{Contrasts, Uneven, uneven};

    const POSITIONS: usize = 60;

    /// Four channels, four repeats, both directions; `reading` of channel and pass, whose traces shift by themselves.
    fn told(random: &mut ChaCha8Rng, reading: &mut dyn FnMut(usize, usize) -> f64) -> Uneven {
        let (mut places, mut values, mut traces) = (Vec::new(), Vec::new(), Vec::new());
        for pass in 0..8 {
            for channel in 0..4 {
                let from = places.len();
                let shift: f64 = StandardNormal.sample(random);
                for k in 0..POSITIONS {
                    places.push(Place {
                        channel,
                        x: k as f64,
                        time: (pass * POSITIONS + k) as f64,
                        repeat: (pass / 2) as u32,
                        direction: if pass % 2 == 0 { 1.0 } else { -1.0 },
                        cell: channel * POSITIONS + k,
                    });
                    let white: f64 = StandardNormal.sample(random);
                    let own = reading(channel, pass);
                    // The first channel's indicator is three times as rough.
                    values.push(own + if channel == 0 { 3.0 } else { 1.0 } * (shift + white));
                }
                traces.push(from..places.len());
            }
        }
        uneven(&Contrasts::new(
            &places,
            &traces,
            &DVector::from_vec(values),
        ))
        .unwrap()
    }

    /// *Coverage*: of noise alike in all channels, but for its scale, no more than is said is told: of 1000 at 5 % at
    /// most 74 (3.5 standard deviations); for all choices together, so that there may be fewer.
    #[test]
    fn an_indicator_that_scatters_more_is_not_uneven() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let of = |_: usize| told(&mut random, &mut |_, _| 0.0).p_value < 0.05;
        let count = (0..1000).map(of).filter(|told| *told).count();
        assert!(count <= 74, "{count}");
    }

    /// *Simulated truth*: one indicator jumps by 20 shifts for three passes, in one channel.
    #[test]
    fn a_jump_in_one_channel_is_told() {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let jump = |channel: usize, pass: usize| {
            let jumped = channel == 2 && (3..6).contains(&pass);
            if jumped { 20.0 } else { 0.0 }
        };
        let found = told(&mut random, &mut { jump });
        assert_eq!(found.channels, [2]);
        assert!(found.p_value < 1e-3 && found.times > 3.0, "{found:?}");
    }
}
