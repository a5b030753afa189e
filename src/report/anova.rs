//! The page of an analysis of variance.

use errsep_models::anova::recipe::Summary;
use errsep_models::anova::{Groups, OneWay};

use crate::io::units::{per_cent, symbol};

use super::plot::{Axis, Bar, Bars, Chart, Series};
use super::{Cell, Figure, Page, Section, Standing, Table, number};

/// One feature as the page shows it.
#[derive(Debug, Clone)]
pub struct FeatureView<'a> {
    /// Name of the feature.
    pub name: &'a str,
    /// Unit of its readings.
    pub unit: &'a str,
    /// Its readings by part.
    pub groups: &'a Groups,
    /// What was found.
    pub result: &'a OneWay,
    /// The figures of NISTIR 6868, where they were asked for.
    pub summary: Option<&'a Summary>,
    /// Why its readings say less than they seem to.
    pub remark: Option<String>,
}

/// The page of all features; `open` names those whose components are not determined.
#[must_use]
pub fn page(data: &str, features: &[FeatureView], open: &[&str]) -> Page {
    let (standing, sentence) = verdict(features, open);
    let mut overview = Section::new("Components of variance").table(overview_table(features));
    let units: Vec<&str> = features.iter().map(|f| f.unit).collect();
    for unit in units
        .iter()
        .enumerate()
        .filter(|(i, u)| !units[..*i].contains(u))
        .map(|(_, u)| u)
    {
        overview = overview.figure(components_figure(features, unit));
    }
    overview = overview.note(
        "A mean square between parts is not their variance: it holds that of the measurement, and \
         n₀ times that of the parts. The components here are freed of both.",
    );
    let mut page = Page::new("Analysis of variance", data).summary(standing, sentence);
    page = page.section(overview);
    if features.iter().any(|f| f.summary.is_some()) {
        page =
            page.section(Section::new("As NISTIR 6868 forms them").table(recipe_table(features)));
    }
    features
        .iter()
        .fold(page, |page, feature| page.section(feature_section(feature)))
}

fn verdict(features: &[FeatureView], open: &[&str]) -> (Standing, String) {
    if !open.is_empty() {
        let sentence = format!(
            "No part was measured twice for {}: the scatter of the parts cannot be told from that of \
             the measurement.",
            open.join(", ")
        );
        return (Standing::Bad, sentence);
    }
    let doubtful = |f: &FeatureView| {
        f.remark
            .as_ref()
            .map(|remark| format!("{}: {remark}", f.name))
    };
    let doubts: Vec<String> = features.iter().filter_map(doubtful).collect();
    if !doubts.is_empty() {
        return (Standing::Caution, format!("{}.", doubts.join("; ")));
    }
    let differ = features
        .iter()
        .filter(|f| f.result.p_value.is_some_and(|p| p < 0.05))
        .count();
    let sentence = match (features, differ) {
        ([one], _) if one.result.groups == 1 => {
            "One part: its mean and the scatter of the readings.".to_owned()
        }
        ([one], 0) => format!(
            "The parts do not differ in {} by more than the measurement scatters.",
            one.name
        ),
        ([one], _) => format!(
            "The parts differ in {} by more than the measurement scatters.",
            one.name
        ),
        (all, n) => format!(
            "In {n} of {} features the parts differ by more than the measurement scatters (5 % level).",
            all.len()
        ),
    };
    (Standing::Good, sentence)
}

fn overview_table(features: &[FeatureView]) -> Table {
    features.iter().fold(
        Table::new(
            "Standard deviations from part to part and of one measurement, and the mean of all \
             readings with its standard uncertainty",
            [
                "feature",
                "unit",
                "mean",
                "between parts",
                "one measurement",
                "F",
                "p",
            ],
        ),
        |table, f| {
            let spread = |c: &Option<errsep_models::anova::Interval>| {
                c.as_ref()
                    .map_or(Cell::Empty, |c| Cell::number(c.standard_deviation))
            };
            table.row([
                f.name.into(),
                symbol(f.unit).into(),
                Cell::measured(f.result.mean.value, f.result.mean.standard_uncertainty),
                spread(&f.result.components.between),
                spread(&f.result.components.within),
                f.result.f.map_or(Cell::Empty, Cell::number),
                f.result.p_value.map_or(Cell::Empty, Cell::Probability),
            ])
        },
    )
}

