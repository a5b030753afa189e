//! Tables in Parquet files: the same readings as from CSV, and messages that tell the row.
#![cfg(feature = "parquet")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use errsep::io::reversal::{ReversalData, read};
use errsep::io::{ColumnMap, Message, TableReader};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

/// A column of a file.
enum Values {
    Texts(Vec<Option<&'static str>>),
    Numbers(Vec<Option<f64>>),
    Whole(Vec<Option<i32>>),
    Times(Vec<Option<i64>>),
}

fn put<D: DataType>(
    group: &mut SerializedRowGroupWriter<'_, std::fs::File>,
    values: &[Option<D::T>],
) {
    let mut column = group.next_column().unwrap().unwrap();
    let there: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let values: Vec<D::T> = values.iter().flatten().cloned().collect();
    let typed = column.typed::<D>();
    typed.write_batch(&values, Some(&there), None).unwrap();
    column.close().unwrap();
}

/// Writes columns into groups of `rows` rows.
fn write(folder: &Path, columns: &[(&str, Values)], rows: usize) -> PathBuf {
    let fields = columns.iter().map(|(name, values)| {
        let (physical, logical) = match values {
            Values::Texts(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Values::Numbers(_) => (Physical::DOUBLE, None),
            Values::Whole(_) => (Physical::INT32, None),
            Values::Times(_) => (
                Physical::INT64,
                Some(LogicalType::timestamp(
                    true,
                    parquet::basic::TimeUnit::MILLIS,
                )),
            ),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical);
        Arc::new(field.build().unwrap())
    });
    let schema = Type::group_type_builder("readings").with_fields(fields.collect());
    let path = folder.join("readings.parquet");
    let mut file = SerializedFileWriter::new(
        std::fs::File::create(&path).unwrap(),
        Arc::new(schema.build().unwrap()),
        Arc::new(WriterProperties::builder().build()),
    )
    .unwrap();
    let count = columns.iter().map(|(_, values)| match values {
        Values::Texts(v) => v.len(),
        Values::Numbers(v) => v.len(),
        Values::Whole(v) => v.len(),
        Values::Times(v) => v.len(),
    });
    let count = count.max().unwrap();
    for start in (0..count).step_by(rows) {
        let own = start..count.min(start + rows);
        let mut group = file.next_row_group().unwrap();
        for (_, values) in columns {
            match values {
                Values::Texts(v) => {
                    let texts = v[own.clone()].iter().map(|t| t.map(ByteArray::from));
                    put::<ByteArrayType>(&mut group, &texts.collect::<Vec<_>>());
                }
                Values::Numbers(v) => put::<DoubleType>(&mut group, &v[own.clone()]),
                Values::Whole(v) => put::<Int32Type>(&mut group, &v[own.clone()]),
                Values::Times(v) => put::<Int64Type>(&mut group, &v[own.clone()]),
            }
        }
        group.close().unwrap();
    }
    file.close().unwrap();
    path
}

fn readings(columns: &[(&str, Values)], rows: usize) -> Result<ReversalData, Message> {
    let folder = tempfile::tempdir().unwrap();
    read(&write(folder.path(), columns, rows), &ColumnMap::default())
}

const ROWS: usize = 150_000;

fn value(row: usize) -> f64 {
    (0.37 * row as f64).sin()
}

fn tidy() -> Vec<(&'static str, Values)> {
    let channel = |row| Some(["1A", "2B"][row % 2]);
    vec![
        ("channel", Values::Texts((0..ROWS).map(channel).collect())),
        (
            "repeat",
            Values::Whole((0..ROWS).map(|_| Some(2)).collect()),
        ),
        (
            "x (m)",
            Values::Numbers((0..ROWS).map(|row| Some(row as f64)).collect()),
        ),
        (
            "reading",
            Values::Numbers((0..ROWS).map(|row| Some(value(row))).collect()),
        ),
    ]
}

#[test]
fn rows_are_readings_in_groups_of_any_size() {
    for rows in [7_001, ROWS] {
        let data = readings(&tidy(), rows).unwrap();
        assert_eq!(data.observations.readings.len(), ROWS);
        for (row, reading) in data.observations.readings.iter().enumerate() {
            assert_eq!(reading.channel.name(), ["1A", "2B"][row % 2]);
            // The unit beside the name holds: m.
            assert_eq!((reading.x, reading.value), (1e3 * row as f64, value(row)));
            assert_eq!(reading.repeat, 2);
        }
        assert!(
            data.in_words().starts_with("Parquet"),
            "{}",
            data.in_words()
        );
    }
}

#[test]
fn what_is_missing_in_a_wide_table_is_a_position_not_read() {
    let number = |v: &[f64]| Values::Numbers(v.iter().map(|v| Some(*v)).collect());
    let columns = [
        ("x", number(&[0.0, 1.0, 2.0])),
        ("1A", Values::Numbers(vec![Some(0.5), None, Some(0.7)])),
        ("1B", number(&[1.5, 2.5, f64::NAN])),
    ];
    let data = readings(&columns, 2).unwrap();
    assert_eq!((data.observations.readings.len(), data.gaps), (4, 2));
}

#[test]
fn messages_tell_the_row() {
    let mut columns = tidy();
    if let Values::Numbers(values) = &mut columns[3].1 {
        values[123_456] = None;
    }
    let why = readings(&columns, 50_000).unwrap_err();
    assert!(why.what().contains("reading is missing"), "{why}");
    assert_eq!(why.place().unwrap().line, 123_457, "{why}");
    let mut columns = tidy();
    if let Values::Texts(values) = &mut columns[0].1 {
        values[70_000] = Some("9Z");
    }
    let why = readings(&columns, 50_000).unwrap_err();
    assert!(why.what().contains("unknown channel `9Z`"), "{why}");
    assert_eq!(why.place().unwrap().line, 70_001, "{why}");
}

#[test]
fn columns_that_are_no_numbers_or_texts_are_refused() {
    let mut columns = tidy();
    columns.push((
        "time",
        Values::Times((0..ROWS).map(|row| Some(row as i64)).collect()),
    ));
    let why = readings(&columns, ROWS).unwrap_err();
    assert!(why.what().contains("`time` holds dates"), "{why}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no.parquet");
    std::fs::write(&path, "channel,x,reading\n").unwrap();
    let why = TableReader::open(&path).err().unwrap();
    assert!(why.what().contains("cannot be read as Parquet"), "{why}");
}
