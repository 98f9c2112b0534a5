//! Wrapper of `kernels/fit.rs` and `kernels/deform.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use glam::DVec2;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyReadonlyArray4, PyUntypedArrayMethods};
use pegbar_kernels::deform::{self, Frames, Stitch};
use pegbar_kernels::fit;
use pyo3::prelude::*;

#[pyfunction]
pub fn fit_triangles<'py>(
    py: Python<'py>,
    shapes: PyReadonlyArray3<'py, f64>,
    intermediate: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let out: Bound<'py, PyArray3<f64>> = empty(py, [triangles.shape()[0], 3, 2])?;
    let mut target = out.readwrite();
    let (shapes, triangles) = (grouped("shapes", &shapes)?, grouped("triangles", &triangles)?);
    let (places, fitted) = (grouped("intermediate", &intermediate)?, bytemuck::cast_slice_mut(target.as_slice_mut()?));
    py.detach(|| fit::fit_triangles(shapes, places, triangles, fitted)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

#[pyfunction]
pub fn average_triangles<'py>(
    py: Python<'py>,
    fitted: PyReadonlyArray3<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
    count: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let out: Bound<'py, PyArray2<f64>> = empty(py, [count, 2])?;
    let mut target = out.readwrite();
    let (fitted, triangles) = (grouped("fitted", &fitted)?, grouped("triangles", &triangles)?);
    let places: &mut [DVec2] = bytemuck::cast_slice_mut(target.as_slice_mut()?);
    py.detach(|| fit::average_triangles(fitted, triangles, places)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

/// A factored mesh.
#[pyclass(frozen, module = "pegbar._kernels")]
pub struct Deformer(deform::Deformer);

#[pymethods]
impl Deformer {
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
        handles: PyReadonlyArray1<'_, u32>,
        guides: PyReadonlyArray1<'_, u32>,
    ) -> PyResult<Self> {
        let (vertices, triangles) = (grouped("vertices", &vertices)?, grouped("triangles", &triangles)?);
        let (handles, guides) = (slice("handles", &handles)?, slice("guides", &guides)?);
        Ok(Self(py.detach(|| deform::Deformer::new(vertices, triangles, handles, guides)).map_err(to_python)?))
    }

    fn deform<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray3<'py, f64>,
        shapes: Option<PyReadonlyArray4<'py, f64>>,
        iterations: usize,
        average: bool,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let out: Bound<'py, PyArray3<f64>> = empty(py, [positions.shape()[0], self.0.count(), 2])?;
        let mut target = out.readwrite();
        let shapes = shapes.as_ref().map(|shapes| grouped("shapes", shapes)).transpose()?;
        let stitch = if average { Stitch::Average } else { Stitch::Poisson };
        let frames = Frames { positions: grouped("positions", &positions)?, shapes, iterations, stitch };
        let places = bytemuck::cast_slice_mut(target.as_slice_mut()?);
        py.detach(|| self.0.deform(frames, places)).map_err(to_python)?;
        drop(target);
        Ok(out)
    }
}
