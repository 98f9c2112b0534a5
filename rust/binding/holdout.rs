//! Wrapper of `kernels/holdout.rs`.

use crate::arrays::slice;
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pegbar_kernels::holdout::{self, Planes};
use pyo3::prelude::*;

#[pyfunction]
pub fn composite_matte<'py>(
    py: Python<'py>,
    alpha: PyReadonlyArray2<'py, f32>,
    drawing_depth: PyReadonlyArray2<'py, f32>,
    rendered_alpha: Option<PyReadonlyArray2<'py, f32>>,
    rendered_depth: PyReadonlyArray2<'py, f32>,
    scale: usize,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let [height, width] = [alpha.shape()[0], alpha.shape()[1]];
    let out = PyArray2::zeros(py, [height, width], false);
    let mut target = out.readwrite();
    let (alpha, depth) = (slice("alpha", &alpha)?, slice("drawing_depth", &drawing_depth)?);
    let rendered_alpha = rendered_alpha.as_ref().map(|array| slice("rendered_alpha", array)).transpose()?;
    let rendered_depth = slice("rendered_depth", &rendered_depth)?;
    let planes = Planes { alpha, depth, rendered_alpha, rendered_depth, width, scale };
    let pixels = target.as_slice_mut()?;
    py.detach(|| holdout::matte(&planes, pixels)).map_err(to_python)?;
    drop(target);
    Ok(out)
}
