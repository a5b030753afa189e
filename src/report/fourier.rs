//! The page of a Fourier separation.

use errsep_models::fourier::{LOST_BELOW, Scan, Separation, determinant};
use errsep_models::uncertainty::coverage_factor;

use super::plot::{Axis, Chart, Mark, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table, number};

/// What the page shows.
#[derive(Debug, Clone, Copy)]
pub struct FourierView<'a> {
    /// Name of the data.
    pub data: &'a str,
    /// The scans.
    pub scans: &'a [Scan],
    /// Length of the section, mm.
    pub length: f64,
    /// The result.
    pub separation: &'a Separation,
    /// Straightness of workpiece and slide.
    pub widths: &'a [Width; 2],
    /// Other ways on the same scans.
    pub methods: &'a [Method],
    /// What the reader has to weigh.
    pub remarks: &'a [String],
}

/// Another way to combine the same scans.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// Name.
    pub name: String,
    /// Standard uncertainty of the profile, root mean square over the positions, µm.
    pub profile_std: f64,
    /// Root mean square over the positions of the difference of its straightness from that of the
    /// answer, µm.
    pub difference: f64,
}

impl Method {
    /// Compares a separation with the answer.
    #[must_use]
    pub fn new(name: String, separation: &Separation, answer: &Separation) -> Self {
        let rms = |sum: f64, count: usize| (sum / count.max(1) as f64).sqrt();
        let apart: f64 = separation
            .straightness
            .iter()
            .zip(&answer.straightness)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        Self {
            name,
            profile_std: rms(
                separation.workpiece_std.iter().map(|u| u * u).sum(),
                separation.workpiece_std.len(),
            ),
            difference: rms(apart, answer.straightness.len()),
        }
    }
}

/// Peak to valley of a profile about its least-squares line, µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Of the profile as found.
    pub value: f64,
    /// Its standard deviation under the error of the profile.
    pub std: f64,
    /// What the error of the profile, once more, adds to it on average.
    pub widening: f64,
    /// Interval with a coverage probability of 95 %, which allows for that.
    pub interval: (f64, f64),
}

impl Width {
    /// "49.65 µm, 95 % interval 44.9 to 48.1 µm (as much noise again would add 1.4 µm)".
    #[must_use]
    pub fn in_words(&self) -> String {
        // Two digits of the uncertainty.
        let decimals = (1.0 - self.std.log10().floor()).clamp(0.0, 6.0) as usize;
        let shown = |value: f64| number::fixed(value, decimals);
        format!(
            "{} µm, {} interval {} to {} µm (as much noise again would add {} µm)",
            shown(self.value),
            number::percent(0.95),
            shown(self.interval.0),
            shown(self.interval.1),
            number::plain(self.widening.max(0.0), 2)
        )
    }
}

/// Coverage factor of the 95 % bands.
fn band(s: &Separation) -> f64 {
    // Degrees of freedom are positive, so that they have a coverage factor.
    coverage_factor(0.95, s.degrees_of_freedom).unwrap_or(f64::NAN)
}

/// The page of a separation.
#[must_use]
pub fn page(view: &FourierView) -> Page {
    let s = view.separation;
    let straight = view.widths[0].in_words();
    let (standing, sentence) = if s.lost.is_empty() && !view.remarks.is_empty() {
        (
            Standing::Caution,
            format!("The workpiece is straight to {straight}; see what is noted below."),
        )
    } else if s.lost.is_empty() {
        (
            Standing::Good,
            format!("The workpiece is straight to {straight}."),
        )
    } else {
        (
            Standing::Caution,
            format!(
                "The workpiece is straight to {straight}, without {} orders that no probe spacing passes.",
                s.lost.len()
            ),
        )
    };
    Page::new("Fourier separation of straightness", view.data)
        .summary(standing, sentence)
        .section(profiles(view))
        .section(orders(view))
        .section(methods(view))
}

