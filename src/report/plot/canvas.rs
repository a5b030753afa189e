//! Small pieces every plot is drawn with: coordinates, text widths, marks, legends.

use super::chart::Mark;
use maud::{Markup, html};
use std::fmt::Write;

/// Height of a line of text, in picture units.
pub(super) const LINE: f64 = 17.0;
/// Mean width of a character of 13-unit text. Wide enough for digits; a proportional font is
/// narrower on average.
pub(super) const CHARACTER: f64 = 7.0;
/// Colours and dashes before they repeat.
pub(super) const TONES: usize = 6;

/// Outer size of a drawing in picture units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Frame {
    /// A drawing over the whole width of the page.
    pub(super) const WIDE: Self = Self {
        width: 760.0,
        height: 380.0,
    };
    /// One of several beside each other.
    pub(super) const PANEL: Self = Self {
        width: 460.0,
        height: 290.0,
    };
}

/// The rectangle of a drawing in which the data are shown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) const fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) const fn bottom(&self) -> f64 {
        self.top + self.height
    }

    pub(super) fn view_box(&self) -> String {
        format!(
            "{} {} {} {}",
            c(self.left),
            c(self.top),
            c(self.width),
            c(self.height)
        )
    }
}

/// One finished drawing.
#[derive(Debug, Clone)]
pub(crate) struct Drawing {
    /// Width and height in picture units.
    pub(crate) size: (f64, f64),
    /// What stands inside the `<svg>` element.
    pub(crate) body: Markup,
    /// Whether it stands over the drawings after it, as their legend.
    pub(crate) spans: bool,
    /// What the drawing shows, for those who do not see it.
    pub(crate) alt: String,
    /// What the pointer reads, if anything.
    pub(crate) values: Option<serde_json::Value>,
    /// Points that were given but not drawn one by one.
    pub(crate) thinned: Option<Thinned>,
}

impl Drawing {
    /// Whether its text can be read on a telephone without moving it.
    pub(in crate::report) fn is_small(&self) -> bool {
        self.size.0 <= Frame::PANEL.width
    }
}

/// How a drawing holds less than the data it was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Thinned {
    /// So many points were drawn; the extremes are among them.
    Extremes { shown: usize, given: usize },
    /// So many cells hold the means of the readings in them.
    Averaged { cells: usize, given: usize },
}

impl Thinned {
    /// Both together; drawings of one figure are thinned in the same way.
    pub(crate) const fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Extremes { shown: a, given: n }, Self::Extremes { shown: b, given: m }) => {
                Self::Extremes {
                    shown: a + b,
                    given: n + m,
                }
            }
            (Self::Averaged { cells: a, given: n }, Self::Averaged { cells: b, given: m }) => {
                Self::Averaged {
                    cells: a + b,
                    given: n + m,
                }
            }
            (first, _) => first,
        }
    }

    /// The sentence that goes into the caption.
    pub(crate) fn words(self) -> String {
        match self {
            Self::Extremes { shown, given } => format!(
                "Thinned for the picture to {shown} of {given} points; the lowest and highest of \
                 every column of pixels are kept."
            ),
            Self::Averaged { cells, given } => {
                format!(
                    "{given} values in {cells} cells of the picture: a cell shows the mean of its values."
                )
            }
        }
    }
}

/// A coordinate with one decimal, which is below what can be seen.
pub(super) fn c(value: f64) -> String {
    let rounded = (value.clamp(-1e6, 1e6) * 10.0).round() / 10.0;
    // Adding zero takes the sign from −0.
    format!("{}", rounded + 0.0)
}

/// Width that a text is given.
pub(super) fn text_width(text: &str) -> f64 {
    CHARACTER * text.chars().count() as f64
}

/// A text cut to what fits into a width, with an ellipsis.
pub(super) fn fitted(text: &str, width: f64) -> String {
    let room = (width / CHARACTER).max(1.0) as usize;
    if text.chars().count() <= room {
        text.to_owned()
    } else {
        text.chars().take(room - 1).chain(['…']).collect()
    }
}

