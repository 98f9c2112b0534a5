//! Wrapper of `kernels/kinematics.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use glam::{DMat3, DVec3};
use numpy::PyUntypedArrayMethods;
use numpy::{PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pegbar_kernels::kinematics::{self, Channel, Skeleton};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Poses<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray4<f64>>);
/// Parents, offsets, rest axes (row by row; none: the parent's), channels of each joint, code of each channel.
type Joints<'py> =
    (Vec<i32>, PyReadonlyArray2<'py, f64>, PyReadonlyArray3<'py, f64>, Vec<usize>, PyReadonlyArray1<'py, u8>);

#[pyfunction]
pub fn forward_kinematics<'py>(
    py: Python<'py>,
    joints: Joints<'py>,
    values: PyReadonlyArray2<'py, f64>,
    degrees: bool,
) -> PyResult<Poses<'py>> {
    let (parents, offsets, axes, counts, codes) = &joints;
    let channels: Option<Vec<_>> = slice("channels", codes)?.iter().map(|code| Channel::from_code(*code)).collect();
    let channels = channels.ok_or_else(|| PyValueError::new_err("channels: want codes 0 to 5"))?;
    let offsets: &[DVec3] = grouped("offsets", offsets)?;
    let axes: &[[f64; 9]] = grouped("axes", axes)?;
    let axes: Vec<_> = axes.iter().map(|rows| DMat3::from_cols_array(rows).transpose()).collect();
    let skeleton = Skeleton { parents, offsets, axes: &axes, counts, channels: &channels, degrees };
    let (frames, numbers) = (values.shape()[0], slice("values", &values)?);
    let (places, turns) = (empty(py, [frames, parents.len(), 3])?, empty(py, [frames, parents.len(), 3, 3])?);
    let (mut places_out, mut turns_out) = (places.readwrite(), turns.readwrite());
    let (positions, rotations) =
        (places_out.as_slice_mut()?.as_chunks_mut().0, turns_out.as_slice_mut()?.as_chunks_mut().0);
    py.detach(|| kinematics::forward_kinematics(&skeleton, numbers, positions, rotations)).map_err(to_python)?;
    drop((places_out, turns_out));
    Ok((places, turns))
}
