//! Wrapper of `kernels/search.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pegbar_kernels::search::{self, Clips, Drawn, Found};
use pyo3::prelude::*;

/// Angles, weights, orders and steps of a drawn sequence.
type Sequence<'py> =
    (PyReadonlyArray3<'py, f32>, PyReadonlyArray3<'py, f32>, PyReadonlyArray2<'py, u32>, PyReadonlyArray3<'py, u32>);

/// Costs and end frames, (blocks, views x labellings x orders).
type Best<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u32>>);

/// Sums of ways (G,) and the steps that led there (n, G).
type Ways<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<u16>>);

#[pyfunction]
pub fn search_clips<'py>(
    py: Python<'py>,
    vectors: PyReadonlyArray3<'py, f32>,
    ranges: PyReadonlyArray2<'py, u64>,
    views: PyReadonlyArray3<'py, f32>,
    drawn: Sequence<'py>,
    block: usize,
) -> PyResult<Best<'py>> {
    let (angles, weights, orders, steps) = drawn;
    let (frames, limbs) = (angles.shape()[1], angles.shape()[2]);
    let clips = Clips { vectors: slice("vectors", &vectors)?, limbs, ranges: grouped("ranges", &ranges)? };
    let (angles, weights) = (slice("angles", &angles)?, slice("weights", &weights)?);
    let sequence =
        Drawn { angles, weights, frames, orders: slice("orders", &orders)?, steps: grouped("steps", &steps)? };
    let views = grouped("views", &views)?;
    let rows = search::count_blocks(clips.ranges, block);
    let columns = sequence.count_paths(limbs) * views.len();
    let mut found = vec![Found::NOTHING; rows * columns];
    py.detach(|| search::search_clips(clips, sequence, views, block, &mut found)).map_err(to_python)?;
    let best: Best<'py> = (empty(py, [rows, columns])?, empty(py, [rows, columns])?);
    best.0.readwrite().as_slice_mut()?.iter_mut().zip(&found).for_each(|(cost, found)| *cost = found.cost);
    best.1.readwrite().as_slice_mut()?.iter_mut().zip(&found).for_each(|(end, found)| *end = found.end);
    Ok(best)
}

/// The sums (G,) of the ways through the next rows, and the steps taken (n, G).
#[pyfunction]
pub fn segment_rows<'py>(
    py: Python<'py>,
    costs: PyReadonlyArray2<'py, f64>,
    steps: PyReadonlyArray2<'py, u32>,
    before: PyReadonlyArray1<'py, f64>,
) -> PyResult<Ways<'py>> {
    let rows: Ways<'py> = (empty(py, [before.shape()[0]])?, empty(py, [costs.shape()[0], costs.shape()[1]])?);
    let (mut sums, mut taken) = (rows.0.readwrite(), rows.1.readwrite());
    sums.as_slice_mut()?.copy_from_slice(slice("before", &before)?);
    let (costs, steps) = (slice("costs", &costs)?, grouped("steps", &steps)?);
    let (reached, moved) = (sums.as_slice_mut()?, taken.as_slice_mut()?);
    py.detach(|| search::segment_rows(costs, steps, reached, moved)).map_err(to_python)?;
    drop((sums, taken));
    Ok(rows)
}
