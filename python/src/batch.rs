//! Many campaigns: the process that hands out tasks, and those that work them out.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use errsep::cli::batch::shared::{self, Asked};
use errsep::io::Message;
use errsep::io::source::InMemory;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::exception;
use crate::long::{interruptible, without_the_lock};

/// A batch whose tasks are worked out by `work`, in this process or in others.
#[pyclass(frozen, module = "errsep._errsep")]
pub struct Shared(Mutex<Option<shared::Shared>>);

impl Shared {
    /// What `ask` makes of the batch, without the interpreter's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        ask: impl FnOnce(&mut Option<shared::Shared>) -> Option<Result<T, Message>> + Send,
    ) -> PyResult<T> {
        let answer = without_the_lock(py, || {
            ask(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
        });
        match answer {
            Some(answer) => answer.map_err(|m| exception(py, &m)),
            None => Err(PyValueError::new_err("the batch is finished")),
        }
    }
}

#[pymethods]
impl Shared {
    /// Reads the list, a path or the name of an input in memory, and what is done already.
    #[new]
    #[pyo3(signature = (list, inputs, out, *, jobs, retry_failed, verify, parquet))]
    #[allow(clippy::too_many_arguments, reason = "each is one of the command's")]
    fn new(
        py: Python<'_>,
        list: PathBuf,
        inputs: Vec<(String, Vec<u8>)>,
        out: PathBuf,
        jobs: usize,
        retry_failed: bool,
        verify: bool,
        parquet: bool,
    ) -> PyResult<Self> {
        let inputs = inputs.into_iter().map(|(name, bytes)| InMemory {
            name,
            bytes: Arc::from(bytes),
        });
        let inputs: Vec<InMemory> = inputs.collect();
        let asked = Asked {
            list,
            out,
            jobs,
            retry_failed,
            verify,
            parquet,
        };
        let opened = interruptible(py, None, move || shared::Shared::open(&asked, inputs))?;
        let opened = opened.map_err(|m| exception(py, &m))?;
        Ok(Self(Mutex::new(Some(opened))))
    }

    /// The tasks, each with how many campaigns it has.
    fn tasks(&self, py: Python<'_>) -> PyResult<Vec<(String, usize)>> {
        self.with(py, |batch| batch.as_mut().map(shared::Shared::tasks))
    }

    /// Takes the report of a task.
    fn take(&self, py: Python<'_>, report: &str) -> PyResult<()> {
        self.with(py, |batch| batch.as_mut().map(|b| b.take(report)))
    }

    /// Writes the page and lets the folder go; returns how many campaigns there are, how many were worked
    /// out now, and how many failed.
    fn finish(&self, py: Python<'_>) -> PyResult<(usize, usize, usize)> {
        let batch = self.with(py, |batch| batch.take().map(Ok))?;
        let counts = interruptible(py, None, move || batch.finish())?;
        let counts = counts.map_err(|m| exception(py, &m))?;
        Ok((counts.campaigns, counts.worked_out, counts.failed))
    }

    /// Lets the folder go, whatever is done.
    fn close(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// Works out a task and returns its report.
#[pyfunction]
pub fn work(py: Python<'_>, task: String) -> PyResult<String> {
    let worked = interruptible(py, None, move || shared::work(&task))?;
    worked.map_err(|m| exception(py, &m))
}
