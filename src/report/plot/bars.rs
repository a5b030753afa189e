//! Horizontal bars: budgets, shares, evidence.

use super::canvas::{Area, Drawing, Frame, c, fitted, text_width};
use super::chart::Axis;
use super::scale::{Domain, Scale, drawable};
use crate::report::number::plain;
use maud::{Markup, html};

const ROW: f64 = 27.0;
const NAMES: f64 = 240.0;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    name: String,
    value: f64,
    interval: Option<(f64, f64)>,
    note: String,
    strong: bool,
}

impl Bar {
    /// A bar from zero to a value.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value,
            interval: None,
            note: String::new(),
            strong: true,
        }
    }

    /// Adds whiskers.
    #[must_use]
    pub const fn interval(mut self, low: f64, high: f64) -> Self {
        self.interval = Some((low, high));
        self
    }

    /// Words after the value.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the bar in outline only: a candidate that was not chosen.
    #[must_use]
    pub const fn faint(mut self) -> Self {
        self.strong = false;
        self
    }
}

/// Bars under each other on one scale, in the order given.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    axis: Axis,
    bars: Vec<Bar>,
    rules: Vec<(f64, String)>,
    width: f64,
}

/// Width of a small chart: on a telephone its text is hardly smaller than that of the page.
const SMALL: f64 = 420.0;

impl Bars {
    /// An empty chart of a quantity.
    pub const fn new(axis: Axis) -> Self {
        Self {
            axis,
            bars: Vec::new(),
            rules: Vec::new(),
            width: Frame::WIDE.width,
        }
    }

    /// A chart that is read at a glance, on a telephone without being moved.
    #[must_use]
    pub const fn small(mut self) -> Self {
        self.width = SMALL;
        self
    }

    /// Adds a bar.
    #[must_use]
    pub fn bar(mut self, bar: Bar) -> Self {
        self.bars.push(bar);
        self
    }

    /// Adds bars.
    #[must_use]
    pub fn bars(mut self, bars: impl IntoIterator<Item = Bar>) -> Self {
        self.bars.extend(bars);
        self
    }

    /// Marks a value, such as a threshold.
    #[must_use]
    pub fn rule(mut self, value: f64, label: impl Into<String>) -> Self {
        self.rules.push((value, label.into()));
        self
    }

    pub(super) fn drawing(&self) -> Drawing {
        let width = self.width;
        let domain = self
            .bars
            .iter()
            .flat_map(|bar| {
                [bar.value]
                    .into_iter()
                    .chain(bar.interval.into_iter().flat_map(|(a, b)| [a, b]))
            })
            .chain(self.rules.iter().map(|(value, _)| *value))
            .chain(self.axis.range.into_iter().flat_map(|(a, b)| [a, b]))
            .filter(|v| drawable(*v, false))
            .fold(Domain::EMPTY.with(0.0), Domain::with);
        let names = self
            .bars
            .iter()
            .map(|b| text_width(&b.name))
            .fold(0.0, f64::max);
        // Room for the longest text beside the longest bar.
        let notes = self
            .bars
            .iter()
            .map(|b| text_width(&caption(b)))
            .fold(0.0, f64::max);
        let left = 14.0 + names.min(NAMES);
        let top = if self.rules.is_empty() { 6.0 } else { 24.0 };
        let area = Area {
            left,
            top,
            width: (width - left - 14.0 - notes.min(220.0)).max(120.0),
            height: ROW * self.bars.len().max(1) as f64,
        };
        let x = Scale::new(domain, false, 0.0, area.left, area.right());
        let ticks = x.ticks((area.width / 70.0) as usize, false);
        let title = ticks.title(&self.axis.quantity, &self.axis.unit);
        let zero = x.at(0.0);
        let row = |k: usize| area.top + (k as f64 + 0.5) * ROW;
        let body = html! {
            g class="axes" {
                @for (value, label) in &ticks.marks {
                    @let at = x.at(*value);
                    path class=(if *value == 0.0 { "zero" } else { "grid" })
                        d={ "M" (c(at)) " " (c(area.top)) "V" (c(area.bottom())) } {}
                    text class="middle" x=(c(at)) y=(c(area.bottom() + 18.0)) { (label) }
                }
                text class="axis middle" x=(c(area.left + 0.5 * area.width))
                    y=(c(area.bottom() + 38.0)) { (title) }
            }
            @for (k, bar) in self.bars.iter().enumerate() {
                (draw(bar, row(k), zero, &x))
            }
            @for (value, label) in &self.rules {
                @if drawable(*value, false) {
                    @let at = x.at(*value);
                    path class="rule" d={ "M" (c(at)) " " (c(area.top)) "V" (c(area.bottom())) } {}
                    text class="label middle" x=(c(at)) y="16" { (label) }
                }
            }
            // Over the rules, so that none runs through a number.
            @for (k, bar) in self.bars.iter().enumerate() {
                (words(bar, row(k), zero, &x, &area))
            }
        };
        let told: Vec<String> = self
            .bars
            .iter()
            .map(|bar| format!("{} {}", bar.name, caption(bar)))
            .collect();
        Drawing {
            size: (width, area.bottom() + 48.0),
            body,
            spans: false,
            alt: format!("{title}: {}", told.join("; ")),
            values: None,
            thinned: None,
        }
    }
}

fn caption(bar: &Bar) -> String {
    match bar.note.as_str() {
        "" => plain(bar.value, 3),
        note => format!("{}, {note}", plain(bar.value, 3)),
    }
}

/// Where a bar ends, and its whiskers.
fn reach(bar: &Bar, zero: f64, x: &Scale) -> (f64, Option<(f64, f64)>) {
    let end = if drawable(bar.value, false) {
        x.at(bar.value)
    } else {
        zero
    };
    let whiskers = bar
        .interval
        .filter(|(a, b)| drawable(*a, false) && drawable(*b, false))
        .map(|(a, b)| (x.at(a), x.at(b)));
    (end, whiskers)
}

fn draw(bar: &Bar, y: f64, zero: f64, x: &Scale) -> Markup {
    let (end, whiskers) = reach(bar, zero, x);
    html! {
        rect class=(if bar.strong { "bar" } else { "bar faint" }) x=(c(zero.min(end))) y=(c(y - 8.0))
            width=(c((end - zero).abs())) height="16" {}
        @if let Some((a, b)) = whiskers {
            path class="whisker" d={ "M" (c(a)) " " (c(y - 4.0)) "v8m0 -4H" (c(b)) "m0 -4v8" } {}
        }
    }
}

fn words(bar: &Bar, y: f64, zero: f64, x: &Scale, area: &Area) -> Markup {
    let (end, whiskers) = reach(bar, zero, x);
    let far = whiskers.map_or(end, |(_, b)| end.max(b)).max(zero);
    html! {
        text class="bar-name end" x=(c(area.left - 8.0)) y=(c(y + 4.5)) { (fitted(&bar.name, NAMES)) }
        text class="label" x=(c(far + 6.0)) y=(c(y + 4.5)) { (caption(bar)) }
    }
}
