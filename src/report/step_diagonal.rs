//! The page of diagonal and step-diagonal tests.

use errsep_models::diagonal::{
    ClosedForm, Component, ComponentEstimate, Determined, DiagonalTotals, Motion, SequenceChoice,
    StepDiagonalFit, Total,
};

use errsep_models::uncertainty::coverage_factor;

use super::plot::{Axis, Chart, Mark, Series};
use super::{Cell, Figure, Page, Section, Standing, Table, number};

const URAD: f64 = 1e6;

/// What the page shows.
#[derive(Debug, Clone, Copy)]
pub struct StepDiagonalView<'a> {
    /// Name of the data.
    pub data: &'a str,
    /// The regression.
    pub fit: &'a StepDiagonalFit,
    /// The paper's estimators.
    pub forms: &'a [ClosedForm],
    /// Whole diagonals.
    pub totals: &'a DiagonalTotals,
    /// Sets of sequences, where they were asked for.
    pub choices: &'a [SequenceChoice],
    /// What the reader has to weigh.
    pub remarks: &'a [String],
}

/// The page of the tests.
#[must_use]
pub fn page(view: &StepDiagonalView) -> Page {
    let fit = view.fit;
    let whole = fit
        .components
        .iter()
        .filter(|c| c.determined == Determined::Wholly)
        .count();
    let sentence = format!(
        "The readings determine {} of {} unknowns: {whole} of 18 error functions wholly.",
        fit.rank, fit.parameters
    );
    let standing = if fit.ambiguities.is_empty() && view.remarks.is_empty() {
        Standing::Good
    } else {
        Standing::Caution
    };
    Page::new("Diagonal and step-diagonal tests", view.data)
        .summary(standing, sentence)
        .section(determined(view))
        .section(profiles(view))
        .section(reversals(view))
        .section(closed(view))
        .section(choices(view))
}

fn determined(view: &StepDiagonalView) -> Section {
    let mut table = Table::new("The 21 errors", ["name", "error", "determined", "value"]);
    for c in &view.fit.components {
        table = table.row([
            c.component.name().into(),
            c.component.words().into(),
            c.determined.words().into(),
            size(c).map_or(Cell::Empty, Cell::from),
        ]);
    }
    for l in &view.fit.squareness {
        let value = match (l.value, l.std) {
            (Some(s), std) => format!(
                "{} µrad",
                number::measured(URAD * l.location.iso_sign() * s, std.map(|u| URAD * u))
            )
            .into(),
            (None, _) => Cell::Empty,
        };
        table = table.row([
            l.location.name().into(),
            l.location.words().into(),
            l.determined.words().into(),
            value,
        ]);
    }
    let mut section = view
        .remarks
        .iter()
        .fold(
            Section::new("What the readings determine"),
            |section, remark| section.warning(remark.as_str()),
        )
        .table(table);
    if !view.fit.ambiguities.is_empty() {
        section = section
            .warning(
                "Some errors have the same effect on every reading. No analysis can separate them.",
            )
            .list(
                view.fit
                    .ambiguities
                    .iter()
                    .map(|a| format!("{}.", a.statement)),
            );
    }
    if !view.fit.remedies.is_empty() {
        let mut table = Table::new(
            "What one further measurement would settle",
            ["measure", "settles"],
        );
        for r in &view.fit.remedies {
            table = table.row([r.measure.as_str().into(), r.settles.join(", ").into()]);
        }
        section = section.table(table);
    }
    section
}

fn profiles(view: &StepDiagonalView) -> Section {
    view.fit
        .components
        .iter()
        .filter(|c| matches!(c.determined, Determined::Wholly | Determined::ShapeOnly))
        .fold(Section::new("Error functions"), |section, c| {
            section.figure(profile(c, ""))
        })
}

/// Peak to valley of what is determined, with its greatest expanded uncertainty.
fn size(c: &ComponentEstimate) -> Option<String> {
    let (factor, unit) = unit(c.component);
    let high = c.values.iter().copied().reduce(f64::max)?;
    let low = c.values.iter().copied().reduce(f64::min)?;
    let span = number::plain(factor * (high - low), 3);
    let expanded = expanded(c).into_iter().reduce(f64::max);
    Some(match expanded {
        Some(u) => format!(
            "{span} {unit} peak to valley, U up to {} {unit}",
            number::plain(u, 2)
        ),
        None => format!("{span} {unit} peak to valley"),
    })
}

/// Expanded uncertainties (95 %) in the unit that is shown; empty where the noise is not known.
fn expanded(c: &ComponentEstimate) -> Vec<f64> {
    let (factor, _) = unit(c.component);
    c.std
        .iter()
        .zip(&c.degrees_of_freedom)
        .map(|(u, degrees)| {
            // Degrees of freedom of an estimate are positive, so that they have a coverage factor.
            coverage_factor(0.95, *degrees).map_or(f64::NAN, |k| k * factor * u)
        })
        .collect()
}

