//! The report of a design.

use std::path::Path;

use errsep_models::reversal::designs::{FoundForm, angle_name};

use super::Outcome;
use super::text::{meaning, summary};
use crate::io::Message;
use crate::io::reversal::ReversalSetup;
use crate::io::units::urad_from_rad;
use crate::report::plot::{Axis, Chart, Dial, Dials, Panels, Series};
use crate::report::{Cell, Figure, KeyFigure, Page, Section, Standing, Table};

pub fn page(file: &Path, setup: &ReversalSetup, o: &Outcome) -> Result<Page, Message> {
    let standing = if o.warnings.is_empty() {
        Standing::Good
    } else {
        Standing::Caution
    };
    let page = Page::new("Reversal", format!("{} · simultaneous", file.display()))
        .summary(standing, summary(o))
        .section(slopes(o))
        .section(design(o))
        .section(forms(o))
        .section(residuals(o))
        .section(closures(o));
    Ok(page
        .section(fit(o))
        .section(Section::new("Set-up").verbatim(format!(
            "{}\n# data: {}\n",
            setup.as_toml(),
            o.data.in_words()
        ))))
}

fn slopes(o: &Outcome) -> Section {
    let warned = o
        .warnings
        .iter()
        .fold(Section::new("Slopes"), |section, text| {
            section.warning(text.clone())
        });
    let figures = o.fit.slopes().into_iter().map(|s| {
        KeyFigure::new(greek(&s.name), urad_from_rad(s.value.value), "µrad")
            .std(urad_from_rad(s.value.std))
            .meaning(meaning(&s.name))
    });
    let section = warned
        .key_figures(figures)
        .paragraph("After ±: standard uncertainty (k = 1). 1 µrad is 1 µm over a metre.");
    let rows = o
        .open()
        .into_iter()
        .map(|(what, remedy)| [Cell::from(greek(&what)), remedy.into()]);
    let rows: Vec<[Cell; 2]> = rows.collect();
    if rows.is_empty() {
        return section;
    }
    section.table(
        Table::new(
            "Not determined by these channels",
            [
                "what changes together without any reading changing",
                "what would determine it",
            ],
        )
        .rows(rows),
    )
}

fn greek(name: &str) -> String {
    [
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("cone", "τ"),
        ("kappa", "κ"),
    ]
    .iter()
    .fold(name.to_owned(), |text, (word, letter)| {
        text.replace(word, letter)
    })
}

/// One view along the axis for each position of the spindle.
fn design(o: &Outcome) -> Section {
    let design = &o.fit.design;
    let dials = design.positions().into_iter().map(|position| {
        let title = format!("spindle at {}°", angle_name(position));
        let sides = design.sides().iter().fold(Dial::new(title), |dial, side| {
            dial.on_part(angle_name(*side), side + position)
        });
        let here = design
            .channels()
            .iter()
            .filter(|c| (c.spindle - position).abs() < 0.75);
        here.fold(sides, |dial, c| dial.around(c.name.clone(), c.indicator))
    });
    let rows = design.channels().iter().enumerate().map(|(c, channel)| {
        [
            channel.name.clone().into(),
            Cell::number(channel.indicator),
            Cell::number(channel.spindle),
            Cell::number(design.sides()[design.side_of(c)]),
        ]
    });
    Section::new("Design")
        .figure(Figure::new(
            "Indicators and sides",
            "Seen along the spindle axis, near on the right and top above: arrows are the indicators with \
             their channels, figures inside are the sides of the artefact, which turn with the spindle.",
            Dials::new(dials),
        ))
        .table(
            Table::new(
                "Channels",
                ["channel", "indicator (°)", "spindle (°)", "side seen (°)"],
            )
            .rows(rows),
        )
}

fn position() -> Axis {
    Axis::new("slide position x", "mm")
}

