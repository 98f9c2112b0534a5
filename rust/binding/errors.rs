//! The one place where a kernel's refusal becomes a Python exception.

use pegbar_kernels::error::KernelError;
use pegbar_kernels::words::TextError;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pyo3::import_exception!(pegbar.errors, FormatError);

/// Every kernel error is a wrong argument: ValueError, with the argument's name in the message.
pub fn to_python(error: KernelError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A broken text is a FormatError with path and line.
pub fn format_error(py: Python<'_>, path: &str, error: &TextError) -> PyErr {
    let line = PyDict::new(py);
    let made = line
        .set_item("line", error.line)
        .and_then(|()| py.get_type::<FormatError>().call((path, error.problem.as_str()), Some(&line)));
    made.map_or_else(|failure| failure, PyErr::from_value)
}
