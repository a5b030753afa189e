//! One line of the outcome file.

use serde::{Deserialize, Serialize};

/// The parameter of an effect: truth and estimate.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sized {
    pub effect: String,
    pub truth: f64,
    pub value: f64,
    pub std: f64,
    /// Smallest amplitude seen with 80 % probability, where the effect was not named.
    pub detectable: Option<f64>,
}

/// What became of one case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    pub set: String,
    pub noise: String,
    pub case: u64,
    pub truth: Vec<String>,
    pub kind: String,
    /// The effects named, in alphabetical order.
    pub said: Vec<String>,
    pub groups: Vec<Vec<String>>,
    pub partial: Vec<String>,
    pub p_value: f64,
    pub adequacy: f64,
    /// Withheld: what was named is one that the whole catalogue cannot tell from the truth.
    #[serde(default)]
    pub alias: bool,
    /// Standard deviations between the members of each group.
    #[serde(default)]
    pub apart: Vec<f64>,
    pub gap_true: f64,
    pub gap: f64,
    pub held_after: Option<f64>,
    pub held_floor: Option<f64>,
    pub sizes: Vec<Sized>,
    pub seconds: f64,
    /// Digest of the answer, before it was opened.
    pub seal: String,
    /// Digest of the report, before the answer was opened.
    pub report: String,
}

impl Outcome {
    /// What was said, in a word.
    pub fn label(&self) -> String {
        match self.kind.as_str() {
            "effect" if self.groups.is_empty() => self.said.join(" + "),
            "effect" => "a group".to_owned(),
            kind => kind.to_owned(),
        }
    }

    /// The truth, in a word.
    pub fn name(&self) -> String {
        let mut names = self.truth.clone();
        names.sort();
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(" + ")
        }
    }

    /// Exactly the truth was named.
    pub fn right(&self) -> bool {
        self.label() == self.name()
    }

    /// A group with the truth in it was named.
    pub fn in_group(&self) -> bool {
        self.kind == "effect"
            && !self.groups.is_empty()
            && self
                .truth
                .iter()
                .all(|t| self.said.contains(t) || self.groups.iter().any(|group| group.contains(t)))
    }

    /// A group of which one who knew everything but the member would take the wrong one more often
    /// than once in a hundred times: less than twice the 99 % quantile apart.
    pub fn alike(&self) -> bool {
        self.in_group() && self.apart.iter().any(|apart| *apart < 4.65)
    }

    /// Something was named, no group, and it was not the truth.
    pub fn wrong(&self) -> bool {
        self.kind == "effect" && self.groups.is_empty() && !self.right()
    }
}
