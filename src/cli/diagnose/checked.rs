//! Readings scored against what was sealed before they were taken, in place of a diagnosis.

use std::fmt::Write;

use errsep_models::model::{AnyModel, FittedModel};
use serde_json::json;

use super::Args;
use super::case::{Case, catalogue};
use super::sealed::{SealFile, interval};
use super::words::number;
use crate::cli::{Answer, progress};
use crate::diagnosis::{
    Checked, CheckedEffect, CheckedGap, CheckedNumber, Options, Standing, checked, for_people,
    scaled,
};
use crate::io::source::{Read256, digest_of};
use crate::io::{CsvTable, Message, Status};
use crate::report::number::{fixed, percent};
use crate::report::plot::{Axis, Chart, Series};
use crate::report::{self, Cell, Figure, Page, Section, Table};

impl Case {
    /// The score of the readings against a seal.
    pub(super) fn checked(self, args: &Args, seal: &SealFile) -> Result<Answer, Message> {
        let options = Options {
            seed: args.common.seed,
            ..Options::default()
        };
        let bar = progress("checking", None);
        let found = checked(
            &self.model,
            catalogue(args, &self.model)?,
            &seal.expected,
            &options,
        );
        bar.finish_and_clear();
        let found = found.ok_or_else(|| {
            Message::bad_input("none of these readings was planned")
                .in_file(&args.data)
                .remedy("give the measurement that the seal was made for: the same channels, repeats and directions, within its positions")
        })?;
        let mut notes = self.notes;
        if digest_of(&args.data) == Read256::Digest(seal.data.sha256.clone()) {
            notes.push(
                "The seal rests on these very readings: that they agree with it is no evidence."
                    .to_owned(),
            );
        }
        notes.extend(of_plan(&found));
        let statement = statement(&found);
        let json = json!({
            "schema": "errsep.check/1",
            "model": self.model.name(),
            "statement": statement,
            "sealed": {"sha256": seal.sha256, "date": seal.date, "data": seal.data, "plan": seal.plan},
            "effects": found.effects,
            "quantities": found.quantities,
            "gap": {"unit": found.unit, "without": found.without, "with": found.with},
            "trace": found.trace,
            "notes": notes,
        });
        let mut text = format!(
            "{}: {}, against what was sealed on {}\n\n{statement}\n\n",
            args.data.display(),
            self.readings,
            seal.date
        );
        text += &in_words(&found);
        for note in &notes {
            let _ = writeln!(text, "\nNote: {note}");
        }
        let channels = self.model.channel_names();
        let along = (self.along, self.model.position_unit());
        Ok(Answer {
            text,
            json,
            page: args.common.page(|| {
                page(
                    args,
                    &found,
                    &statement,
                    &notes,
                    &missed(&self.model, &found),
                    along,
                )
            }),
            tables: args
                .common
                .tables(|| vec![table(&self.model, &channels, &found)]),
            inputs: vec![args.data.clone()],
            setup: None,
            seed: Some(args.common.seed),
            status: Status::Done,
        })
    }
}

/// What differs between plan and measurement.
fn of_plan(found: &Checked) -> Option<String> {
    let trace = &found.trace;
    (trace.missing > 0 || trace.not_planned > 0).then(|| {
        format!(
            "{} planned readings are missing and {} readings were not planned: only what was planned is compared.",
            trace.missing, trace.not_planned
        )
    })
}

fn words(standing: Standing) -> &'static str {
    match standing {
        Standing::Stands => "stands: it is there, of the size that was sealed",
        Standing::Changed => "is there, but of another size than was sealed",
        Standing::Gone => "does not stand: nothing of it is there",
        Standing::Untested => "is not tested: these readings could not have shown it",
    }
}

fn statement(found: &Checked) -> String {
    let mut said: Vec<String> = found
        .effects
        .iter()
        .map(|e| format!("{} {}", e.effect, words(e.standing)))
        .collect();
    if said.is_empty() {
        said.push("no cause was sealed".to_owned());
    }
    let gap = if found.with.inside {
        "what the model misses is as it was sealed".to_owned()
    } else {
        let way = if found.with.z > 0.0 { "more" } else { "less" };
        format!(
            "the model misses {way} than was sealed ({} {} RMS): something else has changed",
            number(found.with.found),
            for_people(found.unit)
        )
    };
    format!(
        "{}; {} of the readings lie in their bands, where {} were expected; {gap}.",
        said.join("; "),
        percent(found.trace.coverage),
        percent(found.trace.expected)
    )
}

fn in_words(found: &Checked) -> String {
    let mut text = format!(
        "{:<34} {:<36} {:<14} {:>6}\n",
        "Sealed", "to be found (95 %)", "found", "z"
    );
    for (name, n) in numbers(found) {
        let (scale, _) = scaled(&n.unit);
        let expected = interval(n.sealed, n.found95, &n.unit);
        let _ = writeln!(
            text,
            "  {name:<32} {expected:<36} {:<14} {:>6}",
            number(scale * n.found),
            fixed(n.z, 2)
        );
    }
    for (name, gap) in gaps(found) {
        let expected = interval(gap.sealed, gap.found95, for_people(found.unit));
        let _ = writeln!(
            text,
            "  {name:<32} {expected:<36} {:<14} {:>6}",
            number(gap.found),
            fixed(gap.z, 2)
        );
    }
    let by_channel: Vec<String> = (found.trace.by_channel.iter())
        .map(|(name, part)| format!("{name} {}", percent(*part)))
        .collect();
    let _ = writeln!(
        text,
        "\n{} readings in their bands: {} ({})",
        found.trace.readings,
        percent(found.trace.coverage),
        by_channel.join(", ")
    );
    text
}

