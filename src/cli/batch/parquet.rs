//! A part as Parquet: the rows of its NDJSON, and a column for every number of the answers.

use std::collections::BTreeMap;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use serde::Deserialize;
use serde_json::value::RawValue;

use super::lean::Lean;

/// A row as the part has it, the answer as its text.
#[derive(Deserialize)]
struct Told<'a> {
    id: String,
    key: String,
    status: String,
    exit: u8,
    message: Option<String>,
    #[serde(borrow)]
    result: Option<&'a RawValue>,
}

/// A column by its kind; a campaign without it has `None`.
enum Column {
    Texts(Vec<Option<ByteArray>>),
    Whole(Vec<Option<i32>>),
    Numbers(Vec<Option<f64>>),
    Truths(Vec<Option<bool>>),
}

/// What the answers have beside lists and texts: a name, and a value for each row.
#[derive(Default)]
struct Scalars {
    numbers: BTreeMap<String, Vec<Option<f64>>>,
    truths: BTreeMap<String, Vec<Option<bool>>>,
}

impl Scalars {
    /// Takes what a row has, by the path in its answer: `tilts` in front and `value` at the end are left
    /// out, and what stands beside a value is joined to its name by `_`.
    fn take(&mut self, row: usize, name: &str, value: &Lean) {
        match value {
            Lean::Number(number) => put(&mut self.numbers, row, name, *number),
            Lean::Truth(truth) => put(&mut self.truths, row, name, *truth),
            Lean::Object(members) => {
                let quantity = matches!(value.get("value"), Some(Lean::Number(_)));
                for (key, inner) in members {
                    let name = match (name, key.as_str()) {
                        ("" | "tilts", key) => key.to_owned(),
                        (name, "value") if quantity => name.to_owned(),
                        (name, key) if quantity => format!("{name}_{key}"),
                        (name, key) => format!("{name}.{key}"),
                    };
                    self.take(row, &name, inner);
                }
            }
            Lean::Nothing | Lean::Text(_) | Lean::Texts(_) => {}
        }
    }
}

fn put<T: Copy>(columns: &mut BTreeMap<String, Vec<Option<T>>>, row: usize, name: &str, value: T) {
    let column = columns.entry(name.to_owned()).or_default();
    column.resize(row, None);
    // The first of two paths that come to the same name.
    if column.len() == row {
        column.push(Some(value));
    }
}

/// The rows of a part, as the bytes of a Parquet file.
///
/// # Errors
/// A row is none, or Parquet cannot hold it.
pub(super) fn of<'l>(lines: impl Iterator<Item = &'l str>) -> Result<Vec<u8>, ParquetError> {
    let rows: Vec<Told> = lines
        .map(serde_json::from_str)
        .collect::<Result<_, _>>()
        .map_err(|e| ParquetError::External(Box::new(e)))?;
    let mut scalars = Scalars::default();
    for (row, told) in rows.iter().enumerate() {
        if let Some(result) = told.result {
            let lean = serde_json::from_str(result.get());
            scalars.take(
                row,
                "",
                &lean.map_err(|e| ParquetError::External(Box::new(e)))?,
            );
        }
    }
    let texts = |of: &dyn Fn(&Told) -> Option<String>| {
        let text = |told| of(told).map(|text| ByteArray::from(text.into_bytes()));
        Column::Texts(rows.iter().map(text).collect())
    };
    let mut columns = vec![
        ("id".to_owned(), texts(&|t| Some(t.id.clone()))),
        ("key".to_owned(), texts(&|t| Some(t.key.clone()))),
        ("status".to_owned(), texts(&|t| Some(t.status.clone()))),
        (
            "exit".to_owned(),
            Column::Whole(rows.iter().map(|t| Some(i32::from(t.exit))).collect()),
        ),
        ("message".to_owned(), texts(&|t| t.message.clone())),
    ];
    let taken = |name: &String| {
        ["id", "key", "status", "exit", "message", "result"].contains(&name.as_str())
    };
    for (name, mut values) in scalars.numbers {
        values.resize(rows.len(), None);
        if !taken(&name) {
            columns.push((name, Column::Numbers(values)));
        }
    }
    for (name, mut values) in scalars.truths {
        values.resize(rows.len(), None);
        if columns.iter().all(|(other, _)| *other != name) {
            columns.push((name, Column::Truths(values)));
        }
    }
    let result = texts(&|t| t.result.map(|r| r.get().to_owned()));
    columns.push(("result".to_owned(), result));
    written(&columns)
}

