//! The page of a run of a turning bar.

use super::plot::{Axis, Chart, Mark, Panels, Polar, PolarTrace, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table};

/// What the page shows, in the units in which it is shown; what there is none of is left empty.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// Name of the data.
    pub data: String,
    /// Whether nothing speaks against the answer.
    pub good: bool,
    /// The sentences a person acts on.
    pub statement: String,
    /// Name, value, standard uncertainty, unit and meaning of the answers.
    pub answers: Vec<(String, f64, f64, String, String)>,
    /// Root mean square of the residuals without and with what was named, µm.
    pub rms: (f64, f64),
    /// Without and with it: position (mm) and residual (µm).
    pub residuals: (Vec<f64>, Vec<f64>, Vec<f64>),
    /// Time (s, or number of the reading), lag (°), its standard uncertainty, speed (turns a minute).
    pub turn: Option<Turn>,
    /// Position (mm) and both parts (µm) of the bar's axis.
    pub axis: (Vec<f64>, Vec<f64>, Vec<f64>),
    /// Sections: name, angle (rad), deviation (µm).
    pub sections: Vec<(String, Vec<f64>, Vec<f64>)>,
    /// Position (mm), form and half of its 95 % band (µm).
    pub form: (Vec<f64>, Vec<f64>, Vec<f64>),
    /// Rivals: name, evidence, explained, p, left (µm), held out (µm).
    pub rivals: Vec<(String, f64, f64, f64, f64, Option<f64>)>,
    /// Sentences on what one indicator cannot tell apart.
    pub not_told: Vec<String>,
    /// Sentences on what remains.
    pub remains: Vec<String>,
}

/// The turn of the spindle.
#[derive(Debug, Clone, Default)]
pub struct Turn {
    /// Axis of the times and its unit.
    pub clock: (String, String),
    /// Times.
    pub time: Vec<f64>,
    /// Behind the steady turn, degrees.
    pub lag: Vec<f64>,
    /// Half of its 95 % band, degrees.
    pub half: Vec<f64>,
    /// Turns in a minute, or in a reading.
    pub speed: Vec<f64>,
    /// Unit of the speed.
    pub speed_unit: String,
    /// Mean speed.
    pub mean: f64,
    /// Place of the greatest lag.
    pub greatest: usize,
}

/// The page.
#[must_use]
pub fn page(view: &View) -> Page {
    let standing = if view.good {
        Standing::Good
    } else {
        Standing::Caution
    };
    Page::new("Bar in a turning spindle", view.data.clone())
        .summary(standing, view.statement.clone())
        .section(answers(view))
        .section(turn(view))
        .section(residuals(view))
        .section(bar(view))
        .section(form(view))
        .section(rivals(view))
        .section(Section::new("What one indicator cannot tell apart").list(view.not_told.clone()))
        .section(Section::new("What remains").list(view.remains.clone()))
}

fn answers(view: &View) -> Section {
    let figures = view
        .answers
        .iter()
        .map(|(name, value, std, unit, meaning)| {
            let figure =
                KeyFigure::new(name.clone(), *value, unit.clone()).meaning(meaning.clone());
            if *std > 0.0 { figure.std(*std) } else { figure }
        });
    Section::new("Answer").key_figures(figures)
}

fn turn(view: &View) -> Section {
    let section = Section::new("How the spindle turned");
    let Some(turn) = &view.turn else {
        return section;
    };
    let (quantity, unit) = &turn.clock;
    let clock = || Axis::new(quantity.clone(), unit.clone());
    let mut lag = Chart::new(clock(), Axis::new("behind a steady turn", "°")).series(
        Series::line("lag", turn.time.clone(), turn.lag.clone()).half_band(turn.half.clone()),
    );
    if let (Some(t), Some(l)) = (turn.time.get(turn.greatest), turn.lag.get(turn.greatest)) {
        lag = lag.annotate(*t, *l, "greatest");
    }
    let speed = Chart::new(clock(), Axis::new("speed", turn.speed_unit.clone()))
        .series(Series::line("speed", turn.time.clone(), turn.speed.clone()))
        .horizontal(turn.mean, "mean");
    section
        .figure(Figure::new(
            "Angle of the spindle against a steady turn",
            "The line of least squares through the angle is taken out: above zero the spindle is behind, where \
             the curve falls it turns faster than on average. Band: 95 % by the noise of the readings; a change \
             of speed within a turn is not in it.",
            lag,
        ))
        .figure(Figure::new(
            "Speed of the spindle",
            "The slope of the curve above, added to the mean speed.",
            speed,
        ))
}

