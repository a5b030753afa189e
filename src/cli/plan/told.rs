//! What a plan can show, in words, as a page and for programs.

use std::fmt::Write;

use serde_json::json;

use super::Args;
use crate::cli::Answer;
use crate::diagnosis::{Diagnosability, for_people};
use crate::io::Status;
use crate::report::number::plain;
use crate::report::plot::{Axis, Bar, Bars};
use crate::report::{Cell, Figure, Page, Section, Standing, Table};

/// Biases below this, rad, are rounding.
const NO_BIAS: f64 = 1e-12;

/// What the sign before a size means.
pub(super) const AT_LEAST: &str = "\u{2265}: what differs from repeat to repeat is taken for noise in part, and may have to be several times as great.";

const BY_SHAPE: &str = "The sizes above are of a typical shape:";

/// A size of an effect from which a plan shows it or tells it apart.
pub(super) fn effect_size(row: &Diagnosability, value: Option<f64>) -> String {
    let least = if row.at_least && value.is_some() {
        "\u{2265} "
    } else {
        ""
    };
    format!("{least}{}", size(value, &row.unit))
}

/// Effects of which other shapes show from another size on than the typical one.
fn by_shape(rows: &[Diagnosability]) -> Vec<String> {
    let in_words = |row: &Diagnosability| {
        let shapes = row.by_shape.as_ref()?;
        let from = size(Some(shapes.from), &row.unit);
        let others = shapes.to.map_or("at no plausible size".to_owned(), |to| {
            format!("from {}", size(Some(to), &row.unit))
        });
        Some(format!(
            "{}: in some shapes from {from}, in others {others}",
            row.effect
        ))
    };
    rows.iter().filter_map(in_words).collect()
}

pub(super) fn size(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(
        || "never".to_owned(),
        |v| {
            let (value, unit) = if unit == "rad" {
                (v * 1e6, "µrad")
            } else {
                (v, for_people(unit))
            };
            format!("{} {unit}", plain(value, 3)).trim_end().to_owned()
        },
    )
}

/// The greatest bias per visible µm; of what is never seen, that it biases at all.
fn harm(row: &Diagnosability) -> String {
    let greatest = |list: &[(String, f64, String)]| {
        list.iter()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .cloned()
    };
    match (greatest(&row.harm_per_visible), greatest(&row.harm)) {
        (Some((name, bias, _)), _) if bias.abs() > NO_BIAS => {
            format!("{} µrad in {name}", plain(1e6 * bias, 3))
        }
        (None, Some((name, bias, _))) if bias.abs() > NO_BIAS => format!("unseen, in {name}"),
        _ => String::new(),
    }
}

pub(super) fn answer(
    args: &Args,
    rows: &[Diagnosability],
    mut extras: Vec<(&'static str, f64, Vec<String>)>,
) -> Answer {
    extras.sort_by(|a, b| {
        (b.2.len(), b.1)
            .partial_cmp(&(a.2.len(), a.1))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut text = String::from(
        "effect                   visible     seen from        told apart from   bias per visible µm      most like\n",
    );
    let mut table = Table::new(
        "What the plan shows",
        [
            "effect",
            "visible",
            "seen from",
            "told apart from",
            "bias per visible µm",
            "most like",
        ],
    );
    let shown = rows.iter().filter(|row| row.detectable.is_some()).count();
    let sentence = format!(
        "Of {} effects such a measurement would show {shown}, each from some size on; {} would not show whatever their size.",
        rows.len(),
        rows.len() - shown
    );
    // To a hundredth of a per cent: below, it is rounding.
    let percent = |row: &Diagnosability| (1e4 * row.visible).round() / 100.0;
    let bar = |row: &Diagnosability| Bar::new(row.effect.clone(), percent(row));
    let visible = Bars::new(Axis::new("visible part", "%")).bars(rows.iter().map(bar));
    for row in rows {
        let [seen, told] = [row.detectable, row.identifiable].map(|value| effect_size(row, value));
        let like = row
            .confused_with
            .as_ref()
            .map_or(String::new(), |n| format!("{n} (cosine {:.2})", row.cosine));
        let harm = harm(row);
        let _ = writeln!(
            text,
            "{:<24} {:>6.1} %  {seen:>15}  {told:>15}   {harm:<22}   {like}",
            row.effect,
            100.0 * row.visible
        );
        table = table.row([
            Cell::Text(row.effect.clone()),
            Cell::Share(row.visible),
            Cell::Text(seen),
            Cell::Text(told),
            Cell::Text(harm),
            Cell::Text(like),
        ]);
    }
    if rows.iter().any(|row| row.at_least) {
        let _ = writeln!(text, "{AT_LEAST}");
    }
    let shapes = by_shape(rows);
    if !shapes.is_empty() {
        let _ = writeln!(text, "\n{BY_SHAPE}");
        for line in &shapes {
            let _ = writeln!(text, "  {line}");
        }
    }
    text += "\nWhat would help most\n";
    let mut help = Vec::new();
    for (name, gain, new) in &extras {
        let shows = if new.is_empty() {
            String::new()
        } else {
            format!(", and shows {}", new.join(", "))
        };
        help.push(format!(
            "{name}: sizes seen shrink by a factor of {gain:.2}{shows}"
        ));
    }
    for line in &help {
        let _ = writeln!(text, "  {line}");
    }
    let extras: Vec<_> = extras
        .into_iter()
        .map(|(name, gain, shows)| json!({"measure": name, "gain": gain, "shows": shows}))
        .collect();
    let mut section = Section::new("What the plan can show")
        .figure(Figure::new(
            "Visible part of each effect",
            "What the fit of such a measurement cannot take up, so that it shows; below the rest it passes for form, tilt or offset.",
            visible,
        ))
        .table(table);
    if rows.iter().any(|row| row.at_least) {
        section = section.paragraph(AT_LEAST);
    }
    if !shapes.is_empty() {
        section = section.paragraph(BY_SHAPE).list(shapes);
    }
    Answer {
        text,
        json: json!({"schema": "errsep.plan/1", "effects": rows, "extra_measurements": extras}),
        page: Page::new("Plan", args.plan.display().to_string())
            .summary(Standing::Neutral, sentence)
            .section(section.paragraph("What would help most:").list(help)),
        tables: Vec::new(),
        inputs: vec![args.plan.clone()],
        setup: None,
        seed: Some(args.common.seed),
        status: Status::Done,
    }
}
