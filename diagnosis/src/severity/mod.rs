//! What else would have been given the same name: the severity of a test (Mayo and Spanos, Brit. J.
//! Phil. Sci. 57 (2006) 323).
//!
//! Rivals of the visible size of the gap found are drawn from families (`rivals.rs`), each with a draw of
//! the noise, and named as the diagnosis names (`stage.rs`). One minus the greatest of the
//! probabilities, over the families, of coming to the same name is the severity.
//!
//! Rivals are drawn of what is listed or smooth. A cause that nobody listed, and that is nearly the one named, is none of
//! them, but is mostly not quite that one either: a name is strong only where what it leaves is such as noise leaves.
//!
//! What a cause does anew in every repeat goes into the law of the noise by which it should be seen. Where channels are
//! correlated in what differs between repeats (`noise/dependence.rs`) no name is strong.
//!
//! Of several causes each is judged alone. What they may imitate together is more than what each may, and is not drawn:
//! none of them is strong.

pub(super) mod grounds;
#[cfg(test)]
mod named_alike;
pub(super) mod rivals;
pub(super) mod stage;

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

use crate::attribution::confidence::Answer;
use crate::attribution::context::Context;
use crate::detection::estimate::jumps_instead;
use crate::detection::null::BATCH;
use crate::levels::{STRONG, SURE, SUSPECT};
use crate::noise::dependence::Dependence;
use crate::options::Options;
use crate::severity::grounds::Grounds;
use crate::severity::rivals::{Drawn, Family};
use crate::severity::stage::Name;
use errsep_models::number::{percent, plain};

/// One in so many of the rivals asked for must be drawn: a family that is mostly the name's own shape, or nothing of the
/// size of the gap, is no rival of it.
const FEWEST: usize = 4;
/// Why none of several names is strong.
pub(crate) const TOGETHER: &str =
    "each of several causes is judged alone, and what they may imitate together is not known";
/// Why no name is strong where the noise is not independent.
pub(crate) const NO_NOISE: &str = "what differs from repeat to repeat is not independent noise";
/// Why no name is strong beside which the repeats are likelier with a jump.
pub(crate) const JUMP: &str =
    "something that jumps would make the repeats more alike than what is named does";
/// Rivals that a line tells.
const TOLD: usize = 3;

/// How much a name is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Confidence {
    /// The lower limit of the severity is 0.95 or more, what the cause leaves is such as noise leaves, what differs between
    /// repeats is noise too and no likelier with a jump, and it is named alone.
    Strong,
    /// It is not.
    Weak,
}

/// The severity of the test that a named effect has passed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Severity {
    /// The effect, of a group the one named first.
    pub effect: String,
    /// One minus the greatest of the rivals' probabilities.
    pub value: f64,
    /// Its one-sided 95 % lower limit (Clopper and Pearson, of the least known family).
    pub lower: f64,
    /// Probability that as much as the causes leave, all of them together, would stand out with nothing else there.
    pub left: f64,
    /// Whether other causes are named beside it.
    pub beside_others: bool,
    /// Whether what differs between repeats is not independent noise.
    pub dependent_noise: bool,
    /// Whether jumps, each at some moment and of whatever kind, would make the repeats likelier than what is named does.
    pub jump_beside: bool,
    /// Strong where the lower limit reaches 0.95, `left` is above 0.05, no cause is named beside it, the noise is
    /// that of independent readings and no jump does better.
    pub confidence: Confidence,
    /// The families of rivals, the greatest probability first.
    pub rivals: Vec<Rival>,
}

/// A family of rivals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rival {
    /// An effect, or `smooth in position`, `smooth in time`, `smooth in reading`, `smooth in position and time`, `smooth in` a
    /// covariate of the model, `step in time` or such a covariate, `proportional to` one.
    pub name: String,
    /// Probability that a gap of this size made by it would have been given the same name alone.
    pub probability: f64,
}

