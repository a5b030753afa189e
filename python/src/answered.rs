//! Commands and their answers.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use errsep::cli::call::call as call_command;
use errsep::cli::{Report, Traced, result_json};
use errsep::io::output::{CsvTable, Values};
use errsep::io::provenance::Provenance;
use errsep::io::source::InMemory;
use errsep::io::{OutFolder, Status, printable};
use errsep::report::Page;
use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use serde_json::Value;

use crate::errors::exception;
use crate::long::{interruptible, without_the_lock};
use crate::table::Given;

/// Runs a command. `arguments` are those of the command line; `inputs` are names and bytes of what is
/// held in memory.
#[pyfunction]
#[pyo3(signature = (arguments, inputs, threads=None))]
pub fn call(
    py: Python<'_>,
    arguments: Vec<String>,
    inputs: Vec<(String, Vec<u8>)>,
    threads: Option<NonZeroUsize>,
) -> PyResult<Answered> {
    let inputs = inputs.into_iter().map(|(name, bytes)| InMemory {
        name,
        bytes: Arc::from(bytes),
    });
    let inputs = inputs.collect();
    let traced = interruptible(py, threads, move || call_command(&arguments, inputs))?;
    traced.map(Answered::of).map_err(|m| exception(py, &m))
}

/// The program itself, its name the first of the arguments: returns its exit status.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<u8> {
    interruptible(py, None, move || errsep::cli::run(arguments))
}

/// The answer of a command.
#[pyclass(frozen, module = "errsep._errsep")]
pub struct Answered {
    text: String,
    json: Value,
    provenance: Provenance,
    shown: Shown,
    tables: Vec<CsvTable>,
    setup: Option<String>,
    inputs: Vec<PathBuf>,
    status: Status,
}

/// What there is to see: a page that is drawn when it is asked for, or one that was drawn before.
enum Shown {
    Page(Box<Page>),
    Drawn(Drawn),
}

/// A page in the forms in which it is looked at.
#[derive(Clone, FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub struct Drawn {
    html: String,
    title: String,
    standing: String,
    sentence: String,
    /// Title, caption and SVG.
    figures: Vec<(String, String, String)>,
}

impl Shown {
    fn drawn(&self) -> Drawn {
        match self {
            Self::Drawn(drawn) => drawn.clone(),
            Self::Page(page) => {
                let (standing, sentence) = page.told();
                Drawn {
                    html: page.render(),
                    title: page.title().to_owned(),
                    standing: standing.word().to_owned(),
                    sentence: sentence.to_owned(),
                    figures: self.figures(),
                }
            }
        }
    }

    fn figures(&self) -> Vec<(String, String, String)> {
        match self {
            Self::Drawn(drawn) => drawn.figures.clone(),
            Self::Page(page) => {
                let figures = page.figures();
                let drawn = figures.map(|f| {
                    let words = (f.title().to_owned(), f.caption().to_owned());
                    (words.0, words.1, f.plot().to_svg())
                });
                drawn.collect()
            }
        }
    }

    fn html(&self) -> String {
        match self {
            Self::Drawn(drawn) => drawn.html.clone(),
            Self::Page(page) => page.render(),
        }
    }

    fn told(&self) -> (String, String, String) {
        match self {
            Self::Drawn(d) => (d.title.clone(), d.standing.clone(), d.sentence.clone()),
            Self::Page(page) => {
                let (standing, sentence) = page.told();
                let words = (standing.word().to_owned(), sentence.to_owned());
                (page.title().to_owned(), words.0, words.1)
            }
        }
    }
}

/// A table for Python: its file's name, and its columns as arrays or lists of texts.
type Table<'py> = (String, Vec<(String, Bound<'py, PyAny>)>);

/// What a pickle keeps of an answer: a dictionary of Python.
#[derive(FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub struct Kept<'py> {
    text: String,
    json: String,
    provenance: String,
    shown: Drawn,
    tables: Vec<Table<'py>>,
    setup: Option<String>,
    inputs: Vec<PathBuf>,
    status: u8,
}

impl Answered {
    fn of(traced: Traced) -> Self {
        let Traced { answer, provenance } = traced;
        Self {
            text: printable::lines(&answer.text).into_owned(),
            json: answer.json,
            provenance,
            shown: Shown::Page(Box::new(answer.page)),
            tables: answer.tables,
            setup: answer.setup,
            inputs: answer.inputs,
            status: answer.status,
        }
    }
}

