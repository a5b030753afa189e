//! The answer in words.

use std::fmt::Write;

use errsep_models::diagonal::{ComponentEstimate, Determined, SequenceChoice};
use errsep_models::uncertainty::Expanded;

use super::Found;
use crate::cli::quantity::{COVERAGE, coverage_words, measured_words, unexpandable};
use crate::io::{Message, units::urad_from_rad};
use crate::report::number;

pub(super) fn in_words(name: &str, found: &Found) -> Result<String, Message> {
    let fit = &found.fit;
    let [x, y, z] = found.zone.travel;
    let mut text = format!(
        "Diagonal tests {name}\n  {} readings in a work zone of {x} × {y} × {z} mm, {} steps\n  {} of {} unknowns determined",
        found.readings.len(),
        found.zone.steps,
        fit.rank,
        fit.parameters
    );
    let _ = match fit.noise {
        Some(noise) => writeln!(
            text,
            ", noise of a reading {} µm ({} degrees of freedom)",
            number::plain(noise, 3),
            fit.degrees_of_freedom
        ),
        None => writeln!(text, ", noise of a reading not known"),
    };
    for remark in &found.remarks {
        let _ = writeln!(text, "  {remark}");
    }
    let angles = fit.angles().map_err(unexpandable)?;
    let _ = writeln!(text, "\nWhat the readings determine");
    for c in &fit.components {
        let words = c.component.words();
        let _ = writeln!(text, "  {} {words:28} {}", c.component.name(), span(c)?);
    }
    for l in &fit.squareness {
        let name = l.location.name();
        let value = match (angles.iter().find(|a| a.label == name), l.value) {
            (Some(angle), _) => measured_words(angle)?,
            (None, Some(s)) => {
                let s = urad_from_rad(l.location.iso_sign() * s);
                format!("{} µrad", number::measured(s, None))
            }
            (None, None) => l.determined.words().to_owned(),
        };
        let _ = writeln!(text, "  {name} {:28} {value}", l.location.words());
    }
    if let Some(degrees) = fit.noise_degrees_of_freedom {
        let _ = writeln!(text, "  U: {}", coverage_words(degrees)?);
    }
    if !fit.reversals.is_empty() {
        let _ = writeln!(
            text,
            "\nReversal, arrived in the positive sense of the axis less in the negative"
        );
        for c in &fit.reversals {
            let words = c.component.words();
            let _ = writeln!(text, "  {} {words:28} {}", c.component.name(), span(c)?);
        }
        for (diagonal, value) in &found.totals.reversals {
            let _ = writeln!(
                text,
                "  diagonal {}, forward less backward     {} µm",
                diagonal.name(),
                number::plain(*value, 3)
            );
        }
    }
    if !fit.ambiguities.is_empty() {
        let _ = writeln!(text, "\nWhat cannot be told apart");
        for a in &fit.ambiguities {
            let _ = writeln!(text, "  {}.", a.statement);
        }
    }
    if !fit.remedies.is_empty() {
        let _ = writeln!(text, "\nWhat one further measurement would settle");
        for r in &fit.remedies {
            let _ = writeln!(text, "  {}: {}", r.measure, r.settles.join(", "));
        }
    }
    for choice in &found.choices {
        let _ = writeln!(text, "\n{}", choice_words(choice));
    }
    Ok(text)
}

fn choice_words(choice: &SequenceChoice) -> String {
    let sequences: Vec<&str> = choice.sequences.iter().map(|s| s.name()).collect();
    let angular: Vec<String> = choice.angular.iter().map(|c| c.name()).collect();
    format!(
        "Sequences {} determine the angular errors {}",
        sequences.join(", "),
        if angular.is_empty() {
            "none".to_owned()
        } else {
            angular.join(", ")
        }
    )
}

/// Peak to valley of what is determined, and its greatest expanded uncertainty.
fn span(c: &ComponentEstimate) -> Result<String, Message> {
    let (low, high) = c
        .values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if low > high {
        return Ok(c.determined.words().to_owned());
    }
    let (factor, unit) = if c.component.rotation {
        (urad_from_rad(1.0), "µrad")
    } else {
        (1.0, "µm")
    };
    let note = match c.determined {
        Determined::Wholly => String::new(),
        other => format!(" ({})", other.words()),
    };
    let span = number::plain(factor * (high - low), 3);
    let mut greatest: Option<Expanded> = None;
    for quantity in c.quantities().map_err(unexpandable)? {
        let expanded = quantity.expanded(COVERAGE).map_err(unexpandable)?;
        if greatest.is_none_or(|g| expanded.expanded_uncertainty > g.expanded_uncertainty) {
            greatest = Some(expanded);
        }
    }
    Ok(match greatest {
        None => format!("spans {span} {unit}{note}"),
        Some(expanded) => format!(
            "spans {span} {unit}, U up to {} {unit} (k = {}){note}",
            number::uncertainty(factor * expanded.expanded_uncertainty),
            number::plain(expanded.coverage_factor, 3),
        ),
    })
}
