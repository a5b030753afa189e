//! Problems that functions of Python state, and what they are told.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use errsep::io::Message;
use errsep_solvers::argmin::core::observers::Observe;
use errsep_solvers::argmin::core::{Error as Broken, KV, State};
use errsep_solvers::{FitState, NoValue, Problem, central_differences};
use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyStopIteration;
use pyo3::prelude::*;

use crate::errors::exception;
use crate::interrupts::Interrupts;

/// The first exception raised by a function of Python; no more of them are called after it.
#[derive(Clone, Default)]
pub struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    pub fn put(&self, error: PyErr) {
        let mut raised = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        raised.get_or_insert(error);
    }

    pub fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn is_there(&self) -> bool {
        let raised = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        raised.is_some()
    }
}

/// The problem that functions of Python state.
pub struct Stated {
    pub names: Vec<String>,
    pub residuals: Py<PyAny>,
    pub jacobian: Option<Py<PyAny>>,
    /// The start and its residuals, which also tell how many there are.
    pub first: (DVector<f64>, DVector<f64>),
    pub raised: Raised,
    pub stop: Arc<AtomicBool>,
    pub interrupts: Arc<Interrupts>,
}

impl Stated {
    /// What Python answers, unless it has raised an exception before.
    /// Ctrl-C is looked for before each question.
    fn ask<T>(&self, question: impl FnOnce(Python<'_>) -> PyResult<T>) -> Result<T, NoValue> {
        let over = || NoValue::new("a function of Python raised an exception");
        if self.raised.is_there() {
            return Err(over());
        }
        let asked = Python::attach(|py| self.interrupts.look(py).and_then(|()| question(py)));
        asked.map_err(|error| {
            self.raised.put(error);
            self.stop.store(true, Ordering::Relaxed);
            over()
        })
    }
}

/// What a function of Python gives for these parameters.
pub fn residuals_of(
    py: Python<'_>,
    function: &Py<PyAny>,
    parameters: &DVector<f64>,
) -> PyResult<DVector<f64>> {
    let given = function.call1(py, (PyArray1::from_slice(py, parameters.as_slice()),))?;
    let array: PyReadonlyArray1<'_, f64> = given.extract(py)?;
    Ok(DVector::from_iterator(
        array.len()?,
        array.as_array().iter().copied(),
    ))
}

impl Problem for Stated {
    fn parameter_count(&self) -> usize {
        self.names.len()
    }

    fn residual_count(&self) -> usize {
        self.first.1.len()
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        if *parameters == self.first.0 {
            return Ok(self.first.1.clone());
        }
        self.ask(|py| {
            let residuals = residuals_of(py, &self.residuals, parameters)?;
            if residuals.len() == self.residual_count() {
                return Ok(residuals);
            }
            let told = Message::bad_input(format!(
                "there are {} residuals here and {} at the start",
                residuals.len(),
                self.residual_count()
            ));
            Err(exception(py, &told.remedy("return as many every time")))
        })
    }

    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let Some(function) = &self.jacobian else {
            return central_differences(|p| self.residuals(p), parameters);
        };
        self.ask(|py| {
            let given = function.call1(py, (PyArray1::from_slice(py, parameters.as_slice()),))?;
            let array: PyReadonlyArray2<'_, f64> = given.extract(py)?;
            let array = array.as_array();
            let (rows, columns) = array.dim();
            Ok(DMatrix::from_row_iterator(
                rows,
                columns,
                array.iter().copied(),
            ))
        })
    }

    fn parameter_name(&self, index: usize) -> String {
        self.names.get(index).cloned().unwrap_or_default()
    }
}

/// Tells the caller of each iteration, and looks for Ctrl-C.
pub struct Told {
    pub callback: Option<Py<PyAny>>,
    pub raised: Raised,
    pub stop: Arc<AtomicBool>,
    pub interrupts: Arc<Interrupts>,
}

impl Told {
    fn tell(&self, state: &FitState) -> PyResult<()> {
        Python::attach(|py| {
            self.interrupts.look(py)?;
            let (Some(callback), Some(parameters)) = (&self.callback, state.get_param()) else {
                return Ok(());
            };
            let parameters = PyArray1::from_slice(py, parameters.as_slice());
            let told = callback.call1(py, (state.get_iter() + 1, state.get_cost(), parameters));
            match told {
                Err(e) if e.is_instance_of::<PyStopIteration>(py) => {
                    self.stop.store(true, Ordering::Relaxed);
                    Ok(())
                }
                other => other.map(|_| ()),
            }
        })
    }
}

impl Observe<FitState> for Told {
    fn observe_iter(&mut self, state: &FitState, _kv: &KV) -> Result<(), Broken> {
        self.tell(state).map_err(|error| {
            let told = Broken::msg(error.to_string());
            self.raised.put(error);
            told
        })
    }
}
