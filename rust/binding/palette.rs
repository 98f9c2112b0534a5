//! Wrapper of `kernels/palette.rs`.

use crate::arrays::{empty, grouped, slice};
use crate::errors::to_python;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pegbar_kernels::palette::{self, Swatch};
use pyo3::prelude::*;

type LabelsAndUnmatched<'py> = (Bound<'py, PyArray2<u8>>, usize, Option<[usize; 2]>);

#[pyfunction]
pub fn palette_labels<'py>(
    py: Python<'py>,
    segmentation: PyReadonlyArray3<'py, u8>,
    colors: PyReadonlyArray2<'py, u8>,
    labels: PyReadonlyArray1<'py, u8>,
    tolerance: f64,
) -> PyResult<LabelsAndUnmatched<'py>> {
    let [height, width, channels] = [segmentation.shape()[0], segmentation.shape()[1], segmentation.shape()[2]];
    let (colors, labels): (&[[u8; 3]], _) = (grouped("colors", &colors)?, slice("labels", &labels)?);
    let swatches: Vec<_> = colors.iter().zip(labels).map(|(&color, &label)| Swatch { color, label }).collect();
    let out: Bound<'py, PyArray2<u8>> = empty(py, [height, width])?;
    let mut target = out.readwrite();
    let (image, found) = (slice("segmentation", &segmentation)?, target.as_slice_mut()?);
    let unmatched = py.detach(|| palette::palette_labels(image, channels, width, &swatches, tolerance, found));
    let unmatched = unmatched.map_err(to_python)?;
    drop(target);
    Ok((out, unmatched.count, unmatched.first))
}
