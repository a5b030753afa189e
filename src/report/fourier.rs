//! The page of a Fourier separation.

use errsep_models::fourier::{LOST_BELOW, Scan, Separation, determinant};
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};

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
    /// The workpiece without its least-squares line, µm.
    pub straightness: &'a [f64],
    /// Uncertainty of the profile by method, µm.
    pub methods: &'a [(String, f64)],
}

/// Greatest less least value.
pub fn peak_to_valley(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if low <= high { high - low } else { 0.0 }
}

/// Coverage factor of the 95 % bands; the normal one where nothing tells the degrees of freedom.
fn band(s: &Separation) -> f64 {
    let degrees = s.degrees_of_freedom.unwrap_or(DegreesOfFreedom::Infinite);
    // Degrees of freedom are positive, so that they have a coverage factor.
    coverage_factor(0.95, degrees).unwrap_or(f64::NAN)
}

/// The page of a separation.
#[must_use]
pub fn page(view: &FourierView) -> Page {
    let s = view.separation;
    let straight = number::plain(peak_to_valley(view.straightness), 3);
    let (standing, sentence) = if s.lost.is_empty() {
        (
            Standing::Good,
            format!("The workpiece is straight to {straight} µm."),
        )
    } else {
        (
            Standing::Caution,
            format!(
                "The workpiece is straight to {straight} µm, without {} orders that no probe spacing passes.",
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
    let half: Vec<f64> = s.workpiece_std.iter().map(|u| band(s) * u).collect();
    let mut figures = vec![
        KeyFigure::new("Straightness", peak_to_valley(view.straightness), "µm")
            .meaning("workpiece, about its least-squares line"),
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
    Section::new("Profiles")
        .key_figures(figures)
        .figure(Figure::new(
            "Workpiece",
            "Deviation from the least-squares line. The 95 % band of the reading noise includes that of the line.",
            Chart::new(Axis::new("position x", "mm"), Axis::new("deviation", "µm")).series(
                Series::line("workpiece", s.x.clone(), view.straightness.to_vec()).half_band(half),
            ),
        ))
        .figure(Figure::new(
            "Slide",
            "Mean reading of P1 less the workpiece; its slope cannot be told from the workpiece's.",
            Chart::new(Axis::new("position x", "mm"), Axis::new("deviation", "µm"))
                .series(Series::line("slide", s.x.clone(), s.slide.clone())),
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
    let half = s.orders.iter().map(|o| band(s) * 2.0 * o.std).collect();
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
        "Standard uncertainty of the profile, root mean square over the positions",
        ["method", "uncertainty (µm)"],
    );
    for (name, u) in view.methods {
        table = table.row([name.as_str().into(), Cell::number(*u)]);
    }
    Section::new("Combination").table(table)
}
