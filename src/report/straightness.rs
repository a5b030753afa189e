//! The page of a profile against its reference lines.

use errsep_models::straightness::{ReferenceLine, Straightness};

use super::plot::{Axis, Chart, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table, number};

/// The page: `x` in mm, `y` in µm, one result a reference line; `remark` where these say nothing.
#[must_use]
pub fn page(
    name: &str,
    x: &[f64],
    y: &[f64],
    results: &[Straightness],
    remark: Option<&str>,
) -> Page {
    let ends = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |e, v| {
        (e.0.min(*v), e.1.max(*v))
    });
    let zone = results
        .iter()
        .find(|s| s.reference == ReferenceLine::MinimumZone);
    let sentence = zone.map_or_else(String::new, |zone| {
        format!(
            "The profile is straight to {} µm over {} mm (minimum zone).",
            number::plain(zone.error(), 4),
            number::plain(ends.1 - ends.0, 4)
        )
    });
    let key = results
        .iter()
        .map(|s| KeyFigure::new("Straightness", s.error(), "µm").meaning(s.reference.name()));
    let rows = results.iter().map(|s| {
        [
            Cell::Text(s.reference.name().to_owned()),
            Cell::number(s.error()),
            Cell::number(s.lowest),
            Cell::number(s.highest),
            // µm/mm = mrad.
            Cell::number(s.slope * 1e3),
        ]
    });
    let columns = [
        "reference line",
        "straightness (µm)",
        "lowest (µm)",
        "highest (µm)",
        "slope of the line (µrad)",
    ];
    let section = Section::new("Straightness").key_figures(key);
    let section = match zone {
        Some(zone) => section.figure(Figure::new(
            "Deviation from the middle of the minimum zone",
            "The two dotted lines are the closest parallels that hold all points.",
            deviations(zone, x, y),
        )),
        None => section,
    };
    Page::new("Straightness", name)
        .summary(
            remark.map_or(Standing::Neutral, |_| Standing::Bad),
            remark.map_or(sentence, str::to_owned),
        )
        .section(section.table(Table::new("By reference line", columns).rows(rows)))
}

fn deviations(zone: &Straightness, x: &[f64], y: &[f64]) -> Chart {
    let mut points: Vec<(f64, f64)> = x
        .iter()
        .zip(y)
        .map(|(&x, &y)| (x, zone.deviation(x, y)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (x, deviation) = points.into_iter().unzip();
    Chart::new(Axis::new("position x", "mm"), Axis::new("deviation", "µm"))
        .series(Series::line("profile", x, deviation))
        .horizontal(zone.lowest, "")
        .horizontal(zone.highest, "minimum zone")
}
