//! Wrapper of `kernels/over.rs`.

use crate::arrays::{empty, grouped};
use crate::errors::to_python;
use numpy::{PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::over;
use pyo3::prelude::*;

#[pyfunction]
pub fn over_ground<'py>(
    py: Python<'py>,
    drawn: PyReadonlyArray3<'py, u8>,
    ground: PyReadonlyArray3<'py, u8>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let out: Bound<'py, PyArray3<u8>> = empty(py, [drawn.shape()[0], drawn.shape()[1], 3])?;
    let mut target = out.readwrite();
    let (upper, lower) = (grouped("drawn", &drawn)?, grouped("ground", &ground)?);
    let pixels = bytemuck::cast_slice_mut(target.as_slice_mut()?);
    py.detach(|| over::over_ground(upper, lower, pixels)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
