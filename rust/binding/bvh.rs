//! Wrapper of `kernels/bvh.rs`.

use crate::arrays::empty;
use crate::errors::format_error;
use bytemuck::cast_slice;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pegbar_kernels::bvh;
use pyo3::prelude::*;

/// Names, parents and offsets of the joints; parents and offsets of the end sites.
type Hierarchy<'py> = (Vec<String>, Vec<i32>, Bound<'py, PyArray2<f64>>, Vec<i32>, Bound<'py, PyArray2<f64>>);
/// Channels of each joint, code of each channel, seconds a frame, numbers of each frame.
type Frames<'py> = (Vec<usize>, Bound<'py, PyArray1<u8>>, f64, Bound<'py, PyArray2<f64>>);

#[pyfunction]
pub fn parse_bvh<'py>(py: Python<'py>, path: &str, text: &[u8]) -> PyResult<(Hierarchy<'py>, Frames<'py>)> {
    let clip = py.detach(|| bvh::parse(text)).map_err(|error| format_error(py, path, &error))?;
    let points = |points: &[glam::DVec3]| -> PyResult<Bound<'py, PyArray2<f64>>> {
        let array = empty(py, [points.len(), 3])?;
        array.readwrite().as_slice_mut()?.copy_from_slice(cast_slice(points));
        Ok(array)
    };
    let codes = PyArray1::from_iter(py, clip.channels.iter().map(|channel| channel.code()));
    let values = PyArray1::from_vec(py, clip.values).reshape([clip.frames, clip.channels.len()])?;
    let (offsets, end_offsets) = (points(&clip.offsets)?, points(&clip.end_offsets)?);
    Ok((
        (clip.names, clip.parents, offsets, clip.end_parents, end_offsets),
        (clip.counts, codes, clip.frame_time, values),
    ))
}
