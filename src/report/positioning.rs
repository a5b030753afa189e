//! The page of a positioning test.

use errsep_models::positioning::{Direction, Figure as Quantity, Positioning};

use super::plot::{Axis, Chart, Mark, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table, number};
use crate::io::units::symbol;

/// What the page shows.
#[derive(Debug, Clone, Copy)]
pub struct PositioningView<'a> {
    /// Name of the data.
    pub data: &'a str,
    /// Name of the axis.
    pub axis: Option<&'a str>,
    /// Unit of the targets, as files name it.
    pub position_unit: &'a str,
    /// Unit of the deviations, as files name it.
    pub deviation_unit: &'a str,
    /// What was found.
    pub result: &'a Positioning,
    /// What the uncertainties hold.
    pub contents: &'a str,
    /// Which figures have none, and why.
    pub withheld: &'a [String],
    /// The drift in a sentence.
    pub drift: Option<&'a str>,
    /// What the reader has to weigh.
    pub warnings: &'a [String],
}

/// The page of a positioning test.
#[must_use]
pub fn page(view: &PositioningView) -> Page {
    let title = match view.axis {
        Some(name) => format!("Positioning of {name}"),
        None => "Positioning".to_owned(),
    };
    let standing = if view.warnings.is_empty() {
        Standing::Good
    } else {
        Standing::Caution
    };
    let unit = symbol(view.deviation_unit);
    let named = |figure: Quantity| {
        let value = view.result.value(figure)?;
        let (sign, meaning) = figure.in_words();
        Some(format!(
            "{meaning} {sign} = {} {unit}",
            number::fixed(value, 2)
        ))
    };
    let first = [
        Quantity::A,
        Quantity::E,
        Quantity::AForward,
        Quantity::EForward,
    ];
    let lead = first
        .into_iter()
        .chain([Quantity::ABackward, Quantity::EBackward])
        .find_map(named);
    let parts: Vec<String> = lead
        .into_iter()
        .chain(named(Quantity::R))
        .chain(named(Quantity::B))
        .collect();
    let mut sentence = parts.join(", ");
    if let Some(letter) = sentence.get(..1) {
        sentence = letter.to_uppercase() + &sentence[1..] + ".";
    }
    Page::new(title, view.data)
        .summary(standing, sentence)
        .section(result(view))
        .section(figures(view))
        .section(points(view))
}

fn result(view: &PositioningView) -> Section {
    let unit = symbol(view.deviation_unit);
    let shown = [
        Quantity::A,
        Quantity::E,
        Quantity::R,
        Quantity::B,
        Quantity::M,
    ];
    let key = shown.into_iter().filter_map(|figure| {
        let (sign, meaning) = figure.in_words();
        let value = view.result.value(figure)?;
        let meaning = match view.result.uncertainty(figure) {
            Some(Ok(u)) => format!("{meaning}, U = {} {unit}", number::plain(u, 2)),
            _ => meaning.to_owned(),
        };
        Some(KeyFigure::new(sign, value, unit).digits(4).meaning(meaning))
    });
    let section = Section::new("Deviations by target")
        .key_figures(key)
        .figure(Figure::new(
            "Deviations by target",
            "Means of each direction with the band of two standard deviations. The lines mark the ends of the \
             accuracy A (outer) and of the systematic error E (inner), where both directions were measured.",
            chart(view),
        ));
    view.warnings.iter().fold(section, |section, warning| {
        section.warning(warning.as_str())
    })
}

