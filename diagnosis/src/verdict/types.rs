//! What the diagnosis says.

use errsep_models::model::{AnyModel, FittedModel};
use serde::Serialize;

use crate::attribution::reported::{Bias, Candidate};
use crate::attribution::shrink::{HeldOut, Size};
use crate::detection::localise::Item;
use crate::detection::smallest::SizesByShape;
use crate::levels::INVISIBLE;
use crate::noise::dependence::Dependence;
use crate::noise::law::NoiseLaw;
use crate::severity::Severity;
use crate::verdict::told::for_people;
use errsep_models::number::plain;

/// The kind of verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// No gap is detected; its interval holds zero.
    None,
    /// One or several effects of the catalogue explain the gap.
    Effect,
    /// There is a gap that no effect of the catalogue explains.
    Unknown,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Its kind.
    pub kind: Kind,
    /// The effects, by what each adds; of a group the one of greatest evidence.
    pub effects: Vec<String>,
    /// How severe the test of each effect was, in the same order; empty where no rivals were drawn.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub severity: Vec<Severity>,
    /// Groups of effects that these data cannot tell apart, the greatest evidence first.
    pub indistinguishable: Vec<Vec<String>>,
    /// Effects that explain a part of an unknown gap.
    pub partial: Vec<String>,
    /// For each group the observation that would split it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub separate: Vec<String>,
    /// The shape of an unknown gap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Fingerprint>,
    /// One sentence for a person.
    pub statement: String,
    /// Probability of as much standing out with nothing there.
    pub p_value: f64,
    /// Probability of what remains.
    pub adequacy: f64,
}

impl Verdict {
    /// For each effect named those that stand for it: its group, or itself alone.
    #[must_use]
    pub fn causes(&self) -> Vec<Vec<&str>> {
        self.effects
            .iter()
            .map(|effect| {
                let mut groups = self.indistinguishable.iter();
                let own = groups.find(|group| group.first() == Some(effect));
                let alone = std::slice::from_ref(effect);
                let members = own.map_or(alone, Vec::as_slice);
                members.iter().map(String::as_str).collect()
            })
            .collect()
    }

    /// The effects whose change is taken out of the readings for all that is said of afterwards:
    /// those named, or those that explain a part.
    #[must_use]
    pub fn taken_out(&self) -> &[String] {
        match self.kind {
            Kind::None => &[],
            Kind::Effect => &self.effects,
            Kind::Unknown => &self.partial,
        }
    }
}

/// What an unknown gap looks like, beside its places.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fingerprint {
    /// Channels in which it is.
    pub present: Vec<String>,
    /// Channels in which it is not.
    pub absent: Vec<String>,
    /// Part that turns its sign with the direction of travel, where both were run.
    pub odd: Option<f64>,
    /// Part that comes back in every repeat, where there are repeats.
    pub repeated: Option<f64>,
    /// The effect that is most like it.
    pub nearest: Option<Nearest>,
}

/// The effect most like an unknown gap, and why it is not it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nearest {
    /// The effect.
    pub effect: String,
    /// Cosine of the angle between the gap and the effect's best signature.
    pub cosine: f64,
    /// Probability of what remains beside it.
    pub p_value: f64,
    /// Where most remains beside it.
    pub against: Option<Where>,
}

/// The gap between model and readings, in the unit of the readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Unit of the readings.
    pub unit: &'static str,
    /// Standard deviation of one reading, or of the mean of those that each is gathered from.
    pub noise: f64,
    /// How many those are.
    pub readings_in_each: f64,
    /// What the model misses.
    pub before: Size,
    /// What it still misses with the effects.
    pub after: Size,
    /// 1 − after / before.
    pub shrink: f64,
    /// `after / before` predicted by the score before refitting, as a shrink.
    pub predicted_shrink: f64,
    /// On repeats that were not used, where there are enough.
    pub held_out: Option<HeldOut>,
}