fn residuals(view: &View) -> Section {
    let (x, before, after) = &view.residuals;
    let section = Section::new("What the model leaves");
    if x.is_empty() {
        return section;
    }
    let chart = |title: String, values: &[f64]| {
        Chart::new(
            Axis::new("slide position x", "mm"),
            Axis::new("residual", "µm"),
        )
        .titled(title)
        .series(Series::line("residual", x.clone(), values.to_vec()))
    };
    let rms = |value: f64| super::number::plain(value, 3);
    let mut charts = vec![chart(
        format!("steady turn: {} µm RMS", rms(view.rms.0)),
        before,
    )];
    if !after.is_empty() {
        charts.push(chart(
            format!("with what was found: {} µm RMS", rms(view.rms.1)),
            after,
        ));
    }
    section.figure(Figure::new(
        "Residuals of all readings, on one scale",
        "Reading less model.",
        Panels::new(charts),
    ))
}

fn bar(view: &View) -> Section {
    let mut section = Section::new("The bar");
    let (x, first, second) = &view.axis;
    if !x.is_empty() {
        let along = Chart::new(
            Axis::new("slide position x", "mm"),
            Axis::new("offset of the bar's axis", "µm"),
        )
        .titled("along the travel")
        .series(Series::line("towards side 0", x.clone(), first.clone()))
        .series(Series::line("towards side 90", x.clone(), second.clone()));
        let ends = [0, x.len() - 1];
        let seen = Chart::new(
            Axis::new("towards side 0", "µm").including(0.0, 0.0),
            Axis::new("towards side 90", "µm").including(0.0, 0.0),
        )
        .titled("seen along the spindle axis")
        .series(Series::line(
            "axis of the bar",
            first.clone(),
            second.clone(),
        ))
        .series(Series::points("spindle axis", vec![0.0], vec![0.0]).mark(Mark::Cross))
        .annotate(
            first[ends[0]],
            second[ends[0]],
            format!("{:.0} mm", x[ends[0]]),
        )
        .annotate(
            first[ends[1]],
            second[ends[1]],
            format!("{:.0} mm", x[ends[1]]),
        );
        section = section.figure(Figure::new(
            "Axis of the bar about that of the spindle, e + γx",
            "Side 0 is the side that runs out most at mid travel. Twice the distance from the spindle axis is the run-out there.",
            Panels::new([along, seen]).own_scales(),
        ));
    }
    if !view.sections.is_empty() {
        let polar = view.sections.iter().fold(
            Polar::new(Axis::new("deviation from a circle", "µm")),
            |polar, (name, angle, value)| {
                polar.trace(PolarTrace::new(name.clone(), angle.clone(), value.clone()))
            },
        );
        section = section.figure(Figure::new(
            "Roundness at three places",
            "The harmonics of the section that were fitted, strongly enlarged; the angle is the side of the bar.",
            polar,
        ));
    }
    section
}

fn form(view: &View) -> Section {
    let (x, value, half) = &view.form;
    if x.is_empty() {
        return Section::new("Form");
    }
    Section::new("Form").figure(Figure::new(
        "Form of slide and bar together",
        "Their least-squares line is taken out: its slope is the answer above. Band: 95 % by the noise of the \
         readings; what changes within a turn is not in it.",
        Chart::new(
            Axis::new("slide position x", "mm"),
            Axis::new("deviation", "µm"),
        )
        .series(Series::line("form", x.clone(), value.clone()).half_band(half.clone())),
    ))
}

fn rivals(view: &View) -> Section {
    let rows = view
        .rivals
        .iter()
        .map(|(name, evidence, explained, p, left, held)| {
            [
                name.clone().into(),
                Cell::number(*evidence),
                Cell::Share(*explained),
                Cell::Probability(*p),
                Cell::number(*left),
                held.map_or(Cell::Empty, Cell::number),
            ]
        });
    Section::new("Explanations, weighed").table(
        Table::new(
            "Against a straight bar that turns steadily",
            [
                "explanation",
                "log evidence",
                "explains",
                "p",
                "left (µm RMS)",
                "turns held out (µm RMS)",
            ],
        )
        .rows(rows),
    )
}
