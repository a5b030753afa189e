//! Designs side by side, as text, JSON and page.

use std::fmt::Write;

use serde_json::{Value, json};

use super::super::designs::{Common, Promise, ToldApart};
use super::super::{AT_LEAST, Args, effect_size, size};
use crate::report::number::counted;
use crate::report::plot::{Axis, Bar, Bars};
use crate::report::{Cell, Figure, Page, Section, Standing, Table};

/// The letter of a design.
fn letter(place: usize) -> String {
    char::from(b'A' + (place % 26) as u8).to_string()
}

fn letters(places: &[usize]) -> String {
    places
        .iter()
        .map(|k| letter(*k))
        .collect::<Vec<_>>()
        .join(", ")
}

fn duration(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round();
    match (minutes / 60.0).floor() {
        0.0 => format!("{minutes} min"),
        hours => format!("{hours} h {} min", minutes - 60.0 * hours),
    }
}

/// A design in words, without its name.
fn described(p: &Promise) -> String {
    let (forms, slopes) = (&p.determined.forms, &p.determined.slopes);
    format!(
        "{}, {}, {} of the spindle; forms {} of {} ({} to spare), slopes {} of {} ({} to spare); \
         {}, {} ({}, {}, {} set)",
        counted(p.design.channels().len(), "channel"),
        counted(p.design.indicators().len(), "indicator"),
        counted(p.design.positions().len(), "position"),
        forms.rank(),
        forms.unknowns().len(),
        forms.to_spare(),
        slopes.rank(),
        slopes.unknowns().len(),
        slopes.to_spare(),
        counted(p.readings, "reading"),
        duration(p.time.seconds),
        match p.time.passes {
            1 => "1 pass".to_owned(),
            many => format!("{many} passes"),
        },
        counted(p.time.turns, "turn"),
        counted(p.time.settings, "indicator"),
    )
}

/// Rows of a comparison: a name, then a cell a design.
struct Compared {
    heading: &'static str,
    title: &'static str,
    rows: Vec<(String, Vec<String>)>,
}

fn compared(promises: &[Promise]) -> Vec<Compared> {
    let known = |p: &Promise, k: usize| {
        let own = &p.wanted[k];
        own.std
            .map_or_else(|| "-".to_owned(), |std| size(Some(std), own.unit))
    };
    let wanted = promises.first().map_or(&[][..], |p| &p.wanted[..]);
    let uncertainty = wanted.iter().enumerate().map(|(k, w)| {
        (
            w.quantity.clone(),
            promises.iter().map(|p| known(p, k)).collect(),
        )
    });
    let mut names: Vec<&str> = Vec::new();
    for row in promises.iter().flat_map(|p| &p.effects) {
        if !names.contains(&&row.effect[..]) {
            names.push(&row.effect);
        }
    }
    let of = |p: &Promise, name: &str, told: bool| {
        let own = p.effects.iter().find(|e| e.effect == name);
        own.map_or_else(
            || "-".to_owned(),
            |e| effect_size(e, if told { e.identifiable } else { e.detectable }),
        )
    };
    let rows = |told: bool| -> Vec<(String, Vec<String>)> {
        names
            .iter()
            .map(|name| {
                (
                    (*name).to_owned(),
                    promises.iter().map(|p| of(p, name, told)).collect(),
                )
            })
            .collect()
    };
    vec![
        Compared {
            heading: "standard uncertainty",
            title: "Standard uncertainty of what is wanted",
            rows: uncertainty.collect(),
        },
        Compared {
            heading: "effect seen from",
            title: "Smallest size of an effect that is seen",
            rows: rows(false),
        },
        Compared {
            heading: "told apart from",
            title: "Smallest size of an effect that is told from all others",
            rows: rows(true),
        },
    ]
}

/// What a design leaves open, with what to add.
fn open(p: &Promise) -> Vec<String> {
    let open = p.determined.not_determined.iter().map(|n| match &n.remedy {
        Some(remedy) => format!("{}: {}", n.combination, remedy.words),
        None => format!("{}: more than one trace more is needed", n.combination),
    });
    let blind = p.determined.not_seen.join(", ");
    let blind = (!blind.is_empty()).then(|| format!("{blind}: seen by no channel"));
    open.chain(blind).collect()
}

