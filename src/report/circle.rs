//! The page of a circle.

use errsep_models::circle::{Circle, Circularity, Point, Reference, Zone};

use super::plot::{Axis, Chart, Mark, Polar, PolarTrace, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table, number};

/// What the page shows of the fit.
#[derive(Debug, Clone, Copy)]
pub struct CircleView<'a> {
    /// Name of the data.
    pub data: &'a str,
    /// The points, mm.
    pub points: &'a [Point],
    /// The orthogonal-distance circle, mm.
    pub circle: Circle,
    /// Standard uncertainties of centre x, centre y and radius, mm.
    pub std: [f64; 3],
    /// Radial deviations, µm.
    pub residuals_um: &'a [f64],
    /// Standard deviation of the radial deviations, µm, and whether it was given.
    pub noise: (f64, bool),
    /// What the answer says of form, where it does.
    pub form: Option<&'a str>,
    /// What the reader has to weigh.
    pub remarks: &'a [String],
    /// The circularities.
    pub circularity: &'a Circularity,
    /// Other fits by name, mm.
    pub others: &'a [(String, Circle)],
}

/// The page of a circle fit.
#[must_use]
pub fn page(view: &CircleView) -> Page {
    let sentence = match &view.circularity.minimum_zone {
        Ok(zone) => format!(
            "The points lie between two concentric circles {} µm apart (minimum zone).",
            number::plain(zone.width_um, 4)
        ),
        Err(reason) => format!("No minimum zone: {reason}."),
    };
    let standing = if view.circularity.minimum_zone.is_ok() && view.remarks.is_empty() {
        Standing::Good
    } else {
        Standing::Caution
    };
    Page::new("Circle", view.data)
        .summary(standing, sentence)
        .section(fit_section(view))
        .section(circularity_section(view))
        .section(others_section(view))
}

fn fit_section(view: &CircleView) -> Section {
    let c = view.circle;
    let angle: Vec<f64> = view
        .points
        .iter()
        .map(|p| (p.y - c.centre.y).atan2(p.x - c.centre.x))
        .collect();
    let degrees = angle.iter().map(|a| a.to_degrees()).collect();
    let figure = |name: &str, value: f64, std: f64, meaning: &str| {
        KeyFigure::new(name, value, "mm").std(std).meaning(meaning)
    };
    let (noise, given) = view.noise;
    let section = Section::new("Orthogonal-distance fit").key_figures([
        figure(
            "Radius",
            c.radius,
            view.std[2],
            "least squared radial deviations",
        ),
        figure("Centre x", c.centre.x, view.std[0], ""),
        figure("Centre y", c.centre.y, view.std[1], ""),
        KeyFigure::new("Deviation", noise, "µm").meaning(if given {
            "standard deviation of a point, given"
        } else {
            "standard deviation of a point, from the residuals: form and noise together"
        }),
    ]);
    let section = match view.form {
        Some(sentence) => section.note(sentence),
        None => section,
    };
    let section = view
        .remarks
        .iter()
        .fold(section, |section, remark| section.warning(remark.as_str()));
    section.figure(Figure::new(
        "Radial deviations",
        "Each point against its angle about the fitted centre, positive outside.",
        Chart::new(Axis::new("angle", "°"), Axis::new("deviation", "µm"))
            .series(Series::points("points", degrees, view.residuals_um.to_vec()).mark(Mark::Dot)),
    ))
}

fn circularity_section(view: &CircleView) -> Section {
    let mut table = Table::new(
        "Roundness deviation about each reference circle",
        [
            "reference",
            "deviation (µm)",
            "centre x (mm)",
            "centre y (mm)",
            "radius (mm)",
        ],
    );
    for (reference, zone) in zones(view.circularity) {
        table = table.row(match zone {
            Ok(z) => [
                reference.name().into(),
                Cell::number(z.width_um),
                digits(z.centre.x),
                digits(z.centre.y),
                digits(z.radius),
            ],
            Err(reason) => [
                format!("{}: {reason}", reference.name()).into(),
                Cell::Empty,
                Cell::Empty,
                Cell::Empty,
                Cell::Empty,
            ],
        });
    }
    Section::new("Circularity").table(table).figure(Figure::new(
        "Deviations around the circle",
        "The points in order of angle, the deviation enlarged, with the circles of the minimum zone.",
        polar(view),
    ))
}

/// The four references with what each gave.
pub fn zones(c: &Circularity) -> [(Reference, Result<&Zone, String>); 4] {
    let of = |r: &'_ Result<Zone, errsep_models::circle::CircleError>| match r {
        Ok(_) => String::new(),
        Err(e) => e.to_string(),
    };
    [
        (Reference::LeastSquares, Ok(&c.least_squares)),
        (
            Reference::MinimumZone,
            c.minimum_zone.as_ref().map_err(|_| of(&c.minimum_zone)),
        ),
        (
            Reference::MaximumInscribed,
            c.maximum_inscribed
                .as_ref()
                .map_err(|_| of(&c.maximum_inscribed)),
        ),
        (
            Reference::MinimumCircumscribed,
            c.minimum_circumscribed
                .as_ref()
                .map_err(|_| of(&c.minimum_circumscribed)),
        ),
    ]
}

fn polar(view: &CircleView) -> Polar {
    let c = view.circle;
    let mut order: Vec<(f64, f64)> = view
        .points
        .iter()
        .zip(view.residuals_um)
        .map(|(p, r)| ((p.y - c.centre.y).atan2(p.x - c.centre.x), *r))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (angle, value) = order.into_iter().unzip();
    let mut plot = Polar::new(Axis::new("deviation", "µm"))
        .trace(PolarTrace::new("points", angle, value).mark(Mark::Dot));
    if let Ok(zone) = &view.circularity.minimum_zone {
        let shift = (
            1e3 * (zone.centre.x - c.centre.x),
            1e3 * (zone.centre.y - c.centre.y),
        );
        for (name, radius) in [("zone, inner", zone.inner), ("zone, outer", zone.outer)] {
            plot = plot.trace(PolarTrace::circle(name, 1e3 * (radius - c.radius), shift));
        }
    }
    plot
}

fn others_section(view: &CircleView) -> Section {
    let mut table = Table::new(
        "Other fits less the orthogonal one",
        ["fit", "centre x (µm)", "centre y (µm)", "radius (µm)"],
    );
    for (name, other) in view.others {
        table = table.row([
            name.as_str().into(),
            Cell::number(1e3 * (other.centre.x - view.circle.centre.x)),
            Cell::number(1e3 * (other.centre.y - view.circle.centre.y)),
            Cell::number(1e3 * (other.radius - view.circle.radius)),
        ]);
    }
    Section::new("Beside the algebraic fits")
        .table(table)
        .note("The Kåsa fit shrinks short arcs; the fit of NISTIR 6868, appendix F, ends at it.")
}

fn digits(value: f64) -> Cell {
    Cell::Number { value, digits: 8 }
}