fn forms(o: &Outcome) -> Section {
    let line = |form: &FoundForm| {
        Series::line(form.name.clone(), o.x.clone(), form.values.clone())
            .half_band(form.std.iter().map(|s| o.form_factor(form) * s).collect())
    };
    let is_slide = |form: &&FoundForm| form.name == "M_h" || form.name == "M_v";
    let chart = || Chart::new(position(), Axis::new("deviation from straight", "µm"));
    let planes: Vec<Chart> = o
        .forms
        .iter()
        .filter(is_slide)
        .map(|form| {
            let plane = if form.name == "M_h" {
                "horizontal"
            } else {
                "vertical"
            };
            chart().titled(plane).series(line(form))
        })
        .collect();
    let mut section = Section::new("Forms");
    if !planes.is_empty() {
        section = section.figure(Figure::new(
            "Form of the slide in both planes",
            "Each form has its least-squares line taken out. Bands: 95 % at each position.",
            Panels::new(planes),
        ));
    }
    let others = o.forms.iter().filter(|f| !is_slide(f));
    let sides = others.fold(chart(), |chart, form| chart.series(line(form)));
    section.figure(Figure::new(
        "Forms of the artefact",
        "The sides by their angle on the artefact; sums where the design does not tell them apart.",
        sides,
    ))
}

fn residuals(o: &Outcome) -> Section {
    let charts = o
        .fit
        .design
        .channels()
        .iter()
        .enumerate()
        .map(|(c, channel)| {
            let readings = o.data.observations.readings.iter().zip(&o.fit.residuals);
            let own: Vec<(f64, f64)> = readings
                .filter(|(r, _)| r.channel == c)
                .map(|(r, residual)| (r.x, *residual))
                .collect();
            let (x, y) = own.into_iter().unzip();
            Chart::new(position(), Axis::new("residual", "µm"))
                .titled(channel.name.clone())
                .series(Series::points(channel.name.clone(), x, y))
        });
    Section::new("Residuals").figure(Figure::new(
        "Residuals by channel",
        "Reading less model, all channels on one scale. A pattern here is something the model does not have.",
        Panels::new(charts),
    ))
}

fn closures(o: &Outcome) -> Section {
    let section = Section::new("Closures");
    let mut rows: Vec<[Cell; 4]> = o
        .fit
        .closures
        .iter()
        .map(|c| {
            [
                c.name.clone().into(),
                Cell::number(c.rms),
                Cell::number(c.expected_rms),
                "zero whatever the forms are: drift between traces, an imperfect turn".into(),
            ]
        })
        .collect();
    for slope in &o.fit.position_slopes {
        rows.push([
            format!("{} (µrad)", greek(&slope.name)).into(),
            Cell::measured(
                urad_from_rad(slope.value.value),
                urad_from_rad(slope.value.std),
            ),
            Cell::Empty,
            "slope of a spindle position against the others: zero for rigid parts".into(),
        ]);
    }
    if rows.is_empty() {
        return section.paragraph("No channel is to spare: nothing checks the answer.");
    }
    section.table(
        Table::new(
            "What the channels to spare say",
            ["combination", "rms (µm)", "noise alone (µm)", "meaning"],
        )
        .rows(rows),
    )
}

fn fit(o: &Outcome) -> Section {
    let fit = &o.fit;
    let rows = fit
        .design
        .channels()
        .iter()
        .zip(&fit.by_channel)
        .map(|(channel, own)| {
            [
                channel.name.clone().into(),
                own.readings.into(),
                Cell::number(own.sigma),
                Cell::number(own.rms),
            ]
        });
    Section::new("How the solution was reached")
        .paragraph(format!(
            "{}. {}; {} degrees of freedom.",
            fit.convergence.ending,
            super::text::cells(fit),
            fit.degrees_of_freedom
        ))
        .key_figures([
            KeyFigure::new("Noise of one reading", fit.noise_um, "µm").meaning(o.noise_words())
        ])
        .table(
            Table::new(
                "Channels",
                ["channel", "readings", "noise (µm)", "residual rms (µm)"],
            )
            .rows(rows),
        )
}
