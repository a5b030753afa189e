//! The answer on the terminal.

use std::fmt::Write;
use std::path::Path;

use errsep_models::reversal::staged::Value;
use errsep_models::reversal::{Channel, NOT_SHOWN};
use errsep_models::uncertainty::coverage_factor;

use super::effects;
use super::outcome::Outcome;
use crate::cli::quantity::COVERAGE;
use crate::io::reversal::ReversalData;
use crate::io::units::{arcsec_from_rad, um_from_mm, urad_from_rad};
use crate::report::number;

/// One sentence that answers the question: is the slide parallel to the spindle, and how straight?
pub fn summary(o: &Outcome) -> String {
    if o.still {
        return "All readings are equal, which tells neither tilt nor form: the resolution of the indicators is \
                too coarse, or the column is not the reading."
            .to_owned();
    }
    let Some(alpha) = o.alpha() else {
        return "These channels do not determine the tilt between slide and spindle by itself."
            .to_owned();
    };
    let is_parallel = alpha.value.abs() < 2.0 * alpha.std;
    let shown = if is_parallel {
        alpha
    } else {
        Value {
            value: alpha.value.abs(),
            ..alpha
        }
    };
    // rad × mm = mm.
    let over_length = |rad: f64| um_from_mm(rad * o.length());
    let size = format!(
        "{} µrad, {} µm over {} mm",
        measured_urad(shown),
        number::measured(over_length(shown.value), Some(over_length(shown.std))),
        number::plain(o.length(), 5)
    );
    let mut text = if is_parallel {
        format!("The slide is parallel to the spindle axis within the uncertainty: {size}")
    } else {
        let side = if alpha.value < 0.0 { "near" } else { "far" };
        format!("As x grows the slide runs towards the {side} side of the spindle axis by {size}")
    };
    if o.open().is_some() {
        text += ", if the two sides of the artefact are parallel: these channels count half the angle \
                 between them, its cone, as alpha";
    }
    let lines = o.straightness();
    if let Some((_, lines)) = lines.iter().find(|(name, _)| *name == "M") {
        let zone = lines[2].1;
        let std = o.rms_std("M");
        text += &if zone > std {
            format!(
                "; the slide is straight to {} µm (minimum zone of points known to ± {} µm)",
                number::plain(zone, 3),
                number::uncertainty(std)
            )
        } else {
            format!(
                "; how straight the slide is cannot be said: its points are known to ± {} µm only, which hides the {} µm found (minimum zone)",
                number::uncertainty(std),
                number::plain(zone, 3)
            )
        };
    }
    text + "."
}

fn measured_urad(v: Value) -> String {
    number::measured(urad_from_rad(v.value), Some(urad_from_rad(v.std)))
}

/// The whole answer.
pub fn text(file: &Path, data: &ReversalData, o: &Outcome) -> String {
    let mut t = String::new();
    write_all(&mut t, file, data, o).map_or_else(|_| summary(o), |()| t)
}

fn write_all(t: &mut String, file: &Path, data: &ReversalData, o: &Outcome) -> std::fmt::Result {
    let channels = data.observations.channels();
    writeln!(
        t,
        "{}: {} readings in {} ({})",
        file.display(),
        data.observations.readings.len(),
        names(&channels),
        data.in_words()
    )?;
    writeln!(t, "\n{}\n", summary(o))?;
    // Degrees of freedom are positive, so that they have a coverage factor.
    let k = coverage_factor(COVERAGE, o.noise_freedom).unwrap_or(f64::NAN);
    writeln!(
        t,
        "Tilts (value ± standard uncertainty; U expanded, {}, k = {}, {} degrees of freedom)",
        number::percent(COVERAGE),
        number::plain(k, 3),
        o.noise_freedom
    )?;
    for tilt in &o.tilts {
        writeln!(
            t,
            "  {:13} {} µrad ({}″), U = {} µrad  {}",
            tilt.name,
            measured_urad(tilt.angle),
            number::plain(arcsec_from_rad(tilt.angle.value), 4),
            number::uncertainty(urad_from_rad(k * tilt.angle.std)),
            o.meaning(tilt)
        )?;
    }
    let missing = data.missing();
    if !missing.is_empty() {
        writeln!(
            t,
            "  not read: {}; what stands alone above is determined, sums are determined only together",
            names(&missing)
        )?;
    }
    if let Some(open) = o.open() {
        writeln!(
            t,
            "\nNot determined by these channels\n  {}: {}",
            open.combination, open.remedy
        )?;
    }
    write_effects(t, o)?;
    if let Some(contrasts) = &o.contrasts {
        writeln!(t, "\nContrasts of the four slopes (1A 1B 2A 2B)")?;
        for (contrast, value) in contrasts {
            writeln!(
                t,
                "  {}  {:8} {} µrad  {}",
                contrast.pattern(),
                contrast.name(o.convention),
                measured_urad(*value),
                contrast.meaning(o.convention)
            )?;
        }
    }
    writeln!(
        t,
        "\nForms without straight-line part: straightness in µm (u: typical standard uncertainty of a point)"
    )?;
    for (name, lines) in o.straightness() {
        write!(t, "  {name:20}")?;
        for (reference, error) in lines {
            write!(t, " {} {}; ", reference.name(), number::plain(error, 3))?;
        }
        let std = o
            .forms
            .iter()
            .find(|f| f.name == name)
            .map_or(0.0, |f| middle(&f.std));
        writeln!(t, "u {}", number::uncertainty(std))?;
    }
    if let Some(closure) = &o.closure {
        writeln!(
            t,
            "\nClosure: profile {} µm rms (noise alone: {}), slope {}",
            number::plain(closure.rms, 3),
            number::plain(closure.expected_rms, 3),
            match closure.slope {
                Some(slope) => format!("{} µrad", measured_urad(slope)),
                None => "taken up by an effect in the fit".to_owned(),
            }
        )?;
    }
    writeln!(
        t,
        "Noise of one reading: {} µm ({})",
        number::plain(o.noise, 3),
        o.noise_words
    )?;
    for (channel, noise) in &o.channel_noise {
        writeln!(t, "  {} {} µm", channel.name(), number::plain(*noise, 3))?;
    }
    writeln!(t, "\nMethod: {}; {}", o.method, o.convergence.reason)?;
    if let Some(knots) = &o.knots {
        writeln!(t, "  knots: {}", knots.reason)?;
    }
    for (name, rms, meaning) in &o.method_errors {
        writeln!(
            t,
            "  estimated error of {name}: {} µm rms ({meaning})",
            number::plain(*rms, 2)
        )?;
    }
    for warning in &o.warnings {
        writeln!(t, "Note: {warning}.")?;
    }
    writeln!(t, "\nNot shown by any such measurement:")?;
    for (name, why) in NOT_SHOWN {
        writeln!(t, "  {name}: {why}")?;
    }
    Ok(())
}

fn write_effects(t: &mut String, o: &Outcome) -> std::fmt::Result {
    if o.effects.is_empty() {
        return Ok(());
    }
    writeln!(t, "\nEffects in the fit (value ± standard uncertainty)")?;
    for effect in &o.effects {
        writeln!(t, "  {}", effects::title(effect))?;
        for parameter in &effect.parameters {
            let words = effects::in_words(parameter);
            writeln!(t, "    {:16} {words}", parameter.name)?;
        }
    }
    Ok(())
}

fn names(channels: &[Channel]) -> String {
    channels
        .iter()
        .map(|c| c.name())
        .collect::<Vec<_>>()
        .join(", ")
}

fn middle(values: &[f64]) -> f64 {
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