fn told_as_the_least(promises: &[Promise]) -> bool {
    promises.iter().flat_map(|p| &p.effects).any(|e| e.at_least)
}

pub(super) fn text(promises: &[Promise], told: &[ToldApart]) -> String {
    let mut text = format!("{}\n\n", sentence(promises));
    for (k, p) in promises.iter().enumerate() {
        let _ = writeln!(text, "{}  {}: {}", letter(k), p.name, described(p));
        for line in open(p) {
            let _ = writeln!(text, "     not determined: {line}");
        }
    }
    for part in compared(promises) {
        let _ = write!(text, "\n{:<26}", part.heading);
        for k in 0..promises.len() {
            let _ = write!(text, " {:>14}", letter(k));
        }
        text.push('\n');
        for (name, cells) in part.rows {
            let _ = write!(text, "{name:<26}");
            for cell in cells {
                let _ = write!(text, " {cell:>14}");
            }
            text.push('\n');
        }
    }
    if told_as_the_least(promises) {
        let _ = writeln!(text, "{AT_LEAST}");
    }
    text += "\nConfused: one leaves what the other does, up to three times the size that is seen\n";
    for (k, p) in promises.iter().enumerate() {
        let _ = writeln!(text, "  {}  {}", letter(k), pairs(p));
    }
    if promises.len() > 1 {
        text += "\nConfused by one design and told apart by another\n";
        for own in told {
            let _ = writeln!(
                text,
                "  {} / {}: confused by {}, told apart by {}",
                own.pair.0,
                own.pair.1,
                letters(&own.confused_in),
                letters(&own.told_apart_in)
            );
        }
        if told.is_empty() {
            text += "  none\n";
        }
    }
    text
}

fn pairs(p: &Promise) -> String {
    if p.confused.is_empty() {
        return "none".to_owned();
    }
    let words = p.confused.iter().map(|(a, b, _)| format!("{a} / {b}"));
    words.collect::<Vec<_>>().join("; ")
}

pub(super) fn json(promises: &[Promise], told: &[ToldApart], plan: &Common) -> Value {
    let designs: Vec<Value> = promises
        .iter()
        .map(|p| {
            let channels = p.design.channels().iter().map(|c| {
                json!({"channel": c.name, "indicator": c.indicator, "spindle": c.spindle, "side": c.side()})
            });
            let analysis = |a: &errsep_models::reversal::designs::Analysis| {
                json!({"unknowns": a.unknowns(), "found": a.rank(), "to_spare": a.to_spare()})
            };
            let not_determined = p.determined.not_determined.iter().map(|n| {
                json!({"combination": n.combination, "remedy": n.remedy.as_ref().map(|r| &r.words)})
            });
            let confused = p
                .confused
                .iter()
                .map(|(a, b, cosine)| json!({"effects": [a, b], "cosine": cosine}));
            json!({
                "name": p.name,
                "channels": channels.collect::<Vec<_>>(),
                "forms": analysis(&p.determined.forms),
                "slopes": analysis(&p.determined.slopes),
                "not_determined": not_determined.collect::<Vec<_>>(),
                "not_seen": p.determined.not_seen,
                "wanted": p.wanted,
                "readings": p.readings,
                "time": p.time,
                "effects": p.effects,
                "confused": confused.collect::<Vec<_>>(),
            })
        })
        .collect();
    let names = |places: &[usize]| {
        places
            .iter()
            .map(|k| &promises[*k].name)
            .collect::<Vec<_>>()
    };
    let apart: Vec<Value> = told
        .iter()
        .map(|t| {
            json!({
                "effects": [t.pair.0, t.pair.1],
                "confused_in": names(&t.confused_in),
                "told_apart_in": names(&t.told_apart_in),
            })
        })
        .collect();
    json!({"schema": "errsep.plan/2", "costs": plan.costs, "designs": designs, "told_apart": apart})
}

