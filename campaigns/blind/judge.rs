//! The judge: counts, intervals and confusion matrices from outcome files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::outcome::Outcome;
use statrs::distribution::{ContinuousCDF, Normal};

/// What the written part of a page stands between.
const MARKS: [&str; 2] = [
    "<!-- written by the campaign -->",
    "<!-- end of what the campaign wrote -->",
];

/// The counts of outcome files as Markdown.
pub fn judged<'a>(files: impl Iterator<Item = &'a str>) -> std::io::Result<String> {
    let mut outcomes = Vec::new();
    for file in files {
        for line in std::fs::read_to_string(file)?.lines() {
            outcomes.push(serde_json::from_str::<Outcome>(line)?);
        }
    }
    let of = |set: &str| -> Vec<&Outcome> { outcomes.iter().filter(|o| o.set == set).collect() };
    let mut text = String::new();
    single(&mut text, &of("single"));
    pairs(&mut text, &of("pairs"));
    withheld(&mut text, &of("withheld"));
    nulls(&mut text, &of("null"));
    small(&mut text, &of("small"));
    Ok(text)
}

/// Puts the text between the marks of a page.
pub fn write_into(page: &str, text: &str) -> std::io::Result<()> {
    let whole = std::fs::read_to_string(page)?;
    let (Some(from), Some(to)) = (whole.find(MARKS[0]), whole.find(MARKS[1])) else {
        return Err(std::io::Error::other(format!(
            "{page} has no `{}`",
            MARKS[0]
        )));
    };
    let head = &whole[..from + MARKS[0].len()];
    std::fs::write(page, format!("{head}\n{text}\n{}", &whole[to..]))
}

/// k of n with the 95 % interval of Wilson (1927).
fn share(k: usize, n: usize) -> String {
    if n == 0 {
        return "—".to_owned();
    }
    let (n_, p, z2) = (n as f64, k as f64 / n as f64, 1.96f64 * 1.96);
    let centre = (p + z2 / (2.0 * n_)) / (1.0 + z2 / n_);
    let reach = 1.96 / (1.0 + z2 / n_) * (p * (1.0 - p) / n_ + z2 / (4.0 * n_ * n_)).sqrt();
    format!(
        "{k} of {n}: {:.1} % ({:.1} to {:.1})",
        100.0 * p,
        100.0 * (centre - reach).max(0.0),
        100.0 * (centre + reach).min(1.0)
    )
}

fn count(outcomes: &[&Outcome], what: impl Fn(&Outcome) -> bool) -> String {
    share(outcomes.iter().filter(|o| what(o)).count(), outcomes.len())
}

fn line(text: &mut String, what: &str, figure: &str, target: &str) {
    let _ = writeln!(text, "| {what} | {figure} | {target} |");
}

fn head(text: &mut String, title: &str) {
    let _ = writeln!(
        text,
        "\n### {title}\n\n| what | measured (95 % interval) | target |\n|---|---|---|"
    );
}

fn single(text: &mut String, outcomes: &[&Outcome]) {
    if outcomes.is_empty() {
        return;
    }
    head(text, "One effect");
    line(
        text,
        "right effect named, alone",
        &count(outcomes, Outcome::right),
        "≥ 98 %",
    );
    line(
        text,
        "named alone but wrong",
        &count(outcomes, Outcome::wrong),
        "≤ 1 %",
    );
    line(
        text,
        "a group with the right effect",
        &count(outcomes, Outcome::in_group),
        "",
    );
    line(
        text,
        "`unknown`",
        &count(outcomes, |o| o.kind == "unknown"),
        "≤ 1 %",
    );
    line(
        text,
        "gap before within 15 %",
        &count(outcomes, |o| (o.gap / o.gap_true - 1.0).abs() < 0.15),
        "≥ 95 %",
    );
    let right: Vec<&Outcome> = outcomes.iter().copied().filter(|o| o.right()).collect();
    let held: Vec<&Outcome> = right
        .iter()
        .copied()
        .filter(|o| o.held_after.is_some())
        .collect();
    let closed =
        |o: &Outcome| matches!((o.held_after, o.held_floor), (Some(a), Some(f)) if a <= 1.2 * f);
    line(
        text,
        "held-out gap after ≤ 1.2 × floor, of right answers",
        &count(&held, closed),
        "≥ 95 %",
    );
    let inside: Vec<bool> = right
        .iter()
        .flat_map(|o| &o.sizes)
        .map(|s| (s.value.abs() - s.truth.abs()).abs() < 2.0 * s.std)
        .collect();
    let hits = inside.iter().filter(|i| **i).count();
    line(
        text,
        "size of the effect within 2 u, of right answers",
        &share(hits, inside.len()),
        "93–97 %",
    );
    seconds(text, outcomes);
    matrix(text, outcomes);
    let _ = writeln!(
        text,
        "\n| effect | size within 2 u | held-out ≤ 1.2 × floor |\n|---|---|---|"
    );
    let names: BTreeSet<String> = right.iter().map(|o| o.name()).collect();
    for name in names {
        let of: Vec<&Outcome> = right.iter().copied().filter(|o| o.name() == name).collect();
        let sizes: Vec<_> = of.iter().flat_map(|o| &o.sizes).collect();
        let hits = sizes
            .iter()
            .filter(|s| (s.value.abs() - s.truth.abs()).abs() < 2.0 * s.std);
        let held: Vec<&Outcome> = of
            .iter()
            .copied()
            .filter(|o| o.held_after.is_some())
            .collect();
        let floors = held.iter().filter(|o| closed(o)).count();
        let _ = writeln!(
            text,
            "| {name} | {} of {} | {floors} of {} |",
            hits.count(),
            sizes.len(),
            held.len()
        );
    }
}

