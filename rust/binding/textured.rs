//! Wrapper of `kernels/textured.rs`.

use crate::arrays::grouped;
use crate::errors::to_python;
use numpy::{PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::texels::Texture;
use pegbar_kernels::textured::{self, Sheet, Target};
use pyo3::prelude::*;

#[pyfunction]
pub fn render_sheet<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
    texture_coordinates: PyReadonlyArray2<'py, f64>,
    texture: PyReadonlyArray3<'py, u8>,
    size: (usize, usize),
    samples: usize,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let out = PyArray3::zeros(py, [size.1, size.0, 4], false);
    let mut picture = out.readwrite();
    let sheet = Sheet {
        vertices: grouped("vertices", &vertices)?,
        texture_coordinates: grouped("texture_coordinates", &texture_coordinates)?,
        triangles: grouped("triangles", &triangles)?,
    };
    let (height, width) = (texture.shape()[0], texture.shape()[1]);
    let texture = Texture { pixels: grouped("texture", &texture)?, width, height };
    let target = Target { pixels: picture.as_slice_mut()?.as_chunks_mut().0, width: size.0, samples };
    py.detach(|| textured::render_sheet(sheet, texture, target)).map_err(to_python)?;
    drop(picture);
    Ok(out)
}
