//! What Python raises: errors of overfly as exceptions, Ctrl-C in long work.
//!
//! In:    errors of the library.
//! Out:   exceptions with the whole sentence.
//! Keeps: nothing.
//! Not here: faults of arrays (`arrays`).

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::error::Error;

create_exception!(
    overfly,
    OverflyError,
    PyRuntimeError,
    "What overfly could not do, in one sentence: a file, an archive, a device, a recording.\n\n\
     Values that cannot be used raise ValueError instead."
);

/// An exception for what the library could not do.
pub fn failed(error: &dyn Error) -> PyErr {
    OverflyError::new_err(sentence(error))
}

/// An exception for a value that cannot be used.
pub fn refused(what: impl Into<String>) -> PyErr {
    PyValueError::new_err(what.into())
}

/// What an error says, and its causes where it does not say them itself.
pub fn sentence(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let more = error.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = error.source();
    }
    text
}

/// Raises what Ctrl-C left behind. For work that runs without the interpreter's lock.
pub fn interrupted() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}
