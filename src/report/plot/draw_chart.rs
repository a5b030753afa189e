//! Drawing of charts and panels.

use super::canvas::{
    Area, Drawing, Entry, Frame, LINE, TONES, Thinned, c, fitted, legend, mark, mark_class, point,
    text_width,
};
use super::chart::{Axis, Chart, Join, Mark, Panels, Series};
use super::scale::{Domain, Scale, Ticks, drawable};
use super::{pointer, thin};
use maud::{Markup, html};
use std::fmt::Write;

/// Room left free around the data, as a part of their range.
const PAD: f64 = 0.04;

pub(super) fn chart(chart: &Chart, frame: Frame) -> Drawing {
    Plan {
        frame,
        x: domain_x(chart),
        y: domain_y(chart),
        legend: true,
    }
    .draw(chart)
}

/// The charts of a row of panels, after a legend of their own where they share one.
pub(super) fn panels(panels: &Panels) -> Vec<Drawing> {
    let union = |domain: fn(&Chart) -> Domain| {
        panels
            .charts
            .iter()
            .map(domain)
            .fold(Domain::EMPTY, Domain::union)
    };
    let (x, y) = (union(domain_x), union(domain_y));
    let mut charts = panels.charts.iter().map(entries);
    let first = charts.next().unwrap_or_default();
    let common = panels.charts.len() > 1 && charts.all(|other| other == first);
    let mut drawings = Vec::with_capacity(panels.charts.len() + 1);
    if common && !first.is_empty() {
        let width = Frame::WIDE.width;
        let (body, height) = legend(&first, 0.0, 0.0, width);
        drawings.push(Drawing {
            size: (width, height),
            body,
            spans: true,
            alt: "Legend".to_owned(),
            values: None,
            thinned: None,
        });
    }
    drawings.extend(panels.charts.iter().map(|chart| {
        Plan {
            frame: Frame::PANEL,
            x: if panels.one_x_scale {
                x
            } else {
                domain_x(chart)
            },
            y: if panels.one_y_scale {
                y
            } else {
                domain_y(chart)
            },
            legend: !common,
        }
        .draw(chart)
    }));
    drawings
}

fn domain_x(chart: &Chart) -> Domain {
    let mut domain = with_range(&chart.x);
    for series in &chart.series {
        let reach = match series.join {
            Join::Columns(width) => 0.5 * width,
            _ => 0.0,
        };
        for x in series.x.iter().flat_map(|x| [x - reach, x + reach]) {
            if drawable(x, chart.x.log) {
                domain = domain.with(x);
            }
        }
    }
    rules(chart, false, chart.x.log).fold(domain, Domain::with)
}

fn domain_y(chart: &Chart) -> Domain {
    let log = chart.y.log;
    let mut domain = with_range(&chart.y);
    for series in &chart.series {
        domain = domain.union(Domain::of(&series.y, log));
        if let Some(band) = &series.band {
            domain = domain
                .union(Domain::of(&band.lower, log))
                .union(Domain::of(&band.upper, log));
        }
        if matches!(series.join, Join::Columns(_)) && !log {
            domain = domain.with(0.0);
        }
    }
    rules(chart, true, log).fold(domain, Domain::with)
}

fn rules(chart: &Chart, horizontal: bool, log: bool) -> impl Iterator<Item = f64> {
    chart
        .rules
        .iter()
        .filter(move |rule| rule.horizontal == horizontal)
        .map(|rule| rule.value)
        .filter(move |value| drawable(*value, log))
}

fn with_range(axis: &Axis) -> Domain {
    axis.range.map_or(Domain::EMPTY, |(low, high)| {
        Domain::of(&[low, high], axis.log)
    })
}

