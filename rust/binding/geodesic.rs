//! Wrapper of `kernels/geodesic.rs`.

use crate::arrays::{empty, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::geodesic;
use pyo3::prelude::*;

type Grown<'py> = (Bound<'py, PyArray2<u8>>, Bound<'py, PyArray2<f32>>);

#[pyfunction]
pub fn geodesic_labels<'py>(
    py: Python<'py>,
    seeds: PyReadonlyArray2<'py, u8>,
    costs: PyReadonlyArray2<'py, f32>,
    paces: PyReadonlyArray1<'py, f64>,
) -> PyResult<Grown<'py>> {
    let [height, width] = [seeds.shape()[0], seeds.shape()[1]];
    let labels: Bound<'py, PyArray2<u8>> = empty(py, [height, width])?;
    let distances: Bound<'py, PyArray2<f32>> = empty(py, [height, width])?;
    let (mut grown, mut lengths) = (labels.readwrite(), distances.readwrite());
    let (seeds, costs, paces) = (slice("seeds", &seeds)?, slice("costs", &costs)?, slice("paces", &paces)?);
    let (grown_slice, length_slice) = (grown.as_slice_mut()?, lengths.as_slice_mut()?);
    py.detach(|| geodesic::geodesic_labels(seeds, costs, width, paces, grown_slice, length_slice))
        .map_err(to_python)?;
    drop((grown, lengths));
    Ok((labels, distances))
}
