//! Where the styluses stand beside the crest of a bar, in a set-up.

use std::collections::BTreeMap;

use errsep_models::reversal::designs::{Crest, Design, SAME_ANGLE_DEG, angle_name};
use serde::Deserialize;
use toml::Spanned;

use crate::io::{Message, SetupFile};

/// The radius of the stylus and how far the bar stands beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct StylusBeside {
    /// Radius of the stylus, mm.
    pub tip_radius: f64,
    /// How far the axis of the bar stands beside the stylus at the middle of the travel, mm, positive towards
    /// growing angles of the indicator: of all indicators, or of each by its angle in degrees.
    pub off_crest: Vec<(Option<f64>, f64)>,
}

/// One figure for all indicators, or one for each by its angle.
#[derive(Debug, Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "a number in mm is wanted, or one for each indicator by its angle, such as { 0 = 0.5, 180 = -0.2 }"
)]
pub enum Offsets {
    /// Of all indicators.
    All(f64),
    /// By the angle of the indicator.
    Each(BTreeMap<String, f64>),
}

/// A larger stylus is a slip of the unit, mm.
const LARGEST_TIP: f64 = 1e4;

/// Reads what a set-up says of the styluses; `thickness` as it says it, mm.
///
/// # Errors
/// One of the figures without the others, or one that cannot be.
pub fn read(
    setup: &SetupFile,
    tip_radius: Option<&Spanned<f64>>,
    off_crest: Option<&Spanned<Offsets>>,
    thickness: Option<f64>,
) -> Result<Option<StylusBeside>, Message> {
    let (tip, offsets) = match (tip_radius, off_crest) {
        (None, None) => return Ok(None),
        (Some(tip), Some(offsets)) => (tip, offsets),
        (Some(tip), None) => {
            return Err(setup.bad(
                tip.span(),
                "tip_radius says nothing by itself",
                "give off_crest too, how far the bar stands beside the stylus in mm, or leave both out",
            ));
        }
        (None, Some(offsets)) => {
            return Err(setup.bad(
                offsets.span(),
                "off_crest needs the radius of the stylus",
                "give tip_radius in mm beside it, such as tip_radius = 1.5",
            ));
        }
    };
    let tip_radius = *tip.as_ref();
    if !(0.0..=LARGEST_TIP).contains(&tip_radius) {
        return Err(setup.bad(
            tip.span(),
            format!("a stylus of {tip_radius} mm radius cannot be"),
            "give the radius of its tip in mm",
        ));
    }
    let Some(diameter) = thickness.filter(|d| *d > 0.0) else {
        return Err(setup.bad(
            offsets.span(),
            "off_crest needs the diameter of the bar",
            "give [artefact] thickness, the diameter of the bar in mm",
        ));
    };
    let off_crest = match offsets.as_ref() {
        Offsets::All(mm) => vec![(None, *mm)],
        Offsets::Each(each) => each
            .iter()
            .map(|(angle, mm)| match angle.trim().parse::<f64>() {
                Ok(degrees) if degrees.is_finite() => Ok((Some(degrees), *mm)),
                _ => Err(setup.bad(
                    offsets.span(),
                    format!("off_crest of `{angle}`: no angle of an indicator"),
                    "name each indicator by its angle in degrees, such as { 0 = 0.5, 180 = -0.2 }",
                )),
            })
            .collect::<Result<_, Message>>()?,
    };
    let radius = 0.5 * diameter + tip_radius;
    if let Some((_, mm)) = off_crest.iter().find(|o| !(o.1.abs() < radius)) {
        return Err(setup.bad(
            offsets.span(),
            format!("{mm} mm beside the crest, the stylus would not touch a bar of {diameter} mm"),
            "give the distance in mm: less than the radii of bar and stylus together",
        ));
    }
    Ok(Some(StylusBeside {
        tip_radius,
        off_crest,
    }))
}

impl StylusBeside {
    /// The crest as a fit of a design takes it.
    ///
    /// # Errors
    /// An indicator without a figure, or a figure for an indicator that is not there.
    pub fn of(&self, design: &Design) -> Result<Crest, Message> {
        let same =
            |a: f64, b: f64| ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs() <= SAME_ANGLE_DEG;
        let indicators = design.indicators();
        let names: Vec<String> = indicators.iter().map(|a| angle_name(*a)).collect();
        let stray = |angle: &f64| !indicators.iter().any(|a| same(*a, *angle));
        if let Some(angle) = self.off_crest.iter().filter_map(|o| o.0).find(stray) {
            return Err(Message::bad_input(format!(
                "off_crest of {angle}: no indicator stands there"
            ))
            .remedy(format!("the indicators are at {}", names.join(", "))));
        }
        let of = |indicator: f64| {
            let own = |o: &&(Option<f64>, f64)| o.0.is_none_or(|angle| same(angle, indicator));
            let found = self.off_crest.iter().find(own);
            found.map(|o| o.1).ok_or_else(|| {
                let angle = angle_name(indicator);
                Message::bad_input(format!(
                    "off_crest is not given for the indicator at {angle}"
                ))
                .remedy("give it for each indicator, 0 for one that stands on the crest")
            })
        };
        let channels = design.channels().iter();
        Ok(Crest {
            tip_mm: self.tip_radius,
            offset_mm: channels
                .map(|c| of(c.indicator))
                .collect::<Result<_, Message>>()?,
        })
    }

    /// The lines of a set-up that say it.
    pub fn as_toml(&self) -> String {
        let offsets = match &self.off_crest[..] {
            [(None, mm)] => format!("{mm:?}"),
            each => {
                let own = each
                    .iter()
                    .filter_map(|(angle, mm)| Some((angle.as_ref()?, mm)));
                let all: Vec<String> = own.map(|(a, mm)| format!("\"{a}\" = {mm:?}")).collect();
                format!("{{ {} }}", all.join(", "))
            }
        };
        format!(
            "tip_radius = {:?}      # mm\noff_crest = {offsets}      # mm, at the middle of the travel\n",
            self.tip_radius
        )
    }
}
