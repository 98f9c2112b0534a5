//! Wrapper of `kernels/rim.rs`.

use crate::arrays::{empty, slice};
use crate::composite::Pixels;
use crate::errors::to_python;
use numpy::ndarray::Ix2;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::composite::Rendered;
use pegbar_kernels::rim;
use pyo3::prelude::*;

#[pyfunction]
pub fn rim_depth<'py>(
    py: Python<'py>,
    rendered: Pixels<'py>,
    rendered_depth: PyReadonlyArray2<'py, f32>,
) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
    let [height, width] = [rendered_depth.shape()[0], rendered_depth.shape()[1]];
    let depth = slice("rendered_depth", &rendered_depth)?;
    let pixels = match &rendered {
        Pixels::Bytes(array) => Rendered::Bytes(slice("rendered", array)?),
        Pixels::Floats(array) => Rendered::Floats(slice("rendered", array)?),
    };
    let found = py.detach(|| rim::rim(pixels, depth, width)).map_err(to_python)?;
    if found.is_empty() {
        return Ok(None);
    }
    let out = empty::<f32, Ix2, 2>(py, [height, width])?;
    let mut target = out.readwrite();
    let filled = target.as_slice_mut()?;
    py.detach(|| rim::fill(depth, &found, filled)).map_err(to_python)?;
    drop(target);
    Ok(Some(out))
}
