//! The page of a reversal: the tilts first, then the forms, then everything by which a reader can
//! judge them.

mod view;

use std::collections::BTreeSet;

pub use view::{
    Angle, Closure, Contrast, Convergence, Effect, Form, Knots, Residual, Straightness, View,
};

use super::plot::{Axis, Chart, Mark, Panels, Series};
use super::{Cell, Figure, KeyFigure, Page, Section, Standing, Table, number};

/// Microradians in a radian: angles arrive in rad and are shown in µrad.
const URAD: f64 = 1e6;

/// The page of a reversal.
pub fn page(view: &View) -> Page {
    let standing = view.standing.unwrap_or(Standing::Neutral);
    Page::new("Reversal", format!("{} · {}", view.data, view.method))
        .summary(standing, view.summary.clone())
        .section(tilts(view))
        .section(effects(view))
        .section(forms(view))
        .section(straightness(view))
        .section(residuals(view))
        .section(closure(view))
        .section(slopes(view))
        .section(fit(view))
        .section(hidden(view))
        .section(setup(view))
}

fn tilts(view: &View) -> Section {
    let open = view.open.iter().map(|o| format!("Not determined: {o}"));
    let warned = open
        .chain(view.warnings.iter().cloned())
        .fold(Section::new("Tilts"), Section::warning);
    if view.tilts.is_empty() {
        return warned;
    }
    let figures = view.tilts.iter().map(|angle| {
        let figure = KeyFigure::new(greek(&angle.name), angle.value * URAD, "µrad")
            .meaning(angle.meaning.clone());
        match angle.std {
            Some(std) => figure.std(std * URAD),
            None => figure,
        }
    });
    warned
        .key_figures(figures)
        .paragraph("After ±: standard uncertainty (k = 1). 1 µrad is 1 µm over a metre.")
}

fn effects(view: &View) -> Section {
    let section = Section::new("Effects in the fit");
    if view.effects.is_empty() {
        return section;
    }
    let rows = view.effects.iter().map(|e| {
        [
            e.effect.clone().into(),
            e.parameter.clone().into(),
            e.value.clone().into(),
        ]
    });
    section.table(
        Table::new(
            "Fitted along with tilts and forms, with one covariance",
            ["effect", "parameter", "value ± standard uncertainty"],
        )
        .rows(rows),
    )
}

/// Names are spelled out in data and code; a page has room for the letter.
fn greek(name: &str) -> String {
    [("alpha", "α"), ("beta", "β"), ("gamma", "γ"), ("tau", "τ")]
        .iter()
        .fold(name.to_owned(), |text, (word, letter)| {
            text.replace(word, letter)
        })
}

fn coverage(view: &View) -> f64 {
    if view.coverage_factor > 0.0 {
        view.coverage_factor
    } else {
        1.96
    }
}

fn forms(view: &View) -> Section {
    let section = Section::new("Forms");
    if view.forms.is_empty() {
        return section;
    }
    let factor = coverage(view);
    let banded = view.forms.iter().any(|form| !form.std.is_empty());
    let chart = view.forms.iter().fold(
        Chart::new(position(), Axis::new("deviation from straight", "µm")),
        |chart, form| {
            let line = Series::line(form.name.clone(), form.x.clone(), form.value.clone());
            chart.series(if form.std.is_empty() {
                line
            } else {
                line.half_band(form.std.iter().map(|s| factor * s).collect())
            })
        },
    );
    let band = if banded {
        " Bands: 95 % at each position."
    } else {
        ""
    };
    section.figure(Figure::new(
        "Forms of the slide and of the artefact",
        format!(
            "Each form has its least-squares line taken out; its slope belongs to the tilts. \
             M is the slide, S_A and S_B are the artefact's two sides.{band}"
        ),
        chart,
    ))
}

fn position() -> Axis {
    Axis::new("slide position x", "mm")
}

