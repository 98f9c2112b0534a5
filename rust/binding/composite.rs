//! Wrapper of `kernels/composite.rs`.

use crate::arrays::slice;
use crate::errors::to_python;
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray3, PyUntypedArrayMethods};
use pegbar_kernels::color::Space;
use pegbar_kernels::composite::{self, Layer, Render, Rendered, Target};
use pyo3::prelude::*;

#[derive(FromPyObject)]
pub enum Pixels<'py> {
    Bytes(PyReadonlyArray3<'py, u8>),
    Floats(PyReadonlyArray3<'py, f32>),
}

#[derive(FromPyObject)]
pub enum Output<'py> {
    Bytes(PyReadwriteArray3<'py, u8>),
    Floats(PyReadwriteArray3<'py, f32>),
}

#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn depth_composite(
    py: Python<'_>,
    drawing: PyReadonlyArray3<'_, u8>,
    alpha: PyReadonlyArray2<'_, f32>,
    drawing_depth: PyReadonlyArray2<'_, f32>,
    rendered: Pixels<'_>,
    rendered_depth: PyReadonlyArray2<'_, f32>,
    scale: usize,
    linear: [bool; 2],
    mut out: Output<'_>,
) -> PyResult<()> {
    let (pixels, channels, width) = (slice("drawing", &drawing)?, drawing.shape()[2], drawing.shape()[1]);
    let (alpha, depth) = (slice("alpha", &alpha)?, slice("drawing_depth", &drawing_depth)?);
    let layer = Layer { pixels, channels, width, alpha, depth };
    let pixels = match &rendered {
        Pixels::Bytes(array) => Rendered::Bytes(slice("rendered", array)?),
        Pixels::Floats(array) => Rendered::Floats(slice("rendered", array)?),
    };
    let [space, result] = linear.map(|linear| if linear { Space::Linear } else { Space::Display });
    let render = Render { pixels, depth: slice("rendered_depth", &rendered_depth)?, scale, space };
    let target = match &mut out {
        Output::Bytes(array) => Target::Bytes(array.as_slice_mut()?),
        Output::Floats(array) => Target::Floats(array.as_slice_mut()?),
    };
    py.detach(|| composite::depth_composite(&layer, &render, result, target)).map_err(to_python)
}
