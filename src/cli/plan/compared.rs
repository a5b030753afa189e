//! The plan file of designs that are compared, and the answer side by side.

use std::collections::BTreeMap;
use std::fmt::Write;

use errsep_models::reversal::designs::{Design, SLOPES, Zero};
use serde::Deserialize;
use serde_json::{Value, json};
use toml::Spanned;

use super::designs::{Common, Costs, Promise, ToldApart, promise, told_apart};
use super::{Args, FORMS, LARGEST, LONGEST_TRAVEL, size};
use crate::cli::{Answer, progress};
use crate::io::message::{list, nearest};
use crate::io::reversal::{Angles, channels};
use crate::io::{Message, SetupFile, Status};
use crate::report::plot::{Axis, Bar, Bars};
use crate::report::{Cell, Figure, Page, Section, Standing, Table};

/// More designs than this have no place beside each other.
const MOST_DESIGNS: usize = 8;

/// What is expected where the plan does not say it: α_h, α_v, γ_1, γ_2, cone, µrad.
const SLOPES_EXPECTED: [f64; 5] = [50.0, 50.0, 20.0, 20.0, 0.0];

/// What is done takes so long where the plan does not say it.
const COSTS: Costs = Costs {
    trace: 60.0,
    turn: 30.0,
    indicator: 300.0,
    indicators: 2,
};

/// Longest time of one step, s: a week.
const LONGEST: f64 = 604_800.0;

/// Forms that can be wanted; `S`: the worst known of all sides.
const FORMS_WANTED: [&str; 3] = ["M_h", "M_v", "S"];

const WANTED: [&str; 5] = ["alpha_h", "alpha_v", "M_h", "M_v", "S"];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    noise: Spanned<f64>,
    travel: Spanned<f64>,
    positions: Spanned<usize>,
    repeats: Option<Spanned<u32>>,
    #[serde(default)]
    both_directions: bool,
    slopes: Option<Spanned<[f64; 5]>>,
    forms: Option<Spanned<[f64; 2]>>,
    thickness: Option<Spanned<f64>>,
    #[serde(default)]
    zero: Zeros,
    wanted: Option<Spanned<Vec<String>>>,
    seconds_a_trace: Option<Spanned<f64>>,
    seconds_a_turn: Option<Spanned<f64>>,
    seconds_an_indicator: Option<Spanned<f64>>,
    indicators: Option<Spanned<usize>>,
    design: Option<Spanned<Given>>,
    #[serde(default)]
    channels: BTreeMap<Spanned<String>, Spanned<Angles>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Zeros {
    #[default]
    Reset,
    Kept,
}

