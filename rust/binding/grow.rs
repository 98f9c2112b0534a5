//! Wrapper of `kernels/grow.rs`.

use crate::arrays::{empty, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::grow;
use pyo3::prelude::*;

#[pyfunction]
#[pyo3(signature = (labels, figure, reach))]
pub fn grow_labels<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, u8>,
    figure: PyReadonlyArray2<'py, u8>,
    reach: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let [height, width] = [labels.shape()[0], labels.shape()[1]];
    let out: Bound<'py, PyArray2<u8>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (labels, figure, grown) = (slice("labels", &labels)?, slice("figure", &figure)?, target.as_slice_mut()?);
    py.detach(|| grow::grow_labels(labels, figure, width, reach, grown)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
