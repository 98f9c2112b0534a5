//! Wrapper of `kernels/triangulate.rs`.

use crate::arrays::grouped;
use crate::errors::to_python;
use glam::DVec2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pegbar_kernels::triangulate::{self, Ring};
use pyo3::prelude::*;

/// Triangles and crossing edges.
type Meshed<'py> = (Bound<'py, PyArray2<u32>>, Bound<'py, PyArray2<u32>>);

fn rows<'py, const N: usize>(py: Python<'py>, rows: Vec<[u32; N]>) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, N])
}

#[pyfunction]
pub fn constrained_delaunay<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    edges: PyReadonlyArray2<'py, u32>,
) -> PyResult<Meshed<'py>> {
    let (points, edges) = (grouped("points", &points)?, grouped("edges", &edges)?);
    let mesh = py.detach(|| triangulate::triangulate(points, edges)).map_err(to_python)?;
    Ok((rows(py, mesh.triangles)?, rows(py, mesh.crossing)?))
}

#[pyfunction]
pub fn inside_rings<'py>(
    py: Python<'py>,
    places: PyReadonlyArray2<'py, f64>,
    rings: Vec<(PyReadonlyArray2<'py, f64>, bool)>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let places = grouped("places", &places)?;
    let read = |(ring, hole): &(PyReadonlyArray2<'py, f64>, bool)| -> PyResult<Ring> {
        Ok(Ring::new(grouped::<f64, DVec2, _>("rings", ring)?, *hole))
    };
    let rings = rings.iter().map(read).collect::<PyResult<Vec<Ring>>>()?;
    Ok(py.detach(|| triangulate::inside(places, &rings)).into_pyarray(py))
}
