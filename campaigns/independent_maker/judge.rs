//! How an answer stands to what was put in.

use crate::case::Case;
use crate::product::Said;

/// How an answer stands to one effect that was put in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Named, and nothing else.
    Alone,
    /// One group, and it holds the effect.
    Group,
    /// Several causes, the effect or its group among them.
    Among,
    /// Another effect alone.
    Wrong,
    /// Groups or several causes without the effect.
    WrongGroup,
    /// `unknown`.
    Unknown,
    /// `none`.
    Nothing,
    /// Readings that are not taken.
    Refused,
}

/// All outcomes in the order of the tables.
pub const OUTCOMES: [(Outcome, &str); 8] = [
    (Outcome::Alone, "alone"),
    (Outcome::Group, "group with it"),
    (Outcome::Among, "among several"),
    (Outcome::Wrong, "another alone"),
    (Outcome::WrongGroup, "others"),
    (Outcome::Unknown, "unknown"),
    (Outcome::Nothing, "none"),
    (Outcome::Refused, "refused"),
];

/// Judges an answer to one effect.
pub fn outcome(said: &Result<Said, String>, truth: &str) -> Outcome {
    let Ok(said) = said else {
        return Outcome::Refused;
    };
    let causes = said.causes();
    let holds = causes
        .iter()
        .any(|group| group.iter().any(|name| name == truth));
    match (said.kind.as_str(), causes.as_slice()) {
        ("none", _) => Outcome::Nothing,
        ("unknown", _) => Outcome::Unknown,
        (_, [one]) if one.len() == 1 => {
            if holds {
                Outcome::Alone
            } else {
                Outcome::Wrong
            }
        }
        (_, [_]) => {
            if holds {
                Outcome::Group
            } else {
                Outcome::WrongGroup
            }
        }
        _ => {
            if holds {
                Outcome::Among
            } else {
                Outcome::WrongGroup
            }
        }
    }
}

/// How an answer stands to two effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Both {
    /// Both and nothing else.
    Exactly,
    /// Two causes, each with one of them, at least one of them a group.
    Groups,
    /// One of them, nothing wrong.
    One,
    /// Something that is not there.
    Wrong,
    /// `unknown`.
    Unknown,
    /// `none`.
    Nothing,
    /// Readings that are not taken.
    Refused,
}

/// All in the order of the table.
pub const BOTH: [(Both, &str); 7] = [
    (Both::Exactly, "exactly both"),
    (Both::Groups, "both, within groups"),
    (Both::One, "one of them only"),
    (Both::Wrong, "an effect that is not there"),
    (Both::Unknown, "`unknown`"),
    (Both::Nothing, "`none`"),
    (Both::Refused, "refused"),
];

/// Judges an answer to two effects.
pub fn both(said: &Result<Said, String>, truths: [&str; 2]) -> Both {
    let Ok(said) = said else { return Both::Refused };
    match said.kind.as_str() {
        "none" => return Both::Nothing,
        "unknown" => return Both::Unknown,
        _ => {}
    }
    let causes = said.causes();
    let holds = |group: &[String], truth: &str| group.iter().any(|name| name == truth);
    if causes
        .iter()
        .any(|group| !truths.iter().any(|t| holds(group, t)))
    {
        return Both::Wrong;
    }
    let matched = |[a, b]: [usize; 2]| holds(&causes[a], truths[0]) && holds(&causes[b], truths[1]);
    match causes.len() {
        1 => Both::One,
        2 if matched([0, 1]) || matched([1, 0]) => {
            if causes.iter().all(|group| group.len() == 1) {
                Both::Exactly
            } else {
                Both::Groups
            }
        }
        _ => Both::Wrong,
    }
}

/// Whether the gap before is told within 15 %.
pub fn gap_right(said: &Said, case: &Case) -> bool {
    (said.gap / case.gap - 1.0).abs() <= 0.15
}

/// A size of less than so many standard uncertainties is none, where the answer states one for each indicator.
const NONE: f64 = 3.0;

/// How far the size is off in standard uncertainties, where the answer states one in the same sense; of an answer that
/// states one for each indicator, that of the first that has any. Signs are a convention and left aside.
pub fn size_off(said: &Said, case: &Case) -> Option<f64> {
    let truth = case.truths.first()?;
    let (size, unit) = truth.size?;
    let unit_of = |unit: &str| unit.replace("um", "µm").replace("μm", "µm");
    let same = |told: &str| unit_of(told) == unit || (unit == "1" && told.is_empty());
    let own = said.sizes.iter();
    let own = own.filter(|(effect, _, _, told)| effect == truth.name && same(told));
    let has = own
        .clone()
        .find(|(_, value, std, _)| value.abs() > NONE * std);
    let (_, value, std, _) = has.or_else(|| own.clone().next())?;
    Some((value.abs() - size.abs()) / std)
}