/// A place where the gap lies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// The place.
    pub axis: &'static str,
    /// Which channel, pattern, direction …
    pub value: String,
    /// Where it begins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// Where it ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Unit of both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Part of the gap that it explains.
    pub share: f64,
    /// 95 % interval of the share.
    pub share_ci95: [f64; 2],
    /// Corrected for every place looked at.
    pub p_value: f64,
}

impl Where {
    pub(crate) fn new(
        model: &AnyModel,
        item: &Item,
        share: f64,
        share_ci95: [f64; 2],
        p_value: f64,
    ) -> Self {
        let unit = if item.axis == "time" {
            model.time_unit()
        } else {
            model.position_unit()
        };
        Self {
            axis: item.axis,
            value: item.value.clone(),
            from: item.from,
            to: item.to,
            unit: item.from.and(item.to).map(|_| unit),
            share,
            share_ci95,
            p_value,
        }
    }

    /// From where to where, in words.
    #[must_use]
    pub fn range(&self) -> Option<String> {
        let (from, to) = (plain(self.from?, 4), plain(self.to?, 4));
        let unit = self.unit.map_or("", for_people);
        Some(format!("{from} to {to} {unit}").trim_end().to_owned())
    }
}

/// An effect that these readings show badly or not at all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hidden {
    /// Its name.
    pub effect: String,
    /// Part of the effect that the fit cannot absorb.
    pub visible: f64,
    /// Smallest amplitude that would be seen with 80 % probability; none where that is greater than
    /// any plausible one or where nothing shows.
    pub detectable: Option<f64>,
    /// How far that size is another for other shapes of the effect; none where they are alike.
    pub by_shape: Option<SizesByShape>,
    /// Whether it may have to be greater than that: it differs from repeat to repeat and is taken for noise in
    /// part.
    pub at_least: bool,
    /// Unit of that amplitude.
    pub unit: String,
    /// The quantity it biases most, per unit of its amplitude.
    pub harm: Option<Harm>,
}

impl Hidden {
    /// Whether the effect would show if only it could be so great.
    #[must_use]
    pub fn implausible(&self) -> bool {
        self.detectable.is_none() && self.visible >= INVISIBLE
    }
}

/// What an unseen effect does to a quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Harm {
    /// The quantity.
    pub quantity: String,
    /// Bias per unit of the effect's amplitude.
    pub per_unit: f64,
    /// Unit of the quantity.
    pub unit: String,
}

/// The whole diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// `errsep.diagnosis/1`.
    pub schema: &'static str,
    /// The model.
    pub model: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// How great the gap is.
    pub gap: Gap,
    /// The noise.
    pub noise: NoiseOut,
    /// Where the gap lies.
    #[serde(rename = "where")]
    pub places: Vec<Where>,
    /// The effects, by what they explain.
    pub candidates: Vec<Candidate>,
    /// How far the quantities move.
    pub bias: Vec<Bias>,
    /// What could still hide.
    pub hidden: Vec<Hidden>,
    /// What the reader should know.
    pub notes: Vec<String>,
    /// For plots: what is left of every reading, and the profiles.
    #[serde(skip)]
    pub detail: Detail,
}

/// What is left of every reading, and the profiles, without and with the effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detail {
    /// Least-squares residuals without the effects.
    pub before: Vec<f64>,
    /// With them.
    pub after: Vec<f64>,
    /// Name, values without and values with the effects.
    pub profiles: Vec<(String, Vec<f64>, Vec<f64>)>,
    /// What the effects change in every reading.
    pub change: Vec<f64>,
    /// For each group, where the model knows of further measurements: standard deviations between
    /// the effect named first and the member nearest to it, in these readings.
    pub apart: Vec<f64>,
}

impl Detail {
    /// What the effects change in every reading.
    pub fn change(&self) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_column_slice(&self.change)
    }
}

