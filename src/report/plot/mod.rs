//! Plots as SVG with styles by class, so that one drawing serves light and dark screens, print
//! and grey.
//!
//! The drawings are written here and not by a plotting library because those fix colour, size and
//! pixel when they draw: a page that follows the reader's theme, and a script that finds the
//! value under the pointer, need classes and the scales.

mod bars;
mod canvas;
mod chart;
mod dial;
mod draw_chart;
mod heat;
mod pointer;
mod polar;
mod scale;
mod style;
mod thin;

pub use bars::{Bar, Bars};
pub use chart::{Axis, Chart, Mark, Panels, Series};
pub use dial::{Dial, Dials};
pub use heat::{HeatMap, HeatMaps};
pub use polar::{Polar, PolarTrace};

pub(super) use canvas::{Drawing, Thinned};
pub(super) use style::page_style;

use canvas::{Frame, c};
use maud::{Markup, PreEscaped, html};

/// Anything that can stand in a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Plot {
    /// One chart over the whole width.
    Chart(Chart),
    /// Charts beside each other.
    Panels(Panels),
    /// Maps beside each other.
    HeatMaps(HeatMaps),
    /// Deviations around a circle.
    Polar(Polar),
    /// Horizontal bars.
    Bars(Bars),
    /// Directions about an axis, views beside each other.
    Dials(Dials),
}

impl From<Dials> for Plot {
    fn from(dials: Dials) -> Self {
        Self::Dials(dials)
    }
}

impl From<HeatMaps> for Plot {
    fn from(maps: HeatMaps) -> Self {
        Self::HeatMaps(maps)
    }
}

impl From<Polar> for Plot {
    fn from(polar: Polar) -> Self {
        Self::Polar(polar)
    }
}

impl From<Bars> for Plot {
    fn from(bars: Bars) -> Self {
        Self::Bars(bars)
    }
}

impl From<Chart> for Plot {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<Panels> for Plot {
    fn from(panels: Panels) -> Self {
        Self::Panels(panels)
    }
}

impl Plot {
    /// The drawings of the plot, in reading order.
    pub(super) fn drawings(&self) -> Vec<Drawing> {
        match self {
            Self::Chart(chart) => vec![draw_chart::chart(chart, Frame::WIDE)],
            Self::Panels(panels) => draw_chart::panels(panels),
            Self::HeatMaps(maps) => maps.drawings(),
            Self::Polar(polar) => vec![polar.drawing()],
            Self::Bars(bars) => vec![bars.drawing()],
            Self::Dials(dials) => dials.drawings(),
        }
    }

    /// The plot as an SVG file of its own, in light colours on white.
    pub fn to_svg(&self) -> String {
        const GAP: f64 = 12.0;
        let drawings = self.drawings();
        let width = drawings
            .iter()
            .map(|d| d.size.0)
            .fold(Frame::WIDE.width, f64::max);
        // Fill rows from the left, as the page does.
        let mut placed = Vec::with_capacity(drawings.len());
        let (mut x, mut y, mut row) = (0.0, 0.0, 0.0f64);
        let total = if drawings.iter().any(|d| d.size.0 < Frame::WIDE.width) {
            width.max(2.0 * Frame::PANEL.width + GAP)
        } else {
            width
        };
        for drawing in &drawings {
            let (w, h) = drawing.size;
            if x > 0.0 && x + w > total {
                (x, y, row) = (0.0, y + row + GAP, 0.0);
            }
            placed.push((drawing, x, y));
            x += w + GAP;
            row = row.max(h);
        }
        let height = y + row;
        let alt: Vec<&str> = drawings.iter().map(|d| d.alt.as_str()).collect();
        let svg: Markup = html! {
            svg xmlns="http://www.w3.org/2000/svg" class="plot" role="img"
                width=(c(total)) height=(c(height))
                viewBox={ "0 0 " (c(total)) " " (c(height)) } {
                title { (alt.join("; ")) }
                style { (PreEscaped(style::fixed_style())) }
                rect width="100%" height="100%" fill="#ffffff" {}
                @for (drawing, x, y) in &placed {
                    svg x=(c(*x)) y=(c(*y)) width=(c(drawing.size.0)) height=(c(drawing.size.1))
                        viewBox={ "0 0 " (c(drawing.size.0)) " " (c(drawing.size.1)) } {
                        (drawing.body)
                    }
                }
            }
        };
        svg.into_string()
    }
}
