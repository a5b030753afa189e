//! The page of a diagnosis: the verdict, how far the gap shrinks, where it lies, what causes it,
//! what it had done to the answer, and what these data cannot show.

mod severity;
mod view;

pub use view::{
    Candidate, Finding, Gap, Group, Hidden, Place, Profile, Residual, Severity, Shift, Size,
    Trials, View,
};

use super::plot::{Axis, Bar, Bars, Chart, HeatMap, HeatMaps, Panels, Series};
use super::{Cell, Figure, KeyFigure, Order, Page, Section, Standing, Table, number};

/// The page of a diagnosis.
pub fn page(view: &View) -> Page {
    let standing = match view.finding {
        Finding::None => Standing::Good,
        Finding::Effect if view.severities.iter().any(|s| s.weak) => Standing::Caution,
        Finding::Effect => Standing::Neutral,
        Finding::Unknown => Standing::Caution,
    };
    Page::new("Diagnosis", view.data.clone())
        .summary(standing, view.statement.clone())
        .section(gap(view))
        .section(residuals(view))
        .section(causes(view))
        .section(severity::section(view))
        .section(places(view))
        .section(shifts(view))
        .section(hidden(view))
        .section(trials(view))
}

/// The page of a fit that effects have joined: nothing is sought, so that there is no verdict and no
/// ladder of evidence.
pub fn with_effects(view: &View) -> Page {
    let mut effects = Section::new("Effects in the fit");
    for effect in &view.candidates {
        let variant = effect.variant.as_deref();
        effects = effects.paragraph(format!(
            "{}{}: {} of it cannot be absorbed by the fit; p {}.",
            effect.effect,
            variant.map_or(String::new(), |variant| format!(" ({variant})")),
            number::percent(effect.visible),
            number::probability(effect.p_value)
        ));
        let parameters = effect.parameters.iter();
        effects = effects.key_figures(parameters.map(|(name, value, std, unit)| {
            KeyFigure::new(name.clone(), *value, unit.clone()).std(*std)
        }));
    }
    Page::new("Fit with effects", view.data.clone())
        .summary(Standing::Neutral, view.statement.clone())
        .section(effects)
        .section(gap(view))
        .section(residuals(view))
        .section(shifts(view))
}

fn gap(view: &View) -> Section {
    let gap = &view.gap;
    let noted = view
        .notes
        .iter()
        .fold(Section::new("The gap"), |section, text| {
            section.note(text.clone())
        });
    if gap.unit.is_empty() {
        return noted;
    }
    let unit = || gap.unit.clone();
    let size = |name: &str, size: &Size| {
        KeyFigure::new(name, size.rms, unit())
            .digits(3)
            .meaning(format!(
                "95 % interval {} to {}",
                number::plain(size.ci95[0], 3),
                number::plain(size.ci95[1], 3)
            ))
    };
    let mut figures = vec![
        size("Gap before", &gap.before),
        size("Gap after", &gap.after),
        KeyFigure::new(format!("Noise of {}", gap.of_what), gap.noise, unit()).digits(3),
    ];
    if view.taken_out.is_empty() {
        figures.remove(1);
    }
    let bar =
        |name: &str, size: &Size| Bar::new(name, size.rms).interval(size.ci95[0], size.ci95[1]);
    let mut bars = Bars::new(Axis::new("gap, root mean square", unit()))
        .bar(bar("before", &gap.before))
        .bar(bar("after", &gap.after).note(shrunk(gap.shrink)));
    if let Some((before, after)) = gap.held_out {
        let shrink = if before > 0.0 {
            1.0 - after / before
        } else {
            0.0
        };
        bars = bars
            .bar(Bar::new("before, held-out repeats", before).faint())
            .bar(
                Bar::new("after, held-out repeats", after)
                    .faint()
                    .note(shrunk(shrink)),
            );
    }
    let section = noted.key_figures(figures);
    if view.taken_out.is_empty() {
        return section;
    }
    section.figure(Figure::new(
        "How far the gap shrinks",
        "What the model misses with the noise of the readings taken out, without and with the \
         effects found. Held-out repeats took no part in finding or fitting them.",
        bars.rule(gap.noise, format!("noise of {}", gap.of_what)),
    ))
}

