//! The answer on the terminal.

use std::fmt::Write;
use std::path::Path;

use errsep_models::reversal::designs::{DesignFit, Found, angle_name};
use errsep_models::reversal::simultaneous::NoiseOrigin;
use errsep_models::reversal::staged::Value;

use super::Outcome;
use crate::cli::quantity::coverage_words;
use crate::io::Message;
use crate::io::units::{arcsec_from_rad, um_from_mm, urad_from_rad};
use crate::report::number;

/// What a slope means.
pub fn meaning(name: &str) -> &'static str {
    match name {
        "alpha_h" => "slide against spindle axis, horizontal: + runs away from the near side",
        "alpha_v" => "slide against spindle axis, vertical: + runs away from the top",
        "gamma_1" => "artefact against spindle axis, along side 0",
        "gamma_2" => "artefact against spindle axis, along side 90",
        "cone" => "half the cone angle of the artefact",
        "kappa_c" => "oval cone: sides 0 and 180 against 90 and 270",
        "kappa_s" => "oval cone: sides 45 and 225 against 135 and 315",
        _ => "determined together only",
    }
}

/// One or two sentences: does the slide run parallel to the spindle?
pub fn summary(o: &Outcome) -> String {
    let readings = &o.data.observations.readings;
    if o.fit.noise_origin != NoiseOrigin::Declared
        && readings.windows(2).all(|r| r[0].value == r[1].value)
    {
        return "All readings are equal, which tells neither tilt nor form: the resolution of the indicators is \
                too coarse, or the column is not the reading."
            .to_owned();
    }
    let planes = [
        ("alpha_h", "horizontally", "near", "far"),
        ("alpha_v", "vertically", "top", "bottom"),
    ];
    let length = o.x.last().unwrap_or(&0.0) - o.x.first().unwrap_or(&0.0);
    let told: Vec<String> = planes
        .into_iter()
        .filter_map(|(name, plane, minus, plus)| {
            let alpha = o.fit.slope(name)?;
            let is_parallel = alpha.value.abs() < 2.0 * alpha.std;
            let shown = if is_parallel { alpha.value } else { alpha.value.abs() };
            let over = um_from_mm(1.0) * length;
            let size = format!(
                "{} µrad, {} µm over {} mm",
                urad(Value { value: shown, ..alpha }),
                number::measured(over * shown, Some(over * alpha.std)),
                number::plain(length, 5)
            );
            Some(if is_parallel {
                format!("{plane} the slide is parallel to the spindle axis within the uncertainty ({size})")
            } else {
                let side = if alpha.value < 0.0 { minus } else { plus };
                format!("{plane} the slide runs towards the {side} side of the spindle axis as x grows ({size})")
            })
        })
        .collect();
    if told.is_empty() {
        return "These channels do not determine the tilt between slide and spindle by itself."
            .to_owned();
    }
    let text = told.join("; ");
    text[..1].to_uppercase() + &text[1..] + "."
}

fn urad(v: Value) -> String {
    number::measured(urad_from_rad(v.value), Some(urad_from_rad(v.std)))
}

/// The whole answer.
///
/// # Errors
/// Degrees of freedom without a coverage factor.
pub fn text(file: &Path, o: &Outcome) -> Result<String, Message> {
    let coverage = coverage_words(o.freedom())?;
    let mut t = String::new();
    Ok(write_all(&mut t, file, o, &coverage).map_or_else(|_| summary(o), |()| t))
}