fn straightness(view: &View) -> Section {
    let section = Section::new("Straightness");
    if view.straightness.is_empty() {
        return section;
    }
    let table = Table::new(
        "Highest less lowest deviation from each reference line",
        [
            "form",
            "least-squares line (µm)",
            "end-point line (µm)",
            "minimum zone (µm)",
        ],
    )
    .rows(view.straightness.iter().map(|s| {
        [
            s.form.clone().into(),
            Cell::number(s.least_squares),
            Cell::number(s.end_point),
            Cell::number(s.minimum_zone),
        ]
    }));
    section.table(table)
}

fn residuals(view: &View) -> Section {
    let section = Section::new("Residuals");
    if view.residuals.is_empty() {
        return section;
    }
    let squares: f64 = view.residuals.iter().map(|r| r.residual * r.residual).sum();
    let count = view.residuals.len();
    let rms = (squares / count as f64).sqrt();
    let of_how_many = match view.degrees_of_freedom {
        Some(dof) => format!("of {count} values, {dof} degrees of freedom"),
        None => format!("of {count} values"),
    };
    let mut figures = vec![KeyFigure::new("Residual RMS", rms, "µm").meaning(of_how_many)];
    if let Some(noise) = view.noise_um {
        figures.push(
            KeyFigure::new("Noise of one reading", noise, "µm").meaning(view.noise_source.clone()),
        );
    }
    let mut section = section.key_figures(figures).figure(Figure::new(
        "Residuals by channel",
        "Reading less model, all channels on one scale. A pattern here is something the model \
         does not have.",
        Panels::new(channels(view).into_iter().map(|channel| {
            [false, true]
                .into_iter()
                .filter(|way| view.residuals.iter().any(|r| r.backward == *way))
                .fold(
                    Chart::new(position(), Axis::new("residual", "µm")).titled(channel),
                    |chart, way| chart.series(travel(view, channel, way)),
                )
        })),
    ));
    if !view.channel_noise.is_empty() {
        let rows = view
            .channel_noise
            .iter()
            .map(|(channel, noise)| [channel.clone().into(), Cell::number(*noise)]);
        section = section.table(
            Table::new("Noise of one reading by channel", ["channel", "noise (µm)"]).rows(rows),
        );
    }
    section
}

fn channels(view: &View) -> BTreeSet<&str> {
    view.residuals.iter().map(|r| r.channel).collect()
}

/// The residuals of one channel in one direction of travel, in order of position.
fn travel(view: &View, channel: &str, backward: bool) -> Series {
    let mut readings: Vec<&Residual> = view
        .residuals
        .iter()
        .filter(|r| r.channel == channel && r.backward == backward)
        .collect();
    readings.sort_by(|a, b| a.x.total_cmp(&b.x));
    let (name, mark) = if backward {
        ("backward", Mark::Ring)
    } else {
        ("forward", Mark::Dot)
    };
    Series::points(
        name,
        readings.iter().map(|r| r.x).collect(),
        readings.iter().map(|r| r.residual).collect(),
    )
    .mark(mark)
    .tone(usize::from(backward))
    .extra("repeat", readings.iter().map(|r| r.repeat as f64).collect())
}

fn closure(view: &View) -> Section {
    let section = Section::new("Closure");
    let Some(closure) = &view.closure else {
        return section;
    };
    let meaning = closure.expected_rms.map_or(String::new(), |expected| {
        format!("noise alone gives {} µm", number::plain(expected, 2))
    });
    let section = section
        .paragraph(
            "The combination (1A + 1B − 2A − 2B)/4 of the channels is zero whatever the slide and \
             the artefact look like. What stands here is drift between the two spindle positions, \
             an imperfect half turn, or another effect that the model does not have.",
        )
        .key_figures([KeyFigure::new("Closure RMS", closure.rms, "µm").meaning(meaning)]);
    if closure.x.is_empty() {
        return section;
    }
    section.figure(Figure::new(
        "Closure profile",
        "Zero in a perfect reversal.",
        Chart::new(position(), Axis::new("closure", "µm").including(0.0, 0.0)).series(
            Series::line("closure", closure.x.clone(), closure.value.clone()),
        ),
    ))
}

