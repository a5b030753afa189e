//! Directions about an axis: what stands still around a round part, and what is on the part.

use super::canvas::{Drawing, LINE, TONES, c, fitted, text_width};
use maud::html;

const WIDTH: f64 = 232.0;
const RADIUS: f64 = 46.0;
/// From the part to the foot of an arrow.
const ARROW: f64 = 26.0;

/// One view along the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Dial {
    title: String,
    part: Vec<(String, f64)>,
    around: Vec<(String, f64)>,
}

impl Dial {
    /// A view with nothing in it.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            part: Vec::new(),
            around: Vec::new(),
        }
    }

    /// Marks a direction on the part, degrees counterclockwise from the right.
    #[must_use]
    pub fn on_part(mut self, label: impl Into<String>, degrees: f64) -> Self {
        self.part.push((label.into(), degrees));
        self
    }

    /// Adds what points at the part from a direction, degrees counterclockwise from the right.
    #[must_use]
    pub fn around(mut self, label: impl Into<String>, degrees: f64) -> Self {
        self.around.push((label.into(), degrees));
        self
    }

    fn drawing(&self, tone: usize) -> Drawing {
        let (cx, cy) = (0.5 * WIDTH, 2.0 * LINE + RADIUS + ARROW + 22.0);
        let at = |degrees: f64, radius: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            (cx + radius * cos, cy - radius * sin)
        };
        let arrow = |degrees: f64| {
            let (from, to) = (at(degrees, RADIUS + ARROW), at(degrees, RADIUS + 2.0));
            let (left, right) = (
                at(degrees + 5.0, RADIUS + 10.0),
                at(degrees - 5.0, RADIUS + 10.0),
            );
            format!(
                "M{} {}L{} {}M{} {}L{} {}L{} {}",
                c(from.0),
                c(from.1),
                c(to.0),
                c(to.1),
                c(left.0),
                c(left.1),
                c(to.0),
                c(to.1),
                c(right.0),
                c(right.1)
            )
        };
        // A label beside the foot of its arrow, kept within the drawing.
        let beside = |label: &str, degrees: f64| {
            let (x, y) = at(degrees, RADIUS + ARROW + 14.0);
            let half = 0.5 * text_width(label);
            let out = half * degrees.to_radians().cos();
            ((x + out).clamp(half, WIDTH - half), y + 4.5)
        };
        let body = html! {
            text class="middle" x=(c(cx)) y=(c(LINE)) { (fitted(&self.title, WIDTH)) }
            circle class="frame" cx=(c(cx)) cy=(c(cy)) r=(c(RADIUS)) {}
            @for (label, degrees) in &self.part {
                @let (inner, outer) = (at(*degrees, RADIUS - 7.0), at(*degrees, RADIUS));
                @let (x, y) = at(*degrees, RADIUS - 20.0);
                path class="frame" d={ "M" (c(inner.0)) " " (c(inner.1)) "L" (c(outer.0)) " " (c(outer.1)) } {}
                text class="label middle" x=(c(x)) y=(c(y + 4.5)) { (label) }
            }
            g class={ "t" (tone % TONES) } {
                @for (_, degrees) in &self.around { path class="line" d=(arrow(*degrees)) {} }
            }
            @for (label, degrees) in &self.around {
                @let (x, y) = beside(label, *degrees);
                text class="middle" x=(c(x)) y=(c(y)) { (fitted(label, 0.5 * WIDTH)) }
            }
        };
        let list = |all: &[(String, f64)]| {
            let told = all.iter().map(|(label, d)| format!("{label} at {d}°"));
            told.collect::<Vec<_>>().join(", ")
        };
        Drawing {
            size: (WIDTH, cy + RADIUS + ARROW + 34.0),
            body,
            spans: false,
            alt: format!(
                "{}: {}; on the part {}",
                self.title,
                list(&self.around),
                list(&self.part)
            ),
            values: None,
            thinned: None,
        }
    }
}

/// Views beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Dials(Vec<Dial>);

impl Dials {
    /// These views.
    pub fn new(dials: impl IntoIterator<Item = Dial>) -> Self {
        Self(dials.into_iter().collect())
    }

    pub(super) fn drawings(&self) -> Vec<Drawing> {
        self.0.iter().map(|dial| dial.drawing(0)).collect()
    }
}