/// Appends a point to path data, starting a stroke or going on with one.
pub(super) fn point(path: &mut String, start: bool, x: f64, y: f64) {
    // Writing to a string cannot fail.
    let _ = write!(path, "{}{} {}", if start { 'M' } else { 'L' }, c(x), c(y));
}

/// Appends a mark centred on a point.
pub(super) fn mark(path: &mut String, mark: Mark, x: f64, y: f64) {
    let (x, y) = (c(x), c(y));
    let _ = match mark {
        Mark::None => Ok(()),
        // A stroke of no length with round caps is a dot.
        Mark::Dot => write!(path, "M{x} {y}h0"),
        Mark::Ring => write!(path, "M{x} {y}m-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0"),
        Mark::Triangle => write!(path, "M{x} {y}m-3.4 2.4h6.8l-3.4 -5.8z"),
        Mark::Square => write!(path, "M{x} {y}m-2.7 -2.7h5.4v5.4h-5.4z"),
        Mark::Cross => write!(path, "M{x} {y}m-2.8 -2.8l5.6 5.6m0 -5.6l-5.6 5.6"),
    };
}

/// Class of a path made of marks.
pub(super) const fn mark_class(mark: Mark) -> &'static str {
    match mark {
        Mark::Dot => "dots",
        _ => "marks",
    }
}

/// One entry of a legend.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) tone: usize,
    pub(super) line: bool,
    pub(super) filled: bool,
    pub(super) mark: Mark,
}

/// A legend in lines of at most `width`, and the height it takes.
pub(super) fn legend(entries: &[Entry], left: f64, top: f64, width: f64) -> (Markup, f64) {
    const SWATCH: f64 = 30.0;
    const GAP: f64 = 18.0;
    let mut places = Vec::with_capacity(entries.len());
    let (mut x, mut line) = (0.0, 0);
    for entry in entries {
        let name = fitted(&entry.name, width - SWATCH - GAP);
        let taken = SWATCH + text_width(&name) + GAP;
        if x > 0.0 && x + taken > width {
            x = 0.0;
            line += 1;
        }
        places.push((entry, name, left + x, top + LINE * (f64::from(line) + 0.5)));
        x += taken;
    }
    let height = if entries.is_empty() {
        0.0
    } else {
        LINE * f64::from(line + 1) + 4.0
    };
    let markup = html! {
        g class="legend" {
            @for (entry, name, x, y) in &places {
                g class={ "t" (entry.tone % TONES) } {
                    @if entry.filled {
                        rect class="band" x=(c(*x)) y=(c(y - 6.0)) width="24" height="12" {}
                    }
                    @if entry.line {
                        path class="line" d={ "M" (c(*x)) " " (c(*y)) "h24" } {}
                    }
                    @if entry.mark != Mark::None {
                        @let data = { let mut d = String::new(); mark(&mut d, entry.mark, x + 12.0, *y); d };
                        path class=(mark_class(entry.mark)) d=(data) {}
                    }
                }
                text x=(c(x + SWATCH)) y=(c(y + 4.5)) { (name) }
            }
        }
    };
    (markup, height)
}

/// A value as the pointer shows it: seven digits are more than a picture resolves.
pub(super) fn pointed(value: f64) -> serde_json::Value {
    if value.is_finite() {
        format!("{value:.6e}")
            .parse::<f64>()
            .map_or(serde_json::Value::Null, Into::into)
    } else {
        serde_json::Value::Null
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_finite() {
        assert_eq!(c(-0.01), "0");
        assert_eq!(c(12.34), "12.3");
        assert_eq!(c(f64::INFINITY), "1000000");
    }

    #[test]
    fn a_long_legend_takes_more_lines() {
        let entry = |name: &str| Entry {
            name: name.to_owned(),
            tone: 0,
            line: true,
            filled: false,
            mark: Mark::None,
        };
        let one = legend(&[entry("a"), entry("b")], 0.0, 0.0, 400.0).1;
        let two = legend(
            &[entry(&"a".repeat(30)), entry(&"b".repeat(30))],
            0.0,
            0.0,
            400.0,
        )
        .1;
        assert!(two > one);
        assert_eq!(fitted("abcdef", 3.0 * CHARACTER), "ab…");
    }
}
