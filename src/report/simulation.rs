//! The page of simulated data: what they were made from, and a picture of them.

use serde_json::Value;

use crate::diagnosis::scaled;
use crate::io::units::symbol;

use super::plot::{Axis, Chart, Series};
use super::{Cell, Figure, Page, Section, Standing, Table};

/// Curves of the truth that one picture holds.
const MOST_CURVES: usize = 6;

/// The page of a kind of simulation with its seed, the file of its data and their rows.
#[must_use]
pub fn page(kind: &str, seed: u64, (file, rows): (&str, usize), truth: &Value) -> Page {
    let mut figures = Vec::new();
    let mut numbers = Vec::new();
    take("", truth, &mut numbers, &mut figures);
    let table = Table::new("What the data were made from", ["truth", "value", "unit"]).rows(
        numbers
            .into_iter()
            .map(|(name, value, unit)| [Cell::Text(name), value, Cell::Text(unit)]),
    );
    let section = figures
        .into_iter()
        .fold(Section::new("Truth"), |section, chart| {
            section.figure(Figure::new(
                "Curves that the data were made from",
                "As they were before noise.",
                chart,
            ))
        });
    Page::new("Simulation", kind)
        .summary(
            Standing::Neutral,
            format!("Simulated data, {rows} rows in {file}, seed {seed}: their truth is below."),
        )
        .section(section.table(table))
}

/// Numbers and curves of a truth, by their names in the JSON.
fn take(
    name: &str,
    value: &Value,
    numbers: &mut Vec<(String, Cell, String)>,
    figures: &mut Vec<Chart>,
) {
    let of = |value: &Value| match value {
        Value::Number(n) => n.as_f64().map(Cell::number),
        Value::Array(list) if list.len() <= 4 && !list.is_empty() => {
            let all: Option<Vec<String>> = list
                .iter()
                .map(|v| v.as_f64().map(|v| super::number::plain(v, 4)))
                .collect();
            all.map(|all| Cell::Text(all.join(", ")))
        }
        Value::String(text) => Some(Cell::Text(text.clone())),
        Value::Bool(is) => Some(Cell::Text(if *is { "yes" } else { "no" }.to_owned())),
        _ => None,
    };
    if let Some(cell) = of(value) {
        numbers.push((name.to_owned(), cell, String::new()));
        return;
    }
    let Value::Object(object) = value else { return };
    let sized = ["value", "std"]
        .iter()
        .find_map(|key| of(object.get(*key)?));
    if let (Some(cell), Some(unit)) = (sized, object.get("unit").and_then(Value::as_str)) {
        let (factor, people) = scaled(unit);
        let told = match cell.value() {
            Some(value) => (Cell::number(factor * value), people),
            None => (cell, symbol(unit)),
        };
        numbers.push((name.to_owned(), told.0, told.1.to_owned()));
        return;
    }
    figures.extend(curves(object));
    for (key, inner) in object {
        let name = if name.is_empty() {
            key.clone()
        } else {
            format!("{name} {key}")
        };
        take(&name, inner, numbers, figures);
    }
}

/// Curves over their common `x`.
fn curves(object: &serde_json::Map<String, Value>) -> Option<Chart> {
    let list = |value: &Value| -> Option<Vec<f64>> {
        let all = value.as_array().filter(|list| list.len() > 4)?;
        all.iter().map(Value::as_f64).collect()
    };
    let x = list(object.get("x")?)?;
    let chart = Chart::new(Axis::new("position x", "mm"), Axis::new("value", "µm"));
    let curves: Vec<(&String, Vec<f64>)> = object
        .iter()
        .filter(|(name, _)| *name != "x")
        .filter_map(|(name, value)| Some((name, list(value)?)))
        .filter(|(_, values)| values.len() == x.len())
        .take(MOST_CURVES)
        .collect();
    (!curves.is_empty()).then(|| {
        curves.into_iter().fold(chart, |chart, (name, values)| {
            chart.series(Series::line(name.as_str(), x.clone(), values))
        })
    })
}