/// What the legend of a chart has to tell; nothing where one bare series speaks for itself.
fn entries(chart: &Chart) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (index, series) in chart.series.iter().enumerate() {
        let tone = tone(series, index);
        entries.push(Entry {
            name: match &series.band {
                Some(band) => format!("{} with {}", series.name, band.name),
                None => series.name.clone(),
            },
            tone,
            line: series.join == Join::Line,
            filled: series.band.is_some() || matches!(series.join, Join::Columns(_)),
            mark: series.mark,
        });
    }
    if chart.series.len() == 1 && chart.series.iter().all(|s| s.band.is_none()) {
        entries.clear();
    }
    entries
}

pub(super) fn tone(series: &Series, index: usize) -> usize {
    series.tone.unwrap_or(index) % TONES
}

/// Everything that is settled before a chart is drawn.
struct Plan {
    frame: Frame,
    x: Domain,
    y: Domain,
    legend: bool,
}

/// The scales and the area of one chart.
pub(super) struct Layout {
    pub(super) area: Area,
    pub(super) x: Scale,
    pub(super) y: Scale,
    x_ticks: Ticks,
    y_ticks: Ticks,
}

impl Plan {
    fn draw(&self, chart: &Chart) -> Drawing {
        let Frame { width, height } = self.frame;
        let mut top = 8.0;
        if !chart.title.is_empty() {
            top += LINE + 4.0;
        }
        let legend = if self.legend {
            let (markup, taken) = legend(&entries(chart), 12.0, top, width - 24.0);
            top += taken;
            Some(markup)
        } else {
            None
        };
        let layout = self.layout(chart, top);
        let drawn: Vec<(Markup, Vec<usize>)> = chart
            .series
            .iter()
            .enumerate()
            .map(|(index, series)| draw_series(series, tone(series, index), &layout))
            .collect();
        let (shown, given) = chart
            .series
            .iter()
            .zip(&drawn)
            .fold((0, 0), |(s, g), (series, (_, kept))| {
                (s + kept.len(), g + series.len())
            });
        let (drawn, kept): (Vec<Markup>, Vec<Vec<usize>>) = drawn.into_iter().unzip();
        let values = pointer::values(chart, &layout, &kept);
        let area = layout.area;
        let body = html! {
            @if !chart.title.is_empty() {
                text class="panel-title" x=(c(area.left)) y="19" { (fitted(&chart.title, area.width)) }
            }
            @if let Some(legend) = legend { (legend) }
            (axes(chart, &layout))
            // A nested viewport cuts off what lies outside the axes.
            svg x=(c(area.left)) y=(c(area.top)) width=(c(area.width)) height=(c(area.height))
                viewBox=(area.view_box()) {
                (stretches(chart, &layout))
                @for markup in &drawn { (markup) }
                (marks(chart, &layout))
            }
        };
        Drawing {
            size: (width, height),
            body,
            spans: false,
            alt: alt(chart),
            values: Some(values),
            thinned: (shown < given).then_some(Thinned::Extremes { shown, given }),
        }
    }

    fn layout(&self, chart: &Chart, top: f64) -> Layout {
        let Frame { width, height } = self.frame;
        let bottom = height - 46.0;
        let y = Scale::new(self.y, chart.y.log, PAD, bottom, top);
        let y_ticks = y.ticks(((bottom - top) / 42.0) as usize, chart.y.whole);
        let left = 34.0 + text_width(&"0".repeat(y_ticks.widest()));
        // Half of a wide label may stand beyond the last tick.
        let right = width - 24.0;
        // Lines and columns fill the width; points want room for their marks.
        let pad = if chart.series.iter().any(|s| s.mark != Mark::None) {
            0.02
        } else {
            0.0
        };
        let x = Scale::new(self.x, chart.x.log, pad, left, right);
        let room = (right - left) / 62.0;
        let mut x_ticks = x.ticks(room as usize, chart.x.whole);
        if text_width(&"0".repeat(x_ticks.widest() + 1)) > (right - left) / room {
            x_ticks = x.ticks((room / 2.0) as usize, chart.x.whole);
        }
        Layout {
            area: Area {
                left,
                top,
                width: right - left,
                height: bottom - top,
            },
            x,
            y,
            x_ticks,
            y_ticks,
        }
    }
}

