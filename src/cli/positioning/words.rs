//! The answer in words: figures, what their uncertainties hold, drift, warnings.

use std::fmt::Write;

use errsep_models::positioning::{Drift, Figure, NoUncertainty, Positioning};
use errsep_models::uncertainty::{DegreesOfFreedom, Quantity};

use super::Found;
use crate::cli::quantity::{measured_words, unexpandable};
use crate::io::Message;
use crate::io::positioning::{AxisKind, PositioningSetup};
use crate::io::units::{SECONDS_PER_HOUR, symbol};
use crate::report::number;

/// Runs that ISO 230-2 asks for.
const RUNS: usize = 5;
/// Longest travel for which it asks for them, mm and degrees.
const LONG: f64 = 2000.0;
const TURN: f64 = 360.0;

/// The answer for people.
pub(super) fn in_words(data: &str, found: &Found, drift: Option<&str>) -> String {
    let (setup, result) = (&found.setup, &found.result);
    let deviations = &result.deviations;
    let unit = symbol(setup.kind.deviation_unit());
    let at = symbol(setup.kind.position_unit());
    let axis = setup.name.as_deref().map(|name| format!(" of {name}"));
    let directions: Vec<&str> = deviations.directions().map(|(d, _)| d.name()).collect();
    let ends = [deviations.targets.first(), deviations.targets.last()];
    let [first, last] = ends.map(|t| place(t.copied().unwrap_or_default()));
    let mut text = format!(
        "Positioning{} ({data}): {} targets from {first} to {last} {at}, {} {}, {}{}\n",
        axis.unwrap_or_default(),
        deviations.targets.len(),
        deviations.runs,
        if deviations.runs == 1 { "run" } else { "runs" },
        directions.join(" and "),
        match deviations.missing.len() {
            0 => String::new(),
            1 => ", one reading missing".to_owned(),
            n => format!(", {n} readings missing"),
        },
    );
    for (standard, figures) in [("ISO 230-2", &Figure::ISO[..]), ("VDI 3441", &Figure::VDI)] {
        let told: Vec<String> = figures
            .iter()
            .filter_map(|f| figure(result, *f, unit))
            .collect();
        if !told.is_empty() {
            let _ = writeln!(text, "\n{standard}");
            text.extend(told);
        }
    }
    let _ = writeln!(text, "\n{}", contents(found));
    for sentence in withheld(result) {
        let _ = writeln!(text, "{sentence}");
    }
    if let Some(drift) = drift {
        let _ = writeln!(text, "{drift}");
    }
    if let Some((low, high)) = found.data.temperature {
        let _ = writeln!(
            text,
            "Temperature from {} to {} °C; the deviations are not corrected for it.",
            number::plain(low, 4),
            number::plain(high, 4)
        );
    }
    for warning in &found.warnings {
        let _ = writeln!(text, "Note: {warning}");
    }
    text
}

