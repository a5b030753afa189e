//! One effect a case.

use std::time::Instant;

use rayon::prelude::*;

use super::{APART, LAWS, ended, known, prepared};
use crate::arguments::Arguments;
use crate::case::Order;
use crate::judge::{OUTCOMES, Outcome, gap_right, outcome, size_off};
use crate::physics::{SOURCES, Source};
use crate::product::{apart, ask};
use crate::seen::Seen;
use crate::table::{print, rate};

/// What answers to a source are right.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    /// In the catalogue.
    Listed,
    /// Not in the catalogue: `unknown` is right.
    Outside,
    /// Four channels cannot show it: `none` is right.
    Absorbed,
}

/// One case and how it was answered.
struct Row {
    source: &'static Source,
    which: usize,
    what: &'static str,
    class: Class,
    outcome: Outcome,
    /// Whether a name with the effect is strong, and one without it, where severity was asked for.
    strong: Option<[bool; 2]>,
    /// Whether the noise is said not to be independent; the maker's is.
    dependent: bool,
    law: &'static str,
    gap: Option<bool>,
    size: Option<bool>,
    /// Whether the certificate tells the effect from all others, where that was asked.
    separable: Option<bool>,
    seconds: f64,
}

impl Row {
    fn right(&self) -> bool {
        self.outcome
            == match self.class {
                Class::Listed => Outcome::Alone,
                Class::Outside => Outcome::Unknown,
                Class::Absorbed => Outcome::Nothing,
            }
    }
}

/// Runs the set and prints its tables.
pub fn run(arguments: &Arguments) -> Result<(), String> {
    let start = Instant::now();
    let known = known()?;
    let class = |source: &Source| {
        if source.absorbed {
            Class::Absorbed
        } else if known.iter().any(|name| name == source.name) {
            Class::Listed
        } else {
            Class::Outside
        }
    };
    let mut orders = Vec::new();
    for seed in arguments.seed..arguments.seed + arguments.cases {
        for source in &SOURCES {
            for which in (0..source.realisations).filter(|k| arguments.wants(source.name, *k)) {
                orders.push((source, which, seed));
            }
        }
    }
    let rows: Result<Vec<Row>, String> = orders
        .par_iter()
        .map(|(source, which, seed)| one(arguments, source, class(source), [*which as u64, *seed]))
        .collect();
    let rows = rows?;
    tables(&rows);
    ended(start, rows.len());
    Ok(())
}

/// Makes a case, has it diagnosed, and tells where the answer is not right.
fn one(
    arguments: &Arguments,
    source: &'static Source,
    class: Class,
    [which, seed]: [u64; 2],
) -> Result<Row, String> {
    let law = LAWS[((seed + which) % LAWS.len() as u64) as usize];
    let which = which as usize;
    let order = Order {
        name: format!("{}/{which}", source.name),
        seed,
        sources: vec![(source, which)],
        law,
        design: arguments.design.1,
        count: arguments.count,
    };
    let case = prepared(arguments, &order)?;
    let said = ask(&case, &[], (arguments.severity, seed));
    let truth = &case.truths[0];
    let judged = said.as_ref().ok();
    let mut row = Row {
        source,
        which,
        what: truth.what,
        class,
        outcome: outcome(&said, source.name),
        strong: judged.filter(|_| arguments.severity > 0).map(|said| {
            let holds = |group: &[String]| group.iter().any(|name| name == source.name);
            [said.is_strong(holds), said.is_strong(|group| !holds(group))]
        }),
        dependent: judged.is_some_and(|said| said.dependent),
        law: law.name(),
        gap: judged
            .filter(|_| class != Class::Absorbed)
            .map(|said| gap_right(said, &case)),
        size: None,
        separable: None,
        seconds: judged.map_or(0.0, |said| said.seconds),
    };
    if row.outcome == Outcome::Alone {
        let off = judged.and_then(|said| size_off(said, &case));
        row.size = off.map(|off| off.abs() <= 2.0);
        if let Some(off) = off.filter(|off| off.abs() > 2.0) {
            println!(
                "--only {}/{which} --seed {seed} --cases 1: {}, {}: its size is off by {off:+.1} u",
                source.name,
                truth.what,
                law.name(),
            );
        }
    }
    let mut separation = String::new();
    if arguments.certificate && class == Class::Listed {
        let seen = Seen::new(&case.schedule, &case.noise);
        let apart = seen.and_then(|seen| apart(&case, &[seen.of(&case.change)])[0]);
        row.separable = Some(apart.is_some_and(|sd| sd >= APART));
        separation = apart.map_or(", not to be told apart".to_owned(), |sd| {
            format!(", {sd:.1} sd apart")
        });
    }
    let words = said.as_ref().map_or_else(
        |what| format!("refused: {what}"),
        |said| format!("{} (p {:.3})", said.in_words(), said.p_value),
    );
    if !row.right() || row.gap == Some(false) {
        println!(
            "--only {}/{which} --seed {seed} --cases 1: {}, {}, shows {:.2} noise{separation}; gap {:.4} for {:.4} µm: {words}",
            source.name,
            truth.what,
            law.name(),
            truth.visible / case.noise.sigma,
            judged.map_or(f64::NAN, |said| said.gap),
            case.gap,
        );
    }
    Ok(row)
}

