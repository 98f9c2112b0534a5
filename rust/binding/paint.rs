//! Wrapper of `kernels/paint.rs`.

use crate::arrays::{grouped, slice};
use crate::errors::to_python;
use numpy::PyUntypedArrayMethods;
use numpy::{PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray3};
use pegbar_kernels::paint::{self, Ink, Picture};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The picture's bytes in C order: a Fortran-ordered array would be painted scrambled.
fn writable<'a>(pixels: &'a mut PyReadwriteArray3<'_, u8>) -> PyResult<&'a mut [u8]> {
    if !pixels.is_c_contiguous() || pixels.shape()[2] != 4 {
        return Err(PyValueError::new_err("pixels: want a C-contiguous array of four channels"));
    }
    Ok(pixels.as_slice_mut()?)
}

#[pyfunction]
pub fn fill_polygon(
    py: Python<'_>,
    mut pixels: PyReadwriteArray3<'_, u8>,
    points: PyReadonlyArray2<'_, f64>,
    color: [u8; 4],
    antialias: bool,
) -> PyResult<()> {
    let [height, width] = [pixels.shape()[0], pixels.shape()[1]];
    let points = grouped("points", &points)?;
    let mut picture = Picture { pixels: writable(&mut pixels)?, width, height };
    py.detach(|| paint::fill_polygon(&mut picture, points, Ink { color, antialias })).map_err(to_python)
}

#[pyfunction]
pub fn stroke_polyline(
    py: Python<'_>,
    mut pixels: PyReadwriteArray3<'_, u8>,
    points: PyReadonlyArray2<'_, f64>,
    widths: PyReadonlyArray1<'_, f64>,
    closed: bool,
    color: [u8; 4],
    antialias: bool,
) -> PyResult<()> {
    let [height, width] = [pixels.shape()[0], pixels.shape()[1]];
    let (points, widths) = (grouped("points", &points)?, slice("width", &widths)?);
    let mut picture = Picture { pixels: writable(&mut pixels)?, width, height };
    let ink = Ink { color, antialias };
    py.detach(|| paint::stroke_polyline(&mut picture, points, widths, closed, ink)).map_err(to_python)
}

#[pyfunction]
pub fn unpremultiply<'py>(py: Python<'py>, pixels: PyReadonlyArray3<'py, u8>) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let out = PyArray3::zeros(py, [pixels.shape()[0], pixels.shape()[1], pixels.shape()[2]], false);
    let mut target = out.readwrite();
    let (from, to) = (slice("pixels", &pixels)?, target.as_slice_mut()?);
    py.detach(|| paint::unpremultiply(from, to)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