pub(super) fn page(args: &Args, promises: &[Promise], told: &[ToldApart]) -> Page {
    let headings = |first: &str| {
        std::iter::once(first.to_owned())
            .chain((0..promises.len()).map(letter))
            .collect::<Vec<_>>()
    };
    let lines = promises
        .iter()
        .enumerate()
        .map(|(k, p)| format!("{}: {} - {}", letter(k), p.name, described(p)));
    let mut section = Section::new("The designs").list(lines);
    let bar =
        |(k, p): (usize, &Promise)| Bar::new(letter(k), (p.time.seconds / 6.0).round() / 10.0);
    section = section.figure(Figure::new(
        "Time of each design",
        "Passes of the slide, turns of the spindle and indicators set up, by the seconds of the plan.",
        Bars::new(Axis::new("time", "min")).bars(promises.iter().enumerate().map(bar)),
    ));
    for part in compared(promises) {
        let mut table = Table::new(part.title, headings(part.heading));
        for (name, cells) in part.rows {
            let cells = cells.into_iter().map(Cell::Text);
            table = table.row(std::iter::once(Cell::Text(name)).chain(cells));
        }
        section = section.table(table);
    }
    if told_as_the_least(promises) {
        section = section.paragraph(AT_LEAST);
    }
    let mut limits = Section::new("What the designs cannot tell");
    for (k, p) in promises.iter().enumerate() {
        limits = limits
            .paragraph(format!("{}: confused effects: {}", letter(k), pairs(p)))
            .list(open(p));
    }
    if promises.len() > 1 {
        let mut table = Table::new(
            "Confused by one design and told apart by another",
            ["effects", "confused by", "told apart by"],
        );
        for own in told {
            table = table.row([
                Cell::Text(format!("{} / {}", own.pair.0, own.pair.1)),
                Cell::Text(letters(&own.confused_in)),
                Cell::Text(letters(&own.told_apart_in)),
            ]);
        }
        limits = limits.table(table);
    }
    Page::new("Plan", args.plan.display().to_string())
        .summary(Standing::Neutral, sentence(promises))
        .section(section)
        .section(limits)
}

/// Uncertainties within this share of the smallest are the same to people: the quicker design counts.
const AS_GOOD: f64 = 1.01;

/// Which designs determine most of what is wanted, which of them knows the first of it best, and which
/// is quickest.
fn sentence(promises: &[Promise]) -> String {
    let count = |p: &Promise| p.wanted.iter().filter(|w| w.std.is_some()).count();
    let most = promises.iter().map(count).max().unwrap_or(0);
    let able: Vec<usize> = (0..promises.len())
        .filter(|k| count(&promises[*k]) == most)
        .collect();
    let shared = |place: usize| {
        able.iter()
            .all(|k| promises[*k].wanted[place].std.is_some())
    };
    let wanted = promises.first().map_or(&[][..], |p| &p.wanted[..]);
    let Some(place) = (0..wanted.len()).find(|place| most > 0 && shared(*place)) else {
        return match most {
            0 => "None of these designs determines anything of what is wanted.".to_owned(),
            _ => "No design determines all that is wanted, and each another part of it.".to_owned(),
        };
    };
    let known = |k: usize| promises[k].wanted[place].std.unwrap_or(f64::INFINITY);
    let quickest = |of: &mut dyn Iterator<Item = &usize>| {
        let time = |k: &&usize| promises[**k].time.seconds;
        of.min_by(|a, b| time(a).total_cmp(&time(b))).copied()
    };
    let least = able.iter().map(|k| known(*k)).fold(f64::INFINITY, f64::min);
    let best = quickest(&mut able.iter().filter(|k| known(**k) <= AS_GOOD * least));
    let (Some(best), Some(quick)) = (best, quickest(&mut able.iter())) else {
        return String::new();
    };
    let to = |k: usize| {
        let std = size(Some(known(k)), wanted[place].unit);
        format!("to {std} in {}", duration(promises[k].time.seconds))
    };
    let what = if most == wanted.len() {
        "all that is wanted".to_owned()
    } else {
        format!("most of what is wanted, {most} of {}", wanted.len())
    };
    let quantity = &wanted[place].quantity;
    let verb = if able.len() == 1 {
        "determines"
    } else {
        "determine"
    };
    let head = format!("{} {verb} {what}", letters(&able));
    if able.len() == 1 {
        return format!("{head}: {quantity} {}.", to(best));
    }
    let head = format!(
        "{head}. {} knows {quantity} best, {}",
        letter(best),
        to(best)
    );
    if best == quick {
        return format!("{head}, and is done first.");
    }
    format!("{head}; {} is done first, {}.", letter(quick), to(quick))
}