/// Truths against answers.
fn matrix(text: &mut String, outcomes: &[&Outcome]) {
    let answers: BTreeSet<String> = outcomes.iter().map(|o| o.label()).collect();
    let mut rows: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for outcome in outcomes {
        *rows
            .entry(outcome.name())
            .or_default()
            .entry(outcome.label())
            .or_default() += 1;
    }
    let names: Vec<String> = answers.into_iter().collect();
    let _ = writeln!(
        text,
        "\n| put in \\ said | {} |\n|---|{}",
        names.join(" | "),
        "---|".repeat(names.len())
    );
    for (truth, row) in rows {
        let cells: Vec<String> = names
            .iter()
            .map(|n| row.get(n).map_or(String::new(), ToString::to_string))
            .collect();
        let _ = writeln!(text, "| {truth} | {} |", cells.join(" | "));
    }
}

fn pairs(text: &mut String, outcomes: &[&Outcome]) {
    if outcomes.is_empty() {
        return;
    }
    head(text, "Two effects at once");
    line(
        text,
        "exactly both",
        &count(outcomes, Outcome::right),
        "≥ 95 %",
    );
    let told_apart: Vec<&Outcome> = outcomes.iter().copied().filter(|o| !o.alike()).collect();
    line(
        text,
        "exactly both, of those that the readings tell apart at 99 %",
        &count(&told_apart, Outcome::right),
        "",
    );
    line(
        text,
        "both, one of them in a group",
        &count(outcomes, Outcome::in_group),
        "",
    );
    line(
        text,
        "one of them only",
        &count(outcomes, |o| {
            o.kind == "effect" && o.said.len() == 1 && o.truth.contains(&o.said[0])
        }),
        "",
    );
    line(
        text,
        "an effect that is not there",
        &count(outcomes, |o| {
            o.groups.is_empty() && o.said.iter().any(|s| !o.truth.contains(s))
        }),
        "",
    );
    line(
        text,
        "`unknown`",
        &count(outcomes, |o| o.kind == "unknown"),
        "",
    );
    let mut missed: BTreeMap<String, usize> = BTreeMap::new();
    for outcome in outcomes.iter().filter(|o| !o.right() && !o.in_group()) {
        for name in &outcome.truth {
            *missed.entry(name.clone()).or_default() += 1;
        }
    }
    let list: Vec<String> = missed.iter().map(|(n, k)| format!("{n} {k}")).collect();
    let _ = writeln!(
        text,
        "\nEffects in the pairs that were not named exactly: {}.",
        list.join(", ")
    );
}