fn written(columns: &[(String, Column)]) -> Result<Vec<u8>, ParquetError> {
    let fields = columns.iter().map(|(name, column)| column.field(name));
    let fields: Vec<Arc<Type>> = fields.collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("campaigns").with_fields(fields);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY);
    let mut file = SerializedFileWriter::new(
        Vec::new(),
        Arc::new(schema.build()?),
        Arc::new(properties.build()),
    )?;
    let mut group = file.next_row_group()?;
    for (_, column) in columns {
        match column {
            Column::Texts(values) => put_in::<ByteArrayType>(&mut group, values)?,
            Column::Whole(values) => put_in::<Int32Type>(&mut group, values)?,
            Column::Numbers(values) => put_in::<DoubleType>(&mut group, values)?,
            Column::Truths(values) => put_in::<BoolType>(&mut group, values)?,
        }
    }
    group.close()?;
    file.into_inner()
}

impl Column {
    fn field(&self, name: &str) -> Result<Arc<Type>, ParquetError> {
        let (physical, logical) = match self {
            Self::Texts(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Self::Whole(_) => (Physical::INT32, None),
            Self::Numbers(_) => (Physical::DOUBLE, None),
            Self::Truths(_) => (Physical::BOOLEAN, None),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical);
        Ok(Arc::new(field.build()?))
    }
}

fn put_in<D: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[Option<D::T>],
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else {
        return Err(ParquetError::General("a column has no place".to_owned()));
    };
    let there: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let values: Vec<D::T> = values.iter().flatten().cloned().collect();
    column
        .typed::<D>()
        .write_batch(&values, Some(&there), None)?;
    column.close()
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::*;

    const ROWS: [&str; 3] = [
        r#"{"id":"a","key":"1","status":"done","exit":0,"message":null,"result":{"schema":"errsep.reversal/1","readings":12,"tilts":{"alpha":{"value":4e-5,"std":1e-7,"unit":"rad"},"beta":null},"residual":{"rms":0.02,"list":[1,2]},"agreement":{"disagree":false},"exit":3}}"#,
        r#"{"id":"b","key":"2","status":"failed","exit":2,"message":"no, \"result\": none","result":null}"#,
        r#"{"id":"c","key":"3","status":"done","exit":0,"message":null,"result":{"readings":8,"tilts":{"beta":{"value":2.0}}}}"#,
    ];

    /// The columns of a file as they are read back, by name.
    fn read(bytes: Vec<u8>) -> BTreeMap<String, Vec<Field>> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        let file = SerializedFileReader::new(file).unwrap();
        let mut columns: BTreeMap<String, Vec<Field>> = BTreeMap::new();
        for row in file.get_row_iter(None).unwrap() {
            for (name, field) in row.unwrap().into_columns() {
                columns.entry(name).or_default().push(field);
            }
        }
        columns
    }

    #[test]
    fn rows_read_back_with_a_column_for_every_scalar() {
        let columns = read(of(ROWS.into_iter()).unwrap());
        let text = |t: &str| Field::Str(t.to_owned());
        let names: Vec<&str> = columns.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "agreement.disagree",
                "alpha",
                "alpha_std",
                "beta",
                "exit",
                "id",
                "key",
                "message",
                "readings",
                "residual.rms",
                "result",
                "status"
            ]
        );
        assert_eq!(columns["id"], ["a", "b", "c"].map(text));
        assert_eq!(columns["exit"], [0, 2, 0].map(Field::Int));
        assert_eq!(columns["message"][1], text("no, \"result\": none"));
        let number = Field::Double;
        assert_eq!(columns["alpha"], [number(4e-5), Field::Null, Field::Null]);
        assert_eq!(columns["alpha_std"][0], number(1e-7));
        assert_eq!(columns["beta"], [Field::Null, Field::Null, number(2.0)]);
        assert_eq!(
            columns["readings"],
            [number(12.0), Field::Null, number(8.0)]
        );
        assert_eq!(columns["agreement.disagree"][0], Field::Bool(false));
        let result = r#"{"readings":8,"tilts":{"beta":{"value":2.0}}}"#;
        assert_eq!(columns["result"][1..], [Field::Null, text(result)]);
    }
}
