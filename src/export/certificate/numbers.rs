//! The numbers of a result as a certificate states them.

use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};
use serde_json::Value;

/// Coverage probability of uncertainties that the result tells as standard ones.
const COVERAGE: f64 = 0.95;

/// What a result holds for a certificate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Numbers {
    /// What was calibrated, in a few words.
    pub title: String,
    /// How: the method in a sentence or two.
    pub method: String,
    /// The standard that defines the figures.
    pub norm: Option<&'static str>,
    /// The numbers by subject.
    pub groups: Vec<Group>,
    /// What the result holds that is not stated, and why.
    pub left: Vec<(String, String)>,
    /// What the result warns of.
    pub warnings: Vec<String>,
    /// Version of the program that made the result.
    pub version: Option<String>,
}

/// Numbers of one subject.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Group {
    /// The subject.
    pub name: String,
    /// What holds for all of them.
    pub about: String,
    /// The numbers.
    pub entries: Vec<Entry>,
}

/// A quantity, or a list of quantities of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// What is to be known of it; empty for nothing.
    pub about: String,
    /// Unit as the result has it.
    pub unit: String,
    /// The values, one if it is no list.
    pub values: Vec<f64>,
    /// Whether it is a list.
    pub list: bool,
    /// Their uncertainty.
    pub uncertainty: Uncertainty,
}

/// What is stated of the uncertainty of one or more values.
#[derive(Debug, Clone, PartialEq)]
pub enum Uncertainty {
    /// None; the certificate says so.
    None,
    /// There is none to state: a number that was chosen, or is an uncertainty itself.
    Nominal,
    /// U = k u.
    Expanded {
        /// U of each value.
        expanded: Vec<f64>,
        /// k of each value.
        factors: Vec<f64>,
        /// Coverage probability.
        probability: f64,
        /// Distribution that k comes from, where one is told.
        distribution: Option<&'static str>,
    },
    /// A coverage interval that need not be symmetric.
    Interval {
        /// Standard uncertainty.
        standard: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
        /// Coverage probability.
        probability: f64,
    },
}

impl Uncertainty {
    /// A coverage interval, where these numbers are one; else none.
    pub fn interval(standard: &Value, ends: [&Value; 2], probability: &Value) -> Self {
        let numbers = (
            standard.as_f64().filter(|u| *u >= 0.0),
            ends.map(Value::as_f64),
            probability.as_f64().filter(is_probability),
        );
        match numbers {
            (Some(standard), [Some(low), Some(high)], Some(probability)) => Self::Interval {
                standard,
                low,
                high,
                probability,
            },
            _ => Self::None,
        }
    }
}

/// What turns the standard uncertainties of a list into expanded ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    factor: f64,
    probability: f64,
    distribution: &'static str,
}

impl Coverage {
    /// From `degrees_of_freedom`, with `coverage_factor` and `coverage_probability` where they are told.
    pub fn of(told: &Value) -> Option<Self> {
        let freedom = &told["degrees_of_freedom"];
        let probability = told["coverage_probability"].as_f64().unwrap_or(COVERAGE);
        let probability = Some(probability).filter(is_probability)?;
        let degrees = match freedom.as_f64() {
            Some(number) => DegreesOfFreedom::new(number).ok()?,
            None if freedom == "infinite" => DegreesOfFreedom::Infinite,
            None => return None,
        };
        let factor = match told["coverage_factor"].as_f64() {
            Some(factor) => factor,
            None => coverage_factor(probability, degrees).ok()?,
        };
        Some(Self {
            factor,
            probability,
            distribution: distribution(freedom),
        })
    }
}

/// The distribution that a coverage factor of so many degrees of freedom comes from.
fn distribution(freedom: &Value) -> &'static str {
    if freedom == "infinite" { "normal" } else { "t" }
}

impl Group {
    /// A subject without numbers yet.
    pub fn new(name: &str, about: &str) -> Self {
        Self {
            name: name.to_owned(),
            about: about.to_owned(),
            entries: Vec::new(),
        }
    }
}

