//! Wrapper of `kernels/descriptor.rs`.

use crate::arrays::{empty, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::descriptor::{self, Poses};
use pyo3::prelude::*;

#[pyfunction]
pub fn pose_distance<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'py, f64>,
    b: PyReadonlyArray2<'py, f64>,
    weights: PyReadonlyArray1<'py, f64>,
    a_trust: PyReadonlyArray2<'py, f64>,
    b_trust: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let out: Bound<'py, PyArray2<f64>> = empty(py, [a.shape()[0], b.shape()[0]])?;
    let mut target = out.readwrite();
    let distances = target.as_slice_mut()?;
    let a = Poses { angles: slice("a", &a)?, trust: slice("a_trust", &a_trust)? };
    let b = Poses { angles: slice("b", &b)?, trust: slice("b_trust", &b_trust)? };
    let weights = slice("weights", &weights)?;
    py.detach(|| descriptor::pose_distance(a, b, weights, distances)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
