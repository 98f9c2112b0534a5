//! Wrapper of `kernels/amc.rs`.

use crate::errors::format_error;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pegbar_kernels::amc;
use pyo3::prelude::*;

/// Keywords, first frame's number, step from number to number, numbers of each frame.
type Motion<'py> = (Vec<String>, usize, usize, Bound<'py, PyArray2<f64>>);

#[pyfunction]
pub fn parse_amc<'py>(py: Python<'py>, path: &str, text: &[u8], bones: Vec<(String, usize)>) -> PyResult<Motion<'py>> {
    let clip = py.detach(|| amc::parse(text, &bones)).map_err(|error| format_error(py, path, &error))?;
    let width = bones.iter().map(|(_, count)| count).sum();
    let values = PyArray1::from_vec(py, clip.values).reshape([clip.frames, width])?;
    Ok((clip.keywords, clip.first, clip.step, values))
}
