//! The compiled half of the Python package `errsep`: it calls the commands and the engine, and knows
//! no more of Python than arrays, texts and exceptions. What people see is in `errsep/*.py`.

mod answered;
mod batch;
mod errors;
mod interrupts;
mod least_squares;
mod long;
mod stated;
mod table;

use pyo3::prelude::*;

/// The compiled half of the package.
#[pymodule]
fn _errsep(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<answered::Answered>()?;
    module.add_function(wrap_pyfunction!(answered::call, module)?)?;
    module.add_function(wrap_pyfunction!(answered::main, module)?)?;
    module.add_class::<batch::Shared>()?;
    module.add_function(wrap_pyfunction!(batch::work, module)?)?;
    module.add_function(wrap_pyfunction!(table::table_as_csv, module)?)?;
    module.add_function(wrap_pyfunction!(least_squares::least_squares, module)?)
}