impl Rival {
    /// The family in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        match self.name.split_once(' ') {
            Some(("smooth", of)) => format!("smooth errors {of}"),
            Some(("step", of)) => format!("steps {of}"),
            Some(("proportional", of)) => format!("errors proportional {of}"),
            _ => self.name.clone(),
        }
    }
}

impl Severity {
    /// Whether the lower limit of the severity makes the name weak: by rivals, or as too few could be drawn.
    #[must_use]
    pub fn is_weak_by_rivals(&self) -> bool {
        self.lower < STRONG
    }

    /// Whether what the causes leave stands out.
    #[must_use]
    pub fn leaves_something(&self) -> bool {
        self.left <= SUSPECT
    }

    /// The severity in a line.
    #[must_use]
    pub fn in_words(&self) -> String {
        let worst: Vec<String> = self
            .rivals
            .iter()
            .filter(|rival| rival.probability > 0.0)
            .take(TOLD)
            .map(|rival| format!("{} {}", rival.in_words(), percent(rival.probability)))
            .collect();
        let alike = if worst.is_empty() {
            "no rival that was drawn would have looked the same".to_owned()
        } else {
            format!("would have looked the same: {}", worst.join(", "))
        };
        let word = match self.confidence {
            Confidence::Strong => "strong".to_owned(),
            Confidence::Weak if self.leaves_something() => format!(
                "weak, as noise alone would leave as much beside it in only {} of cases",
                percent(self.left)
            ),
            Confidence::Weak if self.dependent_noise => format!("weak, as {NO_NOISE}"),
            Confidence::Weak if self.jump_beside => format!("weak, as {JUMP}"),
            Confidence::Weak if !self.is_weak_by_rivals() => format!("weak, as {TOGETHER}"),
            Confidence::Weak => "weak".to_owned(),
        };
        format!(
            "Severity of {}: {} (at least {}), {word}; {alike}",
            self.effect,
            plain(self.value, 3),
            plain(self.lower, 3)
        )
    }
}

/// Rivals drawn and rivals named alike.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    asked: usize,
    drawn: usize,
    alike: usize,
}

impl Count {
    fn probability(self) -> f64 {
        self.alike as f64 / self.drawn.max(1) as f64
    }

    /// One-sided upper limit of the probability.
    fn upper(self) -> f64 {
        if self.alike >= self.drawn {
            return 1.0;
        }
        let (a, n) = (self.alike as f64, self.drawn as f64);
        Beta::new(a + 1.0, n - a).map_or(1.0, |law| law.inverse_cdf(SURE))
    }

    /// One-sided lower limit.
    fn lower(self) -> f64 {
        if self.alike == 0 {
            return 0.0;
        }
        let (a, n) = (self.alike as f64, self.drawn as f64);
        Beta::new(a, n - a + 1.0).map_or(0.0, |law| law.inverse_cdf(1.0 - SURE))
    }

    /// Whether more draws can hardly change on which side of the limit it is.
    fn settled(self) -> bool {
        self.upper() <= 1.0 - STRONG || self.is_beyond()
    }

    /// Whether it is surely beyond the limit.
    fn is_beyond(self) -> bool {
        self.lower() > 1.0 - STRONG
    }
}

/// The severity of each cause of an answer.
pub(crate) fn severities(
    context: &Context<'_>,
    readings: &DVector<f64>,
    answer: &Answer,
    dependence: &Dependence,
    options: &Options,
) -> Vec<Severity> {
    let grounds = Grounds::of(context);
    let left = context.chance_beside(readings, &answer.causes);
    let clean = context
        .changes(readings, &answer.causes)
        .map(|changes| context.without(readings, &answer.causes, &changes));
    let beside = Beside {
        left,
        several: answer.causes.len() > 1,
        dependent_noise: dependence.is_seen(),
        jump: clean.is_some_and(|clean| {
            jumps_instead(context.model, readings, &clean, context.law.drifts)
        }),
    };
    Name::all(context, readings, answer, options.false_alarm)
        .iter()
        .map(|name| severity(context, (&grounds, beside), name, options))
        .collect()
}