fn shrunk(share: f64) -> String {
    format!("shrunk by {}", number::percent(share))
}

fn residuals(view: &View) -> Section {
    let section = Section::new("Before and after");
    if view.residuals.is_empty() {
        return section;
    }
    let (quantity, unit) = view.x.clone();
    let maps = unique(view.residuals.iter().map(|r| r.panel.as_str()))
        .into_iter()
        .flat_map(|panel| {
            let rows = in_time(view.residuals.iter().filter(|r| r.panel == panel));
            let mut before = HeatMap::new(format!("{panel} before"), rows.iter().copied());
            let mut after = HeatMap::new(format!("{panel} after"), rows.iter().copied());
            for r in view.residuals.iter().filter(|r| r.panel == panel) {
                if let Some(row) = rows.iter().position(|row| *row == r.row) {
                    before.add(row, r.x, r.before);
                    after.add(row, r.x, r.after);
                }
            }
            if view.taken_out.is_empty() {
                vec![before]
            } else {
                vec![before, after]
            }
        });
    section.figure(Figure::new(
        "Residuals, all on one scale",
        "Each row is one trace, in the order in which they were read. Negative values are hatched. What is left after looks like noise \
         if the effects are right.",
        HeatMaps::new(
            Axis::new(quantity, unit),
            "residual",
            view.gap.unit.clone(),
            maps,
        ),
    ))
}

/// The rows of a panel, the first that was read first.
fn in_time<'a>(residuals: impl Iterator<Item = &'a Residual>) -> Vec<&'a str> {
    let mut begun: Vec<(&str, f64)> = Vec::new();
    for r in residuals {
        match begun.iter_mut().find(|(row, _)| *row == r.row) {
            Some((_, time)) => *time = time.min(r.time),
            None => begun.push((&r.row, r.time)),
        }
    }
    begun.sort_by(|a, b| a.1.total_cmp(&b.1));
    begun.into_iter().map(|(row, _)| row).collect()
}

fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn causes(view: &View) -> Section {
    let mut section = Section::new("Causes");
    if view.candidates.is_empty() {
        return section;
    }
    for group in &view.groups {
        section = section.note(format!(
            "One of: {}. These readings cannot tell them apart. To tell them apart: {}.",
            group.effects.join(", "),
            group.separate
        ));
    }
    for candidate in view.candidates.iter().filter(|c| c.named) {
        let variant = candidate.variant.as_deref();
        section = section.paragraph(format!(
            "{}{}: {}. To confirm: {}.",
            candidate.effect,
            variant.map_or(String::new(), |variant| format!(" ({variant})")),
            candidate.physics,
            candidate.confirm
        ));
        if !candidate.parameters.is_empty() {
            section =
                section.key_figures(candidate.parameters.iter().map(|(name, value, std, unit)| {
                    KeyFigure::new(name.clone(), *value, unit.clone()).std(*std)
                }));
        }
    }
    let mut ladder: Vec<&Candidate> = view.candidates.iter().collect();
    ladder.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let bars = ladder.iter().map(|c| {
        let bar = Bar::new(c.effect.clone(), c.evidence)
            .note(format!("explains {}", number::percent(c.explained)));
        if c.named { bar } else { bar.faint() }
    });
    let rows = ladder.iter().map(|c| {
        [
            c.effect.clone().into(),
            Cell::number(c.evidence),
            Cell::Share(c.explained),
            Cell::Probability(c.p_value),
            Cell::Share(c.visible),
        ]
    });
    section
        .figure(Figure::new(
            "Evidence ladder",
            "Logarithm of the evidence for each effect against none, alone. Filled: named, alone \
             or in a group; outline: not needed. Evidence below zero speaks against the effect.",
            Bars::new(Axis::new("log evidence", "")).bars(bars),
        ))
        .table(
            Table::new(
                "Candidates",
                ["effect", "log evidence", "explains", "p", "visible"],
            )
            .rows(rows)
            .sorted_by(1, Order::Descending),
        )
}

