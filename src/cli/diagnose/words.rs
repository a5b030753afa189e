//! A diagnosis in words.

use std::fmt::Write;

use crate::diagnosis::{Bias, Diagnosis, Harm, Hidden, Told, Trials, for_people, scaled};
use crate::report::number::{plain, probability};

/// What "at least" means beside the size of an effect.
const AT_LEAST: &str = "  At least: what differs from repeat to repeat is taken for noise in part, and may have to be several times as great.";

/// µrad for people; other units as they are.
pub(super) fn shown(value: f64, unit: &str) -> (f64, &str) {
    let (scale, unit) = scaled(unit);
    (scale * value, unit)
}

/// What an unseen effect does to a quantity, per unit of its size.
pub(super) fn harm_in_words(harm: &Harm, hidden: &Hidden) -> String {
    let (value, unit) = shown(harm.per_unit, &harm.unit);
    let (scale, per) = scaled(&hidden.unit);
    let per = if per.is_empty() {
        "unit of its size"
    } else {
        per
    };
    let value = plain(value / scale, 3);
    format!("{value} {unit} in {} per {per}", harm.quantity)
}

pub fn in_words(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let taken_out = !diagnosis.verdict.taken_out().is_empty();
    let mut text = format!("{}\n\n", diagnosis.verdict.statement);
    let after = if taken_out {
        format!(" -> {}", gap.after.figures())
    } else {
        String::new()
    };
    let _ = writeln!(
        text,
        "Gap, {} RMS           {}{after}   noise of {} {}",
        for_people(gap.unit),
        gap.before.figures(),
        gap.of_what(),
        gap.noise_figure()
    );
    if let Some(held) = gap.held_out.filter(|_| taken_out) {
        let _ = writeln!(
            text,
            "On held-out repeats   {} -> {}   (a perfect model: {})",
            number(held.before),
            number(held.after),
            number(held.floor)
        );
    }
    for severity in &diagnosis.verdict.severity {
        let _ = writeln!(text, "{}", severity.in_words());
    }
    if !diagnosis.places.is_empty() {
        let _ = writeln!(
            text,
            "\nWhere                                              share   p"
        );
    }
    for place in &diagnosis.places {
        let range = place
            .range()
            .map_or(String::new(), |range| format!(" {range}"));
        let _ = writeln!(
            text,
            "  {:<48} {:>5.1} %  {}",
            format!("{} {}{range}", place.axis, place.value),
            100.0 * place.share,
            probability(place.p_value)
        );
    }
    let _ = writeln!(
        text,
        "\nEffect                     explains          p   visible  parameters"
    );
    for candidate in &diagnosis.candidates {
        let parameters: Vec<String> = candidate
            .parameters
            .iter()
            .map(|p| p.told().in_words())
            .collect();
        let mark = if candidate.in_set { "*" } else { " " };
        let shown = if candidate.p_value < 0.05 {
            parameters.join(", ")
        } else {
            String::new()
        };
        let _ = writeln!(
            text,
            "{mark} {:<24} {:>6.1} %   {:>8}  {:>5.1} %  {shown}",
            candidate.effect,
            100.0 * candidate.explained,
            probability(candidate.p_value),
            100.0 * candidate.visible
        );
    }
    if taken_out {
        let _ = writeln!(text, "\nBias of the answer        without        with");
        for bias in &diagnosis.bias {
            let (before, unit) = shown(bias.before, &bias.unit);
            let (after, _) = shown(bias.after, &bias.unit);
            let _ = writeln!(
                text,
                "  {:<12} {:>14} {:>14} {unit}   {}",
                bias.quantity,
                number(before),
                number(after),
                moved(bias).in_words()
            );
        }
    }
    let _ = writeln!(text, "\nWhat could still hide");
    for hidden in &diagnosis.hidden {
        let detectable = hidden.detectable.map_or_else(
            || {
                if hidden.implausible() {
                    "would show only at sizes that are not plausible".to_owned()
                } else {
                    "would not show whatever its size".to_owned()
                }
            },
            |d| {
                let least = if hidden.at_least { "at least " } else { "" };
                let shapes = by_shape(hidden).map_or(String::new(), |range| format!(", {range}"));
                format!("would show from {least}{}{shapes}", size(d, &hidden.unit))
            },
        );
        let _ = writeln!(
            text,
            "  {:<24} {detectable} ({:.1} % visible)",
            hidden.effect,
            100.0 * hidden.visible
        );
    }
    if diagnosis.hidden.iter().any(|hidden| hidden.at_least) {
        let _ = writeln!(text, "{AT_LEAST}");
    }
    for note in &diagnosis.notes {
        let _ = writeln!(text, "\nNote: {note}");
    }
    text
}

/// How far the size that shows is another for other shapes of an effect, in words.
pub(super) fn by_shape(hidden: &Hidden) -> Option<String> {
    let shapes = hidden.by_shape.as_ref()?;
    let others = shapes.to.map_or("at no plausible size".to_owned(), |to| {
        format!("from {}", size(to, &hidden.unit))
    });
    Some(format!(
        "in some shapes from {} and in others {others}",
        size(shapes.from, &hidden.unit)
    ))
}

/// A size with its unit, where it has one.
fn size(value: f64, unit: &str) -> String {
    let (value, unit) = shown(value, unit);
    format!("{} {unit}", number(value)).trim_end().to_owned()
}

/// Of the standard uncertainty of a quantity: by less it has not moved but for rounding.
const NOT_MOVED: f64 = 1e-6;

/// How far a quantity moves, as it is shown.
pub(super) fn moved(bias: &Bias) -> Told {
    let told = |value: f64| {
        let counts = value.abs() > NOT_MOVED * bias.std;
        shown(if counts { value } else { 0.0 }, &bias.unit)
    };
    let (value, unit) = told(bias.moved);
    Told {
        name: "moved".to_owned(),
        value,
        std: told(bias.moved_std).0,
        unit: unit.to_owned(),
    }
}

/// Four digits.
pub(super) fn number(value: f64) -> String {
    plain(value, 4)
}

pub(super) fn proof_in_words(trials: &Trials) -> String {
    let all: usize = trials.counts.iter().flatten().sum();
    let mut text = format!(
        "\nPut into these readings and diagnosed blind: {all} times, {} right, {} named wrong\n",
        trials.right, trials.wrong
    );
    for (truth, row) in trials.truths.iter().zip(&trials.counts) {
        let said: Vec<String> = trials
            .answers
            .iter()
            .zip(row)
            .filter(|(_, count)| **count > 0)
            .map(|(answer, count)| format!("{answer} {count}"))
            .collect();
        let _ = writeln!(text, "  {truth:<24} {}", said.join(", "));
    }
    text
}
