//! Wrapper of `kernels/color.rs`.

use crate::arrays::slice;
use crate::errors::to_python;
use numpy::{PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::color::{self, Conversion};
use pyo3::prelude::*;

#[pyfunction]
pub fn convert_srgb<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
    encode: bool,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let [height, width] = [pixels.shape()[0], pixels.shape()[1]];
    let out = PyArray3::zeros(py, [height, width, 4], false);
    let mut target = out.readwrite();
    let (pixels, values) = (slice("pixels", &pixels)?, target.as_slice_mut()?);
    let how = if encode { Conversion::Encode } else { Conversion::Decode };
    py.detach(|| color::convert_picture(how, pixels, width, values)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
