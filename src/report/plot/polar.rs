//! Polar plots: a small deviation around a circle, strongly enlarged.

use super::canvas::{
    Drawing, Entry, LINE, TONES, Thinned, c, legend, mark, mark_class, point, pointed,
};
use super::chart::{Axis, Mark};
use super::scale::{Domain, Scale, drawable};
use super::thin;
use maud::html;
use serde_json::json;
use std::f64::consts::TAU;

const WIDTH: f64 = 560.0;
const RADIUS: f64 = 215.0;
/// The deviations fill the ring from this part of the radius outward.
const INNER: f64 = 0.3;
/// Points of a circle drawn as a curve.
const CIRCLE: usize = 180;

/// One closed curve of deviations over the angle.
#[derive(Debug, Clone, PartialEq)]
pub struct PolarTrace {
    name: String,
    angle: Vec<f64>,
    value: Vec<f64>,
    mark: Mark,
    tone: Option<usize>,
}

impl PolarTrace {
    /// Deviations at angles (rad, counterclockwise from the right), in the order of measurement.
    pub fn new(name: impl Into<String>, angle: Vec<f64>, value: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            angle,
            value,
            mark: Mark::None,
            tone: None,
        }
    }

    /// A reference circle by the deviation of its radius and the place of its centre, all in the
    /// unit of the plot. Enlarged, a shifted circle is a limaçon: `r + x·cos φ + y·sin φ`.
    pub fn circle(name: impl Into<String>, radius: f64, centre: (f64, f64)) -> Self {
        let angle: Vec<f64> = (0..=CIRCLE)
            .map(|k| TAU * k as f64 / CIRCLE as f64)
            .collect();
        let value = angle
            .iter()
            .map(|a| radius + centre.0 * a.cos() + centre.1 * a.sin())
            .collect();
        Self::new(name, angle, value)
    }

    /// Shows the points.
    #[must_use]
    pub const fn mark(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// Fixes colour and dash, 0 to 5.
    #[must_use]
    pub const fn tone(mut self, tone: usize) -> Self {
        self.tone = Some(tone);
        self
    }
}

/// Deviations around a circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Polar {
    quantity: Axis,
    traces: Vec<PolarTrace>,
}

impl Polar {
    /// An empty plot of a radial quantity.
    pub const fn new(quantity: Axis) -> Self {
        Self {
            quantity,
            traces: Vec::new(),
        }
    }

    /// Adds a curve.
    #[must_use]
    pub fn trace(mut self, trace: PolarTrace) -> Self {
        self.traces.push(trace);
        self
    }