fn profiles(view: &FourierView) -> Section {
    let s = view.separation;
    let half: Vec<f64> = s.straightness_std.iter().map(|u| band(s) * u).collect();
    let mut figures = vec![
        KeyFigure::new("Straightness", view.widths[0].value, "µm")
            .std(view.widths[0].std)
            .meaning("workpiece, about its least-squares line"),
        KeyFigure::new("Straightness of the slide", view.widths[1].value, "µm")
            .std(view.widths[1].std)
            .meaning("read point by point: the noise adds to it"),
        KeyFigure::new("Noise of a reading", s.noise.0, "µm"),
    ];
    if let Some(value) = s.height_difference {
        figures.push(
            KeyFigure::new("Height difference", value, "µm")
                .meaning("P2 less P3, slide ending level"),
        );
    }
    if let Some(value) = s.repeatability {
        figures.push(KeyFigure::new("U_sp", value, "µm").meaning("repeatability of the profile"));
    }
    let mut section = Section::new("Profiles").key_figures(figures);
    for remark in view.remarks {
        section = section.warning(remark.as_str());
    }
    let half_of_slide = s.slide_std.iter().map(|u| band(s) * u).collect();
    section
        .paragraph(format!(
            "Straightness of the workpiece: {}. Of the slide: {}.",
            view.widths[0].in_words(),
            view.widths[1].in_words()
        ))
        .figure(Figure::new(
            "Workpiece",
            "Deviation from the least-squares line with the 95 % band of the reading noise.",
            Chart::new(Axis::new("position x", "mm"), Axis::new("deviation", "µm")).series(
                Series::line("workpiece", s.x.clone(), s.straightness.clone()).half_band(half),
            ),
        ))
        .figure(Figure::new(
            "Slide",
            "Mean reading of P1 less the workpiece, with the 95 % band of each point; its slope cannot be told from the workpiece's.",
            Chart::new(Axis::new("position x", "mm"), Axis::new("deviation", "µm"))
                .series(Series::line("slide", s.x.clone(), s.slide.clone()).half_band(half_of_slide)),
        ))
        .note(
            "A height difference between P2 and P3 and a tilt of the workpiece are the same straight \
             line: neither can be told from these readings unless the slide ends level.",
        )
}

fn orders(view: &FourierView) -> Section {
    let s = view.separation;
    let count = s.orders.len();
    let order: Vec<f64> = (1..=count).map(|w| w as f64).collect();
    let mut spacings: Vec<f64> = view.scans.iter().map(|scan| scan.spacing).collect();
    spacings.sort_by(f64::total_cmp);
    spacings.dedup();
    let mut chart = Chart::new(
        Axis::new("order", "undulations per section").whole(),
        Axis::new("determinant |W|", "").log(),
    );
    for &d in &spacings {
        let w = (1..=count)
            .map(|order| determinant(d, view.length, order).max(LOST_BELOW))
            .collect();
        chart = chart.series(Series::line(format!("d = {d} mm"), order.clone(), w).mark(Mark::Dot));
    }
    let amplitude = s
        .orders
        .iter()
        .map(|o| 2.0 * o.coefficient.norm())
        .collect();
    let half = s
        .orders
        .iter()
        .map(|o| band(s) * o.amplitude_std())
        .collect();
    let spectrum = Chart::new(
        Axis::new("order", "undulations per section").whole(),
        Axis::new("amplitude", "µm"),
    )
    .series(Series::line("workpiece", order, amplitude).half_band(half));
    let mut section = Section::new("Orders")
        .figure(Figure::new(
            "What each probe spacing passes",
            "Noise grows as one over the root of the determinant; near zero the order is lost.",
            chart,
        ))
        .figure(Figure::new(
            "Amplitudes of the workpiece",
            "Peak amplitude of each order with its 95 % band.",
            spectrum,
        ));
    if !s.lost.is_empty() {
        let list: Vec<String> = s.lost.iter().map(ToString::to_string).collect();
        section = section.warning(format!(
            "Lost orders: {}. They are zero in the profile; add a probe spacing that passes them.",
            list.join(", ")
        ));
    }
    section
}

fn methods(view: &FourierView) -> Section {
    if view.methods.is_empty() {
        return Section::new("Combination");
    }
    let mut table = Table::new(
        "Other ways on the same scans: standard uncertainty of the profile and difference of its straightness from the answer, both root mean square over the positions",
        ["method", "uncertainty (µm)", "difference (µm)"],
    );
    for method in view.methods {
        table = table.row([
            method.name.as_str().into(),
            Cell::number(method.profile_std),
            Cell::number(method.difference),
        ]);
    }
    Section::new("Combination").table(table)
}
