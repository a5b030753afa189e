//! A planned reversal as its set-up has it.

use errsep_models::reversal::Convention;
use serde::Deserialize;
use toml::Spanned;

use crate::io::{Message, Numbers, SetupFile};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    noise: Spanned<f64>,
    travel: Spanned<f64>,
    positions: Spanned<usize>,
    repeats: Option<Spanned<u32>>,
    #[serde(default)]
    both_directions: bool,
    tilts: Option<Spanned<Numbers<3>>>,
    forms: Option<Spanned<Numbers<2>>>,
    #[serde(default)]
    convention: Convention,
}

#[derive(Debug, Clone)]
pub(super) struct Planned {
    pub noise: f64,
    pub travel: f64,
    pub positions: usize,
    pub repeats: u32,
    pub both_directions: bool,
    pub tilts: [f64; 3],
    pub forms: [f64; 2],
    pub convention: Convention,
}

/// What is expected where the set-up does not say it: tilts, urad, and forms, um.
const TILTS: [f64; 3] = [50.0, 0.0, 20.0];
pub(super) const FORMS: [f64; 2] = [1.0, 1.0];

/// Greater expectations are slips of the unit: travel, mm, noise and forms, um, tilts, urad.
pub(super) const LONGEST_TRAVEL: f64 = 1e6;
pub(super) const LARGEST: f64 = 1e6;

impl Planned {
    pub(super) fn read(setup: &SetupFile) -> Result<Self, Message> {
        let file: File = setup.parse()?;
        let within = |value: &Spanned<f64>, name: &str, most: f64, unit: &str| {
            if *value.get_ref() > 0.0 && *value.get_ref() <= most {
                return Ok(*value.get_ref());
            }
            let what = format!("{name} = {} {unit} cannot be planned", value.get_ref());
            let remedy = format!("give {name} in {unit}, greater than zero and at most {most}");
            Err(setup.bad(value.span(), what, remedy))
        };
        let noise = within(&file.noise, "noise", LARGEST, "um")?;
        let travel = within(&file.travel, "travel", LONGEST_TRAVEL, "mm")?;
        let (positions, at_positions) = (*file.positions.get_ref(), file.positions.span());
        let repeats = file.repeats.as_ref().map_or(1, |r| *r.get_ref());
        if let Some(given) = &file.repeats
            && repeats == 0
        {
            return Err(setup.bad(given.span(), "no repeat gives no reading", "give 1 or more"));
        }
        let directions = if file.both_directions { 2 } else { 1 };
        let readings = positions
            .saturating_mul(4 * directions)
            .saturating_mul(repeats as usize);
        if positions < 5 || readings > MOST_READINGS {
            return Err(setup.bad(
                at_positions,
                format!("{positions} positions make a plan of {readings} readings"),
                format!("give 5 or more positions, and {MOST_READINGS} readings at most"),
            ));
        }
        let limits = |least: f64| least..=LARGEST;
        let (tilts, forms) = (file.tilts, file.forms);
        if let Some(tilts) = &tilts
            && !tilts
                .get_ref()
                .0
                .iter()
                .all(|t| limits(-LARGEST).contains(t))
        {
            return Err(setup.bad(
                tilts.span(),
                "the expected tilts cannot be",
                "give alpha, beta, gamma in urad, finite and below 1e6",
            ));
        }
        if let Some(forms) = &forms
            && !forms.get_ref().0.iter().all(|f| limits(0.0).contains(f))
        {
            return Err(setup.bad(
                forms.span(),
                "the expected forms cannot be",
                "give root mean squares of slide and artefact in um, zero or greater and below 1e6",
            ));
        }
        Ok(Self {
            noise,
            travel,
            positions,
            repeats,
            both_directions: file.both_directions,
            tilts: tilts.map_or(TILTS, |t| t.into_inner().0),
            forms: forms.map_or(FORMS, |f| f.into_inner().0),
            convention: file.convention,
        })
    }
}

/// Most readings of a plan.
pub(super) const MOST_READINGS: usize = 20_000;