/// A position as short as it is, to 0.1 µm.
fn place(position: f64) -> String {
    let text = number::fixed(position, 4);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn figure(result: &Positioning, figure: Figure, unit: &str) -> Option<String> {
    let value = result.value(figure)?;
    let (sign, meaning) = figure.in_words();
    let expanded = match result.uncertainty(figure) {
        Some(Ok(expanded)) => format!("U = {} {unit}", number::uncertainty(expanded)),
        _ => String::new(),
    };
    // A letter with a bar above it is two characters of one width.
    let wide = 3 + sign.chars().filter(|c| *c == '\u{304}').count();
    Some(format!(
        "  {sign:wide$} {:>9} {unit}  {expanded:14}  {meaning}\n",
        number::fixed(value, 3)
    ))
}

/// What the uncertainties hold.
pub(super) fn contents(found: &Found) -> String {
    let influences = found.setup.influences;
    let unit = symbol(found.setup.kind.deviation_unit());
    let given: Vec<String> = [
        ("device", influences.device),
        ("misalignment", influences.misalignment),
        ("expansion", influences.expansion),
        ("drift", influences.drift),
    ]
    .into_iter()
    .filter(|(_, u)| *u > 0.0)
    .map(|(name, u)| format!("{name} {} {unit}", number::plain(u, 3)))
    .collect();
    let sampled = "U (95 %) takes readings as independent and holds what so few of them leave open of means and \
                   standard deviations (rather too much where several targets are nearly extreme)";
    if given.is_empty() {
        format!(
            "{sampled}; nothing of device, misalignment, expansion and drift, which are not stated."
        )
    } else {
        format!("{sampled}, and {} (k = 2).", given.join(", "))
    }
}

/// Which figures have no uncertainty, and why.
pub(super) fn withheld(result: &Positioning) -> Vec<String> {
    let mut reasons: Vec<(NoUncertainty, Vec<&str>)> = Vec::new();
    for (figure, expanded) in &result.uncertainties {
        if let Err(why) = expanded {
            let name = figure.in_words().0;
            match reasons.iter_mut().find(|(w, _)| w == why) {
                Some((_, names)) => names.push(name),
                None => reasons.push((*why, vec![name])),
            }
        }
    }
    reasons
        .into_iter()
        .map(|(why, names)| format!("No uncertainty of {}: {why}.", names.join(", ")))
        .collect()
}

/// The drift and its rate in an hour.
///
/// # Errors
/// A rate that is no number.
pub(super) fn rate(found: &Found) -> Result<Option<(Drift, Quantity)>, Message> {
    let Some(drift) = found.result.drift else {
        return Ok(None);
    };
    let unit = format!("{}/h", found.setup.kind.deviation_unit());
    let quantity = Quantity::new(
        "drift",
        drift.rate * SECONDS_PER_HOUR,
        drift.std * SECONDS_PER_HOUR,
        unit,
    );
    let freedom = DegreesOfFreedom::new(drift.degrees_of_freedom as f64).map_err(unexpandable)?;
    let quantity = quantity
        .map_err(unexpandable)?
        .with_degrees_of_freedom(freedom);
    Ok(Some((drift, quantity)))
}

/// The drift as a sentence.
///
/// # Errors
/// A rate whose uncertainty cannot be expanded.
pub(super) fn drift(found: &Found) -> Result<Option<String>, Message> {
    let Some((drift, rate)) = rate(found)? else {
        return Ok(None);
    };
    let shown = if drift.shows() {
        let unit = symbol(found.setup.kind.deviation_unit());
        let change = number::plain(drift.rate * drift.duration, 2);
        format!(
            "over the test {change} {unit}, which the standard deviations hold: let the machine warm up and measure again"
        )
    } else if drift.may || found.result.scatter.is_some_and(|s| s.runs_differ()) {
        "none that shows beside the heights of the runs, which differ as if each had been zeroed anew".to_owned()
    } else {
        "none that shows".to_owned()
    };
    Ok(Some(format!(
        "Drift common to all targets: {}: {shown}.",
        measured_words(&rate)?
    )))
}

/// What the reader has to weigh.
pub(super) fn warnings(setup: &PositioningSetup, result: &Positioning) -> Vec<String> {
    let deviations = &result.deviations;
    let at = symbol(setup.kind.position_unit());
    let length = deviations.length();
    let travel = setup.travel.map_or(length, |(from, to)| to - from);
    let (limit, long) = match setup.kind {
        AxisKind::Linear => (LONG, "2000 mm"),
        AxisKind::Rotary => (TURN, "360°"),
    };
    let is_long = length.max(travel) > limit;
    let runs = deviations.runs;
    let mut warnings = Vec::new();
    if runs == 1 && is_long {
        warnings.push(format!(
            "one run, as ISO 230-2 asks for axes over {long}: there is no R and no A."
        ));
    } else if runs == 1 {
        warnings.push(
            "one run: there is no R and no A. ISO 230-2 asks for five runs in each direction."
                .to_owned(),
        );
    } else if runs < RUNS {
        warnings.push(format!(
            "{runs} runs: ISO 230-2 asks for five; R and A rest on few readings."
        ));
    } else if is_long {
        warnings.push(format!(
            "over {long} ISO 230-2 asks for one run and gives no R and no A; those here go beyond it."
        ));
    }
    warnings.extend(missing(result, at));
    if !deviations.is_bidirectional() {
        warnings.push(
            "one direction of approach: nothing is told of the reversal, nor of both directions together."
                .to_owned(),
        );
    }
    if let Some(fewest) = fewest(setup.kind, length.max(travel), is_long)
        && deviations.targets.len() < fewest
    {
        warnings.push(format!(
            "{} targets: ISO 230-2 asks for {fewest} at least on this travel.",
            deviations.targets.len()
        ));
    }
    let ends = [deviations.targets.first(), deviations.targets.last()];
    if let (Some((from, to)), [Some(first), Some(last)]) = (setup.travel, ends) {
        if *first < from || *last > to {
            warnings.push(format!(
                "targets from {} to {} {at} lie outside the travel from {} to {} {at}: check the units.",
                place(*first),
                place(*last),
                place(from),
                place(to)
            ));
        } else if length < 0.8 * travel {
            warnings.push(format!(
                "the targets cover {} of the travel: the figures are of that part.",
                number::percent(length / travel)
            ));
        }
    }
    warnings
}

/// Readings that are missing, the first by name, and what is made of those that are there.
fn missing(result: &Positioning, at: &str) -> Option<String> {
    /// As many are named.
    const NAMED: usize = 3;
    let missing = &result.deviations.missing;
    let named: Vec<String> = missing
        .iter()
        .take(NAMED)
        .map(|m| {
            format!(
                "run {} at {} {at} {}",
                m.run,
                place(m.target),
                m.direction.name()
            )
        })
        .collect();
    let more = match missing.len().saturating_sub(NAMED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let are = match missing.len() {
        0 => return None,
        1 => "one reading is".to_owned(),
        n => format!("{n} readings are"),
    };
    let of = match result.freed_of_heights {
        true => {
            "means there are of the other runs, freed of the heights of all runs (which differ), standard deviations of the \
             readings that are there"
        }
        false => "means and standard deviations there are of the readings that are there",
    };
    Some(format!(
        "{are} missing ({}{more}): {of}, and the uncertainties know how many these are. ISO 230-2 takes as many runs at \
         every target: for a test by the standard measure them again.",
        named.join(", "),
    ))
}

/// Targets that ISO 230-2 asks for: five in each metre and five at least; of a rotary axis 3, 5 and 8
/// up to 90°, 180° and 360°. Beyond, it asks for spacings, not for a number.
fn fewest(kind: AxisKind, travel: f64, is_long: bool) -> Option<usize> {
    if is_long {
        return None;
    }
    Some(match kind {
        AxisKind::Linear => 5.max((travel * 5e-3).floor() as usize),
        AxisKind::Rotary if travel <= 90.0 => 3,
        AxisKind::Rotary if travel <= 180.0 => 5,
        AxisKind::Rotary => 8,
    })
}
