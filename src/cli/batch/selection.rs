//! Readings of many campaigns in one Parquet file: `key` of a list says which rows are a campaign's.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::campaigns::Campaign;
use crate::io::Message;

/// The rows of a Parquet file that have a value in a column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Selection {
    pub file: PathBuf,
    pub column: String,
    pub value: String,
}

/// The rows of selections as CSV, or why there are none, by [`Selection::name`].
pub(super) type Held = HashMap<PathBuf, Result<Arc<[u8]>, Message>>;

impl Selection {
    /// The selection that `key` of a list states, such as `campaign=m1-monday`.
    pub fn of(file: PathBuf, key: &str) -> Option<Self> {
        let (column, value) = key.split_once('=')?;
        let (column, value) = (column.trim(), value.trim());
        let stated = !column.is_empty() && !value.is_empty();
        stated.then(|| Self {
            file,
            column: column.to_owned(),
            value: value.to_owned(),
        })
    }

    /// The name by which the rows go, in arguments and in messages, whose lines count them with the
    /// header as the first.
    pub fn name(&self) -> PathBuf {
        let file = self.file.to_string_lossy();
        PathBuf::from(format!("{file}[{}={}]", self.column, self.value))
    }
}

/// Reads what campaigns select, each file once.
pub(super) fn read(campaigns: &[Campaign]) -> Held {
    let mut held = Held::new();
    let mut files: HashMap<(&PathBuf, &str), Vec<&Selection>> = HashMap::new();
    for selection in campaigns.iter().filter_map(|c| c.selection.as_ref()) {
        let place = (&selection.file, selection.column.as_str());
        files.entry(place).or_default().push(selection);
    }
    for wanted in files.into_values() {
        reading::read(&wanted, &mut held);
    }
    held
}

#[cfg(not(feature = "parquet"))]
mod reading {
    use super::{Held, Selection};

    /// A list without Parquet selects nothing.
    pub fn read(_: &[&Selection], _: &mut Held) {}
}

#[cfg(feature = "parquet")]
mod reading {
    use std::collections::hash_map::Entry;
    use std::collections::{HashMap, HashSet};
    use std::fs::File;
    use std::sync::Arc;

    use parquet::errors::ParquetError;
    use parquet::file::metadata::RowGroupMetaData;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::{Held, Selection};
    use crate::io::Message;
    use crate::io::message::list;

    /// The rows of selections that share file and column.
    pub fn read(wanted: &[&Selection], held: &mut Held) {
        let Some(first) = wanted.first() else { return };
        let found = rows(first, wanted);
        for selection in wanted {
            let rows = match &found {
                Ok(found) => found.get(selection.value.as_str()).cloned().ok_or_else(|| {
                    let Selection { column, value, .. } = selection;
                    Message::bad_input(format!("no row has {column} = {value}"))
                        .in_file(&selection.file)
                        .remedy("correct `key` in the list, or the file")
                }),
                Err(why) => Err(why.clone()),
            };
            held.entry(selection.name()).or_insert(rows);
        }
    }

    type Found<'s> = HashMap<&'s str, Arc<[u8]>>;