    pub(super) fn drawing(&self) -> Drawing {
        let entries: Vec<Entry> = self
            .traces
            .iter()
            .enumerate()
            .map(|(k, trace)| Entry {
                name: trace.name.clone(),
                tone: trace.tone.unwrap_or(k) % TONES,
                line: true,
                filled: false,
                mark: trace.mark,
            })
            .collect();
        let (key, taken) = legend(&entries, 12.0, 8.0, WIDTH - 24.0);
        let (cx, cy) = (0.5 * WIDTH, taken + 2.0 * LINE + 6.0 + RADIUS);
        let domain = self
            .traces
            .iter()
            .map(|t| Domain::of(&t.value, false))
            .fold(Domain::EMPTY, Domain::union);
        let scale = Scale::new(domain, false, 0.04, INNER * RADIUS, RADIUS);
        let ticks = scale.ticks(5, false);
        let title = ticks.title(&self.quantity.quantity, &self.quantity.unit);
        let drawn: Vec<(String, String, Vec<usize>)> = self
            .traces
            .iter()
            .map(|trace| draw(trace, &scale, (cx, cy)))
            .collect();
        let (shown, given) = self
            .traces
            .iter()
            .zip(&drawn)
            .fold((0, 0), |(s, g), (trace, d)| {
                (s + d.2.len(), g + trace.angle.len())
            });
        let body = html! {
            (key)
            g class="axes" {
                @for (value, _) in &ticks.marks {
                    circle class="grid" cx=(c(cx)) cy=(c(cy)) r=(c(scale.at(*value))) {}
                }
                @for k in 0..12 {
                    @let (sin, cos) = (TAU * f64::from(k) / 12.0).sin_cos();
                    path class="grid" d={ "M" (c(cx + INNER * RADIUS * cos)) " " (c(cy - INNER * RADIUS * sin))
                        "L" (c(cx + RADIUS * cos)) " " (c(cy - RADIUS * sin)) } {}
                    @if k % 3 == 0 {
                        text class="middle" x=(c(cx + (RADIUS + 20.0) * cos))
                            y=(c(cy - (RADIUS + 14.0) * sin + 4.5)) { (30 * k) "°" }
                    }
                }
            }
            @for (entry, (line, points, _)) in entries.iter().zip(&drawn) {
                g class={ "t" (entry.tone) } {
                    path class="line" d=(line) {}
                    @if !points.is_empty() { path class=(mark_class(entry.mark)) d=(points) {} }
                }
            }
            // The values along a spoke that no angle label uses.
            @for (value, label) in &ticks.marks {
                @let (sin, cos) = (TAU / 24.0).sin_cos();
                text class="label middle" x=(c(cx + scale.at(*value) * cos))
                    y=(c(cy - scale.at(*value) * sin + 4.5)) { (label) }
            }
            text class="axis middle" x=(c(cx)) y=(c(cy + RADIUS + 40.0)) { (title) }
        };
        // The pointer's scale runs from the centre.
        let (low, high) = scale.bounds();
        let centre = low - (high - low) * INNER / (1.0 - INNER);
        let series: Vec<serde_json::Value> = self
            .traces
            .iter()
            .zip(&drawn)
            .map(|(trace, (_, _, kept))| {
                let pick = |values: &[f64]| -> Vec<serde_json::Value> {
                    kept.iter()
                        .map(|k| {
                            values
                                .get(*k)
                                .copied()
                                .map_or(serde_json::Value::Null, pointed)
                        })
                        .collect()
                };
                json!({ "name": trace.name, "angle": pick(&trace.angle), "r": pick(&trace.value) })
            })
            .collect();
        Drawing {
            size: (WIDTH, cy + RADIUS + 50.0),
            body,
            spans: false,
            alt: format!(
                "{} around the circle: {}",
                self.quantity.quantity,
                entries
                    .iter()
                    .map(|e| e.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            values: Some(json!({
                "kind": "polar",
                "centre": [pointed(cx), pointed(cy)],
                "radius": RADIUS,
                "r": { "low": centre, "high": high, "log": false, "unit": self.quantity.unit },
                "series": series,
            })),
            thinned: (shown < given).then_some(Thinned::Extremes { shown, given }),
        }
    }
}

/// Line, marks and kept points of one trace.
fn draw(trace: &PolarTrace, scale: &Scale, (cx, cy): (f64, f64)) -> (String, String, Vec<usize>) {
    let polar = |k: usize| {
        let (angle, value) = (*trace.angle.get(k)?, *trace.value.get(k)?);
        (drawable(angle, false) && drawable(value, false)).then_some((angle, value))
    };
    let columns = (TAU * RADIUS) as usize;
    let column = |k: usize| polar(k).map(|(a, _)| a.rem_euclid(TAU) / TAU * columns as f64);
    let points = trace.angle.len().min(trace.value.len());
    let kept = thin::kept(points, columns, column, &[&trace.value]);
    let (mut line, mut marks, mut start) = (String::new(), String::new(), true);
    for &k in &kept {
        let Some((angle, value)) = polar(k) else {
            start = true;
            continue;
        };
        let radius = scale.at(value);
        let (x, y) = (cx + radius * angle.cos(), cy - radius * angle.sin());
        point(&mut line, start, x, y);
        mark(&mut marks, trace.mark, x, y);
        start = false;
    }
    (line, marks, kept)
}
