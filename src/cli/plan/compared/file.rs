//! The plan file of designs that are compared.

use std::collections::BTreeMap;

use errsep_models::reversal::designs::{Design, SLOPES, Zero};
use serde::Deserialize;
use toml::Spanned;

use super::super::designs::{Common, Costs};
use super::super::{FORMS, LARGEST, LONGEST_TRAVEL};
use crate::io::message::{list, nearest};
use crate::io::reversal::{Angles, channels};
use crate::io::{Message, Numbers, SetupFile};

/// More designs than this have no place beside each other.
const MOST_DESIGNS: usize = 8;

/// What is expected where the plan does not say it: α_h, α_v, γ_1, γ_2, cone, µrad.
const SLOPES_EXPECTED: [f64; 5] = [50.0, 50.0, 20.0, 20.0, 0.0];

/// What is done takes so long where the plan does not say it.
const COSTS: Costs = Costs {
    trace: 60.0,
    turn: 30.0,
    indicator: 300.0,
    indicators: 2,
};

/// Longest time of one step, s: a week.
const LONGEST: f64 = 604_800.0;

/// Forms that can be wanted; `S`: the worst known of all sides.
const FORMS_WANTED: [&str; 3] = ["M_h", "M_v", "S"];

const WANTED: [&str; 5] = ["alpha_h", "alpha_v", "M_h", "M_v", "S"];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    noise: Spanned<f64>,
    travel: Spanned<f64>,
    positions: Spanned<usize>,
    repeats: Option<Spanned<u32>>,
    #[serde(default)]
    both_directions: bool,
    slopes: Option<Spanned<Numbers<5>>>,
    forms: Option<Spanned<Numbers<2>>>,
    thickness: Option<Spanned<f64>>,
    #[serde(default)]
    zero: Zeros,
    wanted: Option<Spanned<Vec<String>>>,
    seconds_a_trace: Option<Spanned<f64>>,
    seconds_a_turn: Option<Spanned<f64>>,
    seconds_an_indicator: Option<Spanned<f64>>,
    indicators: Option<Spanned<usize>>,
    design: Option<Spanned<Given>>,
    #[serde(default)]
    channels: BTreeMap<Spanned<String>, Spanned<Angles>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Zeros {
    #[default]
    Reset,
    Kept,
}