fn components_figure(features: &[FeatureView], unit: &str) -> Figure {
    let confidence = features
        .first()
        .map_or(0.95, |f| f.result.components.confidence);
    let bars = features.iter().filter(|f| f.unit == unit).flat_map(|f| {
        let bar = |name: &str, component: &Option<errsep_models::anova::Interval>| {
            component.as_ref().map(|c| {
                Bar::new(name, c.standard_deviation).interval(c.lower.sqrt(), c.upper.sqrt())
            })
        };
        let within = bar("one measurement", &f.result.components.within).map(Bar::faint);
        [bar(f.name, &f.result.components.between), within]
            .into_iter()
            .flatten()
    });
    Figure::new(
        format!("Standard deviations ({})", symbol(unit)),
        format!(
            "Filled: from part to part. Outline: one measurement. Whiskers: {} % intervals.",
            per_cent(confidence)
        ),
        Bars::new(Axis::new("standard deviation", symbol(unit))).bars(bars),
    )
}

fn recipe_table(features: &[FeatureView]) -> Table {
    features.iter().fold(
        Table::new(
            "The report's own arithmetic: mean squares taken as variances",
            [
                "feature",
                "mean",
                "variance between",
                "variance within",
                "F",
                "future measurement",
                "future manufacturing",
            ],
        ),
        |table, f| match f.summary {
            None => table,
            Some(s) => table.row([
                f.name.into(),
                Cell::number(s.mean),
                Cell::Number {
                    value: s.variance_between,
                    digits: 6,
                },
                Cell::Number {
                    value: s.variance_within,
                    digits: 6,
                },
                s.f.map_or(Cell::Empty, Cell::number),
                Cell::number(s.future_measurement),
                Cell::number(s.future_manufacturing),
            ]),
        },
    )
}

fn feature_section(feature: &FeatureView) -> Section {
    let r = feature.result;
    let groups = feature.groups.groups();
    let (mut at, mut value) = (Vec::new(), Vec::new());
    for (i, group) in groups.iter().enumerate() {
        for reading in &group.readings {
            at.push(i as f64 + 1.0);
            value.push(*reading);
        }
    }
    let numbers: Vec<f64> = (1..=groups.len()).map(|i| i as f64).collect();
    let means = groups
        .iter()
        .map(errsep_models::anova::Group::mean)
        .collect();
    let chart = Chart::new(
        Axis::new("part, in the order of the file", "").whole(),
        Axis::new("reading", symbol(feature.unit)),
    )
    .series(Series::line("mean of the part", numbers, means))
    .series(Series::points("reading", at, value))
    .horizontal(r.mean.value, "mean");
    let line = |name: &str, m: &errsep_models::anova::MeanSquare| {
        [
            name.into(),
            m.degrees_of_freedom.into(),
            Cell::number(m.sum_of_squares),
            m.mean_square.map_or(Cell::Empty, Cell::number),
        ]
    };
    let unit = symbol(feature.unit);
    let mut section = Section::new(feature.name)
        .figure(Figure::new(
            "Readings by part",
            "Every reading, and the mean of each part.",
            chart,
        ))
        .table(
            Table::new(
                "Table of analysis",
                [
                    "source".to_owned(),
                    "degrees of freedom".to_owned(),
                    format!("sum of squares ({unit}²)"),
                    format!("mean square ({unit}²)"),
                ],
            )
            .row(line("between parts", &r.between))
            .row(line("within parts", &r.within)),
        );
    if let Some(budget) = &r.future_reading {
        section = section.table(super::budget::table(
            &format!(
                "A future reading: ± {} {unit} (standard uncertainty)",
                number::plain(budget.result.standard_uncertainty, 3)
            ),
            budget,
        ));
    }
    section
}
