//! Wrapper of `kernels/warp.rs`.

use crate::arrays::slice;
use crate::errors::to_python;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::warp::{self, Rules};
use pyo3::prelude::*;

#[pyfunction]
#[pyo3(signature = (cost, open_begin, open_end, slope_limit))]
pub fn time_warp<'py>(
    py: Python<'py>,
    cost: PyReadonlyArray2<'py, f64>,
    open_begin: bool,
    open_end: bool,
    slope_limit: Option<usize>,
) -> PyResult<(f64, Bound<'py, PyArray2<i64>>)> {
    let columns = cost.shape()[1];
    let cells = slice("cost", &cost)?;
    let rules = Rules { open_begin, open_end, slope_limit };
    let (total, path) = py.detach(|| warp::time_warp(cells, columns, rules)).map_err(to_python)?;
    let length = path.len();
    let path = PyArray1::from_vec(py, path.into_flattened()).reshape([length, 2])?;
    Ok((total, path))
}