/// One design, or several with names.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "design is no list of channels: write design = \"0/0,0/180\", or [[design]] tables with name and channels"
)]
enum Given {
    One(String),
    Several(Vec<Entry>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: Option<String>,
    channels: String,
}

pub(super) fn common(setup: &SetupFile, file: &File, seed: u64) -> Result<Common, Message> {
    let above = |value: &Spanned<f64>, name: &str, most: f64, unit: &str| {
        let own = *value.get_ref();
        if own > 0.0 && own <= most {
            return Ok(own);
        }
        let what = format!("{name} = {own} {unit} cannot be planned");
        let remedy = format!("give {name} in {unit}, greater than zero and at most {most}");
        Err(setup.bad(value.span(), what, remedy))
    };
    let seconds = |value: &Option<Spanned<f64>>, name: &str, usual: f64| match value {
        Some(given) if (0.0..=LONGEST).contains(given.get_ref()) => Ok(*given.get_ref()),
        Some(given) => Err(setup.bad(
            given.span(),
            format!("{name} = {} is no time", given.get_ref()),
            "give seconds, zero or more and at most a week",
        )),
        None => Ok(usual),
    };
    if *file.positions.get_ref() < 5 {
        let what = format!("{} positions show no form", file.positions.get_ref());
        return Err(setup.bad(file.positions.span(), what, "give 5 or more"));
    }
    let repeats = file.repeats.as_ref().map_or(1, |r| *r.get_ref());
    let indicators = file
        .indicators
        .as_ref()
        .map_or(COSTS.indicators, |n| *n.get_ref());
    for (none, span, what) in [
        (
            repeats == 0,
            file.repeats.as_ref().map(Spanned::span),
            "no repeat gives no reading",
        ),
        (
            indicators == 0,
            file.indicators.as_ref().map(Spanned::span),
            "no indicator reads nothing",
        ),
    ] {
        if none {
            return Err(setup.bad(span.unwrap_or(0..0), what, "give 1 or more"));
        }
    }
    let within = |values: &[f64], least: f64| values.iter().all(|v| (least..=LARGEST).contains(v));
    if let Some(slopes) = &file.slopes
        && !within(&slopes.get_ref().0, -LARGEST)
    {
        let remedy = "give alpha_h, alpha_v, gamma_1, gamma_2, cone in urad, finite and below 1e6";
        return Err(setup.bad(slopes.span(), "the expected slopes cannot be", remedy));
    }
    if let Some(forms) = &file.forms
        && !within(&forms.get_ref().0, 0.0)
    {
        let remedy =
            "give root mean squares of slide and sides in um, zero or greater and below 1e6";
        return Err(setup.bad(forms.span(), "the expected forms cannot be", remedy));
    }
    Ok(Common {
        noise: above(&file.noise, "noise", LARGEST, "um")?,
        travel: above(&file.travel, "travel", LONGEST_TRAVEL, "mm")?,
        positions: *file.positions.get_ref(),
        repeats,
        both_directions: file.both_directions,
        slopes: file
            .slopes
            .as_ref()
            .map_or(SLOPES_EXPECTED, |s| s.get_ref().0),
        forms: file.forms.as_ref().map_or(FORMS, |f| f.get_ref().0),
        thickness: match &file.thickness {
            Some(d) => above(d, "thickness", LARGEST, "mm")?,
            None => 0.0,
        },
        zero: match file.zero {
            Zeros::Reset => Zero::Reset,
            Zeros::Kept => Zero::Kept,
        },
        costs: Costs {
            trace: seconds(&file.seconds_a_trace, "seconds_a_trace", COSTS.trace)?,
            turn: seconds(&file.seconds_a_turn, "seconds_a_turn", COSTS.turn)?,
            indicator: seconds(
                &file.seconds_an_indicator,
                "seconds_an_indicator",
                COSTS.indicator,
            )?,
            indicators,
        },
        wanted: wanted(setup, file)?,
        seed,
    })
}

fn wanted(setup: &SetupFile, file: &File) -> Result<Vec<String>, Message> {
    let Some(given) = &file.wanted else {
        return Ok(WANTED.map(str::to_owned).to_vec());
    };
    let known: Vec<&str> = SLOPES.iter().chain(&FORMS_WANTED).copied().collect();
    for name in given.get_ref() {
        if !known.contains(&&name[..]) {
            let remedy = match nearest(name, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`? Known are {}", list(&known)),
                None => format!("known are {}", list(&known)),
            };
            return Err(setup.bad(given.span(), format!("`{name}` is no quantity"), remedy));
        }
    }
    Ok(given.get_ref().clone())
}

/// The designs with their names.
pub(super) fn designs(setup: &SetupFile, file: &File) -> Result<Vec<(String, Design)>, Message> {
    let mut designs = Vec::new();
    if !file.channels.is_empty() {
        let design = Design::new(channels(setup, &file.channels)?).map_err(|why| {
            Message::bad_input(why.to_string())
                .in_file(setup.path())
                .remedy("give each channel its own name and angles")
        })?;
        designs.push(("[channels]".to_owned(), design));
    }
    let Some(given) = &file.design else {
        return Ok(designs);
    };
    let entries: Vec<(Option<&str>, &str)> = match given.get_ref() {
        Given::One(channels) => vec![(None, channels)],
        Given::Several(several) => several
            .iter()
            .map(|e| (e.name.as_deref(), &e.channels[..]))
            .collect(),
    };
    for (name, channels) in entries {
        let design = Design::parse(channels).map_err(|why| {
            let remedy = "list indicator/spindle in degrees, such as \"0/0,180/0,0/180,180/180\"";
            setup.bad(given.span(), why.to_string(), remedy)
        })?;
        designs.push((name.unwrap_or(channels).to_owned(), design));
    }
    if designs.is_empty() || designs.len() > MOST_DESIGNS {
        let what = format!("{} designs cannot be compared", designs.len());
        let remedy = format!("give one to {MOST_DESIGNS}");
        return Err(setup.bad(given.span(), what, remedy));
    }
    Ok(designs)
}