fn numbers(found: &Checked) -> Vec<(String, &CheckedNumber)> {
    let of = |e: &'_ CheckedEffect| e.effect.clone();
    let sizes = found.effects.iter().flat_map(|e| {
        let name = of(e);
        e.numbers
            .iter()
            .map(move |n| (format!("{name} {}", n.name), n))
    });
    let quantities = found.quantities.iter().map(|n| (n.name.clone(), n));
    sizes.chain(quantities).collect()
}

fn gaps(found: &Checked) -> Vec<(&'static str, &CheckedGap)> {
    if found.effects.is_empty() {
        return vec![("gap, RMS", &found.with)];
    }
    vec![
        ("gap without the cause, RMS", &found.without),
        ("gap with the cause, RMS", &found.with),
    ]
}

/// By channel: positions, and what the readings there differ by in units of half their band.
type Missed = Vec<(String, Vec<f64>, Vec<f64>)>;

fn missed(model: &AnyModel, found: &Checked) -> Missed {
    let of = |(channel, name): (usize, String)| {
        let own = model.places().iter().zip(&found.missed);
        let own = own.filter(|(p, m)| p.channel == channel && m.is_some());
        let (x, y) = own
            .filter_map(|(p, m)| m.map(|(miss, band)| (p.x, miss / band)))
            .unzip();
        (name, x, y)
    };
    model
        .channel_names()
        .into_iter()
        .enumerate()
        .map(of)
        .collect()
}

fn page(
    args: &Args,
    found: &Checked,
    statement: &str,
    notes: &[String],
    missed: &Missed,
    (along, unit): (&str, &str),
) -> Page {
    let all = found.effects.iter().all(|e| e.standing == Standing::Stands);
    let standing = match (all, found.with.inside) {
        (true, true) => report::Standing::Good,
        (false, false) => report::Standing::Bad,
        _ => report::Standing::Caution,
    };
    let mut table = Table::new(
        "What was sealed and what was found",
        ["number", "sealed, to be found (95 %)", "found", "z"],
    );
    for (name, n) in numbers(found) {
        let (scale, _) = scaled(&n.unit);
        table = table.row([
            Cell::Text(name),
            Cell::Text(interval(n.sealed, n.found95, &n.unit)),
            Cell::number(scale * n.found),
            Cell::number(n.z),
        ]);
    }
    for (name, gap) in gaps(found) {
        table = table.row([
            Cell::Text(name.to_owned()),
            Cell::Text(interval(gap.sealed, gap.found95, for_people(found.unit))),
            Cell::number(gap.found),
            Cell::number(gap.z),
        ]);
    }
    let chart = Chart::new(
        Axis::new(along, unit),
        Axis::new("difference in half bands", ""),
    )
    .horizontal(1.0, "end of the band")
    .horizontal(-1.0, "");
    let chart = missed.iter().fold(chart, |chart, (name, x, y)| {
        chart.series(Series::points(name.clone(), x.clone(), y.clone()))
    });
    let figure = Figure::new(
        "Readings against their bands",
        "What each reading differs by from what was sealed, zeros and set-up fitted anew: 95 % were to lie between the lines.",
        chart,
    );
    let section = Section::new("Against the seal").table(table).figure(figure);
    let section = notes
        .iter()
        .fold(section, |section, note| section.note(note.clone()));
    Page::new(
        "Check of a sealed prediction",
        args.data.display().to_string(),
    )
    .summary(standing, statement)
    .section(section)
}

fn table(model: &AnyModel, channels: &[String], found: &Checked) -> CsvTable {
    let rows: Vec<_> = model.places().iter().zip(&found.missed).collect();
    let numbers = |of: &dyn Fn(&(f64, f64)) -> f64| -> Vec<f64> {
        rows.iter()
            .map(|(_, m)| m.as_ref().map_or(f64::NAN, of))
            .collect()
    };
    CsvTable::new("check.csv")
        .texts(
            "channel",
            rows.iter()
                .map(|(p, _)| channels.get(p.channel).cloned().unwrap_or_default())
                .collect::<Vec<_>>(),
        )
        .numbers(
            "repeat",
            rows.iter()
                .map(|(p, _)| f64::from(p.repeat))
                .collect::<Vec<_>>(),
        )
        .numbers(
            "direction",
            rows.iter().map(|(p, _)| p.direction).collect::<Vec<_>>(),
        )
        .numbers("x", rows.iter().map(|(p, _)| p.x).collect::<Vec<_>>())
        .numbers("difference", numbers(&|m| m.0))
        .numbers("half_band", numbers(&|m| m.1))
}
