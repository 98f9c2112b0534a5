//! Wrapper of `kernels/raster.rs` and `kernels/resolve.rs`.

use crate::arrays::{grouped, slice};
use crate::errors::to_python;
use glam::DVec3;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyReadwriteArray2, PyReadwriteArray3, PyUntypedArrayMethods};
use pegbar_kernels::ink::Ink;
use pegbar_kernels::raster::{self, Passes};
use pegbar_kernels::resolve::{self, Samples};
use pegbar_kernels::shade::Toon;
use pegbar_kernels::surface::{Scene, View};
use pyo3::prelude::*;

/// Beauty, depth, coverage, object id.
type Pictures<'py> =
    (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u16>>);

/// The same, borrowed to be written.
type Borrowed<'py> = (
    PyReadwriteArray3<'py, f32>,
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, f32>,
    PyReadwriteArray2<'py, u16>,
);

fn pictures(py: Python<'_>, height: usize, width: usize) -> Pictures<'_> {
    let plane = || PyArray2::zeros(py, [height, width], false);
    (PyArray3::zeros(py, [height, width, 4], false), plane(), plane(), PyArray2::zeros(py, [height, width], false))
}

fn borrow<'py>(pictures: &Pictures<'py>) -> Borrowed<'py> {
    (pictures.0.readwrite(), pictures.1.readwrite(), pictures.2.readwrite(), pictures.3.readwrite())
}

fn passes<'a>(borrowed: &'a mut Borrowed<'_>) -> PyResult<Passes<'a>> {
    Ok(Passes {
        beauty: borrowed.0.as_slice_mut()?.as_chunks_mut().0,
        depth: borrowed.1.as_slice_mut()?,
        coverage: borrowed.2.as_slice_mut()?,
        object_id: borrowed.3.as_slice_mut()?,
    })
}

type Geometry<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u16>,
);

#[pyfunction]
pub fn render_passes<'py>(
    py: Python<'py>,
    geometry: Geometry<'py>,
    camera: ([[f64; 4]; 3], usize, usize),
    near: f64,
    toon: ([f64; 3], PyReadonlyArray1<'py, f32>),
    ink: (f32, [f32; 4], f32, f32),
) -> PyResult<Pictures<'py>> {
    let (matrix, width, height) = camera;
    let out = pictures(py, height, width);
    let mut borrowed = borrow(&out);
    let target = passes(&mut borrowed)?;
    let (vertices, triangles) = (grouped("vertices", &geometry.0)?, grouped("triangles", &geometry.1)?);
    let (colors, normals) = (grouped("colors", &geometry.2)?, grouped("normals", &geometry.3)?);
    let scene = Scene { vertices, triangles, colors, normals, objects: slice("objects", &geometry.4)? };
    let view = View { matrix, near, width, height, margin: 0 };
    let toon = Toon { light: DVec3::from_array(toon.0), bands: slice("bands", &toon.1)? };
    let ink = Ink { width: ink.0, color: ink.1, crease_angle: ink.2, depth_jump: ink.3 };
    py.detach(|| raster::render_passes(&scene, &view, toon, ink, target)).map_err(to_python)?;
    drop(borrowed);
    Ok(out)
}

#[pyfunction]
pub fn resolve_passes<'py>(
    py: Python<'py>,
    beauty: PyReadonlyArray3<'py, f32>,
    depth: PyReadonlyArray2<'py, f32>,
    coverage: PyReadonlyArray2<'py, f32>,
    object_id: PyReadonlyArray2<'py, u16>,
    factor: usize,
) -> PyResult<Pictures<'py>> {
    let [height, width] = [0, 1].map(|axis| depth.shape()[axis] / factor.max(1));
    let out = pictures(py, height, width);
    let mut borrowed = borrow(&out);
    let target = passes(&mut borrowed)?;
    let (beauty, depth) = (grouped("beauty", &beauty)?, slice("depth", &depth)?);
    let (coverage, object_id) = (slice("coverage", &coverage)?, slice("object_id", &object_id)?);
    let samples = Samples { beauty, depth, coverage, object_id };
    py.detach(|| resolve::resolve(samples, width, factor, target)).map_err(to_python)?;
    drop(borrowed);
    Ok(out)
}