/// One design, or several with names.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "design is no list of channels: write design = \"0/0,0/180\", or [[design]] tables with name and channels"
)]
enum Given {
    One(String),
    Several(Vec<Entry>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: Option<String>,
    channels: String,
}

/// Whether a plan names designs.
///
/// # Errors
/// The file is no TOML.
pub(super) fn is_asked(setup: &SetupFile) -> Result<bool, Message> {
    let top: toml::Table = setup.parse()?;
    Ok(top.contains_key("design") || top.contains_key("channels"))
}

/// Compares the designs of a plan.
///
/// # Errors
/// The plan is bad, or a design cannot be fitted or diagnosed.
pub(super) fn run(args: &Args, setup: &SetupFile) -> Result<Answer, Message> {
    let file: File = setup.parse()?;
    let plan = common(setup, &file, args.common.seed)?;
    let designs = designs(setup, &file)?;
    let bar = progress("planning", Some(designs.len() as u64));
    let promises = designs
        .into_iter()
        .map(|(name, design)| {
            let own = promise(name, &design, &plan).map_err(|m| m.in_file(&args.plan));
            bar.inc(1);
            own
        })
        .collect::<Result<Vec<_>, Message>>()?;
    bar.finish_and_clear();
    let told = told_apart(&promises);
    Ok(Answer {
        text: text(&promises, &told),
        json: json(&promises, &told, &plan),
        page: args.common.page(|| page(args, &promises, &told)),
        tables: Vec::new(),
        inputs: vec![args.plan.clone()],
        setup: None,
        seed: Some(args.common.seed),
        status: Status::Done,
    })
}

fn common(setup: &SetupFile, file: &File, seed: u64) -> Result<Common, Message> {
    let above = |value: &Spanned<f64>, name: &str, most: f64, unit: &str| {
        let own = *value.get_ref();
        if own > 0.0 && own <= most {
            return Ok(own);
        }
        let what = format!("{name} = {own} {unit} cannot be planned");
        let remedy = format!("give {name} in {unit}, greater than zero and at most {most}");
        Err(setup.bad(value.span(), what, remedy))
    };
    let seconds = |value: &Option<Spanned<f64>>, name: &str, usual: f64| match value {
        Some(given) if (0.0..=LONGEST).contains(given.get_ref()) => Ok(*given.get_ref()),
        Some(given) => Err(setup.bad(
            given.span(),
            format!("{name} = {} is no time", given.get_ref()),
            "give seconds, zero or more and at most a week",
        )),
        None => Ok(usual),
    };
    if *file.positions.get_ref() < 5 {
        let what = format!("{} positions show no form", file.positions.get_ref());
        return Err(setup.bad(file.positions.span(), what, "give 5 or more"));
    }
    let repeats = file.repeats.as_ref().map_or(1, |r| *r.get_ref());
    let indicators = file
        .indicators
        .as_ref()
        .map_or(COSTS.indicators, |n| *n.get_ref());
    for (none, span, what) in [
        (
            repeats == 0,
            file.repeats.as_ref().map(Spanned::span),
            "no repeat gives no reading",
        ),
        (
            indicators == 0,
            file.indicators.as_ref().map(Spanned::span),
            "no indicator reads nothing",
        ),
    ] {
        if none {
            return Err(setup.bad(span.unwrap_or(0..0), what, "give 1 or more"));
        }
    }
    let within = |values: &[f64], least: f64| values.iter().all(|v| (least..=LARGEST).contains(v));
    if let Some(slopes) = &file.slopes
        && !within(slopes.get_ref(), -LARGEST)
    {
        let remedy = "give alpha_h, alpha_v, gamma_1, gamma_2, cone in urad, finite and below 1e6";
        return Err(setup.bad(slopes.span(), "the expected slopes cannot be", remedy));
    }
    if let Some(forms) = &file.forms
        && !within(forms.get_ref(), 0.0)
    {
        let remedy =
            "give root mean squares of slide and sides in um, zero or greater and below 1e6";
        return Err(setup.bad(forms.span(), "the expected forms cannot be", remedy));
    }
    Ok(Common {
        noise: above(&file.noise, "noise", LARGEST, "um")?,
        travel: above(&file.travel, "travel", LONGEST_TRAVEL, "mm")?,
        positions: *file.positions.get_ref(),
        repeats,
        both_directions: file.both_directions,
        slopes: file
            .slopes
            .as_ref()
            .map_or(SLOPES_EXPECTED, |s| *s.get_ref()),
        forms: file.forms.as_ref().map_or(FORMS, |f| *f.get_ref()),
        thickness: match &file.thickness {
            Some(d) => above(d, "thickness", LARGEST, "mm")?,
            None => 0.0,
        },
        zero: match file.zero {
            Zeros::Reset => Zero::Reset,
            Zeros::Kept => Zero::Kept,
        },
        costs: Costs {
            trace: seconds(&file.seconds_a_trace, "seconds_a_trace", COSTS.trace)?,
            turn: seconds(&file.seconds_a_turn, "seconds_a_turn", COSTS.turn)?,
            indicator: seconds(
                &file.seconds_an_indicator,
                "seconds_an_indicator",
                COSTS.indicator,
            )?,
            indicators,
        },
        wanted: wanted(setup, file)?,
        seed,
    })
}

fn wanted(setup: &SetupFile, file: &File) -> Result<Vec<String>, Message> {
    let Some(given) = &file.wanted else {
        return Ok(WANTED.map(str::to_owned).to_vec());
    };
    let known: Vec<&str> = SLOPES.iter().chain(&FORMS_WANTED).copied().collect();
    for name in given.get_ref() {
        if !known.contains(&&name[..]) {
            let remedy = match nearest(name, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`? Known are {}", list(&known)),
                None => format!("known are {}", list(&known)),
            };
            return Err(setup.bad(given.span(), format!("`{name}` is no quantity"), remedy));
        }
    }
    Ok(given.get_ref().clone())
}

/// The designs with their names.
fn designs(setup: &SetupFile, file: &File) -> Result<Vec<(String, Design)>, Message> {
    let mut designs = Vec::new();
    if !file.channels.is_empty() {
        let design = Design::new(channels(setup, &file.channels)?).map_err(|why| {
            Message::bad_input(why.to_string())
                .in_file(setup.path())
                .remedy("give each channel its own name and angles")
        })?;
        designs.push(("[channels]".to_owned(), design));
    }
    let Some(given) = &file.design else {
        return Ok(designs);
    };
    let entries: Vec<(Option<&str>, &str)> = match given.get_ref() {
        Given::One(channels) => vec![(None, channels)],
        Given::Several(several) => several
            .iter()
            .map(|e| (e.name.as_deref(), &e.channels[..]))
            .collect(),
    };
    for (name, channels) in entries {
        let design = Design::parse(channels).map_err(|why| {
            let remedy = "list indicator/spindle in degrees, such as \"0/0,180/0,0/180,180/180\"";
            setup.bad(given.span(), why.to_string(), remedy)
        })?;
        designs.push((name.unwrap_or(channels).to_owned(), design));
    }
    if designs.is_empty() || designs.len() > MOST_DESIGNS {
        let what = format!("{} designs cannot be compared", designs.len());
        let remedy = format!("give one to {MOST_DESIGNS}");
        return Err(setup.bad(given.span(), what, remedy));
    }
    Ok(designs)
}

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

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
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
            |e| size(if told { e.identifiable } else { e.detectable }, &e.unit),
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

fn text(promises: &[Promise], told: &[ToldApart]) -> String {
    let mut text = String::new();
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

fn json(promises: &[Promise], told: &[ToldApart], plan: &Common) -> Value {
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

fn page(args: &Args, promises: &[Promise], told: &[ToldApart]) -> Page {
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

/// Which design knows the first quantity best, and which is quickest.
fn sentence(promises: &[Promise]) -> String {
    let known: Vec<(usize, f64, f64)> = promises
        .iter()
        .enumerate()
        .filter_map(|(k, p)| Some((k, p.wanted.first()?.std?, p.time.seconds)))
        .collect();
    let quickest = |of: &mut dyn Iterator<Item = &(usize, f64, f64)>| {
        of.min_by(|a, b| a.2.total_cmp(&b.2)).copied()
    };
    let least = known.iter().map(|k| k.1).fold(f64::INFINITY, f64::min);
    let best = quickest(&mut known.iter().filter(|k| k.1 <= AS_GOOD * least));
    let quick = quickest(&mut known.iter());
    let first = promises.first().and_then(|p| p.wanted.first());
    let (Some(best), Some(quick), Some(first)) = (best, quick, first) else {
        return "What is wanted first is determined by none of these designs.".to_owned();
    };
    let to = |own: (usize, f64, f64)| {
        format!(
            "to {} in {}",
            size(Some(own.1), first.unit),
            duration(own.2)
        )
    };
    let text = format!(
        "{} knows {} best, {}",
        letter(best.0),
        first.quantity,
        to(best)
    );
    if best.0 == quick.0 {
        return format!("{text}, and is done first of those that determine it.");
    }
    format!(
        "{text}; of those that determine it {} is done first, {}.",
        letter(quick.0),
        to(quick)
    )
}
