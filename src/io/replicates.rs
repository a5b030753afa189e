//! Reading replicates: one long table of repeated measurements of features of parts.

use std::collections::HashMap;
use std::path::Path;

use super::columns::ColumnMap;
use super::message::Message;
use super::table::{Column, TableReader};

/// Columns whose values together name a feature, in the order of the name.
pub const KEYS: [&str; 6] = ["feature", "table", "quantity", "process", "hole", "axis"];

/// The readings of one feature.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates {
    /// The values of the key columns, joined.
    pub name: String,
    /// The key columns that the table has, with their values.
    pub keys: Vec<(String, String)>,
    /// Unit of the readings.
    pub unit: String,
    /// Parts in the order of their first reading, each with its readings.
    pub parts: Vec<(String, Vec<f64>)>,
    /// The number of the repeat of each of these readings; empty where the table has none.
    pub repeats: Vec<Vec<u32>>,
}

/// Reads a table with the columns `part` and `value`, and where they are known `replicate`, `unit`
/// and any of [`KEYS`]. Features and parts keep the order in which they first occur.
///
/// # Errors
/// A column that is missing or unknown, a field that cannot be read, a reading given twice, a
/// feature in two units, a table without rows.
pub fn read_replicates(path: &Path, map: &ColumnMap) -> Result<Vec<Replicates>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    let known: Vec<&str> = KEYS
        .into_iter()
        .chain(["part", "replicate", "value", "unit"])
        .collect();
    table.only(&known)?;
    let (part, value) = (table.column("part")?, table.column("value")?);
    let (replicate, unit) = (table.optional("replicate"), table.optional("unit"));
    let value = match unit {
        Some(_) => value,
        None => value.in_um(),
    };
    let keys: Vec<Column> = KEYS.iter().filter_map(|key| table.optional(key)).collect();

    let mut features: Vec<Replicates> = Vec::new();
    let mut feature_of = HashMap::new();
    let mut part_of = HashMap::new();
    let mut seen = HashMap::new();
    while let Some(row) = table.next_row()? {
        let reading = row.number(&value)?;
        let part_name = row.text(&part);
        if part_name.is_empty() {
            return Err(row
                .error(&part, "part is missing: the field is empty")
                .remedy("write the number or name of the part, or remove the row"));
        }
        let of_row: Vec<&str> = keys.iter().map(|key| row.text(key)).collect();
        let name = name_of(&of_row);
        let unit_name = unit.as_ref().map_or("um", |unit| row.text(unit));
        let at = *feature_of.entry(name.clone()).or_insert_with(|| {
            features.push(Replicates {
                name: name.clone(),
                keys: keys
                    .iter()
                    .zip(&of_row)
                    .map(|(key, text)| (key.name().to_owned(), (*text).to_owned()))
                    .collect(),
                unit: unit_name.to_owned(),
                parts: Vec::new(),
                repeats: Vec::new(),
            });
            features.len() - 1
        });
        let Some(feature) = features.get_mut(at) else {
            continue;
        };
        if feature.unit != unit_name {
            let what = format!(
                "{name}: the rows before are in {}, this one is in {unit_name}",
                feature.unit
            );
            return Err(row
                .error(unit.as_ref().unwrap_or(&part), what)
                .remedy("convert the readings of a feature to one unit"));
        }
        let mut repeat = None;
        if let Some(column) = &replicate {
            let number = row.count(column)?;
            if let Some(line) = seen.insert((at, part_name.to_owned(), number), row.line()) {
                let what = format!("replicate {number} of part {part_name} stands on line {line}");
                return Err(row
                    .error(column, what)
                    .remedy("number the repeats of a part 1, 2, 3, …, or remove one of the rows"));
            }
            repeat = Some(number);
        }
        let group = *part_of
            .entry((at, part_name.to_owned()))
            .or_insert_with(|| {
                feature.parts.push((part_name.to_owned(), Vec::new()));
                feature.parts.len() - 1
            });
        if let Some((_, readings)) = feature.parts.get_mut(group) {
            readings.push(reading);
        }
        if let Some(number) = repeat {
            feature.repeats.resize(feature.parts.len(), Vec::new());
            if let Some(numbers) = feature.repeats.get_mut(group) {
                numbers.push(number);
            }
        }
    }
    if features.is_empty() {
        return Err(table.no_rows());
    }
    Ok(features)
}

fn name_of(keys: &[&str]) -> String {
    let given: Vec<&str> = keys
        .iter()
        .copied()
        .filter(|text| !text.is_empty())
        .collect();
    if given.is_empty() {
        "readings".to_owned()
    } else {
        given.join(" ")
    }
}
