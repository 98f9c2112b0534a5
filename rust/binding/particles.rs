//! Wrapper of `kernels/particles.rs`.

use crate::arrays::{grouped, slice};
use crate::errors::to_python;
use glam::DVec3;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyReadwriteArray2, PyUntypedArrayMethods};
use pegbar_kernels::particles::{self, Nature};
use pegbar_kernels::surroundings::{Bed, Surroundings};
use pyo3::prelude::*;

/// Substep, gravity; drag; flutter; shares that stick and slide; droplets and their speed; lifetimes; bounds.
type Behaviour = ((f64, [f64; 3]), f64, [f64; 2], [f64; 2], (u32, f64), [f64; 4], ([f64; 3], [f64; 3]));

/// Vertices before and after the frame, triangles.
type Facets<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>);

/// First node's x and z, metres between nodes, whether flakes are taken up, heights (rows, columns).
type Field<'py> = ([f64; 2], f64, bool, PyReadonlyArray2<'py, f64>);

/// Places, speeds, radii and ages (n, 8); serial numbers, hosts and phases (n, 3).
type State<'py> = (PyReadwriteArray2<'py, f64>, PyReadwriteArray2<'py, i64>);

#[pyfunction]
pub fn step_particles<'py>(
    py: Python<'py>,
    behaviour: Behaviour,
    capsules: PyReadonlyArray3<'_, f64>,
    facets: Facets<'_>,
    ground: (f64, bool, Vec<Field<'_>>),
    air: ([f64; 3], PyReadonlyArray2<'_, f64>, f64),
    mut state: State<'_>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let nature = nature(behaviour);
    let substeps = capsules.shape()[0].saturating_sub(1);
    let beds: PyResult<Vec<Bed<'_>>> = ground.2.iter().map(bed).collect();
    let vertices: [&[DVec3]; 2] = [grouped("vertices", &facets.0)?, grouped("vertices", &facets.1)?];
    let around = Surroundings {
        capsules: grouped("capsules", &capsules)?,
        substeps,
        vertices,
        triangles: grouped("triangles", &facets.2)?,
        ground: ground.0,
        absorbs: ground.1,
        beds: &beds?,
        wind: DVec3::from_array(air.0),
        waves: grouped("waves", &air.1)?,
        time: air.2,
    };
    let motion: &mut [[f64; 8]] = bytemuck::cast_slice_mut(state.0.as_slice_mut()?);
    let codes: &mut [[i64; 3]] = bytemuck::cast_slice_mut(state.1.as_slice_mut()?);
    let landed = py.detach(|| particles::step_particles(&nature, &around, motion, codes)).map_err(to_python)?;
    let count = landed.len();
    landed.into_flattened().into_pyarray(py).reshape([count, 4])
}

fn nature(behaviour: Behaviour) -> Nature {
    let ((step, gravity), drag, flutter, fates, splash, lives, (low, high)) = behaviour;
    let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
    Nature { step, gravity: DVec3::from_array(gravity), drag, flutter, fates, splash, lives, low, high }
}

fn bed<'a>(field: &'a Field<'_>) -> PyResult<Bed<'a>> {
    let (origin, spacing, absorbs, heights) = field;
    let columns = heights.shape()[1];
    Ok(Bed { origin: *origin, spacing: *spacing, columns, absorbs: *absorbs, heights: slice("heights", heights)? })
}