    fn rows<'s>(first: &Selection, wanted: &[&'s Selection]) -> Result<Found<'s>, Message> {
        let unreadable = |what: String| {
            Message::bad_input(what)
                .in_file(&first.file)
                .remedy("give a Parquet file of plain columns, with Snappy compression or none")
        };
        let broken = |e: ParquetError| unreadable(format!("cannot be read as Parquet: {e}"));
        let file =
            File::open(&first.file).map_err(|e| unreadable(format!("cannot be read: {e}")))?;
        let file = SerializedFileReader::new(file).map_err(broken)?;
        let fields = file.metadata().file_metadata().schema().get_fields();
        let names: Vec<&str> = fields.iter().map(|f| f.name()).collect();
        let Some(at) = names.iter().position(|name| *name == first.column) else {
            let what = format!("has no column `{}`", first.column);
            return Err(Message::bad_input(what)
                .in_file(&first.file)
                .remedy(format!(
                    "`key` is COLUMN=VALUE; columns are {}",
                    list(&names)
                )));
        };
        let values: HashSet<&'s str> = wanted.iter().map(|s| s.value.as_str()).collect();
        let others = || (0..names.len()).filter(|i| *i != at);
        let mut tables: HashMap<&'s str, csv::Writer<Vec<u8>>> = HashMap::new();
        let written = |e: csv::Error| unreadable(format!("cannot be written as CSV: {e}"));
        for k in 0..file.num_row_groups() {
            let group = file.get_row_group(k).map_err(broken)?;
            if !may_hold(group.metadata(), at, wanted) {
                continue;
            }
            for row in group.get_row_iter(None).map_err(broken)? {
                let fields = row.map_err(broken)?.into_columns();
                let value = text(&fields[at].1);
                let Some(own) = values.get(value.as_str()) else {
                    continue;
                };
                let table = match tables.entry(own) {
                    Entry::Occupied(table) => table.into_mut(),
                    Entry::Vacant(place) => {
                        let mut table = csv::Writer::from_writer(Vec::new());
                        let header = others().map(|i| names[i]);
                        table.write_record(header).map_err(written)?;
                        place.insert(table)
                    }
                };
                let record = others().map(|i| text(&fields[i].1));
                table.write_record(record).map_err(written)?;
            }
        }
        let bytes = |(value, table): (&'s str, csv::Writer<Vec<u8>>)| {
            let bytes = table.into_inner();
            let bytes = bytes.map_err(|e| written(e.into_error().into()))?;
            Ok((value, Arc::from(bytes)))
        };
        tables.into_iter().map(bytes).collect()
    }

    /// Whether a group of rows may hold one of the values, by what it says of its texts.
    fn may_hold(group: &RowGroupMetaData, column: usize, wanted: &[&Selection]) -> bool {
        let statistics = group.columns().get(column).and_then(|c| c.statistics());
        let Some(parquet::file::statistics::Statistics::ByteArray(texts)) = statistics else {
            return true;
        };
        match (texts.min_bytes_opt(), texts.max_bytes_opt()) {
            (Some(least), Some(most)) => wanted
                .iter()
                .any(|s| least <= s.value.as_bytes() && s.value.as_bytes() <= most),
            _ => true,
        }
    }

    /// A field as a table has it.
    fn text(field: &Field) -> String {
        match field {
            Field::Null => String::new(),
            Field::Str(text) => text.clone(),
            // So that it reads back the same.
            Field::Double(number) if number.is_nan() => String::new(),
            Field::Double(number) => number.to_string(),
            Field::Float(number) if number.is_nan() => String::new(),
            Field::Float(number) => number.to_string(),
            other => other.to_string(),
        }
    }
}

#[cfg(all(test, feature = "parquet"))]
mod tests {
    use super::*;

    fn campaign(selection: Selection) -> Campaign {
        Campaign {
            id: selection.value.clone(),
            arguments: Vec::new(),
            files: vec![selection.name()],
            selection: Some(selection),
            as_listed: Vec::new(),
        }
    }

    #[test]
    fn the_rows_of_a_value_come_as_a_table() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("many.parquet");
        let row = |id: &str, rms: &str| {
            format!(
                r#"{{"id":"{id}","key":"m1","status":"done","exit":0,"message":null,"result":{{"rms":{rms}}}}}"#
            )
        };
        let rows = [row("a", "0.1"), row("b", "2.5e-7"), row("a", "3")];
        let bytes = super::super::parquet::of(rows.iter().map(String::as_str)).unwrap();
        std::fs::write(&file, bytes).unwrap();
        let of = |key| campaign(Selection::of(file.clone(), key).unwrap());
        let campaigns = [of("id = a"), of("id=b"), of("id=c"), of("machine=a")];
        let held = read(&campaigns);
        let rows = |k: usize| held[&campaigns[k].files[0]].clone();
        let table = |k| String::from_utf8(rows(k).unwrap().to_vec()).unwrap();
        let a = "key,status,exit,message,rms,result\n\
                 m1,done,0,,0.1,\"{\"\"rms\"\":0.1}\"\n\
                 m1,done,0,,3,\"{\"\"rms\"\":3}\"\n";
        assert_eq!(table(0), a);
        assert!(table(1).contains(",0.00000025,"));
        assert!(rows(2).unwrap_err().what().contains("no row has id = c"));
        let why = rows(3).unwrap_err();
        assert!(why.what().contains("no column `machine`"), "{why}");
        assert_eq!(Selection::of(file, "a"), None);
    }
}