fn write_all(t: &mut String, file: &Path, o: &Outcome, coverage: &str) -> std::fmt::Result {
    let (fit, design) = (&o.fit, &o.fit.design);
    let list = |angles: &[f64]| {
        let all: Vec<String> = angles
            .iter()
            .map(|a| format!("{}°", angle_name(*a)))
            .collect();
        all.join(", ")
    };
    writeln!(
        t,
        "{}: {} readings in {} channels ({}); indicators at {}; spindle at {}; sides {}",
        file.display(),
        o.data.observations.readings.len(),
        design.channels().len(),
        o.data.in_words(),
        list(&design.indicators()),
        list(&design.positions()),
        list(design.sides())
    )?;
    writeln!(t, "\n{}\n", summary(o))?;
    writeln!(t, "Slopes (value ± standard uncertainty; U: {coverage})")?;
    for slope in fit.slopes() {
        write_slope(t, &slope, o.factor())?;
    }
    let constants = fit.constants();
    let own = |c: &&Found| ["e_1", "e_2", "o"].contains(&&c.name[..]);
    for c in constants.iter().filter(own) {
        let value = number::measured(c.value.value, Some(c.value.std));
        writeln!(
            t,
            "  {:22} {value} µm  eccentricity of the artefact, with what lobes of its section make of it at these sides (o: its oval part)",
            c.name
        )?;
    }
    let open = o.open();
    if !open.is_empty() {
        writeln!(t, "\nNot determined by these channels")?;
        for (combination, remedy) in open {
            writeln!(t, "  {combination}: {remedy}")?;
        }
    }
    writeln!(
        t,
        "\nForms without straight-line part, µm (u: typical standard uncertainty of a point)"
    )?;
    for form in &o.forms {
        let (low, high) = form
            .values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(*v), h.max(*v))
            });
        let u = form.std.get(form.std.len() / 2).copied().unwrap_or(0.0);
        writeln!(
            t,
            "  {:22} {} from lowest to highest, u {}",
            form.name,
            number::plain(high - low, 3),
            number::uncertainty(u)
        )?;
    }
    if !fit.closures.is_empty() {
        writeln!(
            t,
            "\nClosures, zero whatever the forms are (µm rms; noise alone would give)"
        )?;
    }
    for closure in &fit.closures {
        writeln!(
            t,
            "  {:40} {} ({})",
            closure.name,
            number::plain(closure.rms, 3),
            number::plain(closure.expected_rms, 3)
        )?;
    }
    for slope in &fit.position_slopes {
        writeln!(
            t,
            "  {:40} {} µrad  slope of that spindle position against the others, zero for rigid parts",
            slope.name,
            urad(slope.value)
        )?;
    }
    writeln!(
        t,
        "\nNoise of one reading: {} µm ({})",
        number::plain(fit.noise_um, 3),
        o.noise_words()
    )?;
    for (channel, own) in design.channels().iter().zip(&fit.by_channel) {
        writeln!(
            t,
            "  {:10} {} µm, residuals {} µm rms",
            channel.name,
            number::plain(own.sigma, 3),
            number::plain(own.rms, 3)
        )?;
    }
    writeln!(
        t,
        "\nMethod: simultaneous; {} ({})",
        fit.convergence.ending,
        cells(fit)
    )?;
    for warning in &o.warnings {
        writeln!(t, "Note: {warning}.")?;
    }
    Ok(())
}

/// The cells of the forms in words.
pub fn cells(fit: &DesignFit) -> String {
    let cells = fit.cells();
    match cells.first() {
        Some((_, first)) if cells.iter().all(|c| c.1 == *first) => {
            format!("{} a form", number::counted(*first, "cell"))
        }
        _ => {
            let own: Vec<String> = cells
                .iter()
                .map(|(name, k)| format!("{name} {k}"))
                .collect();
            format!("cells of the forms: {}", own.join(", "))
        }
    }
}

fn write_slope(t: &mut String, slope: &Found, factor: f64) -> std::fmt::Result {
    writeln!(
        t,
        "  {:22} {} µrad ({}″), U = {} µrad  {}",
        slope.name,
        urad(slope.value),
        number::plain(arcsec_from_rad(slope.value.value), 4),
        number::uncertainty(urad_from_rad(factor * slope.value.std)),
        meaning(&slope.name)
    )
}
