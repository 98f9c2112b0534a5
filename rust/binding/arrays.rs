//! numpy arrays as slices. Strict: dtype and number of axes are checked by the argument's type, order and size here.

use bytemuck::AnyBitPattern;
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyReadonlyArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The array's values in C order. A Fortran-ordered array is refused: `as_slice` alone would scramble it.
pub fn slice<'a, T: Element, D: Dimension>(name: &str, array: &'a PyReadonlyArray<'_, T, D>) -> PyResult<&'a [T]> {
    if !array.is_c_contiguous() {
        return Err(PyValueError::new_err(format!("{name}: want a C-contiguous array")));
    }
    Ok(array.as_slice()?)
}

/// The array's values in C order, taken together as points, pairs or matrices.
pub fn grouped<'a, T, U, D>(name: &str, array: &'a PyReadonlyArray<'_, T, D>) -> PyResult<&'a [U]>
where
    T: Element + bytemuck::NoUninit,
    U: AnyBitPattern,
    D: Dimension,
{
    let values = slice(name, array)?;
    bytemuck::try_cast_slice(values)
        .map_err(|_| PyValueError::new_err(format!("{name}: {} values do not form whole groups", values.len())))
}

/// A new C-ordered array for a kernel to fill. Not zeroed: zeros cost as much as a quick kernel.
pub fn empty<T: Element, D: Dimension, const N: usize>(
    py: Python<'_>,
    shape: [usize; N],
) -> PyResult<Bound<'_, PyArray<T, D>>> {
    let numpy = py.import(pyo3::intern!(py, "numpy"))?;
    let array = numpy.call_method1(pyo3::intern!(py, "empty"), (shape, numpy::dtype::<T>(py)))?;
    Ok(array.cast_into::<PyArray<T, D>>()?)
}