/// Wall time of a diagnosis; the others of the campaign, and whatever else runs, share the
/// processors with it.
fn seconds(text: &mut String, outcomes: &[&Outcome]) {
    let mut seconds: Vec<f64> = outcomes.iter().map(|o| o.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |part: f64| seconds[(part * (seconds.len() - 1) as f64) as usize];
    line(
        text,
        "time of a diagnosis with others beside it, median and 95 % quantile",
        &format!("{:.1} s, {:.1} s", at(0.5), at(0.95)),
        "10 s",
    );
}

fn withheld(text: &mut String, outcomes: &[&Outcome]) {
    if outcomes.is_empty() {
        return;
    }
    head(text, "The effect withheld from the catalogue");
    line(
        text,
        "`unknown`, or one that the whole catalogue cannot tell from it",
        &count(outcomes, |o| o.kind == "unknown" || o.alias),
        "≥ 95 %",
    );
    line(
        text,
        "`unknown`",
        &count(outcomes, |o| o.kind == "unknown"),
        "",
    );
    line(
        text,
        "another effect blamed",
        &count(outcomes, |o| o.kind == "effect" && !o.alias),
        "≤ 2 %",
    );
    seconds(text, outcomes);
    matrix(text, outcomes);
}

fn nulls(text: &mut String, outcomes: &[&Outcome]) {
    if outcomes.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "\n### Nothing there\n\n| noise | cases | alarms at 1 % | at 5 % | at 10 % | largest distance of the p-values from uniform (Kolmogorov, p) |\n|---|---|---|---|---|---|"
    );
    let laws: BTreeSet<&str> = outcomes.iter().map(|o| o.noise.as_str()).collect();
    for law in laws {
        let mut p: Vec<f64> = outcomes
            .iter()
            .filter(|o| o.noise == law)
            .map(|o| o.p_value)
            .collect();
        p.sort_by(f64::total_cmp);
        let below = |level: f64| share(p.iter().filter(|v| **v <= level).count(), p.len());
        let n = p.len() as f64;
        let distance = p
            .iter()
            .enumerate()
            .map(|(k, v)| (v - k as f64 / n).abs().max((v - (k + 1) as f64 / n).abs()))
            .fold(0.0, f64::max);
        let scaled = distance * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
        // Kolmogorov's series.
        let tail: f64 = (1..50)
            .map(|j| {
                let sign = if j % 2 == 1 { 2.0 } else { -2.0 };
                sign * (-2.0 * f64::from(j * j) * scaled * scaled).exp()
            })
            .sum();
        let _ = writeln!(
            text,
            "| {law} | {} | {} | {} | {} | {distance:.3} (p = {:.2}) |",
            p.len(),
            below(0.01),
            below(0.05),
            below(0.1),
            tail.clamp(0.0, 1.0)
        );
    }
    let _ = writeln!(
        text,
        "\nTargets: 0.5–1.5 % at 1 %, 3.5–6.5 % at 5 %, for white and correlated noise."
    );
}

/// Detection of small effects with one signature against Φ(a|Ê| − √T).
fn small(text: &mut String, outcomes: &[&Outcome]) {
    if outcomes.is_empty() {
        return;
    }
    let Ok(normal) = Normal::new(0.0, 1.0) else {
        return;
    };
    let simple = ["taper", "gain-mismatch", "axis-backlash", "reversal-shift"];
    let _ = writeln!(
        text,
        "\n### Sizes about the smallest that can be seen\n\nEffects of one signature: {}. Signal-to-noise ratio a|Ê| = size / its standard uncertainty; the curve is Φ(a|Ê| − √T) with the threshold T that the diagnosis reports in its smallest detectable size.\n\n| a\u{007c}Ê\u{007c} | cases | detected | by the curve |\n|---|---|---|---|",
        simple.join(", ")
    );
    let mut thresholds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for outcome in outcomes {
        for size in &outcome.sizes {
            if let Some(detectable) = size.detectable {
                thresholds
                    .entry(&size.effect)
                    .or_default()
                    .push(detectable / size.std - 0.8416);
            }
        }
    }
    let mut bins: BTreeMap<usize, (usize, usize, f64)> = BTreeMap::new();
    for outcome in outcomes {
        let Some(size) = outcome
            .sizes
            .first()
            .filter(|s| simple.contains(&s.effect.as_str()))
        else {
            continue;
        };
        let Some(all) = thresholds.get_mut(size.effect.as_str()) else {
            continue;
        };
        all.sort_by(f64::total_cmp);
        let root = all[all.len() / 2];
        let ratio = size.truth.abs() / size.std;
        let bin = bins.entry((ratio as usize).min(12)).or_default();
        bin.0 += 1;
        bin.1 += usize::from(outcome.kind != "none");
        bin.2 += normal.cdf(ratio - root);
    }
    for (bin, (n, seen, expected)) in bins {
        let range = if bin == 12 {
            "12 and more".to_owned()
        } else {
            format!("{bin} to {}", bin + 1)
        };
        let _ = writeln!(
            text,
            "| {range} | {n} | {} | {:.1} % |",
            share(seen, n),
            100.0 * expected / n as f64
        );
    }
    let _ = writeln!(
        text,
        "\nA wrong effect named alone, all effects: {}.",
        count(outcomes, Outcome::wrong)
    );
    matrix(text, outcomes);
}