fn places(view: &View) -> Section {
    let section = Section::new("Where the gap lies");
    if view.places.is_empty() {
        return section;
    }
    let rows = view.places.iter().map(|place| {
        [
            format!("{} {}", place.axis, place.value).into(),
            Cell::Share(place.share),
            Cell::Probability(place.p_value),
        ]
    });
    section
        .table(
            Table::new("Places by their share of the gap", ["place", "share", "p"])
                .rows(rows)
                .sorted_by(1, Order::Descending),
        )
        .paragraph("p is corrected for every place looked at. Shares overlap: a reading lies in a channel, at a position and in a repeat at once.")
}

fn shifts(view: &View) -> Section {
    let mut section = Section::new("What the gap had done to the answer");
    if view.taken_out.is_empty() {
        return section;
    }
    if !view.shifts.is_empty() {
        let rows = view.shifts.iter().map(|shift| {
            let cell = |(value, std)| Cell::measured(value, std);
            let name = if shift.unit.is_empty() {
                shift.quantity.clone()
            } else {
                format!("{} ({})", shift.quantity, shift.unit)
            };
            [
                name.into(),
                cell(shift.before),
                cell(shift.after),
                cell(shift.moved),
            ]
        });
        if view.finding == Finding::Unknown || !view.groups.is_empty() {
            section = section.paragraph(format!(
                "With {}, which the readings do not establish.",
                view.taken_out.join(" and ")
            ));
        }
        section = section.table(
            Table::new(
                "The model's quantities without and with the effects",
                ["quantity", "before", "after", "moved by"],
            )
            .rows(rows),
        );
    }
    if !view.profiles.is_empty() {
        let (quantity, unit) = view.x.clone();
        section = section.figure(Figure::new(
            "Profiles without and with the effects",
            "All on one scale.",
            Panels::new(view.profiles.iter().map(|profile| {
                let x = || profile.x.clone();
                Chart::new(
                    Axis::new(quantity.clone(), unit.clone()),
                    Axis::new("deviation", view.gap.unit.clone()),
                )
                .titled(profile.name.clone())
                .series(Series::line("before", x(), profile.before.clone()).tone(1))
                .series(Series::line("after", x(), profile.after.clone()).tone(0))
            })),
        ));
    }
    section
}

fn hidden(view: &View) -> Section {
    let section = Section::new("What hides in the fitted parameters");
    if view.hidden.is_empty() {
        return section;
    }
    let rows = view.hidden.iter().map(|hidden| {
        [
            hidden.effect.clone().into(),
            Cell::Share(hidden.visible),
            hidden
                .detectable
                .as_ref()
                .map_or("at no size".into(), |(size, unit)| {
                    let least = if hidden.at_least { "at least " } else { "" };
                    let shapes =
                        (hidden.by_shape.as_ref()).map_or(String::new(), |s| format!(", {s}"));
                    Cell::from(format!("{least}{} {unit}{shapes}", number::plain(*size, 2)))
                }),
            hidden.harm.clone().into(),
        ]
    });
    section
        .paragraph(
            "An effect with no visible share looks to these readings exactly like other values of the \
             fitted parameters: whether it is there cannot be told from them. What differs from repeat to \
             repeat is taken for noise in part: where a size says at least, it may have to be several times \
             as great.",
        )
        .table(
            Table::new(
                "Effects by what of them can be seen",
                ["effect", "visible", "seen from", "harm when unseen"],
            )
            .rows(rows)
            .sorted_by(1, Order::Ascending),
        )
}

fn trials(view: &View) -> Section {
    let section = Section::new("Blind trials on these data");
    let Some(trials) = &view.trials else {
        return section;
    };
    let headers = ["put in".to_owned()]
        .into_iter()
        .chain(trials.answers.iter().cloned());
    let rows = trials
        .truths
        .iter()
        .zip(&trials.counts)
        .map(|(truth, counts)| {
            [Cell::from(truth.clone())]
                .into_iter()
                .chain(counts.iter().map(|n| Cell::from(*n)))
                .collect::<Vec<_>>()
        });
    section
        .paragraph(
            "Known effects, and none, were put into the structure of these data and diagnosed \
             blind. Rows: what was put in. Columns: what was said.",
        )
        .table(Table::new("Confusion matrix", headers).rows(rows))
}
