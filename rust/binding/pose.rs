//! Wrapper of `kernels/pose.rs`.

use crate::arrays::{empty, grouped};
use crate::errors::to_python;
use bytemuck::cast_slice_mut;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::pose::{self, Settings};
use pegbar_kernels::robust::Loss;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Fits<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Principal point, focal length and its spread, spreads of roll and elevation, loss and its scale, starts.
type Options<'py> = ([f64; 2], f64, Option<f64>, [f64; 2], &'py str, f64, usize);

#[pyfunction]
pub fn fit_poses<'py>(
    py: Python<'py>,
    joints: PyReadonlyArray2<'py, f64>,
    poses: PyReadonlyArray3<'py, f64>,
    options: Options<'py>,
) -> PyResult<Fits<'py>> {
    let (principal, focal, focal_spread, [roll_spread, elevation_spread], loss, scale, starts) = options;
    let (principal, loss) = (principal.into(), named(loss)?);
    let settings = Settings { principal, focal, focal_spread, roll_spread, elevation_spread, loss, scale, starts };
    let [count, marks] = [poses.shape()[0], joints.shape()[0]];
    let out: Fits<'py> = (empty(py, [count, 3, 4])?, empty(py, [count])?, empty(py, [count, marks])?);
    let (mut matrices, mut costs, mut distances) = (out.0.readwrite(), out.1.readwrite(), out.2.readwrite());
    let (joints, poses) = (grouped("joints", &joints)?, grouped("poses", &poses)?);
    let matrices = cast_slice_mut(matrices.as_slice_mut()?);
    let (costs, distances) = (costs.as_slice_mut()?, distances.as_slice_mut()?);
    py.detach(|| pose::fit_poses(joints, poses, &settings, matrices, costs, distances)).map_err(to_python)?;
    Ok(out.clone())
}

/// The loss of a name.
fn named(name: &str) -> PyResult<Loss> {
    match name {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber),
        "cauchy" => Ok(Loss::Cauchy),
        "geman_mcclure" => Ok(Loss::GemanMcClure),
        _ => Err(PyValueError::new_err(format!("loss: no loss {name:?}"))),
    }
}