fn axes(chart: &Chart, layout: &Layout) -> Markup {
    let area = layout.area;
    let x_title = layout.x_ticks.title(&chart.x.quantity, &chart.x.unit);
    let y_title = layout.y_ticks.title(&chart.y.quantity, &chart.y.unit);
    let middle = area.top + 0.5 * area.height;
    html! {
        g class="axes" {
            @for (value, label) in &layout.y_ticks.marks {
                @let y = layout.y.at(*value);
                path class=(if *value == 0.0 { "zero" } else { "grid" })
                    d={ "M" (c(area.left)) " " (c(y)) "H" (c(area.right())) } {}
                text class="end" x=(c(area.left - 7.0)) y=(c(y + 4.5)) { (label) }
            }
            @for (value, label) in &layout.x_ticks.marks {
                @let x = layout.x.at(*value);
                path class="grid" d={ "M" (c(x)) " " (c(area.top)) "V" (c(area.bottom())) } {}
                text class="middle" x=(c(x)) y=(c(area.bottom() + 18.0)) { (label) }
            }
            path class="frame" d={ "M" (c(area.left)) " " (c(area.top)) "V" (c(area.bottom()))
                "H" (c(area.right())) } {}
            text class="axis middle" x=(c(area.left + 0.5 * area.width))
                y=(c(area.bottom() + 38.0)) { (fitted(&x_title, area.width)) }
            text class="axis middle" transform={ "translate(15 " (c(middle)) ") rotate(-90)" }
                { (fitted(&y_title, area.height + 40.0)) }
        }
    }
}

fn stretches(chart: &Chart, layout: &Layout) -> Markup {
    let area = layout.area;
    html! {
        @for stretch in &chart.stretches {
            @if drawable(stretch.from, chart.x.log) && drawable(stretch.to, chart.x.log) {
                @let (a, b) = (layout.x.at(stretch.from), layout.x.at(stretch.to));
                rect class="stretch" x=(c(a.min(b))) y=(c(area.top))
                    width=(c((b - a).abs().max(1.0))) height=(c(area.height)) {}
                text class="label" x=(c(a.min(b).max(area.left) + 4.0)) y=(c(area.bottom() - 6.0))
                    { (stretch.label) }
            }
        }
    }
}

/// Rules and annotations, over the data.
fn marks(chart: &Chart, layout: &Layout) -> Markup {
    let area = layout.area;
    html! {
        @for rule in &chart.rules {
            @if rule.horizontal && drawable(rule.value, chart.y.log) {
                @let y = layout.y.at(rule.value);
                path class="rule" d={ "M" (c(area.left)) " " (c(y)) "H" (c(area.right())) } {}
                @let below = y - area.top < LINE;
                text class="label end" x=(c(area.right() - 5.0))
                    y=(c(if below { y + 15.0 } else { y - 5.0 })) { (rule.label) }
            } @else if !rule.horizontal && drawable(rule.value, chart.x.log) {
                @let x = layout.x.at(rule.value);
                path class="rule" d={ "M" (c(x)) " " (c(area.top)) "V" (c(area.bottom())) } {}
                (beside(x, area.top + 14.0, 5.0, &rule.label, area))
            }
        }
        @for note in &chart.annotations {
            @if drawable(note.x, chart.x.log) && drawable(note.y, chart.y.log) {
                @let (x, y) = (layout.x.at(note.x), layout.y.at(note.y));
                circle class="ringed" cx=(c(x)) cy=(c(y)) r="6" {}
                (beside(x, (y - 9.0).max(area.top + 14.0), 9.0, &note.label, area))
            }
        }
    }
}

/// Words to the right of a place, or to the left where they would leave the picture.
fn beside(x: f64, y: f64, gap: f64, label: &str, area: Area) -> Markup {
    let right = x + gap + text_width(label) <= area.right();
    html! {
        text class=(if right { "label" } else { "label end" })
            x=(c(if right { x + gap } else { x - gap })) y=(c(y)) { (label) }
    }
}