fn tables(rows: &[Row]) {
    for (class, title) in [
        (Class::Listed, "In the catalogue"),
        (Class::Outside, "Outside the catalogue: `unknown` is right"),
        (Class::Absorbed, "Absorbed by the fit: `none` is right"),
    ] {
        let mine: Vec<&Row> = rows.iter().filter(|row| row.class == class).collect();
        if mine.is_empty() {
            continue;
        }
        println!("\n### {title}");
        overall(&mine, class);
        by_effect(&mine);
        by_realisation(&mine);
        by_law(&mine);
    }
    let mut seconds: Vec<f64> = rows.iter().map(|row| row.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    if let (Some(middle), Some(late)) = (
        seconds.get(seconds.len() / 2),
        seconds.get(seconds.len() * 95 / 100),
    ) {
        println!("\nTime of a diagnosis, median and 95 % quantile: {middle:.1} s, {late:.1} s");
    }
}

fn overall(rows: &[&Row], class: Class) {
    let n = rows.len();
    let count = |outcome| rows.iter().filter(|row| row.outcome == outcome).count();
    let yes = |value: fn(&Row) -> Option<bool>| -> String {
        let told: Vec<bool> = rows.iter().filter_map(|row| value(row)).collect();
        rate(told.iter().filter(|right| **right).count(), told.len())
    };
    let mut lines = vec![
        vec![
            "right".to_owned(),
            rate(rows.iter().filter(|row| row.right()).count(), n),
        ],
        vec![
            "another effect alone".to_owned(),
            rate(count(Outcome::Wrong), n),
        ],
        vec![
            "groups or several without it".to_owned(),
            rate(count(Outcome::WrongGroup), n),
        ],
    ];
    if class == Class::Listed {
        lines.push(vec![
            "a group with it".to_owned(),
            rate(count(Outcome::Group), n),
        ]);
        lines.push(vec![
            "it among several".to_owned(),
            rate(count(Outcome::Among), n),
        ]);
        lines.push(vec![
            "`unknown`".to_owned(),
            rate(count(Outcome::Unknown), n),
        ]);
        lines.push(vec!["`none`".to_owned(), rate(count(Outcome::Nothing), n)]);
        lines.push(vec![
            "size within 2 u, of right answers that state it".to_owned(),
            yes(|row| row.size),
        ]);
        if rows.iter().any(|row| row.strong.is_some()) {
            lines.push(vec![
                "alone or in a group, and strong".to_owned(),
                yes(|row| {
                    let held = matches!(row.outcome, Outcome::Alone | Outcome::Group);
                    row.strong.filter(|_| held).map(|[right, _]| right)
                }),
            ]);
        }
        if rows.iter().any(|row| row.separable.is_some()) {
            let separable: Vec<&&Row> = rows
                .iter()
                .filter(|row| row.separable == Some(true))
                .collect();
            let right = separable.iter().filter(|row| row.right()).count();
            lines.push(vec![
                "right, of those that the certificate tells apart".to_owned(),
                rate(right, separable.len()),
            ]);
        }
    }
    if rows.iter().any(|row| row.strong.is_some()) {
        lines.push(vec![
            "a name without it, strong".to_owned(),
            yes(|row| row.strong.map(|[_, wrong]| wrong)),
        ]);
    }
    let right: Vec<&&Row> = rows.iter().filter(|row| row.right()).collect();
    lines.push(vec![
        "right, and the noise is said not to be independent".to_owned(),
        rate(
            right.iter().filter(|row| row.dependent).count(),
            right.len(),
        ),
    ]);
    if class != Class::Absorbed {
        lines.push(vec![
            "gap before within 15 %".to_owned(),
            yes(|row| row.gap),
        ]);
    }
    print(&["what", "measured (95 % limits)"], &lines);
}

/// Counts of every outcome among some rows.
fn counts(rows: &[&&Row]) -> Vec<String> {
    let count = |outcome| match rows.iter().filter(|row| row.outcome == outcome).count() {
        0 => String::new(),
        n => n.to_string(),
    };
    OUTCOMES
        .iter()
        .map(|(outcome, _)| count(*outcome))
        .collect()
}

fn by_effect(rows: &[&Row]) {
    let mut lines = Vec::new();
    for source in &SOURCES {
        let mine: Vec<&&Row> = rows
            .iter()
            .filter(|row| row.source.name == source.name)
            .collect();
        if !mine.is_empty() {
            let mut line = vec![source.name.to_owned(), mine.len().to_string()];
            line.extend(counts(&mine));
            let of = |value: fn(&Row) -> Option<bool>| {
                let told: Vec<bool> = mine.iter().filter_map(|row| value(row)).collect();
                format!(
                    "{} of {}",
                    told.iter().filter(|right| **right).count(),
                    told.len()
                )
            };
            line.push(of(|row| row.gap));
            line.push(of(|row| row.size));
            lines.push(line);
        }
    }
    let mut head = vec!["put in \\ said", "cases"];
    head.extend(OUTCOMES.iter().map(|(_, name)| *name));
    head.extend(["gap within 15 %", "size within 2 u"]);
    print(&head, &lines);
}

fn by_realisation(rows: &[&Row]) {
    let mut lines = Vec::new();
    for source in &SOURCES {
        for which in 0..source.realisations {
            let mine: Vec<&&Row> = rows
                .iter()
                .filter(|row| row.source.name == source.name && row.which == which)
                .collect();
            if let Some(first) = mine.first() {
                let right = mine.iter().filter(|row| row.right()).count();
                let name = format!("{}/{which}", source.name);
                let wrong = mine
                    .iter()
                    .filter(|row| matches!(row.outcome, Outcome::Wrong | Outcome::WrongGroup));
                lines.push(vec![
                    name,
                    first.what.to_owned(),
                    format!("{right} of {}", mine.len()),
                    wrong.count().to_string(),
                ]);
            }
        }
    }
    print(
        &["realisation", "what it is", "right", "others named"],
        &lines,
    );
}

fn by_law(rows: &[&Row]) {
    let lines: Vec<Vec<String>> = LAWS
        .iter()
        .map(|law| {
            let mine: Vec<&&Row> = rows.iter().filter(|row| row.law == law.name()).collect();
            let right = mine.iter().filter(|row| row.right()).count();
            vec![law.name().to_owned(), rate(right, mine.len())]
        })
        .collect();
    print(&["noise", "right (95 % limits)"], &lines);
}
