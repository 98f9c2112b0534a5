//! Wrapper of `kernels/depth.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::depth::{self, Interpolation};
use pyo3::prelude::*;

#[pyfunction]
pub fn limb_depth<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, u8>,
    ends: PyReadonlyArray3<'py, f64>,
    end_depths: PyReadonlyArray2<'py, f64>,
    perspective: bool,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let [height, width] = [labels.shape()[0], labels.shape()[1]];
    let out: Bound<'py, PyArray2<f32>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (labels, pixels) = (slice("labels", &labels)?, target.as_slice_mut()?);
    let (ends, depths) = (grouped("ends", &ends)?, grouped("end_depths", &end_depths)?);
    let how = if perspective { Interpolation::Perspective } else { Interpolation::Linear };
    py.detach(|| depth::limb_depth(labels, width, ends, depths, how, pixels)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
