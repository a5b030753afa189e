//! Numbers and units as people read them: the same in the sentence, the text and the page.

use std::ops::Range;

use errsep_models::model::{AnyModel, FittedModel};

use crate::attribution::reported::ParameterOut;
use crate::attribution::shrink::Size;
use crate::levels::DEPENDENT;
use crate::noise::dependence::Dependence;
use crate::noise::law::{Drifts, NoiseLaw};
use crate::verdict::types::Gap;
use errsep_models::number::{measured, percent, plain};

/// Digits of a gap.
const DIGITS: usize = 3;
/// Readings behind each, in the mean, up to which most stand alone.
const ABOUT_ONE: f64 = 1.5;

/// A value with its standard uncertainty in the unit it is shown in.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard uncertainty.
    pub std: f64,
    /// Unit.
    pub unit: String,
}

impl Told {
    /// `name value ± std unit`.
    #[must_use]
    pub fn in_words(&self) -> String {
        let value = measured(self.value, Some(self.std));
        format!("{} {value} {}", self.name, self.unit)
            .trim_end()
            .to_owned()
    }
}

impl ParameterOut {
    /// The parameter as it is shown: no logarithm, angles in µrad.
    #[must_use]
    pub fn told(&self) -> Told {
        let (name, value, std, unit) = match &self.linear {
            Some(linear) => (&linear.name, linear.value, linear.std, &linear.unit),
            None => (&self.name, self.value, self.std, &self.unit),
        };
        let (scale, unit) = scaled(unit);
        Told {
            name: name.clone(),
            value: scale * value,
            std: scale * std,
            unit: unit.to_owned(),
        }
    }
}

impl Size {
    /// Whether its interval excludes zero.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.ci95[0] > 0.0
    }

    /// Whether its interval holds zero alone: there is less than even noise leaves.
    #[must_use]
    pub fn is_nothing(&self) -> bool {
        self.ci95[1] <= 0.0
    }

    /// The number, or the bound that takes its place where the noise leaves no more to be said.
    #[must_use]
    pub fn in_words(&self, unit: &str) -> String {
        let unit = for_people(unit);
        if self.rms > 0.0 {
            format!("{} {unit} RMS", plain(self.rms, DIGITS))
        } else if self.is_nothing() {
            "nothing beyond the noise".to_owned()
        } else {
            format!("less than {} {unit} RMS", plain(self.ci95[1], DIGITS))
        }
    }

    /// Value and interval, without a unit.
    #[must_use]
    pub fn figures(&self) -> String {
        format!(
            "{} [{}, {}]",
            plain(self.rms, DIGITS),
            plain(self.ci95[0], DIGITS),
            plain(self.ci95[1], DIGITS)
        )
    }
}

impl Gap {
    /// Its noise, without a unit.
    #[must_use]
    pub fn noise_figure(&self) -> String {
        plain(self.noise, DIGITS)
    }

    /// Of what it is the noise: one reading, or a mean of several.
    #[must_use]
    pub fn of_what(&self) -> String {
        of_what(self.readings_in_each)
    }

    /// Whether it is that of means.
    #[must_use]
    pub fn is_of_means(&self) -> bool {
        self.readings_in_each > ABOUT_ONE
    }
}

pub(crate) fn of_what(readings: f64) -> String {
    if readings > ABOUT_ONE {
        format!("a mean of {} readings", plain(readings, 2))
    } else {
        "one reading".to_owned()
    }
}

/// That readings which stand out were pulled in to the others.
pub(crate) fn pulled_in(count: usize) -> String {
    let [stand, its, they] = match count {
        1 => ["reading stands", "its", "it is"],
        _ => ["readings stand", "their", "they are"],
    };
    format!(
        "{count} single {stand} out of {its} neighbours and of {its} own repeats by more than four standard deviations; {they} pulled in to four."
    )
}

/// In what the differences between repeats are not independent noise.
pub(crate) fn no_noise(model: &AnyModel, dependence: &Dependence) -> Option<String> {
    let between_channels = dependence.between_channels.as_ref().map(|both| {
        let names = model.channel_names();
        let [one, other] = both.channels.map(|channel| names[channel].as_str());
        let correlation = plain(both.correlation, 2);
        format!("{one} and {other} are correlated ({correlation})")
    });
    let period = dependence.period.as_ref().map(|period| {
        let length = plain(period.length, 3);
        let unit = for_people(model.position_unit());
        format!("it comes back every {length} {unit}")
    });
    let course = dependence.course.as_ref().map(|course| {
        let correlation = plain(course.correlation, 2);
        format!("it goes on from one trace to the next (correlation {correlation})")
    });
    let uneven = dependence.uneven.as_ref().map(|uneven| {
        let names = model.channel_names();
        let channels: Vec<&str> = uneven.channels.iter().map(|k| names[*k].as_str()).collect();
        format!(
            "the traces of {} shift {} times as much as those of the others",
            channels.join(" and "),
            plain(uneven.times, 2)
        )
    });
    let lasts = course.is_some() || uneven.is_some();
    let mut advice = String::new();
    if period.is_some() {
        advice +=
            " Measure at another feed: what sticks keeps its length, what swings keeps its time.";
    }
    if lasts {
        advice += " Record the indicators at one position for as long as the test took, and the temperatures with them.";
    }
    let what = if lasts {
        "Something that lasts longer than a trace"
    } else {
        "Something that acts anew in every pass"
    };
    let ways = [between_channels, period, course, uneven];
    let ways: Vec<String> = ways.into_iter().flatten().collect();
    (!ways.is_empty()).then(|| format!(
        "What differs from repeat to repeat is not independent noise: {}; independent noise does so in less than {} of cases. {what} is counted as noise here; probabilities and uncertainties hold for independent noise only.{advice}",
        ways.join(", and "),
        percent(DEPENDENT)
    ))
}

/// A unit as people write it.
pub fn for_people(unit: &str) -> &str {
    match unit {
        "um" => "µm",
        "um/mm" => "µm/mm",
        "1" => "",
        unit => unit,
    }
}

/// By what a value is multiplied to be shown, and the unit it is shown in: angles in µrad.
#[must_use]
pub fn scaled(unit: &str) -> (f64, &str) {
    match unit {
        "rad" => (1e6, "µrad"),
        "rad/mm" => (1e6, "µrad/mm"),
        unit => (1.0, for_people(unit)),
    }
}

/// That whole traces drift, where the law of the noise has it so.
pub(crate) fn drifting(model: &AnyModel, law: &NoiseLaw) -> Option<String> {
    if law.drifts == Drifts::Never || law.parts.drift <= 0.0 {
        return None;
    }
    let travel = |trace: &Range<usize>| {
        let places = model.places()[trace.clone()].iter();
        let ends = places.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(least, most), place| (least.min(place.x), most.max(place.x)),
        );
        ends.1 - ends.0
    };
    let longest = model.traces().iter().map(travel).fold(0.0, f64::max);
    Some(format!(
        "Every trace drifts by a slope of its own, {} {} from end to end (standard deviation): that explains the repeats better than any cause that goes on from trace to trace, and counts as noise. An indicator that has come to rest before a pass begins does not drift.",
        plain(law.parts.drift.sqrt() * longest, 2),
        for_people(model.reading_unit())
    ))
}
