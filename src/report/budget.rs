//! A budget of uncertainty as a table and as bars.

use errsep_models::uncertainty::Budget;

use crate::io::units::{URAD_PER_RAD, symbol};

use super::plot::{Axis, Bar, Bars};
use super::{Cell, Figure, Table, number};

/// Factor to and name of the unit in which an influence is shown: angles in µrad.
fn shown(unit: &str) -> (f64, &str) {
    if unit == "rad" {
        (URAD_PER_RAD, symbol("urad"))
    } else {
        (1.0, symbol(unit))
    }
}

/// The rows of a budget, the largest share first; u is the standard uncertainty of an influence, ν
/// its degrees of freedom.
#[must_use]
pub fn table(caption: &str, budget: &Budget) -> Table {
    let contribution = format!("contribution ({})", symbol(&budget.result.unit));
    budget.contributions.iter().fold(
        Table::new(
            caption,
            [
                "influence",
                "unit",
                "value",
                "u",
                "ν",
                "sensitivity",
                &contribution,
                "share",
            ],
        ),
        |table, c| {
            let (factor, unit) = shown(&c.input.unit);
            table.row([
                c.input.label.as_str().into(),
                unit.into(),
                Cell::number(c.input.value * factor),
                Cell::number(c.input.standard_uncertainty * factor),
                c.input.degrees_of_freedom.to_string().into(),
                Cell::number(c.sensitivity / factor),
                Cell::number(c.contribution),
                Cell::Share(c.share),
            ])
        },
    )
}

/// The contributions as bars.
#[must_use]
pub fn figure(title: &str, budget: &Budget) -> Figure {
    let unit = symbol(&budget.result.unit);
    let bars = budget
        .contributions
        .iter()
        .filter(|c| c.contribution > 0.0)
        .map(|c| {
            Bar::new(c.input.label.as_str(), c.contribution)
                .note(format!("({})", number::percent(c.share)))
        });
    Figure::new(
        title,
        "Standard uncertainty by influence, with its share of the variance.",
        Bars::new(Axis::new("contribution", unit)).bars(bars),
    )
}

/// A budget as lines of text, indented by two.
#[must_use]
pub fn text(budget: &Budget) -> String {
    let unit = symbol(&budget.result.unit);
    budget
        .contributions
        .iter()
        .filter(|c| c.contribution > 0.0)
        .map(|c| {
            format!(
                "  {:14} {:>10} {unit} {:>7}\n",
                c.input.label,
                number::plain(c.contribution, 3),
                number::percent(c.share)
            )
        })
        .collect()
}
