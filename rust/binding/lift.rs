//! Wrapper of `kernels/lift.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArray4, PyUntypedArrayMethods};
use pegbar_kernels::lift::{self, Lift};
use pyo3::prelude::*;

#[pyfunction]
pub fn lift_markers<'py>(
    py: Python<'py>,
    projection: PyReadonlyArray4<'py, f64>,
    limbs: PyReadonlyArray2<'py, i64>,
    lengths: PyReadonlyArray2<'py, f64>,
    prior: PyReadonlyArray3<'py, f64>,
    weights: (f64, f64),
    subspace: (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, f64>),
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let [frames, markers] = [prior.shape()[0], prior.shape()[1]];
    let out: Bound<'py, PyArray3<f64>> = empty(py, [frames, markers, 3])?;
    let mut target = out.readwrite();
    let (limbs, (limb_weight, prior_weight)) = (grouped("limbs", &limbs)?, weights);
    let (mean, components) = (slice("mean", &subspace.0)?, slice("components", &subspace.1)?);
    let shared = Lift { markers, limbs, limb_weight, prior_weight, mean, components };
    let (rows, poses) = (grouped("projection", &projection)?, target.as_slice_mut()?);
    let (lengths, prior) = (slice("lengths", &lengths)?, slice("prior", &prior)?);
    py.detach(|| lift::lift(&shared, rows, lengths, prior, poses)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
