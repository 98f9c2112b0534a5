//! Wrapper of `kernels/strand.rs`.

use crate::arrays::{grouped, slice};
use crate::errors::to_python;
use glam::DVec3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyReadwriteArray2, PyUntypedArrayMethods};
use pegbar_kernels::cloth::Drive;
use pegbar_kernels::sheet::Forces;
use pegbar_kernels::strand::{self, Strands};
use pyo3::prelude::*;

/// Rows of points, where strands end, which points are bobs.
type Made<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray1<'py, u32>, PyReadonlyArray1<'py, u32>);

/// Substep, gravity; drag, damping, thickness, friction, ground; rounds.
type Acting = ((f64, [f64; 3]), (f64, f64, f64, f64, f64), usize);

#[pyfunction]
pub fn step_strands(
    py: Python<'_>,
    made: Made<'_>,
    acting: Acting,
    air: PyReadonlyArray2<'_, f64>,
    pins: (PyReadonlyArray1<'_, u32>, PyReadonlyArray3<'_, f64>),
    capsules: PyReadonlyArray3<'_, f64>,
    mut state: (PyReadwriteArray2<'_, f64>, PyReadwriteArray2<'_, f64>),
) -> PyResult<()> {
    let (points, ends, bobs) = (grouped("points", &made.0)?, slice("ends", &made.1)?, slice("bobs", &made.2)?);
    let ((step, gravity), (drag, damping, thickness, friction, ground), rounds) = acting;
    let (gravity, air) = (DVec3::from_array(gravity), grouped("air", &air)?);
    let forces = Forces { step, gravity, air, drag, damping, thickness, friction, ground };
    let substeps = pins.1.shape()[0];
    let (capsules, targets) = (grouped("capsules", &capsules)?, grouped("targets", &pins.1)?);
    let drive = Drive { pins: slice("pins", &pins.0)?, targets, capsules, substeps, rounds };
    let positions: &mut [DVec3] = bytemuck::cast_slice_mut(state.0.as_slice_mut()?);
    let velocities: &mut [DVec3] = bytemuck::cast_slice_mut(state.1.as_slice_mut()?);
    let strands = Strands { points, ends, bobs };
    py.detach(|| strand::step_strands(&strands, &forces, &drive, positions, velocities)).map_err(to_python)
}
