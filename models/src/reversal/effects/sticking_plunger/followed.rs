//! A pointer that sticks, followed through one trace.
//!
//! Once it has let go it stands at the stylus: of all ways in which it came to let go at a reading only the
//! likeliest matters for what follows (Bellman's principle), so that the likeliest way of all is found in one
//! pass over the readings.

use statrs::distribution::{ContinuousCDF, Normal};

use super::LOOSE;

/// What each choice between holding and letting go costs of twice the logarithm of the likelihood: both were as
/// probable before.
pub(super) const COST: f64 = 2.0 * std::f64::consts::LN_2;
/// Where a plunger may stand at first, between one hold before and behind.
const STANDS: usize = 16;
/// Spreads of the hold that are tried, holds to either side of the one near it, and the narrowest interval, all as
/// parts of it.
const SPREADS: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.15, 0.3];
const STEPS: usize = 40;
const NARROW: f64 = 1e-3;
/// Standard deviations beyond which a normal law has a part of less than 10⁻¹².
const CERTAIN: f64 = 7.2;
/// Logarithm of a part of the whole probability that is rounding.
const NOTHING: f64 = 25.0;
/// Part of the hold that is rounding.
const ROUNDING: f64 = 1e-9;
/// Most ways that are followed side by side, and how far behind the likeliest, in variances.
const MOST: usize = 32;
const HOPELESS: f64 = 40.0;

/// The way of a pointer.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// Where it stands at first from the stylus, in holds.
    pub begins: f64,
    /// Choices that the readings made: how often the probability of it is halved by the other ways that it could have
    /// taken, as far as the readings tell them apart.
    pub choices: usize,
    /// Readings, in the order of time, before which it let go.
    pub jumps: Vec<usize>,
    /// Sum of the squares of what it leaves, µm².
    pub square: f64,
}

impl Path {
    /// Where the pointer stands in so many readings after it has let go: from a reading until another.
    pub fn stands(&self, readings: usize) -> impl Iterator<Item = (usize, usize)> {
        let ends = self.jumps.iter().skip(1).copied().chain([readings]);
        self.jumps.iter().copied().zip(ends)
    }
}

/// A way up to a reading.
#[derive(Clone, Copy)]
struct Here {
    cost: f64,
    square: f64,
    at: f64,
    /// Logarithm of the probability of the readings and all ways that came to stand here.
    log: f64,
    /// The last time it let go, by its number.
    last: usize,
}

/// The likeliest way of a pointer with a hold, where the readings have a variance; what each shows is `shown`
/// where the stylus sees `seen`. Nothing where there are no readings.
pub(super) fn follow(seen: &[f64], shown: &[f64], hold: f64, variance: f64) -> Option<Path> {
    let (first, said) = (seen.first()?, shown.first()?);
    let seen_at = |square: f64| {
        if variance > 0.0 {
            -0.5 * square / variance
        } else {
            0.0
        }
    };
    // Where it let go: the one before, and the reading or where it stood at first.
    let mut turns: Vec<(Option<usize>, usize, f64)> = Vec::new();
    let mut ways: Vec<Here> = (0..STANDS)
        .map(|k| {
            let begins = 2.0 * (k as f64 + 0.5) / STANDS as f64 - 1.0;
            turns.push((None, 0, begins));
            let at = first + begins * hold;
            let square = (said - at).powi(2);
            Here {
                cost: square,
                square,
                at,
                log: -(STANDS as f64).ln() + seen_at(square),
                last: k,
            }
        })
        .collect();
    for (k, (stylus, said)) in seen.iter().zip(shown).enumerate().skip(1) {
        let mut next: Vec<Here> = Vec::with_capacity(ways.len() + 1);
        let mut let_go: Option<Here> = None;
        for mut way in ways.iter().copied() {
            let off = (stylus - way.at).abs();
            let (may_hold, may_go) = (off <= (1.0 + LOOSE) * hold, off >= (1.0 - LOOSE) * hold);
            if may_hold && may_go {
                way.cost += COST * variance;
                way.log -= std::f64::consts::LN_2;
            }
            if may_go {
                let log = let_go.map_or(way.log, |known| log_of_sum(known.log, way.log));
                let best = let_go.filter(|known| known.cost <= way.cost).unwrap_or(way);
                let_go = Some(Here { log, ..best });
            }
            if may_hold {
                let square = (said - way.at).powi(2);
                way.cost += square;
                way.square += square;
                way.log += seen_at(square);
                next.push(way);
            }
        }
        if let Some(mut way) = let_go {
            turns.push((Some(way.last), k, 0.0));
            let square = (said - stylus).powi(2);
            way.cost += square;
            way.square += square;
            way.log += seen_at(square);
            way.at = *stylus;
            way.last = turns.len() - 1;
            next.push(way);
        }
        if variance > 0.0 {
            let best = next
                .iter()
                .map(|way| way.cost)
                .fold(f64::INFINITY, f64::min);
            next.retain(|way| way.cost <= best + HOPELESS * variance);
        }
        if next.len() > MOST {
            next.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            next.truncate(MOST);
        }
        ways = next;
    }
    let best = ways.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let all = ways.iter().map(|way| way.log).reduce(log_of_sum)?;
    let halvings = (seen_at(best.square) - all) / std::f64::consts::LN_2;
    let mut jumps = Vec::new();
    let mut turn = best.last;
    while let (Some(before), k, _) = turns[turn] {
        jumps.push(k);
        turn = before;
    }
    jumps.reverse();
    Some(Path {
        begins: turns[turn].2,
        choices: halvings.max(0.0).ceil() as usize,
        jumps,
        square: best.square,
    })
}

