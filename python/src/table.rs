//! Tables that are held in memory, as the bytes that the readers take.

use errsep::io::Message;
use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::exception;
use crate::long::without_the_lock;

/// A column as Python gives it.
#[derive(FromPyObject)]
pub enum Given<'py> {
    /// Numbers.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Texts.
    Texts(Vec<String>),
}

/// A column, away from Python.
enum Column {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Column {
    fn of(given: Given<'_>) -> Self {
        match given {
            Given::Numbers(array) => Self::Numbers(array.as_array().to_vec()),
            Given::Texts(texts) => Self::Texts(texts),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Numbers(v) => v.len(),
            Self::Texts(v) => v.len(),
        }
    }

    /// Numbers so that they read back the same; one that is none is an empty field.
    fn field(&self, row: usize) -> String {
        match self {
            Self::Numbers(v) if v[row].is_nan() => String::new(),
            Self::Numbers(v) => v[row].to_string(),
            Self::Texts(v) => v[row].clone(),
        }
    }
}

/// A table as CSV: names and columns, all as long.
#[pyfunction]
pub fn table_as_csv(py: Python<'_>, columns: Vec<(String, Given<'_>)>) -> PyResult<Vec<u8>> {
    let (names, columns): (Vec<String>, Vec<Column>) = columns
        .into_iter()
        .map(|(name, given)| (name, Column::of(given)))
        .unzip();
    let rows = columns.first().map_or(0, Column::len);
    if let Some(k) = columns.iter().position(|c| c.len() != rows) {
        let told = Message::bad_input(format!(
            "column `{}` has {} values, column `{}` {rows}",
            names[k],
            columns[k].len(),
            names[0]
        ));
        return Err(exception(py, &told.remedy("give columns of one length")));
    }
    without_the_lock(py, || written(&names, &columns, rows))
        .map_err(|e| PyValueError::new_err(format!("the table cannot be written: {e}")))
}

fn written(names: &[String], columns: &[Column], rows: usize) -> Result<Vec<u8>, csv::Error> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(names)?;
    for row in 0..rows {
        csv.write_record(columns.iter().map(|c| c.field(row)))?;
    }
    csv.into_inner().map_err(|e| e.into_error().into())
}
