//! Wrapper of `kernels/matte.rs` and `kernels/fill.rs`.

use crate::arrays::{empty, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::error::KernelError;
use pegbar_kernels::fill;
use pegbar_kernels::matte::{self as kernel, Mode};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Picture<'py> = PyReadonlyArray3<'py, u8>;
type ColorAndAlpha<'py> = (Bound<'py, PyArray3<u8>>, Bound<'py, PyArray2<f32>>);

#[pyfunction]
pub fn ink_alpha<'py>(py: Python<'py>, image: Picture<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let [height, width, channels] = [image.shape()[0], image.shape()[1], image.shape()[2]];
    let out: Bound<'py, PyArray2<f32>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (image, alpha) = (slice("image", &image)?, target.as_slice_mut()?);
    py.detach(|| kernel::ink_alpha(image, channels, width, alpha)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

#[pyfunction]
pub fn has_alpha(py: Python<'_>, image: Picture<'_>) -> PyResult<bool> {
    let channels = image.shape()[2];
    let image = slice("image", &image)?;
    Ok(py.detach(|| kernel::has_alpha(image, channels)))
}

#[pyfunction]
pub fn own_alpha<'py>(py: Python<'py>, image: Picture<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let [height, width] = [image.shape()[0], image.shape()[1]];
    let out: Bound<'py, PyArray2<f32>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (image, alpha) = (slice("image", &image)?, target.as_slice_mut()?);
    py.detach(|| kernel::own_alpha(image, width, alpha)).map_err(to_python)?;
    drop(target);
    Ok(out)
}

#[pyfunction]
pub fn matte<'py>(py: Python<'py>, image: Picture<'py>, mode: &str) -> PyResult<ColorAndAlpha<'py>> {
    let mode = match mode {
        "ink" => Mode::Ink,
        "unmix" => Mode::Unmix,
        _ => return Err(PyValueError::new_err("mode: want \"ink\" or \"unmix\"")),
    };
    into_color_and_alpha(py, &image, |image, channels, width, color, alpha| {
        kernel::matte(mode, image, channels, width, color, alpha)
    })
}

#[pyfunction]
pub fn fill_matte<'py>(
    py: Python<'py>,
    image: Picture<'py>,
    labels: PyReadonlyArray2<'py, u8>,
) -> PyResult<ColorAndAlpha<'py>> {
    let labels = slice("labels", &labels)?;
    into_color_and_alpha(py, &image, |image, channels, width, color, alpha| {
        fill::fill_matte(image, channels, width, labels, color, alpha)
    })
}

fn into_color_and_alpha<'py>(
    py: Python<'py>,
    image: &Picture<'py>,
    kernel: impl FnOnce(&[u8], usize, usize, &mut [u8], &mut [f32]) -> Result<(), KernelError> + Send,
) -> PyResult<ColorAndAlpha<'py>> {
    let [height, width, channels] = [image.shape()[0], image.shape()[1], image.shape()[2]];
    let color: Bound<'py, PyArray3<u8>> = empty(py, [height, width, 3])?;
    let alpha: Bound<'py, PyArray2<f32>> = empty(py, [height, width])?;
    let (mut colors, mut alphas) = (color.readwrite(), alpha.readwrite());
    let (image, colors_out, alphas_out) = (slice("image", image)?, colors.as_slice_mut()?, alphas.as_slice_mut()?);
    py.detach(|| kernel(image, channels, width, colors_out, alphas_out)).map_err(to_python)?;
    drop((colors, alphas));
    Ok((color, alpha))
}