fn slopes(view: &View) -> Section {
    let section = Section::new("Slopes");
    if view.contrasts.is_empty() {
        return section;
    }
    let table = Table::new(
        "Contrasts of the channels' slopes",
        ["1A 1B 2A 2B", "name", "value (µrad)", "meaning"],
    )
    .rows(view.contrasts.iter().map(|contrast| {
        let value = contrast.value * URAD;
        [
            contrast.signs.replace('-', "−").into(),
            greek(&contrast.name).into(),
            contrast
                .std
                .map_or(Cell::Number { value, digits: 6 }, |std| {
                    Cell::measured(value, std * URAD)
                }),
            contrast.meaning.clone().into(),
        ]
    }));
    section.table(table)
}

fn fit(view: &View) -> Section {
    let mut section = Section::new("How the solution was reached");
    if let Some(convergence) = &view.convergence {
        let text = match convergence.costs.len() {
            0 | 1 => sentence(&convergence.reason),
            n => sentence(&format!("{} ({} iterations)", convergence.reason, n - 1)),
        };
        section = if convergence.converged {
            section.paragraph(text)
        } else {
            section.warning(text)
        };
    }
    if let Some(knots) = &view.knots {
        section = section.paragraph(sentence(&knots.reason));
    }
    let charts: Vec<Chart> = [
        view.convergence.as_ref().and_then(convergence_chart),
        view.knots.as_ref().and_then(knots_chart),
    ]
    .into_iter()
    .flatten()
    .collect();
    if !charts.is_empty() {
        section = section.figure(Figure::new(
            "Convergence and choice of knots",
            "Cost: half the weighted sum of squares after each iteration. The criterion balances \
             what is left over against the number of unknowns; the lowest is best.",
            Panels::new(charts).own_scales(),
        ));
    }
    if !view.method_errors.is_empty() {
        let rows = view.method_errors.iter().map(|(name, rms, meaning)| {
            [
                name.clone().into(),
                Cell::number(*rms),
                meaning.clone().into(),
            ]
        });
        section = section.table(
            Table::new(
                "Errors of the method itself",
                ["error", "RMS (µm)", "where it comes from"],
            )
            .rows(rows),
        );
    }
    section
}

/// Words as a sentence of their own.
fn sentence(words: &str) -> String {
    let mut rest = words.chars();
    let first = rest.next().map(char::to_uppercase);
    let mut text: String = first.into_iter().flatten().chain(rest).collect();
    if !text.ends_with('.') {
        text.push('.');
    }
    text
}

fn convergence_chart(convergence: &Convergence) -> Option<Chart> {
    let costs = &convergence.costs;
    let steps = (0..costs.len()).map(|k| k as f64).collect();
    (costs.len() > 1).then(|| {
        Chart::new(
            Axis::new("iteration", "").whole(),
            Axis::new("cost", "").log(),
        )
        .titled("Convergence")
        .series(Series::line("cost", steps, costs.clone()).mark(Mark::Ring))
    })
}

fn knots_chart(knots: &Knots) -> Option<Chart> {
    let counts = knots.tried.iter().map(|(n, _)| *n as f64).collect();
    let values = knots.tried.iter().map(|(_, value)| *value).collect();
    let chart = Chart::new(
        Axis::new("knot intervals", "").whole(),
        Axis::new(knots.criterion.clone(), ""),
    )
    .titled("Choice of the number of knots")
    .series(Series::line(knots.criterion.clone(), counts, values).mark(Mark::Ring));
    let chosen = knots.tried.iter().find(|(n, _)| *n == knots.chosen);
    (knots.tried.len() > 1).then(|| match chosen {
        Some((n, value)) => chart.annotate(*n as f64, *value, format!("used: {n}")),
        None => chart,
    })
}

fn hidden(view: &View) -> Section {
    let section = Section::new("What these data cannot show");
    if view.hidden.is_empty() {
        section
    } else {
        section.list(view.hidden.clone())
    }
}

fn setup(view: &View) -> Section {
    let section = Section::new("Set-up");
    if view.setup.is_empty() {
        section
    } else {
        section.verbatim(view.setup.clone())
    }
}
