//! Maps of values over position, one row a trace, in colours that diverge from zero.

use super::canvas::{Area, Drawing, Frame, LINE, Thinned, c, fitted, pointed, text_width};
use super::chart::Axis;
use super::scale::{Domain, Scale, drawable};
use crate::report::number::plain;
use maud::{Markup, html};
use serde_json::json;
use std::fmt::Write;

/// Cells beside each other before positions share one.
const COLUMNS: usize = 100;
/// Colour steps on either side of zero.
const STEPS: usize = 4;
/// The part of the cells that the colours span; the rest take the last colour.
const SPANNED: f64 = 0.98;

/// One map: rows of values over one axis. Several readings in one cell are averaged.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    title: String,
    rows: Vec<String>,
    points: Vec<Point>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    row: usize,
    x: f64,
    value: f64,
}

impl HeatMap {
    /// An empty map with the names of its rows, top first.
    pub fn new<R: Into<String>>(
        title: impl Into<String>,
        rows: impl IntoIterator<Item = R>,
    ) -> Self {
        Self {
            title: title.into(),
            rows: rows.into_iter().map(Into::into).collect(),
            points: Vec::new(),
        }
    }

    /// Adds one value. What has no row or no finite place is left out.
    pub fn add(&mut self, row: usize, x: f64, value: f64) {
        if row < self.rows.len() && drawable(x, false) && drawable(value, false) {
            self.points.push(Point { row, x, value });
        }
    }
}

/// Maps beside each other in one scale of position and one of colour.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMaps {
    x: Axis,
    quantity: String,
    unit: String,
    maps: Vec<HeatMap>,
}

impl HeatMaps {
    /// Maps of a quantity over an axis.
    pub fn new(
        x: Axis,
        quantity: impl Into<String>,
        unit: impl Into<String>,
        maps: impl IntoIterator<Item = HeatMap>,
    ) -> Self {
        Self {
            x,
            quantity: quantity.into(),
            unit: unit.into(),
            maps: maps.into_iter().collect(),
        }
    }

    pub(super) fn drawings(&self) -> Vec<Drawing> {
        let grid = Grid::of(
            self.maps
                .iter()
                .flat_map(|map| map.points.iter().map(|p| p.x)),
        );
        let cells: Vec<Vec<Vec<f64>>> = self.maps.iter().map(|map| grid.means(map)).collect();
        let limit = limit(cells.iter().flatten().flatten());
        let mut drawings = vec![self.legend(limit)];
        drawings.extend(
            self.maps
                .iter()
                .zip(&cells)
                .map(|(map, cells)| self.draw(map, cells, &grid, limit)),
        );
        drawings
    }

    fn draw(&self, map: &HeatMap, cells: &[Vec<f64>], grid: &Grid, limit: f64) -> Drawing {
        let width = Frame::PANEL.width;
        let names = map.rows.iter().map(|r| text_width(r)).fold(0.0, f64::max);
        let row_height = (200.0 / map.rows.len().max(1) as f64).clamp(6.0, 24.0);
        let top = LINE + 8.0;
        let area = Area {
            left: 14.0 + names.min(140.0),
            top,
            width: width - 16.0 - (14.0 + names.min(140.0)),
            height: row_height * map.rows.len() as f64,
        };
        let x = Scale::new(
            Domain::of(&[grid.low, grid.high()], false),
            false,
            0.0,
            area.left,
            area.right(),
        );
        let ticks = x.ticks((area.width / 62.0) as usize, false);
        let title = ticks.title(&self.x.quantity, &self.x.unit);
        // Names are left out where rows are too low for them; the pointer still tells them.
        let every = (LINE / row_height).ceil().max(1.0) as usize;
        let body = html! {
            text class="panel-title" x=(c(area.left)) y="17" { (fitted(&map.title, area.width)) }
            g class="axes" {
                @for (k, name) in map.rows.iter().enumerate().step_by(every) {
                    text class="end" x=(c(area.left - 7.0))
                        y=(c(area.top + (k as f64 + 0.5) * row_height + 4.5)) { (fitted(name, 140.0)) }
                }
                @for (value, label) in &ticks.marks {
                    @let at = x.at(*value);
                    path class="frame" d={ "M" (c(at)) " " (c(area.bottom())) "v4" } {}
                    text class="middle" x=(c(at)) y=(c(area.bottom() + 18.0)) { (label) }
                }
                text class="axis middle" x=(c(area.left + 0.5 * area.width))
                    y=(c(area.bottom() + 37.0)) { (fitted(&title, area.width)) }
            }
            (coloured(cells, &area, row_height, limit))
            rect class="outline" x=(c(area.left)) y=(c(area.top))
                width=(c(area.width)) height=(c(area.height)) {}
        };
        let shown = cells.iter().flatten().filter(|v| v.is_finite()).count();
        Drawing {
            size: (width, area.bottom() + 46.0),
            body,
            spans: false,
            alt: format!(
                "{}: {} over {}, {} rows",
                map.title,
                self.quantity,
                self.x.quantity,
                map.rows.len()
            ),
            values: Some(json!({
                "kind": "cells",
                "area": [pointed(area.left), pointed(area.top), pointed(area.width), pointed(area.height)],
                "x": {
                    "name": self.x.quantity, "unit": self.x.unit,
                    "values": (0..grid.count).map(|k| pointed(grid.centre(k))).collect::<Vec<_>>(),
                },
                "rows": map.rows,
                "unit": self.unit,
                "values": cells.iter()
                    .map(|row| row.iter().copied().map(pointed).collect::<Vec<_>>())
                    .collect::<Vec<_>>(),
            })),
            thinned: (shown < map.points.len()).then_some(Thinned::Averaged {
                cells: shown,
                given: map.points.len(),
            }),
        }
    }