impl Entry {
    /// A number without uncertainty.
    pub fn bare(name: &str, value: &Value, unit: &str) -> Option<Self> {
        Some(Self {
            name: name.to_owned(),
            about: String::new(),
            unit: unit.to_owned(),
            values: vec![value.as_f64()?],
            list: false,
            uncertainty: Uncertainty::None,
        })
    }

    /// A quantity of the GUM as every answer has it: `value`, `unit`, `degrees_of_freedom`, with `expanded` beside
    /// them or given apart; nothing where it is null.
    pub fn quantity(name: &str, quantity: &Value, expanded: &Value) -> Option<Self> {
        let mut entry = Self::bare(name, &quantity["value"], quantity["unit"].as_str()?)?;
        let number = |key: &str| expanded[key].as_f64();
        if let (Some(u), Some(factor), Some(probability)) = (
            number("expanded_uncertainty").filter(|u| *u >= 0.0),
            number("coverage_factor"),
            number("coverage_probability").filter(is_probability),
        ) {
            entry.uncertainty = if factor >= 1.0 {
                Uncertainty::Expanded {
                    expanded: vec![u],
                    factors: vec![factor],
                    probability,
                    distribution: Some(distribution(&quantity["degrees_of_freedom"])),
                }
            } else {
                // The format has no coverage factor below 1.
                Uncertainty::interval(
                    &quantity["std"],
                    [&expanded["lower"], &expanded["upper"]],
                    &expanded["coverage_probability"],
                )
            };
        }
        Some(entry)
    }

    /// A list without uncertainty; nothing where it is null, empty or has places without a number.
    pub fn list(name: &str, values: &Value, unit: &str) -> Option<Self> {
        Some(Self {
            name: name.to_owned(),
            about: String::new(),
            unit: unit.to_owned(),
            values: numbers(values)?,
            list: true,
            uncertainty: Uncertainty::None,
        })
    }

    /// Positions and other numbers that were chosen.
    pub fn nominal(name: &str, values: &Value, unit: &str) -> Option<Self> {
        let entry = Self::list(name, values, unit)?;
        Some(Self {
            uncertainty: Uncertainty::Nominal,
            ..entry
        })
    }

    /// A list with its standard uncertainties. Where nothing tells how well these are known, and with that no
    /// coverage factor, they follow as a list of their own.
    pub fn with_std(
        name: &str,
        (values, std): (&Value, &Value),
        unit: &str,
        coverage: Option<Coverage>,
    ) -> Vec<Self> {
        let Some(mut entry) = Self::list(name, values, unit) else {
            return Vec::new();
        };
        let whole =
            |std: &Vec<f64>| std.len() == entry.values.len() && std.iter().all(|u| *u >= 0.0);
        let Some(std) = numbers(std).filter(whole) else {
            return vec![entry];
        };
        let usable =
            |c: &Coverage| c.factor >= 1.0 && std.iter().all(|u| (c.factor * u).is_finite());
        match coverage.filter(usable) {
            Some(coverage) => {
                entry.uncertainty = Uncertainty::Expanded {
                    expanded: std.iter().map(|u| coverage.factor * u).collect(),
                    factors: vec![coverage.factor; std.len()],
                    probability: coverage.probability,
                    distribution: Some(coverage.distribution),
                };
                vec![entry]
            }
            None => {
                entry.about = "The result tells standard uncertainties, in the list that follows, but not their degrees of freedom: \
                     no coverage factor can be stated."
                    .to_owned();
                let own = Self {
                    name: format!("standard uncertainty of {name}"),
                    about: String::new(),
                    values: std,
                    uncertainty: Uncertainty::Nominal,
                    ..entry.clone()
                };
                vec![entry, own]
            }
        }
    }

    /// With a remark.
    #[must_use]
    pub fn about(mut self, about: &str) -> Self {
        self.about = about.to_owned();
        self
    }
}

/// Whether a number can be the probability of an interval.
fn is_probability(number: &f64) -> bool {
    *number > 0.0 && *number < 1.0
}

/// The numbers of a list without gaps.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    let values: Vec<f64> = value
        .as_array()?
        .iter()
        .map(Value::as_f64)
        .collect::<Option<_>>()?;
    (!values.is_empty()).then_some(values)
}
