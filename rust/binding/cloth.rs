//! Wrapper of `kernels/cloth.rs` and `kernels/capsule.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use glam::DVec3;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyReadwriteArray2, PyUntypedArrayMethods};
use pegbar_kernels::capsule;
use pegbar_kernels::cloth::{self, Drive};
use pegbar_kernels::sheet::{Forces, Sheet};
use pyo3::prelude::*;

/// Weights, triangles; then pairs and their metres: links, folds, stays, tethers.
type Made<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray1<'py, f64>,
);

/// Compliances of links and folds; substep, gravity; drag, damping, thickness, friction, ground; rounds.
type Acting = ([f64; 2], (f64, [f64; 3]), (f64, f64, f64, f64, f64), usize);

#[pyfunction]
pub fn step_cloth(
    py: Python<'_>,
    made: Made<'_>,
    acting: Acting,
    air: PyReadonlyArray2<'_, f64>,
    pins: (PyReadonlyArray1<'_, u32>, PyReadonlyArray3<'_, f64>),
    capsules: PyReadonlyArray3<'_, f64>,
    mut state: (PyReadwriteArray2<'_, f64>, PyReadwriteArray2<'_, f64>),
) -> PyResult<()> {
    let (weights, triangles) = (slice("weights", &made.0)?, grouped("triangles", &made.1)?);
    let (links, lengths) = (grouped("links", &made.2)?, slice("lengths", &made.3)?);
    let (folds, spans) = (grouped("folds", &made.4)?, slice("spans", &made.5)?);
    let (stays, spread) = (grouped("stays", &made.6)?, slice("spread", &made.7)?);
    let (tethers, reaches) = (grouped("tethers", &made.8)?, slice("reaches", &made.9)?);
    let (compliances, (step, gravity), (drag, damping, thickness, friction, ground), rounds) = acting;
    let sheet =
        Sheet { weights, triangles, links, lengths, folds, spans, tethers, reaches, stays, spread, compliances };
    let (gravity, air) = (DVec3::from_array(gravity), grouped("air", &air)?);
    let forces = Forces { step, gravity, air, drag, damping, thickness, friction, ground };
    let substeps = pins.1.shape()[0];
    let (capsules, targets) = (grouped("capsules", &capsules)?, grouped("targets", &pins.1)?);
    let drive = Drive { pins: slice("pins", &pins.0)?, targets, capsules, substeps, rounds };
    let positions: &mut [DVec3] = bytemuck::cast_slice_mut(state.0.as_slice_mut()?);
    let velocities: &mut [DVec3] = bytemuck::cast_slice_mut(state.1.as_slice_mut()?);
    py.detach(|| cloth::step_cloth(&sheet, &forces, &drive, positions, velocities)).map_err(to_python)
}

/// Metres by point, and the nearest capsule's row.
type Distances<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u32>>);

#[pyfunction]
pub fn capsule_distances<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    capsules: PyReadonlyArray2<'py, f64>,
) -> PyResult<Distances<'py>> {
    let count = [points.shape()[0]];
    let (distance, nearest): Distances<'py> = (empty(py, count)?, empty(py, count)?);
    let (mut metres, mut rows) = (distance.readwrite(), nearest.readwrite());
    let (points, capsules) = (grouped("points", &points)?, grouped("capsules", &capsules)?);
    let (metres_out, rows_out) = (metres.as_slice_mut()?, rows.as_slice_mut()?);
    py.detach(|| capsule::distances(points, capsules, metres_out, rows_out)).map_err(to_python)?;
    drop((metres, rows));
    Ok((distance, nearest))
}
