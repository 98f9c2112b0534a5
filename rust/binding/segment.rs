//! Wrapper of `kernels/segment.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::segment;
use pyo3::prelude::*;

#[pyfunction]
pub fn segment_stick_figure<'py>(
    py: Python<'py>,
    gray: PyReadonlyArray2<'py, u8>,
    ends: PyReadonlyArray3<'py, f64>,
    half_widths: PyReadonlyArray1<'py, f64>,
    threshold: u16,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let [height, width] = [gray.shape()[0], gray.shape()[1]];
    let out: Bound<'py, PyArray2<u8>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (gray, labels) = (slice("gray", &gray)?, target.as_slice_mut()?);
    let (ends, half_widths) = (grouped("ends", &ends)?, slice("half_width", &half_widths)?);
    py.detach(|| segment::segment_stick_figure(gray, width, ends, half_widths, threshold, labels))
        .map_err(to_python)?;
    drop(target);
    Ok(out)
}