#[pymethods]
impl Answered {
    /// What the command prints for people.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// The set-up that a simulation wrote for its data, as TOML.
    #[getter]
    fn setup(&self) -> Option<&str> {
        self.setup.as_deref()
    }

    /// The exit status of the command: 0 done, 1 not solved.
    #[getter]
    fn status(&self) -> u8 {
        self.status.code()
    }

    /// What the command prints for programs.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        without_the_lock(py, || result_json(&self.json, &self.provenance))
            .map_err(|m| exception(py, &m))
    }

    /// The report as one HTML file.
    fn html(&self, py: Python<'_>) -> String {
        without_the_lock(py, || self.shown.html())
    }

    /// Title of the report, how the outcome stands, the sentence a person acts on.
    fn told(&self) -> (String, String, String) {
        self.shown.told()
    }

    /// The figures of the report: title, caption, SVG.
    fn figures(&self, py: Python<'_>) -> Vec<(String, String, String)> {
        without_the_lock(py, || self.shown.figures())
    }

    /// The tables: the name of each file, and its columns by their names.
    fn tables<'py>(&self, py: Python<'py>) -> PyResult<Vec<Table<'py>>> {
        let table = |table: &CsvTable| {
            let column = |(name, values): &(String, Values)| Ok((name.clone(), array(py, values)?));
            let columns = table.columns.iter().map(column);
            let columns: PyResult<Vec<_>> = columns.collect();
            Ok((table.file_name.clone(), columns?))
        };
        self.tables.iter().map(table).collect()
    }

    /// Writes the report's folder.
    fn write(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<()> {
        without_the_lock(py, || self.write_folder(&folder, force)).map_err(|m| exception(py, &m))
    }

    /// What a pickle keeps.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Kept<'py>> {
        let provenance = serde_json::to_string(&self.provenance);
        Ok(Kept {
            text: self.text.clone(),
            json: self.json.to_string(),
            provenance: provenance.map_err(|e| PyValueError::new_err(e.to_string()))?,
            shown: without_the_lock(py, || self.shown.drawn()),
            tables: self.tables(py)?,
            setup: self.setup.clone(),
            inputs: self.inputs.clone(),
            status: self.status.code(),
        })
    }

    /// The answer that a pickle kept.
    #[staticmethod]
    fn of_state(state: Kept<'_>) -> PyResult<Self> {
        let broken = |e: serde_json::Error| PyValueError::new_err(format!("a broken pickle: {e}"));
        Ok(Self {
            text: state.text,
            json: serde_json::from_str(&state.json).map_err(broken)?,
            provenance: serde_json::from_str(&state.provenance).map_err(broken)?,
            shown: Shown::Drawn(state.shown),
            tables: state
                .tables
                .iter()
                .map(kept_table)
                .collect::<PyResult<_>>()?,
            setup: state.setup,
            inputs: state.inputs,
            status: if state.status == Status::Done.code() {
                Status::Done
            } else {
                Status::NotSolved
            },
        })
    }
}

impl Answered {
    fn write_folder(&self, folder: &Path, force: bool) -> Result<(), errsep::io::Message> {
        // Python has handlers of its own, and would be ended by ours.
        let folder = OutFolder::reserve(folder, force)?.leave_signals();
        let report = Report {
            html: &self.shown.html(),
            json: &self.json,
            tables: &self.tables,
            setup: self.setup.as_deref(),
            inputs: &self.inputs,
            provenance: self.provenance.clone(),
        };
        report.write(folder).map(|_| ())
    }
}

fn array<'py>(py: Python<'py>, values: &Values) -> PyResult<Bound<'py, PyAny>> {
    match values {
        Values::Numbers(v) => PyArray1::from_slice(py, v).into_bound_py_any(py),
        Values::Texts(v) => PyList::new(py, v)?.into_bound_py_any(py),
        Values::Words(words, which) => {
            let word = |w: &u8| words.get(usize::from(*w)).copied().unwrap_or("");
            PyList::new(py, which.iter().map(word).collect::<Vec<_>>())?.into_bound_py_any(py)
        }
    }
}

fn kept_table((name, columns): &Table<'_>) -> PyResult<CsvTable> {
    let mut table = CsvTable::new(name);
    for (name, column) in columns {
        table = match column.extract()? {
            Given::Numbers(array) => table.numbers(name, array.as_array().to_vec()),
            Given::Texts(texts) => table.texts(name, texts),
        };
    }
    Ok(table)
}
