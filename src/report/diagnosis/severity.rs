//! What else would have been given the names that were given.

use super::{Severity, View};
use crate::report::plot::{Axis, Bar, Bars};
use crate::report::{Cell, Figure, Section, Table};

/// Worst rivals of a name that the page shows.
const WORST: usize = 6;
/// Probability of any rival below which a name is strong.
const LIMIT: f64 = 0.05;

/// For each named effect how severe its test was, with its worst rivals drawn and in a table.
pub(super) fn section(view: &View) -> Section {
    let mut section = Section::new("What else would have looked the same");
    for severity in &view.severities {
        let worst = &severity.rivals[..severity.rivals.len().min(WORST)];
        section = section.paragraph(severity.line.clone());
        if worst.first().is_some_and(|(_, share)| *share > 0.0) {
            section = section.figure(rivals(severity, worst));
        }
        let rows = worst.iter();
        section = section.table(
            Table::new(
                format!("Rivals of {}", severity.effect),
                ["gap of the same size made by", "named the same"],
            )
            .rows(rows.map(|(name, share)| [name.clone().into(), Cell::Share(*share)])),
        );
    }
    section
}

fn rivals(severity: &Severity, worst: &[(String, f64)]) -> Figure {
    let bars = worst.iter().map(|(name, share)| {
        let bar = Bar::new(name.clone(), 100.0 * share);
        if *share > LIMIT { bar } else { bar.faint() }
    });
    Figure::new(
        format!("What else would be given the name {}", severity.effect),
        "How often a gap of the same size, made by each of these, would be given the same name. A name is \
         strong where all of them are surely below the dotted line, nothing stands out of what it leaves and no cause is named beside it. Filled: \
         beyond the line.",
        Bars::new(Axis::new("named the same", "% of cases"))
            .small()
            .bars(bars)
            .rule(100.0 * LIMIT, format!("{:.0} %", 100.0 * LIMIT)),
    )
}
