//! Messages as exceptions of `errsep.errors`.

use errsep::io::{Message, Trouble};
use pyo3::prelude::*;

/// The exception for a message. Its class is written in Python, so that it can be pickled.
pub fn exception(py: Python<'_>, message: &Message) -> PyErr {
    match class_of(py, message).and_then(|class| made(&class, message)) {
        Ok(exception) => PyErr::from_value(exception),
        Err(why_not) => why_not,
    }
}

fn class_of<'py>(py: Python<'py>, message: &Message) -> PyResult<Bound<'py, PyAny>> {
    let name = match message.trouble() {
        Trouble::BadInput => "InputError",
        Trouble::NotDetermined => "NotDetermined",
        Trouble::NotConverged => "NotConverged",
    };
    py.import("errsep.errors")?.getattr(name)
}

fn made<'py>(class: &Bound<'py, PyAny>, message: &Message) -> PyResult<Bound<'py, PyAny>> {
    let place = message.place();
    let whole = |n: usize| (n > 0).then_some(n);
    let line = place.and_then(|p| whole(p.line));
    let exception = class.call1((
        message.what(),
        place.map(|p| p.file.to_string_lossy().into_owned()),
        line,
        line.and(place).map(|p| p.column.max(1)),
        message.remedy_words(),
    ))?;
    if let Some(reached) = message.reached() {
        let json = class.py().import("json")?;
        let reached = json.call_method1("loads", (reached.to_string(),))?;
        exception.setattr("partial", reached)?;
    }
    Ok(exception)
}
