//! The page of a batch: what failed, which effects are named how often, and the range of every quantity.

use std::collections::BTreeMap;
use std::path::Path;

use super::lean::{Lean, without_lists};
use super::parts::{lines_of, part_files};
use super::row::{LeanRow, Status};
use crate::diagnosis::scaled;
use crate::io::Message;
use crate::report::{Cell, Order, Page, Provenance, Section, Standing, Table};

/// Failures that are listed.
const LISTED: usize = 100;

/// A quantity over the campaigns that have it.
#[derive(Default)]
struct Range {
    values: Vec<(f64, String)>,
}

/// What the parts of a folder hold.
#[derive(Default)]
struct Seen {
    campaigns: usize,
    failures: Vec<(String, String)>,
    effects: BTreeMap<String, usize>,
    verdicts: usize,
    /// By the command's schema, name and unit.
    quantities: BTreeMap<(String, String, String), Range>,
}

/// The page of a folder.
///
/// # Errors
/// The parts cannot be read.
pub(super) fn of(list: &Path, folder: &Path) -> Result<String, Message> {
    let mut seen = Seen::default();
    for part in part_files(folder)? {
        lines_of(&part, |line| {
            if let Ok(row) = serde_json::from_str(&without_lists(line)) {
                seen.take(row);
            }
        })?;
    }
    Ok(seen.page(list).render())
}

impl Seen {
    fn take(&mut self, row: LeanRow) {
        self.campaigns += 1;
        if row.status == Status::Failed {
            let why = row.message.clone().unwrap_or_default();
            self.failures.push((row.id.clone(), why));
        }
        let Some(result) = row.result else { return };
        let of_diagnosis = || result.get("diagnosis")?.get("verdict");
        let verdict = match result.get("verdict") {
            None | Some(Lean::Nothing) => of_diagnosis(),
            own => own,
        };
        if let Some(Lean::Texts(effects)) = verdict.and_then(|v| v.get("effects")) {
            self.verdicts += 1;
            for effect in effects {
                *self.effects.entry(effect.clone()).or_default() += 1;
            }
        }
        let schema = result
            .get("schema")
            .and_then(Lean::text)
            .unwrap_or_default();
        self.quantities_of(schema, "", &result, &row.id);
    }

    /// Everything with a value and a unit, by its name in the answer.
    fn quantities_of(&mut self, schema: &str, name: &str, value: &Lean, id: &str) {
        let Lean::Object(members) = value else { return };
        if let (Some(value), Some(unit)) = (
            value.get("value").and_then(Lean::number),
            value.get("unit").and_then(Lean::text),
        ) {
            let (factor, unit) = scaled(unit);
            let key = (schema.to_owned(), name.to_owned(), unit.to_owned());
            let range = self.quantities.entry(key).or_default();
            range.values.push((factor * value, id.to_owned()));
            return;
        }
        for (key, inner) in members {
            let name = if name.is_empty() {
                key.clone()
            } else {
                format!("{name}.{key}")
            };
            self.quantities_of(schema, &name, inner, id);
        }
    }

    fn page(mut self, list: &Path) -> Page {
        let failed = self.failures.len();
        let sentence = match failed {
            0 => format!("{} campaigns, all of them answered.", self.campaigns),
            n => format!(
                "{} campaigns, {n} of them without an answer.",
                self.campaigns
            ),
        };
        let standing = if failed == 0 {
            Standing::Good
        } else {
            Standing::Caution
        };
        let origin = Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: format!("errsep batch {}", list.display()),
            ..Provenance::default()
        };
        let mut page = Page::new("Batch", list.display().to_string())
            .summary(standing, sentence)
            .provenance(origin);
        if failed > 0 {
            let rows = self.failures.iter().take(LISTED);
            let rows = rows.map(|(id, why)| [Cell::Text(id.clone()), Cell::Text(why.clone())]);
            let table = Table::new("Campaigns without an answer", ["campaign", "why"]).rows(rows);
            let mut section = Section::new("Without an answer").table(table);
            if failed > LISTED {
                section = section.note(format!(
                    "The first {LISTED} of {failed}; the rows of the parts have all."
                ));
            }
            page = page.section(section);
        }
        if self.verdicts > 0 {
            page = page.section(self.effects());
        }
        if !self.quantities.is_empty() {
            page = page.section(self.ranges());
        }
        page
    }

    fn effects(&self) -> Section {
        let rows = self.effects.iter().map(|(effect, count)| {
            let share = *count as f64 / self.verdicts as f64;
            [
                Cell::Text(effect.clone()),
                Cell::number(*count as f64),
                Cell::Share(share),
            ]
        });
        let table = Table::new(
            "Effects named, and in how many campaigns",
            ["effect", "campaigns", "share"],
        )
        .rows(rows)
        .sorted_by(1, Order::Descending);
        Section::new("Effects named")
            .paragraph(format!("Of {} diagnoses.", self.verdicts))
            .table(table)
    }

    fn ranges(&mut self) -> Section {
        let mut table = Table::new(
            "Least, median and greatest value, and whose they are",
            [
                "answer",
                "quantity",
                "unit",
                "campaigns",
                "least",
                "of",
                "median",
                "greatest",
                "of ",
            ],
        );
        for ((schema, name, unit), range) in &mut self.quantities {
            let values = &mut range.values;
            values.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (Some(least), Some(most)) = (values.first(), values.last()) else {
                continue;
            };
            let kind = schema.trim_start_matches("errsep.").split('/').next();
            table = table.row([
                Cell::Text(kind.unwrap_or_default().to_owned()),
                Cell::Text(name.clone()),
                Cell::Text(unit.clone()),
                Cell::number(values.len() as f64),
                Cell::number(least.0),
                Cell::Text(least.1.clone()),
                Cell::number(values[values.len() / 2].0),
                Cell::number(most.0),
                Cell::Text(most.1.clone()),
            ]);
        }
        Section::new("Range of every quantity").table(table)
    }
}