/// The noise, as reported.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseOut {
    /// Standard deviation of the white part.
    pub white: f64,
    /// Of the part correlated along a trace.
    pub correlated: f64,
    /// Its correlation length, mm.
    pub length: f64,
    /// Of the shift of a whole trace.
    pub shift: f64,
    /// Of the slope by which a whole trace drifts, in the unit of the readings over that of the positions; zero unless
    /// that explains the repeats better than causes do.
    pub drift: f64,
    /// `repeats`, `stated` or `neighbours`.
    pub source: &'static str,
    /// How well it is known, and with it every standard uncertainty of the diagnosis; none where it
    /// is stated.
    pub degrees_of_freedom: Option<f64>,
    /// A correlation of two channels in what differs from repeat to repeat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_channels: Option<BetweenChannels>,
    /// A period in what differs from repeat to repeat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period: Option<Period>,
    /// How what differs from repeat to repeat goes on from one trace to the next.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_traces: Option<BetweenTraces>,
    /// Channels whose traces shift more from repeat to repeat than those of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven: Option<Uneven>,
}

/// A correlation of two channels in what differs from repeat to repeat.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BetweenChannels {
    /// The channels.
    pub channels: [String; 2],
    /// The correlation, whitened by the law of the noise along a trace.
    pub correlation: f64,
    /// Probability of as much in independent noise.
    pub p_value: f64,
}

/// A period in what differs from repeat to repeat.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Period {
    /// Its length.
    pub length: f64,
    /// Unit of the positions.
    pub unit: &'static str,
    /// Probability of as much in independent noise.
    pub p_value: f64,
}

/// How what differs from repeat to repeat goes on from one trace to the next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BetweenTraces {
    /// Correlation of the ends of traces with the beginnings of the next ones.
    pub correlation: f64,
    /// Probability of as much in independent noise.
    pub p_value: f64,
}

/// Channels whose traces shift more from repeat to repeat than those of the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Uneven {
    /// The channels.
    pub channels: Vec<String>,
    /// How many times as much, each in units of the scatter of its readings.
    pub times: f64,
    /// Probability of as much in noise that is alike in all.
    pub p_value: f64,
}

/// The source of a noise that is told from all that the fit leaves, where nothing is repeated.
pub(crate) const NOT_REPEATED: &str = "residuals";

impl NoiseOut {
    pub(crate) fn of(model: &AnyModel, law: &NoiseLaw, dependence: &Dependence) -> Self {
        use crate::noise::law::NoiseSource;
        Self {
            white: law.parts.white.sqrt(),
            correlated: law.parts.correlated.sqrt(),
            length: law.parts.length,
            shift: law.parts.shift.sqrt(),
            drift: law.parts.drift.sqrt(),
            source: match law.source {
                NoiseSource::Repeats => "repeats",
                NoiseSource::Stated => "stated",
                NoiseSource::Neighbours => "neighbours",
                NoiseSource::Residuals => NOT_REPEATED,
            },
            degrees_of_freedom: Some(law.freedom).filter(|freedom| freedom.is_finite()),
            between_channels: dependence.between_channels.as_ref().map(|both| {
                let names = model.channel_names();
                BetweenChannels {
                    channels: both.channels.map(|channel| names[channel].clone()),
                    correlation: both.correlation,
                    p_value: both.p_value,
                }
            }),
            period: dependence.period.as_ref().map(|period| Period {
                length: period.length,
                unit: model.position_unit(),
                p_value: period.p_value,
            }),
            between_traces: dependence.course.as_ref().map(|course| BetweenTraces {
                correlation: course.correlation,
                p_value: course.p_value,
            }),
            uneven: dependence.uneven.as_ref().map(|uneven| {
                let names = model.channel_names();
                Uneven {
                    channels: uneven.channels.iter().map(|k| names[*k].clone()).collect(),
                    times: uneven.times,
                    p_value: uneven.p_value,
                }
            }),
        }
    }
}
