//! Wrapper of `kernels/signs.rs`.

use crate::arrays::{empty, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::signs::{self, Track};
use pyo3::prelude::*;

type Doubles<'py> = PyReadonlyArray2<'py, f64>;

/// The limbs' rows of `planar`, `clip`, `noise` (all limbs x frames) and `scales` (limbs x 2: jolt, doubt).
fn tracks<'a>([planar, clip, noise, scales]: &'a [Doubles<'_>; 4]) -> PyResult<Vec<Track<'a>>> {
    let frames = planar.shape()[1].max(1);
    let rows = slice("planar", planar)?.chunks(frames).zip(slice("clip", clip)?.chunks(frames));
    let scales = slice("scales", scales)?.chunks_exact(2);
    let limbs = rows.zip(slice("noise", noise)?.chunks(frames)).zip(scales);
    Ok(limbs
        .map(|(((planar, clip), noise), scale)| Track { planar, clip, noise, jolt: scale[0], doubt: scale[1] })
        .collect())
}

#[pyfunction]
pub fn limb_depths<'py>(
    py: Python<'py>,
    drawn: [Doubles<'py>; 4],
    lengths: Doubles<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let out: Bound<'py, PyArray2<f64>> = empty(py, [lengths.shape()[0], lengths.shape()[1]])?;
    let mut target = out.readwrite();
    let (tracks, lengths, depths) = (tracks(&drawn)?, slice("lengths", &lengths)?, target.as_slice_mut()?);
    py.detach(|| signs::limb_depths(&tracks, lengths, depths)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

#[pyfunction]
pub fn length_costs<'py>(
    py: Python<'py>,
    drawn: [Doubles<'py>; 4],
    candidates: Doubles<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let out: Bound<'py, PyArray2<f64>> = empty(py, [candidates.shape()[0], candidates.shape()[1]])?;
    let mut target = out.readwrite();
    let (tracks, candidates, costs) = (tracks(&drawn)?, slice("candidates", &candidates)?, target.as_slice_mut()?);
    py.detach(|| signs::length_costs(&tracks, candidates, costs)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