fn chart(view: &PositioningView) -> Chart {
    let unit = symbol(view.deviation_unit);
    let targets = &view.result.deviations.targets;
    let mut chart = Chart::new(
        Axis::new("target", symbol(view.position_unit)),
        Axis::new("deviation", unit),
    );
    let profile = &view.result.profile;
    for direction in Direction::ALL {
        let Some(means) = profile.means(direction) else {
            continue;
        };
        let mark = match direction {
            Direction::Forward => Mark::Dot,
            Direction::Backward => Mark::Ring,
        };
        let mut series = Series::line(direction.name(), targets.clone(), means.to_vec()).mark(mark);
        if let Some(stds) = profile.stds(direction) {
            let band = |factor: f64| {
                means
                    .iter()
                    .zip(stds)
                    .map(|(m, s)| m + factor * s)
                    .collect()
            };
            series = series.band("± 2 s", band(-2.0), band(2.0));
        }
        chart = chart.series(series);
    }
    let bidirectional = view.result.deviations.is_bidirectional();
    let ends = |factor: f64| {
        let all = Direction::ALL.into_iter().flat_map(|d| {
            let means = profile.means(d).unwrap_or_default();
            let stds = profile.stds(d);
            means.iter().enumerate().map(move |(i, m)| {
                let s = stds.and_then(|s| s.get(i)).copied().unwrap_or_default();
                (m - factor * s, m + factor * s)
            })
        });
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (l, h)| {
            (low.min(l), high.max(h))
        })
    };
    let marked = [(2.0, Quantity::A), (0.0, Quantity::E)];
    for (factor, figure) in marked.into_iter().filter(|_| bidirectional) {
        let Some(value) = view.result.value(figure) else {
            continue;
        };
        let (low, high) = ends(factor);
        let name = figure.in_words().0;
        let label = format!("{name} {} {unit}", number::fixed(value, 2));
        // One label above, one below: the upper lines may lie close together.
        let (above, below) = match figure {
            Quantity::A => (label, String::new()),
            _ => (String::new(), label),
        };
        chart = chart.horizontal(low, below).horizontal(high, above);
    }
    chart
}

fn figures(view: &PositioningView) -> Section {
    let unit = symbol(view.deviation_unit);
    let columns = [
        "figure",
        "meaning",
        &format!("value ({unit})"),
        &format!("U ({unit})"),
    ];
    let table = |caption: &str, which: &[Quantity]| {
        which
            .iter()
            .fold(Table::new(caption, columns), |table, figure| {
                let (sign, meaning) = figure.in_words();
                let Some(value) = view.result.value(*figure) else {
                    return table;
                };
                let expanded = match view.result.uncertainty(*figure) {
                    Some(Ok(value)) => Cell::Number { value, digits: 2 },
                    _ => Cell::Empty,
                };
                table.row([
                    sign.into(),
                    meaning.into(),
                    Cell::Number { value, digits: 5 },
                    expanded,
                ])
            })
    };
    let mut section =
        Section::new("Figures of the standards").table(table("ISO 230-2", &Quantity::ISO));
    if view.result.value(Quantity::Pa).is_some() {
        section = section.table(table("VDI 3441", &Quantity::VDI));
    }
    section = section.note(view.contents);
    section = view
        .withheld
        .iter()
        .fold(section, |section, sentence| section.note(sentence.as_str()));
    match view.drift {
        Some(sentence) => section.paragraph(sentence),
        None => section,
    }
}

fn points(view: &PositioningView) -> Section {
    let unit = symbol(view.deviation_unit);
    let profile = &view.result.profile;
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for direction in Direction::ALL {
        let mut add = |name: &str, values: Option<&[f64]>| {
            if let Some(values) = values {
                let header = format!("{name} {} ({unit})", direction.name());
                columns.push((header, values.to_vec()));
            }
        };
        add("mean", profile.means(direction));
        add("s", profile.stds(direction));
    }
    let of_point = [
        ("mean", profile.bidirectional_means()),
        ("B", profile.reversals()),
        ("R", profile.repeatabilities()),
    ];
    for (name, values) in of_point {
        columns.extend(values.map(|values| (format!("{name} ({unit})"), values)));
    }
    let target = format!("target ({})", symbol(view.position_unit));
    let header: Vec<&str> = std::iter::once(target.as_str())
        .chain(columns.iter().map(|(name, _)| name.as_str()))
        .collect();
    let mut table = Table::new("What was found at each target", header);
    for (i, target) in view.result.deviations.targets.iter().enumerate() {
        let first = Cell::Number {
            value: *target,
            digits: 7,
        };
        let values = columns.iter().map(|(_, values)| match values.get(i) {
            Some(value) => Cell::Number {
                value: *value,
                digits: 4,
            },
            None => Cell::Empty,
        });
        table = table.row(std::iter::once(first).chain(values).collect::<Vec<_>>());
    }
    Section::new("Targets").table(table)
}