/// What there is beside a name.
#[derive(Debug, Clone, Copy)]
struct Beside {
    /// See [`Severity::left`].
    left: f64,
    several: bool,
    dependent_noise: bool,
    jump: bool,
}

impl Beside {
    /// Whether it makes a name weak, whatever the rivals.
    fn is_weak(self) -> bool {
        self.left <= SUSPECT || self.several || self.dependent_noise || self.jump
    }
}

/// The severity of one name.
fn severity(
    context: &Context<'_>,
    (grounds, beside): (&Grounds, Beside),
    name: &Name,
    options: &Options,
) -> Severity {
    let mut counts = drawn(context, name, (grounds, beside), options);
    counts.sort_by(|a, b| b.1.probability().total_cmp(&a.1.probability()));
    let upper = counts.iter().map(|(_, c)| c.upper()).fold(0.0, f64::max);
    let most = counts.first().map_or(0.0, |(_, c)| c.probability());
    let lower = 1.0 - upper;
    Severity {
        effect: name.effect.clone(),
        value: 1.0 - most,
        lower,
        left: beside.left,
        beside_others: beside.several,
        dependent_noise: beside.dependent_noise,
        jump_beside: beside.jump,
        confidence: if lower >= STRONG && !beside.is_weak() {
            Confidence::Strong
        } else {
            Confidence::Weak
        },
        rivals: counts
            .iter()
            .map(|(family, count)| Rival {
                name: family.name(context, grounds),
                probability: count.probability(),
            })
            .collect(),
    }
}

/// Draws rivals of every family, a batch of each at a time, until it is settled on which side of the limit they are, or
/// until the name is weak in any case: then the families that are left are known as well as a batch tells. A family that
/// can hardly make a gap of this size is no rival: none are counted.
fn drawn(
    context: &Context<'_>,
    name: &Name,
    (grounds, beside): (&Grounds, Beside),
    options: &Options,
) -> Vec<(Family, Count)> {
    let families = Family::beside(context, grounds, &name.members);
    let mut drawn: Vec<(Family, Count)> = families
        .into_iter()
        .map(|family| (family, Count::default()))
        .collect();
    for batch in 0..options.severity.div_ceil(BATCH) {
        drawn = drawn
            .into_par_iter()
            .filter_map(|(family, mut count)| {
                let open = !count.settled() && count.drawn < options.severity;
                if batch == 0 || open {
                    let most = BATCH.min(options.severity - count.drawn);
                    count.asked += most;
                    let draw = (options.seed, batch);
                    let rivals = Drawn::of(context, name, (family, grounds), draw, most);
                    if FEWEST * (count.drawn + rivals.count) < count.asked {
                        return None;
                    }
                    let alike = name.given(context, &rivals);
                    count.drawn += rivals.count;
                    count.alike += alike.iter().filter(|alike| **alike).count();
                }
                Some((family, count))
            })
            .collect();
        if beside.is_weak() || drawn.iter().any(|(_, count)| count.is_beyond()) {
            drawn.retain(|(_, count)| count.drawn > 0);
            return drawn;
        }
    }
    drawn.retain(|(_, count)| count.drawn >= BATCH.min(options.severity));
    drawn
}

#[cfg(test)]
mod tests {
    use super::Count;

    #[test]
    fn a_limit_is_that_of_clopper_and_pearson() {
        let count = |alike, drawn| Count {
            asked: drawn,
            drawn,
            alike,
        };
        // Closed forms: none of n, 1 − 0.05^(1/n); all of n, 0.05^(1/n). Rounding of the search for a
        // quantile: 1e-6.
        assert!((count(0, 64).upper() - (1.0 - 0.05f64.powf(1.0 / 64.0))).abs() < 1e-6);
        assert!((count(64, 64).lower() - 0.05f64.powf(1.0 / 64.0)).abs() < 1e-6);
        // 59 draws are the fewest that settle a family of which none is named alike.
        assert!(count(0, 59).settled() && !count(0, 58).settled());
        assert!(count(32, 64).settled());
    }
}