    fn legend(&self, limit: f64) -> Drawing {
        const STEP: f64 = 34.0;
        let (width, left) = (Frame::WIDE.width, 110.0);
        let end = left + STEP * (2 * STEPS + 1) as f64;
        let title = match self.unit.as_str() {
            "" => self.quantity.clone(),
            unit => format!("{} ({unit})", self.quantity),
        };
        let body = html! {
            @for k in 0..=2 * STEPS {
                @let step = k as i32 - STEPS as i32;
                @let x = left + STEP * k as f64;
                rect class={ "cell " (class(step)) } x=(c(x)) y="4" width=(c(STEP)) height="14" {}
                @if step < 0 { path class="hatch" d=(hatch(x, 4.0, STEP, 14.0)) {} }
            }
            rect class="outline" x=(c(left)) y="4" width=(c(end - left)) height="14" {}
            text class="end" x=(c(left - 7.0)) y="16" { "≤ " (plain(-limit, 2)) }
            text x=(c(end + 7.0)) y="16" { "≥ " (plain(limit, 2)) }
            text class="middle" x=(c(left + 0.5 * (end - left))) y="34" { "0" }
            text class="axis" x=(c(end + 90.0)) y="16" { (fitted(&title, width - end - 90.0)) }
        };
        Drawing {
            size: (width, 40.0),
            body,
            spans: true,
            alt: format!("Colours: {title}; negative values are hatched"),
            values: None,
            thinned: None,
        }
    }
}

/// Equal cells over the positions of all maps.
struct Grid {
    low: f64,
    step: f64,
    count: usize,
}

impl Grid {
    fn of(positions: impl Iterator<Item = f64>) -> Self {
        let mut places: Vec<f64> = positions.collect();
        places.sort_unstable_by(f64::total_cmp);
        places.dedup();
        let (Some(first), Some(last)) = (places.first(), places.last()) else {
            return Self {
                low: 0.0,
                step: 1.0,
                count: 1,
            };
        };
        let count = places.len().min(COLUMNS);
        let range = last - first;
        // A cell around every position where they are even, so that the outer ones are whole.
        let step = if count > 1 && range > 0.0 && range.is_finite() {
            range / (count - 1) as f64
        } else {
            1.0
        };
        Self {
            low: first - 0.5 * step,
            step,
            count,
        }
    }

    fn high(&self) -> f64 {
        self.low + self.step * self.count as f64
    }

    fn centre(&self, column: usize) -> f64 {
        self.low + (column as f64 + 0.5) * self.step
    }