/// A series, and the places of the points that were kept.
fn draw_series(series: &Series, tone: usize, layout: &Layout) -> (Markup, Vec<usize>) {
    let area = layout.area;
    let place = |k: usize, height: &[f64]| -> Option<(f64, f64)> {
        let (x, y) = (*series.x.get(k)?, *height.get(k)?);
        let inside = drawable(x, layout.x.is_log()) && drawable(y, layout.y.is_log());
        inside.then(|| (layout.x.at(x), layout.y.at(y)))
    };
    let mut heights: Vec<&[f64]> = vec![&series.y];
    if let Some(band) = &series.band {
        heights.extend([band.lower.as_slice(), &band.upper]);
    }
    let column = |k: usize| place(k, &series.y).map(|(x, _)| x - area.left);
    let kept = thin::kept(series.len(), area.width as usize, column, &heights);

    let mut line = String::new();
    let mut points = String::new();
    let mut columns = String::new();
    let mut start = true;
    for &k in &kept {
        let Some((x, y)) = place(k, &series.y) else {
            start = true;
            continue;
        };
        match series.join {
            Join::Nothing => {}
            Join::Line => point(&mut line, start, x, y),
            Join::Columns(width) => {
                let edge = |part: f64| series.x.get(k).map(|x| x + part * width);
                let edges = [edge(-0.46), edge(0.46)].map(|edge| {
                    edge.filter(|x| drawable(*x, layout.x.is_log()))
                        .map(|x| layout.x.at(x))
                });
                if let [Some(left), Some(right)] = edges {
                    let foot = if layout.y.is_log() {
                        area.bottom()
                    } else {
                        layout.y.at(0.0)
                    };
                    // Writing to a string cannot fail.
                    let _ = write!(
                        columns,
                        "M{} {}V{}H{}V{}z",
                        c(left),
                        c(foot),
                        c(y),
                        c(right),
                        c(foot)
                    );
                }
            }
        }
        start = false;
        mark(&mut points, series.mark, x, y);
    }
    let band = series.band.as_ref().map(|band| {
        let lower = |k: usize| place(k, &band.lower);
        band_path(&kept, lower, |k| place(k, &band.upper))
    });
    let markup = html! {
        g class={ "t" (tone) } {
            @if let Some(band) = band { path class="band" d=(band) {} }
            @if !columns.is_empty() { path class="columns" d=(columns) {} }
            @if !line.is_empty() { path class="line" d=(line) {} }
            @if !points.is_empty() { path class=(mark_class(series.mark)) d=(points) {} }
        }
    };
    (markup, kept)
}

/// Lower and upper point of a band at one place.
type Across = ((f64, f64), (f64, f64));

/// The outline of a band, one closed piece between gaps.
fn band_path(
    kept: &[usize],
    lower: impl Fn(usize) -> Option<(f64, f64)>,
    upper: impl Fn(usize) -> Option<(f64, f64)>,
) -> String {
    let mut path = String::new();
    let mut piece: Vec<Across> = Vec::new();
    let mut close = |piece: &mut Vec<Across>| {
        for (k, ((x, y), _)) in piece.iter().enumerate() {
            point(&mut path, k == 0, *x, *y);
        }
        for (_, (x, y)) in piece.iter().rev() {
            point(&mut path, false, *x, *y);
        }
        if !piece.is_empty() {
            path.push('z');
        }
        piece.clear();
    };
    for &k in kept {
        match (lower(k), upper(k)) {
            (Some(low), Some(high)) => piece.push((low, high)),
            _ => close(&mut piece),
        }
    }
    close(&mut piece);
    path
}

fn alt(chart: &Chart) -> String {
    let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).collect();
    let unit = |axis: &Axis| match axis.unit.as_str() {
        "" => axis.quantity.clone(),
        unit => format!("{} in {unit}", axis.quantity),
    };
    let title = match chart.title.as_str() {
        "" => String::new(),
        title => format!("{title}: "),
    };
    format!(
        "{title}{} against {}: {}",
        unit(&chart.y),
        unit(&chart.x),
        names.join(", ")
    )
}