/// How far the way back determines the reversal of each error.
fn reversals(view: &StepDiagonalView) -> Section {
    let mut section = Section::new("Reversal");
    if view.fit.reversals.is_empty() {
        return section;
    }
    let mut table = Table::new(
        "Reversal of the 18 error functions: arrived in the positive sense of the axis less in the negative",
        ["name", "error", "determined"],
    );
    for c in &view.fit.reversals {
        table = table.row([
            c.component.name().into(),
            c.component.words().into(),
            c.determined.words().into(),
        ]);
    }
    section = section.table(table);
    if !view.totals.reversals.is_empty() {
        let mut table = Table::new(
            "Whole diagonals, forward less backward",
            ["diagonal", "reversal (µm)"],
        );
        for (diagonal, value) in &view.totals.reversals {
            table = table.row([diagonal.name().into(), Cell::number(*value)]);
        }
        section = section.table(table);
    }
    view.fit
        .reversals
        .iter()
        .filter(|c| matches!(c.determined, Determined::Wholly | Determined::ChangesOnly))
        .fold(section, |section, c| {
            section.figure(profile(c, "reversal of "))
        })
}

fn unit(component: Component) -> (f64, &'static str) {
    if component.rotation {
        (URAD, "µrad")
    } else {
        (1.0, "µm")
    }
}

fn profile(c: &ComponentEstimate, what: &str) -> Figure {
    let (factor, unit) = unit(c.component);
    let values = c.values.iter().map(|v| factor * v).collect();
    let mut series = Series::line(c.component.name(), c.positions.clone(), values).mark(Mark::Dot);
    if !c.std.is_empty() {
        series = series.half_band(expanded(c));
    }
    let caption = match c.determined {
        Determined::ChangesOnly => "From its first value: the constant is not determined.",
        Determined::ShapeOnly => "From the line through its ends: the slope is not determined.",
        _ => "With its expanded uncertainty (95 %) as a band.",
    };
    Figure::new(
        format!("{}: {what}{}", c.component.name(), c.component.words()),
        caption,
        Chart::new(
            Axis::new(format!("position of {}", c.component.axis.letter()), "mm"),
            Axis::new(c.component.name(), unit),
        )
        .series(series),
    )
}

fn closed(view: &StepDiagonalView) -> Section {
    let mut section = Section::new("The paper's estimators");
    let mut table = Table::new(
        "Totals of the profiles; they equal the error only if all angular errors and mirror misalignments vanish",
        ["equation", "stands for", "total", "unit"],
    );
    let mut any = false;
    let both = view.forms.iter().filter(|f| f.motion == Motion::Either);
    for form in both {
        if let (Some(component), Some(total)) = (form.component, form.profile.last()) {
            let (factor, unit) = unit(component);
            table = table.row([
                form.equation.as_str().into(),
                component.name().into(),
                Cell::number(factor * total),
                unit.into(),
            ]);
            any = true;
        }
    }
    if any {
        section = section.table(table).note(
            "Straightness profiles of these estimators hold the integral of the yaw: a yaw of 1 µrad/m \
             bends the straightness of X by 1/4 µm over 1 m with a mirror, 1/8 µm with a retro-reflector.",
        );
    }
    if !view.totals.estimates.is_empty() {
        let mut table = Table::new(
            "From whole diagonals",
            ["equation", "quantity", "value", "unit"],
        );
        for e in &view.totals.estimates {
            let (name, value, unit) = match e.quantity {
                Total::PositioningSum => ("sum of the positioning errors", e.value, "µm"),
                Total::Squareness(l) => (l.name(), URAD * l.iso_sign() * e.value, "µrad"),
            };
            table = table.row([
                e.equation.as_str().into(),
                name.into(),
                Cell::number(value),
                unit.into(),
            ]);
        }
        section = section.table(table);
    }
    section
}

fn choices(view: &StepDiagonalView) -> Section {
    let mut section = Section::new("Choice of the sequences");
    if view.choices.is_empty() {
        return section;
    }
    let names = |list: &[Component]| {
        let names: Vec<String> = list.iter().map(|c| c.name()).collect();
        names.join(" ")
    };
    let mut table = Table::new(
        "For each number of sequences the set that determines most",
        [
            "sequences",
            "angular errors",
            "translational errors, at least in shape",
        ],
    );
    for choice in view.choices {
        let sequences: Vec<&str> = choice.sequences.iter().map(|s| s.name()).collect();
        table = table.row([
            sequences.join(" ").into(),
            names(&choice.angular).into(),
            names(&choice.translational).into(),
        ]);
    }
    section = section.table(table);
    section
}
