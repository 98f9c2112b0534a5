//! The one place where a kernel's refusal becomes a Python exception.

use pegbar_kernels::error::KernelError;
use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// Every kernel error is a wrong argument: ValueError, with the argument's name in the message.
pub fn to_python(error: KernelError) -> PyErr {
    PyValueError::new_err(error.to_string())
}