/// Logarithm of the sum of two probabilities, by their logarithms.
fn log_of_sum(one: f64, other: f64) -> f64 {
    let (less, more) = (one.min(other), one.max(other));
    more + (less - more).exp().ln_1p()
}

/// The mean of how far the pointer is ahead of the stylus, over where it may stand at first, µm.
pub(super) fn mean_lag(seen: &[f64], hold: f64) -> Vec<f64> {
    let Some(first) = seen.first() else {
        return Vec::new();
    };
    let stand = |k: usize| first + hold * (2.0 * (k as f64 + 0.5) / STANDS as f64 - 1.0);
    let mut pointers: Vec<f64> = (0..STANDS).map(stand).collect();
    let mean = |stylus: &f64| {
        for pointer in &mut pointers {
            if (stylus - *pointer).abs() > hold {
                *pointer = *stylus;
            }
        }
        let lag = pointers.iter().map(|pointer| pointer - stylus).sum::<f64>() / STANDS as f64;
        // Where it may stand at first is on either side alike: of that a mean has rounding only.
        if lag.abs() > ROUNDING * hold {
            lag
        } else {
            0.0
        }
    };
    seen.iter().map(mean).collect()
}

/// The hold, and its standard uncertainty, µm: each time it let go the hold was between how far off it had been and
/// how far off it was then. That of a hold with normal spread, by its likelihood for such intervals. All traces
/// count as one: they let go at the same places, by the same error of what is seen there.
pub(super) fn threshold<'p>(
    traces: impl Iterator<Item = (&'p [f64], &'p Path)>,
    near: f64,
) -> (f64, f64) {
    let mut intervals: Vec<(f64, f64)> = Vec::new();
    let mut count = 0;
    for (stylus, path) in traces {
        count += 1;
        // Where it stood at first is not known as well.
        for (from, until) in path.stands(stylus.len()) {
            let off = |k: usize| (stylus[k] - stylus[from]).abs() / near;
            let held = (from..until).map(off).fold(0.0, f64::max);
            let goes = until < stylus.len();
            let then = if goes { off(until) } else { f64::INFINITY };
            intervals.push((held.min(then), then.max(held + NARROW)));
        }
    }
    let mut best = f64::NEG_INFINITY;
    let law = Normal::standard();
    let below = |z: f64| match z {
        z if z < -CERTAIN => 0.0,
        z if z > CERTAIN => 1.0,
        z => law.cdf(z),
    };
    // A sum of what is never positive: no longer summed once it is too small to count.
    let mut likelihood = |centre: f64, spread: f64| -> f64 {
        let mut sum = 0.0;
        for (low, high) in &intervals {
            let held = below((high - centre) / spread) - below((low - centre) / spread);
            sum += held.max(1e-12).ln() / f64::from(count);
            if sum < best - NOTHING {
                return f64::NEG_INFINITY;
            }
        }
        best = best.max(sum);
        sum
    };
    let at = |k: usize| 1.0 + LOOSE * (k as f64 / STEPS as f64 - 1.0);
    // From the middle outwards: the likeliest come early.
    let outwards = (0..=STEPS).flat_map(|k| [STEPS - k, STEPS + k]).skip(1);
    let laws = outwards.flat_map(|k| SPREADS.map(|spread| (at(k), spread)));
    let laws: Vec<(f64, f64)> = laws.map(|(c, spread)| (c, likelihood(c, spread))).collect();
    // Its mean and standard deviation with all holds and spreads as probable before.
    let weights: Vec<f64> = laws.iter().map(|(_, l)| (l - best).exp()).collect();
    let whole: f64 = weights.iter().sum();
    let moment = |of: &dyn Fn(f64) -> f64| {
        let all = laws.iter().zip(&weights);
        all.map(|((c, _), w)| w * of(*c)).sum::<f64>() / whole
    };
    let mean = moment(&|c| c);
    let variance = moment(&|c| (c - mean).powi(2));
    (mean * near, variance.sqrt() * near)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pointer that sticks, from where it stands at first, and when it let go.
    fn stuck(seen: &[f64], hold: f64, begins: f64) -> (Vec<f64>, Vec<usize>) {
        let (mut at, mut jumps) = (seen[0] + begins * hold, Vec::new());
        let shown = seen.iter().enumerate().map(|(k, stylus)| {
            if k > 0 && (stylus - at).abs() > hold {
                at = *stylus;
                jumps.push(k);
            }
            at
        });
        (shown.collect(), jumps)
    }

    fn form() -> Vec<f64> {
        let at = |k: usize| k as f64 / 40.0;
        (0..200).map(|k| 6.0 * at(k).sin() + 0.3 * at(k)).collect()
    }

    /// *Exact*: a hold that every step of the stylus overcomes has no lag, not even of rounding, which a fit would
    /// multiply by 10¹⁶.
    #[test]
    fn a_hold_below_every_step_has_no_lag() {
        // About powers of two what is above and below is rounded unlike.
        for from in [0.5, 1.0, 2.0, 4.0, 8.0, 16.0] {
            let seen: Vec<f64> = (0..50).map(|k| from + 0.3 * f64::from(k)).collect();
            assert!(mean_lag(&seen, 0.061).iter().all(|lag| *lag == 0.0));
            assert!(mean_lag(&seen, 1.0).iter().any(|lag| *lag < -0.1));
        }
    }

    /// *Exact*: without noise every jump is found, and nothing is left; the start is a sixteenth of two holds.
    #[test]
    fn what_is_followed_is_what_was_done() {
        let seen = form();
        let (shown, jumps) = stuck(&seen, 0.5, 0.3125);
        let freely = follow(&seen, &shown, 0.5, 0.0).unwrap();
        assert_eq!(freely.jumps, jumps);
        assert!(freely.square < 1e-20, "{}", freely.square);
        assert!((freely.begins - 0.3125).abs() < 1e-12);
    }

    /// *Simulated truth*: with noise of a fifth of the hold, and a hold that is not known, within three of what is
    /// printed. The mean over 40 starts of traces that are noisy each by its own.
    #[test]
    fn the_hold_is_told_by_when_it_lets_go() {
        let seen = form();
        // A quadratic recurrence for the noise, so that no generator is asked.
        let mut state = 0.41_f64;
        let mut noise = || {
            state = 3.99 * state * (1.0 - state);
            0.1 * (state - 0.5) / 0.35
        };
        let traces: Vec<Vec<f64>> = (0..40)
            .map(|k| {
                let (shown, _) = stuck(&seen, 0.5, f64::from(k) / 20.0 - 1.0);
                shown.into_iter().map(|v| v + noise()).collect()
            })
            .collect();
        let paths: Vec<Path> = traces
            .iter()
            .map(|shown| follow(&seen, shown, 0.47, 0.01).unwrap())
            .collect();
        let all = paths.iter().map(|path| (&seen[..], path));
        let (hold, std) = threshold(all, 0.47);
        assert!((hold - 0.5).abs() < 3.0 * std, "{hold} {std}");
        assert!(std < 0.05, "{std}");
    }

    /// *Limit*: where the stylus moves slowly one way, the pointer is behind by half a hold in the mean.
    #[test]
    fn the_mean_is_half_a_hold_behind() {
        let seen: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let lag = mean_lag(&seen, 0.5);
        let late: f64 = lag[200..].iter().sum::<f64>() / 200.0;
        // A step of the stylus is a fiftieth of the hold.
        assert!((late + 0.25).abs() < 0.01, "{late}");
        assert!(mean_lag(&[], 0.5).is_empty() && follow(&[], &[], 0.5, 0.0).is_none());
    }

    /// Ways of which one is much likelier cost nothing, those as likely as each other a halving each.
    #[test]
    fn a_choice_is_worth_what_the_readings_do_not_tell() {
        let seen = form();
        let (shown, _) = stuck(&seen, 0.5, 0.3125);
        let known = follow(&seen, &shown, 0.5, 1e-6).unwrap().choices;
        let open = follow(&seen, &shown, 0.5, 1.0).unwrap().choices;
        assert!(open < known, "{open} {known}");
        // Exact: ln(e^a + e^b) of equals is one more ln 2.
        assert!((log_of_sum(3.0, 3.0) - 3.0 - std::f64::consts::LN_2).abs() < 1e-15);
    }
}