    /// The mean of each cell, row by row; NaN where there is nothing.
    fn means(&self, map: &HeatMap) -> Vec<Vec<f64>> {
        let mut sums = vec![vec![(0.0, 0.0); self.count]; map.rows.len()];
        for point in &map.points {
            let column = ((point.x - self.low) / self.step).max(0.0) as usize;
            let column = column.min(self.count - 1);
            if let Some((sum, count)) = sums.get_mut(point.row).and_then(|row| row.get_mut(column))
            {
                *sum += point.value;
                *count += 1.0;
            }
        }
        sums.into_iter()
            .map(|row| row.into_iter().map(|(sum, count)| sum / count).collect())
            .collect()
    }
}

/// The value at which the last colour begins.
fn limit<'a>(cells: impl Iterator<Item = &'a f64>) -> f64 {
    let mut sizes: Vec<f64> = cells.map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let place = (SPANNED * sizes.len().saturating_sub(1) as f64).ceil() as usize;
    match sizes.get(place) {
        Some(size) if *size > 0.0 => *size,
        _ => 1.0,
    }
}

/// Colour step of a value, −4 to 4.
fn step(value: f64, limit: f64) -> i32 {
    let steps = STEPS as f64;
    ((steps + 0.5) * value / limit).round().clamp(-steps, steps) as i32
}

fn class(step: i32) -> &'static str {
    match step {
        ..=-4 => "n4",
        -3 => "n3",
        -2 => "n2",
        -1 => "n1",
        0 => "n0",
        1 => "p1",
        2 => "p2",
        3 => "p3",
        4.. => "p4",
    }
}

/// A stroke across a negative cell: the sign must survive grey print.
fn hatch(x: f64, y: f64, width: f64, height: f64) -> String {
    let side = width.min(height);
    let (x, y) = (x + 0.5 * (width - side), y + 0.5 * (height + side));
    format!("M{} {}l{} {}", c(x), c(y), c(side), c(-side))
}

/// The cells, one path a colour; neighbours of one colour are one rectangle.
fn coloured(cells: &[Vec<f64>], area: &Area, row_height: f64, limit: f64) -> Markup {
    let mut paths = vec![String::new(); 2 * STEPS + 1];
    let mut strokes = String::new();
    for (r, row) in cells.iter().enumerate() {
        let y = area.top + r as f64 * row_height;
        let width = area.width / row.len().max(1) as f64;
        let mut start = 0;
        while start < row.len() {
            let colour = |k: usize| {
                row.get(k)
                    .filter(|v| v.is_finite())
                    .map(|v| step(*v, limit))
            };
            let own = colour(start);
            let mut end = start + 1;
            while end < row.len() && colour(end) == own {
                end += 1;
            }
            let (x0, x1) = (
                area.left + start as f64 * width,
                area.left + end as f64 * width,
            );
            if let Some(step) = own {
                if let Some(path) = paths.get_mut((step + STEPS as i32) as usize) {
                    // Writing to a string cannot fail.
                    let _ = write!(
                        path,
                        "M{} {}H{}V{}H{}z",
                        c(x0),
                        c(y),
                        c(x1),
                        c(y + row_height),
                        c(x0)
                    );
                }
                if step < 0 {
                    for k in start..end {
                        let x = area.left + k as f64 * width;
                        strokes += &hatch(x, y, width, row_height);
                    }
                }
            }
            start = end;
        }
    }
    html! {
        @for (k, path) in paths.iter().enumerate() {
            @if !path.is_empty() {
                path class={ "cell " (class(k as i32 - STEPS as i32)) } d=(path) {}
            }
        }
        @if !strokes.is_empty() { path class="hatch" d=(strokes) {} }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_average_and_colours_are_odd_about_zero() {
        let mut map = HeatMap::new("1A", ["1"]);
        map.add(0, 0.0, 1.0);
        map.add(0, 0.0, 3.0);
        map.add(0, 1.0, -2.0);
        map.add(7, 1.0, 9.0);
        map.add(0, f64::NAN, 9.0);
        let grid = Grid::of(map.points.iter().map(|p| p.x));
        assert_eq!(grid.means(&map), [[2.0, -2.0]]);
        for value in [0.0, 0.1, 0.3, 0.7, 1.0, 5.0] {
            assert_eq!(step(value, 1.0), -step(-value, 1.0));
        }
        assert_eq!((step(1.0, 1.0), step(0.1, 1.0)), (4, 0));
    }
}
