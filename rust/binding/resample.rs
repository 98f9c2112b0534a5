//! Wrapper of `kernels/resample.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::resample;
use pyo3::prelude::*;

#[pyfunction]
pub fn resample_view<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray3<'py, f32>,
    view: [f64; 6],
    size: [usize; 2],
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let [width, film] = [picture.shape()[1], size[0]];
    let out: Bound<'py, PyArray3<f32>> = empty(py, [size[1], film, 4])?;
    let mut target = out.readwrite();
    let colors = grouped::<f32, [f32; 4], _>("picture", &picture)?;
    let pixels = bytemuck::cast_slice_mut(target.as_slice_mut()?);
    py.detach(|| resample::resample_rgba(colors, width, &view, pixels, film)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

#[pyfunction]
pub fn nearest_view<'py>(
    py: Python<'py>,
    known: PyReadonlyArray2<'py, u8>,
    view: [f64; 6],
    size: [usize; 2],
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let [width, film] = [known.shape()[1], size[0]];
    let out: Bound<'py, PyArray2<i64>> = empty(py, [size[1], film])?;
    let mut target = out.readwrite();
    let (known, indices) = (slice("known", &known)?, target.as_slice_mut()?);
    py.detach(|| resample::nearest(known, width, &view, indices, film)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
