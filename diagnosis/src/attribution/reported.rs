//! What attribution gives back, as plain values.

use errsep_models::model::Estimate;
use serde::Serialize;

/// One effect of the catalogue against these readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Its name.
    pub effect: String,
    /// Part of the gap that it alone explains.
    pub explained: f64,
    /// Corrected for every shape tried.
    pub p_value: f64,
    /// Log Bayes factor against no effect (Schwarz's approximation); of an effect that is named, alone
    /// or in a group, beside the other causes.
    pub evidence: f64,
    /// Part of the effect that the fit cannot absorb.
    pub visible: f64,
    /// Whether it is in the confidence set.
    pub in_set: bool,
    /// Variant in words, where it has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Its parameters.
    pub parameters: Vec<ParameterOut>,
    /// Of a named effect its other variants that fit as well.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub elsewhere: Vec<Elsewhere>,
    /// What happens physically.
    pub physics: String,
    /// What would confirm it.
    pub confirm: String,
}

/// Another variant of an effect, which these readings cannot tell from the one named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elsewhere {
    /// Variant in words.
    pub variant: String,
    /// Its parameters there.
    pub parameters: Vec<ParameterOut>,
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterOut {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard uncertainty.
    pub std: f64,
    /// Unit.
    pub unit: String,
    /// Of a parameter that is told by its logarithm the quantity itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linear: Option<Linear>,
}

/// A quantity whose logarithm is a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Linear {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard uncertainty, to first order.
    pub std: f64,
    /// Unit.
    pub unit: String,
}

impl From<Estimate> for ParameterOut {
    fn from(estimate: Estimate) -> Self {
        let linear = estimate.unit.strip_prefix("ln ").map(|unit| Linear {
            name: estimate.name.trim_start_matches("log-").to_owned(),
            value: estimate.value.exp(),
            std: estimate.value.exp() * estimate.std,
            unit: unit.to_owned(),
        });
        Self {
            name: estimate.name,
            value: estimate.value,
            std: estimate.std,
            unit: estimate.unit,
            linear,
        }
    }
}

/// How far a quantity moves when the effects are added.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bias {
    /// The quantity; a profile is given by its root mean square.
    pub quantity: String,
    /// Without the effects.
    pub before: f64,
    /// With them.
    pub after: f64,
    /// Root mean square of the difference of profiles, or the difference.
    pub moved: f64,
    /// Standard uncertainty of the value without the effects; of a profile, that of one of its values.
    pub std: f64,
    /// Likewise of the value with them.
    pub after_std: f64,
    /// Standard uncertainty of the move.
    pub moved_std: f64,
    /// Unit.
    pub unit: String,
}
